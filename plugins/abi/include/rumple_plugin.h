/* The boundary between the rumple engine and a kinetics plugin in C, C++, Fortran or any language
 * that can export a C object. Generated from the Rust crate rumple-plugin-abi; do not edit.
 *
 * A plugin exports one object, `rumple_plugin_entry`:
 *
 *     RUMPLE_PLUGIN = { RUMPLE_HEADER, .descriptor = &descriptor, .create = create, ... };
 *
 * `rumple plugin new NAME --lang c` writes a whole one; docs/book/manual/plugins.md in its source is the guide.
 */
#ifndef RUMPLE_PLUGIN_H
#define RUMPLE_PLUGIN_H

#include <stddef.h>
#include <stdint.h>

// The version, which must agree exactly with that of the engine.
#define RumpleABI_MAJOR 1

// The second part of the version, which must agree as well.
#define RumpleABI_MINOR 1



// UTF-8 text by start and length; both zero for an empty text.
typedef struct {
  // First byte.
  const uint8_t *data;
  // Bytes, without any terminating zero.
  size_t length;
} RumpleStr;

// Where species live, and with them rates, signals and length factor.
typedef uint32_t RumpleLocation;
// On the vertices of the mesh.
#define RumpleLocation_VERTEX 0
// On its triangles.
#define RumpleLocation_FACE 1

// One species: a concentration with its own rate.
typedef struct {
  // Name in scenes and results, for example `c`; a letter first, then letters, digits or `_`.
  RumpleStr name;
  // Unit of the value, in words of the plugin; `1` for none.
  RumpleStr unit;
  // Description in one sentence.
  RumpleStr doc;
  // Magnitude that matters, > 0: scale of absolute tolerances and difference steps. 0: from the start of a run.
  double typical;
  // Least value that makes sense; may be -infinity.
  double lower;
  // Greatest value that makes sense; may be +infinity.
  double upper;
  // Diffusion coefficient unless the scene gives one, length²/time, >= 0.
  double diffusion;
  // Default location; a scene may choose another.
  RumpleLocation location;
} RumpleSpecies;

// One parameter of the law.
typedef struct {
  // Name in scenes; same rule as for species.
  RumpleStr name;
  // Unit, in words; `1` for none.
  RumpleStr unit;
  // Description in one sentence.
  RumpleStr doc;
  // Value where a scene gives none (and `default_of` is empty).
  double default_;
  // If not empty: the name of an earlier parameter whose value is the default.
  RumpleStr default_of;
  // Lower bound; may be -infinity.
  double lower;
  // Upper bound; may be +infinity.
  double upper;
  // Bits [`Parameter::LOWER_OPEN`], [`Parameter::UPPER_OPEN`].
  uint32_t open;
} RumpleParameter;
// The lower bound itself is not allowed.
#define RumpleParameter_LOWER_OPEN 1
// The upper bound itself is not allowed.
#define RumpleParameter_UPPER_OPEN 2

// One signal that the rates read. The engine computes only what is asked for.
//
// Each scalar signal is one column of a batch; `position` and `normal` are three (x, y, z).
typedef struct {
  // Which: `mean_curvature`, `gaussian_curvature`, `area_strain`, `tension`, `area_ratio`,
  // `contact_pressure`, `time` (one column each), `position`, `normal` (three).
  RumpleStr name;
  // Magnitude that matters, > 0, in the signal's unit: scale of difference steps.
  double typical;
} RumpleSignal;

