/* Model I in C, without derivatives and (with -DWITH_PARTIALS) with them:
 *
 *   dc/dt = w H+/(1 + H+/H_s) - beta c
 *   Phi   = lambda_0/(lambda_min + (lambda_max - lambda_min)/(1 + exp(b (c - c_star))))
 */
#include "rumple_plugin.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    double w, beta, H_s, b, c_star, lambda_max, lambda_min, lambda_0;
} Model;

static const RumpleSpecies species[] = {{RUMPLE_STR("c"), RUMPLE_STR("1"), RUMPLE_STR("morphogen"),
                                         0.1, 0.0, INFINITY, 0.0, RUMPLE_VERTEX}};

#define POSITIVE(name, value, of)                                                                  \
    {RUMPLE_STR(name), RUMPLE_STR("1"), RUMPLE_STR(name), value, RUMPLE_STR(of), 0.0, INFINITY,    \
     RUMPLE_LOWER_OPEN}
static const RumpleParameter parameters[] = {
    POSITIVE("w", 15.0, ""),          POSITIVE("beta", 1.0, ""),
    POSITIVE("H_s", 0.05, ""),        POSITIVE("b", 100.0, ""),
    POSITIVE("c_star", 0.1, ""),      POSITIVE("lambda_max", 1.0, ""),
    POSITIVE("lambda_min", 0.65, ""), POSITIVE("lambda_0", 1.0, "lambda_max"),
};

static const RumpleSignal signals[] = {{RUMPLE_STR("mean_curvature"), 0.01}};

#ifdef WITH_PARTIALS
#define CAPABILITIES (RUMPLE_RATES | RUMPLE_LENGTH_FACTOR | RUMPLE_RATE_PARTIALS)
#else
#define CAPABILITIES (RUMPLE_RATES | RUMPLE_LENGTH_FACTOR)
#endif

static const RumpleDescriptor descriptor = {
    .size = sizeof(RumpleDescriptor),
    .id = RUMPLE_STR("org.rumple.test.model-i-c"),
    .name = RUMPLE_STR("model-i-c"),
    .version = RUMPLE_STR("0.1.0"),
    .author = RUMPLE_STR("The Rumple developers"),
    .licence = RUMPLE_STR("MIT OR Apache-2.0"),
    .doc = RUMPLE_STR("Model I in C"),
    .species = species,
    .species_count = 1,
    .species_stride = sizeof(RumpleSpecies),
    .parameters = parameters,
    .parameter_count = sizeof parameters / sizeof *parameters,
    .parameter_stride = sizeof(RumpleParameter),
    .signals = signals,
    .signal_count = 1,
    .signal_stride = sizeof(RumpleSignal),
    .capabilities = CAPABILITIES,
};

static int32_t create(const double *values, size_t count, void **instance, RumpleReport *report) {
    (void)report;
    Model *model = malloc(sizeof *model);
    if (!model || count * sizeof(double) != sizeof *model) {
        free(model);
        return RUMPLE_FATAL;
    }
    memcpy(model, values, sizeof *model);
    *instance = model;
    return RUMPLE_OK;
}

static void destroy(void *instance) { free(instance); }

static double at(RumpleColumn column, size_t i) { return column.data[i * column.stride]; }

static int32_t rates(const void *instance, const RumpleBatch *batch, const RumpleColumnMut *values,
                     RumpleReport *report) {
    (void)report;
    const Model *m = instance;
    for (size_t i = 0; i < batch->count; i++) {
        double upward = fmax(at(batch->signals[0], i), 0.0);
        values[0].data[i * values[0].stride] =
            m->w * upward / (1.0 + upward / m->H_s) - m->beta * at(batch->species[0], i);
    }
    return RUMPLE_OK;
}

#ifdef WITH_PARTIALS
static int32_t rate_partials(const void *instance, const RumpleBatch *batch,
                             const RumpleColumnMut *values, const RumpleColumnMut *partials,
                             RumpleReport *report) {
    const Model *m = instance;
    for (size_t i = 0; i < batch->count; i++) {
        double h = at(batch->signals[0], i), q = 1.0 + h / m->H_s;
        partials[0].data[i * partials[0].stride] = -m->beta;
        partials[1].data[i * partials[1].stride] = h > 0.0 ? m->w / (q * q) : 0.0;
    }
    return rates(instance, batch, values, report);
}
#endif

static int32_t length_factor(const void *instance, const RumpleBatch *batch,
                             const RumpleColumnMut *values, RumpleReport *report) {
    (void)report;
    const Model *m = instance;
    for (size_t i = 0; i < batch->count; i++) {
        double x = m->b * (at(batch->species[0], i) - m->c_star), e = exp(-fabs(x));
        double low = x > 0.0 ? e / (1.0 + e) : 1.0 / (1.0 + e);
        values[0].data[i * values[0].stride] =
            m->lambda_0 / (m->lambda_min + (m->lambda_max - m->lambda_min) * low);
    }
    return RUMPLE_OK;
}

static const RumpleObservable observed[] = {
    {RUMPLE_STR("production"), RUMPLE_STR("1/time"), RUMPLE_STR("what upward curvature makes")},
};

static RumpleStatus observe(const void *instance, const RumpleBatch *batch,
                            const RumpleColumnMut *values, RumpleReport *report) {
    (void)report;
    const Model *m = instance;
    for (size_t i = 0; i < batch->count; i++) {
        double upward = fmax(rumple_get(batch->signals[0], i), 0.0);
        rumple_set(values[0], i, m->w * upward / (1.0 + upward / m->H_s));
    }
    return RUMPLE_OK;
}

static const RumpleObservables observables = {
    .size = sizeof observables,
    .observables = observed,
    .observable_count = 1,
    .observable_stride = sizeof *observed,
    .observe = observe,
};

static const void *get_extension(RumpleStr id) {
    static const char name[] = RUMPLE_OBSERVABLES;
    return id.length == sizeof name - 1 && !memcmp(id.data, name, id.length) ? &observables : NULL;
}

RUMPLE_PLUGIN = {
    RUMPLE_HEADER,
    .descriptor = &descriptor,
    .create = create,
    .destroy = destroy,
    .rates = rates,
#ifdef WITH_PARTIALS
    .rate_partials = rate_partials,
#endif
    .length_factor = length_factor,
    .get_extension = get_extension,
};

/* Sizes as the engine has them. */
_Static_assert(sizeof(RumpleSpecies) == SIZE_SPECIES, "species");
_Static_assert(sizeof(RumpleParameter) == SIZE_PARAMETER, "parameter");
_Static_assert(sizeof(RumpleSignal) == SIZE_SIGNAL, "signal");
_Static_assert(sizeof(RumpleDescriptor) == SIZE_DESCRIPTOR, "descriptor");
_Static_assert(sizeof(RumpleReport) == SIZE_REPORT, "report");
_Static_assert(sizeof(RumpleBatch) == SIZE_BATCH, "batch");
_Static_assert(sizeof(RumplePluginTable) == SIZE_TABLE, "table");
_Static_assert(offsetof(RumpleDescriptor, capabilities) == OFFSET_CAPABILITIES, "capabilities");
_Static_assert(offsetof(RumpleParameter, open) == OFFSET_OPEN, "open");
