/* du/dt = u (1 - u/K), dv/dt = u - v; no derivatives, and no typical magnitudes unless TYPICAL is one. */
#include "rumple_plugin.h"
#include <stdlib.h>

#ifndef TYPICAL
#define TYPICAL 0.0
#endif

static const RumpleSpecies species[] = {
    {.name = RUMPLE_STR("u"), .unit = RUMPLE_STR("1"), .doc = RUMPLE_STR("grows"), .typical = TYPICAL, .lower = -1e9, .upper = 1e9},
    {.name = RUMPLE_STR("v"), .unit = RUMPLE_STR("1"), .doc = RUMPLE_STR("follows"), .typical = TYPICAL, .lower = -1e9, .upper = 1e9},
};

static const RumpleParameter parameters[] = {
    {RUMPLE_STR("K"), RUMPLE_STR("1"), RUMPLE_STR("capacity"), 1.0, RUMPLE_STR(""), 0.0, 1e9, RUMPLE_LOWER_OPEN},
};

static const RumpleDescriptor descriptor = {
    .size = sizeof(RumpleDescriptor),
    .id = RUMPLE_STR("org.rumple.test.logistic"),
    .name = RUMPLE_STR("logistic"),
    .version = RUMPLE_STR("0"),
    .author = RUMPLE_STR("The Rumple developers"),
    .licence = RUMPLE_STR("MIT"),
    .doc = RUMPLE_STR("logistic growth"),
    .species = species,
    .species_count = 2,
    .species_stride = sizeof(RumpleSpecies),
    .parameters = parameters,
    .parameter_count = 1,
    .parameter_stride = sizeof(RumpleParameter),
    .signal_stride = sizeof(RumpleSignal),
    .capabilities = RUMPLE_RATES,
};

static RumpleStatus create(const double *values, size_t count, void **instance, RumpleReport *report) {
    double *capacity = malloc(sizeof *capacity);
    *capacity = values[0];
    *instance = capacity;
    return RUMPLE_OK;
}

static void destroy(void *instance) { free(instance); }

static double at(const RumpleColumn *column, size_t k) { return column->data[k * column->stride]; }

static RumpleStatus rates(const void *instance, const RumpleBatch *batch, const RumpleColumnMut *out, RumpleReport *report) {
    for (size_t k = 0; k < batch->count; k++) {
        double u = at(&batch->species[0], k);
        out[0].data[k * out[0].stride] = u * (1 - u / *(const double *)instance);
        out[1].data[k * out[1].stride] = u - at(&batch->species[1], k);
    }
    return RUMPLE_OK;
}

RUMPLE_PLUGIN = {
    RUMPLE_HEADER,
    .descriptor = &descriptor,
    .create = create,
    .destroy = destroy,
    .rates = rates,
};