// What a plugin gives, as bits.
//
// An engine ignores a bit below 2^32 that it does not know, and refuses the plugin for an unknown
// bit from 2^32 on: those stand for physics that must not be left out in silence.
typedef uint64_t RumpleCapabilities;
// Rates R, required.
#define RumpleCapabilities_RATES 1
// Partial derivatives of the rates; without them the engine takes differences.
#define RumpleCapabilities_RATE_PARTIALS (1 << 1)
// A length factor Φ(c) of active strain; without it Φ = 1.
#define RumpleCapabilities_LENGTH_FACTOR (1 << 2)
// Partial derivatives of the length factor; without them the engine takes differences.
#define RumpleCapabilities_LENGTH_FACTOR_PARTIALS (1 << 3)
// Takes parameters that differ from point to point ([`Batch::parameters`](crate::Batch));
// without it the engine makes an instance for every set of values.
#define RumpleCapabilities_PARAMETER_FIELDS (1 << 4)
// A spontaneous curvature C₀(c), by the extension [`FEEDBACK`](crate::FEEDBACK).
#define RumpleCapabilities_SPONTANEOUS_CURVATURE 4294967296
// Instances have a state that must be saved and loaded, by an extension. Reserved.
#define RumpleCapabilities_STATEFUL 8589934592
// A length factor Φ⊥(c) across a fibre, by the extension [`FEEDBACK`](crate::FEEDBACK); the length factor is then
// the one along it.
#define RumpleCapabilities_LENGTH_FACTOR_ACROSS 17179869184

// What a plugin says about itself. Arrays are given by start, length and the distance between
// elements in bytes, so that elements can grow.
typedef struct {
  // Bytes of this structure.
  size_t size;
  // Reverse domain name, for example `org.example.curvature-feedback`.
  RumpleStr id;
  // Short name for people.
  RumpleStr name;
  // Version of the plugin.
  RumpleStr version;
  // Who wrote it.
  RumpleStr author;
  // Licence, as an SPDX expression.
  RumpleStr licence;
  // What it models: equation, reference.
  RumpleStr doc;
  // First species.
  const RumpleSpecies *species;
  // How many species, at least 1.
  size_t species_count;
  // Bytes from one species to the next.
  size_t species_stride;
  // First parameter.
  const RumpleParameter *parameters;
  // How many parameters.
  size_t parameter_count;
  // Bytes from one parameter to the next.
  size_t parameter_stride;
  // First signal.
  const RumpleSignal *signals;
  // How many signals.
  size_t signal_count;
  // Bytes from one signal to the next.
  size_t signal_stride;
  // What the plugin gives.
  RumpleCapabilities capabilities;
} RumpleDescriptor;

// How a call ended.
typedef int32_t RumpleStatus;
// All outputs are written and good.
#define RumpleStatus_OK 0
// All outputs are written, but the law was used outside the range that it was made for.
#define RumpleStatus_UNRELIABLE 1
// Outputs are not usable; a time step shorter by `Report::factor` may succeed.
#define RumpleStatus_RETRY 2
// Outputs are not usable and no other step will help.
#define RumpleStatus_FATAL 3

// Where a callee explains a status that is not [`Status::OK`]. The caller owns it and the buffer,
// and fills in every field before the call.
typedef struct {
  // Bytes of this structure.
  size_t size;
  // Buffer for a UTF-8 message.
  uint8_t *message;
  // Bytes of the buffer.
  size_t capacity;
  // Bytes written by the callee; 0 before the call.
  size_t length;
  // Index within the batch of the first point to blame, or [`NO_POINT`] (as before the call).
  size_t point;
  // With [`Status::RETRY`]: by what to multiply the step, in (0, 1); 0.5 before the call.
  double factor;
} RumpleReport;

// Makes an instance from `count` parameter values in the order of the descriptor and writes its
// handle to `instance`. The handle may be null if the plugin needs none.
typedef RumpleStatus (*RumpleCreate)(const double *parameters,
                                     size_t count,
                                     void **instance,
                                     RumpleReport *report);

// Frees an instance.
typedef void (*RumpleDestroy)(void *instance);

// One input at successive points.
typedef struct {
  // Value at the first point.
  const double *data;
  // Numbers from one point to the next; 0 for one value for all points.
  size_t stride;
} RumpleColumn;

// The inputs of a call at a batch of points.
typedef struct {
  // Bytes of this structure.
  size_t size;
  // How many points.
  size_t count;
  // One column for each species of the descriptor.
  const RumpleColumn *species;
  // How many species columns: as many as the descriptor has species.
  size_t species_count;
  // One column for each scalar signal of the descriptor and three for each vector, in its order.
  const RumpleColumn *signals;
  // How many signal columns; 0 in calls for the length factor, which depends on species alone.
  size_t signal_count;
  // Where parameters differ from point to point: one column for each parameter of the
  // descriptor, which take the place of the instance's values. Only for plugins with
  // [`PARAMETER_FIELDS`](crate::Capabilities::PARAMETER_FIELDS); else null.
  const RumpleColumn *parameters;
  // How many parameter columns: none, or as many as the descriptor has parameters.
  size_t parameter_count;
} RumpleBatch;

