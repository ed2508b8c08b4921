/* The boundary between the rumple engine and a kinetics plugin in C, C++ or any language that can
 * export a C object. The same structures as in the Rust crate rumple-plugin-abi, where every field
 * is explained; the test suite compares the sizes.
 *
 * A plugin exports one object, `rumple_plugin_entry`:
 *
 *     RUMPLE_PLUGIN = { RUMPLE_HEADER, .descriptor = &descriptor, .create = create, ... };
 */
#ifndef RUMPLE_PLUGIN_H
#define RUMPLE_PLUGIN_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define RUMPLE_ABI_MAJOR 1u
#define RUMPLE_ABI_MINOR 0u
#define RUMPLE_MAGIC {'R', 'U', 'M', 'P', 'L', 'E', 0x1a, '\n'}

/* The first fields of every table. */
#define RUMPLE_HEADER                                                                              \
    .magic = RUMPLE_MAGIC, .abi_major = RUMPLE_ABI_MAJOR, .abi_minor = RUMPLE_ABI_MINOR,           \
    .size = sizeof(RumplePluginTable)

/* Text by start and length, from a literal. */
typedef struct {
    const char *data;
    size_t length;
} RumpleStr;
#define RUMPLE_STR(literal) {(literal), sizeof(literal) - 1}

enum { RUMPLE_VERTEX = 0, RUMPLE_FACE = 1 };
enum { RUMPLE_LOWER_OPEN = 1, RUMPLE_UPPER_OPEN = 2 };
enum { RUMPLE_OK = 0, RUMPLE_UNRELIABLE = 1, RUMPLE_RETRY = 2, RUMPLE_FATAL = 3 };

#define RUMPLE_RATES ((uint64_t)1)
#define RUMPLE_RATE_PARTIALS ((uint64_t)1 << 1)
#define RUMPLE_LENGTH_FACTOR ((uint64_t)1 << 2)
#define RUMPLE_LENGTH_FACTOR_PARTIALS ((uint64_t)1 << 3)

typedef struct {
    RumpleStr name, unit, doc;
    double typical;      /* > 0 */
    double lower, upper; /* valid range; may be infinite */
    double diffusion;    /* default, >= 0 */
    uint32_t location;   /* RUMPLE_VERTEX or RUMPLE_FACE */
} RumpleSpecies;

typedef struct {
    RumpleStr name, unit, doc;
    double default_value;
    RumpleStr default_of; /* if not empty: the earlier parameter whose value is the default */
    double lower, upper;  /* bounds; may be infinite */
    uint32_t open;        /* RUMPLE_LOWER_OPEN | RUMPLE_UPPER_OPEN */
} RumpleParameter;

/* name: mean_curvature, gaussian_curvature, area_strain, tension, area_ratio, time (one column
 * each), position, normal (three). */
typedef struct {
    RumpleStr name;
    double typical; /* > 0 */
} RumpleSignal;

typedef struct {
    size_t size;
    RumpleStr id, name, version, author, licence, doc;
    const RumpleSpecies *species;
    size_t species_count, species_stride;
    const RumpleParameter *parameters;
    size_t parameter_count, parameter_stride;
    const RumpleSignal *signals;
    size_t signal_count, signal_stride;
    uint64_t capabilities;
} RumpleDescriptor;

#define RUMPLE_NO_POINT ((size_t)-1)

/* Filled in by the caller; the callee writes what differs. */
typedef struct {
    size_t size;
    char *message; /* `capacity` bytes; the callee writes at most that many, and how many */
    size_t capacity, length;
    size_t point;  /* index in the batch of the point to blame */
    double factor; /* with RUMPLE_RETRY: by what to multiply the step */
} RumpleReport;

/* Value at point i: data[i * stride]. */
typedef struct {
    const double *data;
    size_t stride;
} RumpleColumn;
typedef struct {
    double *data;
    size_t stride;
} RumpleColumnMut;

typedef struct {
    size_t size;
    size_t count;
    const RumpleColumn *species;
    size_t species_count;
    const RumpleColumn *signals;
    size_t signal_count;
} RumpleBatch;

typedef int32_t (*RumpleCreate)(const double *parameters, size_t count, void **instance,
                                RumpleReport *report);
typedef void (*RumpleDestroy)(void *instance);
typedef int32_t (*RumpleEvaluate)(const void *instance, const RumpleBatch *batch,
                                  const RumpleColumnMut *values, RumpleReport *report);
typedef int32_t (*RumpleEvaluatePartials)(const void *instance, const RumpleBatch *batch,
                                          const RumpleColumnMut *values,
                                          const RumpleColumnMut *partials, RumpleReport *report);
typedef const void *(*RumpleGetExtension)(RumpleStr id);

typedef struct {
    unsigned char magic[8];
    uint32_t abi_major, abi_minor;
    size_t size;
    const RumpleDescriptor *descriptor;
    RumpleCreate create;
    RumpleDestroy destroy;
    RumpleEvaluate rates;
    RumpleEvaluatePartials rate_partials;          /* or null */
    RumpleEvaluate length_factor;                  /* or null */
    RumpleEvaluatePartials length_factor_partials; /* or null */
    RumpleGetExtension get_extension;              /* or null */
} RumplePluginTable;

#ifdef _WIN32
#define RUMPLE_PLUGIN __declspec(dllexport) const RumplePluginTable rumple_plugin_entry
#else
#define RUMPLE_PLUGIN                                                                              \
    __attribute__((visibility("default"))) const RumplePluginTable rumple_plugin_entry
#endif

#ifdef __cplusplus
}
#endif

#endif
