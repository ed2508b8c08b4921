/* A plugin with one fault in its table or descriptor; which, the test says by macros. Without any
 * it loads. */
#include "rumple_plugin.h"

#include <math.h>

#ifndef MAGIC
#define MAGIC RUMPLE_MAGIC
#endif
#ifndef MAJOR
#define MAJOR RUMPLE_ABI_MAJOR
#endif
#ifndef MINOR
#define MINOR RUMPLE_ABI_MINOR
#endif
#ifndef TABLE_SIZE
#define TABLE_SIZE sizeof(RumplePluginTable)
#endif
#ifndef DESCRIPTOR
#define DESCRIPTOR &descriptor
#endif
#ifndef DESCRIPTOR_SIZE
#define DESCRIPTOR_SIZE sizeof(RumpleDescriptor)
#endif
#ifndef CREATE
#define CREATE create
#endif
#ifndef NAME
#define NAME RUMPLE_STR("table")
#endif
#ifndef SPECIES
#define SPECIES species
#endif
#ifndef SPECIES_COUNT
#define SPECIES_COUNT 1
#endif
#ifndef SPECIES_STRIDE
#define SPECIES_STRIDE sizeof(RumpleSpecies)
#endif
#ifndef SPECIES_NAME
#define SPECIES_NAME "c"
#endif
#ifndef SECOND_NAME
#define SECOND_NAME "d"
#endif
#ifndef SECOND_LOCATION
#define SECOND_LOCATION RUMPLE_VERTEX
#endif
#ifndef TYPICAL
#define TYPICAL 1.0
#endif
#ifndef DEFAULT
#define DEFAULT 1.0
#endif
#ifndef DEFAULT_OF
#define DEFAULT_OF ""
#endif
#ifndef UPPER
#define UPPER 2.0
#endif
#ifndef SIGNAL
#define SIGNAL "time"
#endif
#ifndef CAPABILITIES
#define CAPABILITIES RUMPLE_RATES
#endif

static const RumpleSpecies species[] = {
    {RUMPLE_STR(SPECIES_NAME), RUMPLE_STR("1"), RUMPLE_STR(""), TYPICAL, 0.0, 1.0, 0.0, 0},
    {RUMPLE_STR(SECOND_NAME), RUMPLE_STR("1"), RUMPLE_STR(""), 1.0, 0.0, 1.0, 0.0, SECOND_LOCATION},
};
static const RumpleParameter parameters[] = {{RUMPLE_STR("k"), RUMPLE_STR("1"), RUMPLE_STR(""),
                                              DEFAULT, RUMPLE_STR(DEFAULT_OF), 0.0, UPPER, 0}};
static const RumpleSignal signals[] = {{RUMPLE_STR(SIGNAL), 1.0}};

static const RumpleDescriptor descriptor = {
    .size = DESCRIPTOR_SIZE,
    .id = RUMPLE_STR("org.rumple.test.table"),
    .name = NAME,
    .version = RUMPLE_STR("0.1.0"),
    .species = SPECIES,
    .species_count = SPECIES_COUNT,
    .species_stride = SPECIES_STRIDE,
    .parameters = parameters,
    .parameter_count = 1,
    .parameter_stride = sizeof(RumpleParameter),
    .signals = signals,
    .signal_count = 1,
    .signal_stride = sizeof(RumpleSignal),
    .capabilities = CAPABILITIES,
};

static int32_t create(const double *values, size_t count, void **instance, RumpleReport *report) {
    (void)values, (void)count, (void)instance, (void)report;
    return RUMPLE_OK;
}

static void destroy(void *instance) { (void)instance; }

static int32_t rates(const void *instance, const RumpleBatch *batch, const RumpleColumnMut *values,
                     RumpleReport *report) {
    (void)instance, (void)report;
    for (size_t i = 0; i < batch->count; i++)
        values[0].data[i * values[0].stride] = batch->signals[0].data[i * batch->signals[0].stride];
#ifdef STATUS
    return STATUS;
#else
    return RUMPLE_OK;
#endif
}

RUMPLE_PLUGIN = {
    .magic = MAGIC,
    .abi_major = MAJOR,
    .abi_minor = MINOR,
    .size = TABLE_SIZE,
    .descriptor = DESCRIPTOR,
    .create = CREATE,
    .destroy = destroy,
    .rates = rates,
};