// One output at successive points. It overlaps with no other output and with no input.
typedef struct {
  // Value at the first point.
  double *data;
  // Numbers from one point to the next, at least 1.
  size_t stride;
} RumpleColumnMut;

// Writes values: for rates one output column a species, for the length factor one in all.
typedef RumpleStatus (*RumpleEvaluate)(const void *instance,
                                       const RumpleBatch *batch,
                                       const RumpleColumnMut *values,
                                       RumpleReport *report);

// Writes the values of [`Evaluate`] and their partial derivatives, row by row: for rates
// `species_count` rows of `species_count + signal_count` columns, for the length factor one row
// of `species_count`.
typedef RumpleStatus (*RumpleEvaluatePartials)(const void *instance,
                                               const RumpleBatch *batch,
                                               const RumpleColumnMut *values,
                                               const RumpleColumnMut *partials,
                                               RumpleReport *report);

// A pointer to the extension of that name, or null. What it points to is fixed by the extension.
typedef const void *(*RumpleGetExtension)(RumpleStr id);

// What the plugin exports under [`ENTRY_SYMBOL`](crate::ENTRY_SYMBOL).
typedef struct {
  // [`MAGIC`](crate::MAGIC).
  uint8_t magic[8];
  // [`ABI_MAJOR`](crate::ABI_MAJOR) of the plugin.
  uint32_t abi_major;
  // [`ABI_MINOR`](crate::ABI_MINOR) of the plugin.
  uint32_t abi_minor;
  // Bytes of this table as the plugin knows it.
  size_t size;
  // What the plugin says about itself.
  const RumpleDescriptor *descriptor;
  // Required.
  RumpleCreate create;
  // Required.
  RumpleDestroy destroy;
  // Required.
  RumpleEvaluate rates;
  // Required with `RATE_PARTIALS`, else null.
  RumpleEvaluatePartials rate_partials;
  // Required with `LENGTH_FACTOR`, else null.
  RumpleEvaluate length_factor;
  // Required with `LENGTH_FACTOR_PARTIALS`, else null.
  RumpleEvaluatePartials length_factor_partials;
  // May be null: no extensions.
  RumpleGetExtension get_extension;
} RumplePluginTable;

// An observable.
typedef struct {
  // Name in scenes and results; same rule as for species.
  RumpleStr name;
  // Unit, in words; `1` for none.
  RumpleStr unit;
  // Description in one sentence.
  RumpleStr doc;
} RumpleObservable;

// What a plugin answers to [`OBSERVABLES`].
typedef struct {
  // Bytes of this structure.
  size_t size;
  // First observable.
  const RumpleObservable *observables;
  // How many.
  size_t observable_count;
  // Bytes from one to the next.
  size_t observable_stride;
  // Writes one column an observable, from the same inputs as the rates. Required.
  RumpleEvaluate observe;
} RumpleObservables;

// What a plugin answers to [`FEEDBACK`].
typedef struct {
  // Bytes of this structure.
  size_t size;
  // C₀. Required with [`SPONTANEOUS_CURVATURE`](crate::Capabilities::SPONTANEOUS_CURVATURE), else null.
  RumpleEvaluate curvature;
  // C₀ and ∂C₀/∂c. May be null: the engine takes differences.
  RumpleEvaluatePartials curvature_partials;
  // Φ⊥. Required with [`LENGTH_FACTOR_ACROSS`](crate::Capabilities::LENGTH_FACTOR_ACROSS), else null.
  RumpleEvaluate length_factor_across;
  // Φ⊥ and ∂Φ⊥/∂c. May be null: the engine takes differences.
  RumpleEvaluatePartials length_factor_across_partials;
} RumpleFeedback;

