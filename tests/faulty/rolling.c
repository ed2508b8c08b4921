/* C0 = c d / 2 without derivatives, and what an engine must refuse. */
#include "rumple_plugin.h"

static const RumpleSpecies species[] = {
    {.name = RUMPLE_STR("c"), .unit = RUMPLE_STR("1"), .doc = RUMPLE_STR("rolls"), .typical = 1.0, .lower = -1e9, .upper = 1e9},
    {.name = RUMPLE_STR("d"), .unit = RUMPLE_STR("1"), .doc = RUMPLE_STR("rolls"), .typical = 1.0, .lower = -1e9, .upper = 1e9},
};

static const RumpleDescriptor descriptor = {
    .size = sizeof(RumpleDescriptor),
    .id = RUMPLE_STR("org.rumple.test.rolling-c"),
    .name = RUMPLE_STR("rolling-c"),
    .version = RUMPLE_STR("0"),
    .author = RUMPLE_STR("The Rumple developers"),
    .licence = RUMPLE_STR("MIT"),
    .doc = RUMPLE_STR("C0 = c d / 2"),
    .species = species,
    .species_count = 2,
    .species_stride = sizeof(RumpleSpecies),
    .parameter_stride = sizeof(RumpleParameter),
    .signal_stride = sizeof(RumpleSignal),
#if defined(ACROSS_ALONE)
    .capabilities = RUMPLE_RATES | RUMPLE_LENGTH_FACTOR_ACROSS,
#elif defined(STATEFUL)
    .capabilities = RUMPLE_RATES | RumpleCapabilities_STATEFUL,
#else
    .capabilities = RUMPLE_RATES | RUMPLE_SPONTANEOUS_CURVATURE,
#endif
};

static RumpleStatus create(const double *parameters, size_t count, void **instance, RumpleReport *report) {
    *instance = 0;
    return RUMPLE_OK;
}

static void destroy(void *instance) {}

static double at(const RumpleColumn *column, size_t k) { return column->data[k * column->stride]; }

static RumpleStatus rates(const void *instance, const RumpleBatch *batch, const RumpleColumnMut *out, RumpleReport *report) {
    for (size_t k = 0; k < batch->count; k++) {
        out[0].data[k * out[0].stride] = 1.0;
        out[1].data[k * out[1].stride] = -at(&batch->species[1], k);
    }
    return RUMPLE_OK;
}

static RumpleStatus curvature(const void *instance, const RumpleBatch *batch, const RumpleColumnMut *out, RumpleReport *report) {
    for (size_t k = 0; k < batch->count; k++)
        out[0].data[k * out[0].stride] = 0.5 * at(&batch->species[0], k) * at(&batch->species[1], k);
    return RUMPLE_OK;
}

static const RumpleFeedback feedback = {
#if defined(TRUNCATED)
    .size = 8,
#else
    .size = sizeof(RumpleFeedback),
#endif
#if !defined(NO_FUNCTION)
    .curvature = curvature,
#endif
};

static const void *get_extension(RumpleStr id) {
    const char name[] = RUMPLE_FEEDBACK;
    if (id.length != sizeof(name) - 1) return 0;
    for (size_t k = 0; k < id.length; k++)
        if (id.data[k] != (uint8_t)name[k]) return 0;
    return &feedback;
}

RUMPLE_PLUGIN = {
    RUMPLE_HEADER,
    .descriptor = &descriptor,
    .create = create,
    .destroy = destroy,
    .rates = rates,
#if !defined(NO_EXTENSION)
    .get_extension = get_extension,
#endif
};