/* Shorter names. */
#define RUMPLE_ABI_MAJOR RumpleABI_MAJOR
#define RUMPLE_ABI_MINOR RumpleABI_MINOR
#define RUMPLE_OK RumpleStatus_OK
#define RUMPLE_UNRELIABLE RumpleStatus_UNRELIABLE
#define RUMPLE_RETRY RumpleStatus_RETRY
#define RUMPLE_FATAL RumpleStatus_FATAL
#define RUMPLE_VERTEX RumpleLocation_VERTEX
#define RUMPLE_FACE RumpleLocation_FACE
#define RUMPLE_LOWER_OPEN RumpleParameter_LOWER_OPEN
#define RUMPLE_UPPER_OPEN RumpleParameter_UPPER_OPEN
#define RUMPLE_RATES RumpleCapabilities_RATES
#define RUMPLE_RATE_PARTIALS RumpleCapabilities_RATE_PARTIALS
#define RUMPLE_LENGTH_FACTOR RumpleCapabilities_LENGTH_FACTOR
#define RUMPLE_LENGTH_FACTOR_PARTIALS RumpleCapabilities_LENGTH_FACTOR_PARTIALS
#define RUMPLE_PARAMETER_FIELDS RumpleCapabilities_PARAMETER_FIELDS
#define RUMPLE_SPONTANEOUS_CURVATURE RumpleCapabilities_SPONTANEOUS_CURVATURE
#define RUMPLE_LENGTH_FACTOR_ACROSS RumpleCapabilities_LENGTH_FACTOR_ACROSS
#define RUMPLE_NO_POINT ((size_t)-1)
#define RUMPLE_OBSERVABLES "rumple.observables/1"
#define RUMPLE_FEEDBACK "rumple.feedback/1"

/* Text from a literal. */
#define RUMPLE_STR(literal) {(const uint8_t *)(literal), sizeof(literal) - 1}

/* The first fields of every table. */
#define RUMPLE_MAGIC {'R', 'U', 'M', 'P', 'L', 'E', 0x1a, '\n'}
#define RUMPLE_HEADER                                                                              \
    .magic = RUMPLE_MAGIC, .abi_major = RUMPLE_ABI_MAJOR, .abi_minor = RUMPLE_ABI_MINOR,           \
    .size = sizeof(RumplePluginTable)

/* Three arrays of a descriptor with their lengths. */
#define RUMPLE_ARRAYS(species_, parameters_, signals_)                                             \
    .species = (species_), .species_count = sizeof(species_) / sizeof *(species_),                 \
    .species_stride = sizeof *(species_), .parameters = (parameters_),                             \
    .parameter_count = sizeof(parameters_) / sizeof *(parameters_),                                \
    .parameter_stride = sizeof *(parameters_), .signals = (signals_),                              \
    .signal_count = sizeof(signals_) / sizeof *(signals_), .signal_stride = sizeof *(signals_)

#ifdef _WIN32
#define RUMPLE_EXPORT __declspec(dllexport)
#else
#define RUMPLE_EXPORT __attribute__((visibility("default")))
#endif
#ifdef __cplusplus
#define RUMPLE_PLUGIN extern "C" RUMPLE_EXPORT const RumplePluginTable rumple_plugin_entry
#else
#define RUMPLE_PLUGIN RUMPLE_EXPORT const RumplePluginTable rumple_plugin_entry
#endif

/* The value of an input at point i. */
static inline double rumple_get(RumpleColumn column, size_t i) {
    return column.data[i * column.stride];
}

/* Writes an output at point i. */
static inline void rumple_set(RumpleColumnMut column, size_t i, double value) {
    column.data[i * column.stride] = value;
}

/* Explains a status that is not RUMPLE_OK, and returns it. Set report->point, too, where a point is
 * to blame. */
static inline RumpleStatus rumple_fail(RumpleReport *report, RumpleStatus status,
                                       const char *message) {
    if (report && report->message) {
        size_t length = 0;
        for (; message[length] && length < report->capacity; length++)
            report->message[length] = (uint8_t)message[length];
        report->length = length;
    }
    return status;
}

#endif
