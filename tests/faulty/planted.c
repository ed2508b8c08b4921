/* dc/dt = -k c, with the fault that FAULT names; where c matters, at points with c > 0.5. */
#define _GNU_SOURCE
#include "rumple_plugin.h"

#include <math.h>
#include <signal.h>
#include <stdlib.h>
#include <unistd.h>

enum {
    NONE, NOT_FINITE, WRONG_DERIVATIVE, HIDDEN_STATE, MUTATED_INPUT, NOT_THREAD_SAFE,
    ABORTS, SEGFAULT, BEYOND, UNWRITTEN, NEGATIVE_FACTOR, WRONG_FACTOR_DERIVATIVE,
    FACTOR_UNWRITTEN, MAXIMUM_KEPT, SEGFAULT_LATE, DEEP, RAISES_FPE,
    NOT_FINITE_ONCE, FAILS_ONCE, EVERY_NTH, NARROW_NAN,
};

/* Of the calls that come LATE. */
enum { LATE = 400, EARLY = 60 };

static const RumpleSpecies species[] = {
    {RUMPLE_STR("c"), RUMPLE_STR("1"), RUMPLE_STR("any"), 1.0, 0.0, 1.0, 0.0, RUMPLE_VERTEX}};
static const RumpleParameter parameters[] = {
    {RUMPLE_STR("k"), RUMPLE_STR("1/time"), RUMPLE_STR("decay"), 1.0, RUMPLE_STR(""), 0.0, 9.0, 0}};
static const RumpleSignal signals[] = {{RUMPLE_STR("mean_curvature"), 0.1}};

static const RumpleDescriptor descriptor = {
    .size = sizeof(RumpleDescriptor),
    .id = RUMPLE_STR("org.rumple.test.planted"),
    .name = RUMPLE_STR("planted"),
    .version = RUMPLE_STR("0.1.0"),
    RUMPLE_ARRAYS(species, parameters, signals),
    .capabilities = RUMPLE_RATES | RUMPLE_RATE_PARTIALS | RUMPLE_LENGTH_FACTOR |
                    RUMPLE_LENGTH_FACTOR_PARTIALS,
};

static RumpleStatus create(const double *values, size_t count, void **instance,
                           RumpleReport *report) {
    (void)report;
    double *k = malloc(count * sizeof *k);
    *k = *values;
    *instance = k;
    return RUMPLE_OK;
}

static void destroy(void *instance) {
    free(instance);
}

static double scratch[1024];
static double calls, most;
static volatile int *volatile nowhere = (volatile int *)8;

/* Without end, which the compiler cannot know. */
static int deep(volatile char *above) {
    volatile char room[4096];
    room[0] = above ? above[0] : 1;
    return room[0] == 1 ? deep(room) + room[0] : 0;
}

static RumpleStatus rates(const void *instance, const RumpleBatch *batch,
                          const RumpleColumnMut *values, RumpleReport *report) {
    const double k = *(const double *)instance;
    calls += 1.0;
    if (FAULT == FAILS_ONCE && calls == EARLY)
        return rumple_fail(report, RUMPLE_FATAL, "planted to fail");
    for (size_t i = 0; i < batch->count; i++) {
        double c = rumple_get(batch->species[0], i), rate = -k * c;
        if (c > 0.5) {
            if (FAULT == NOT_FINITE || (FAULT == NOT_FINITE_ONCE && calls == LATE))
                rate = NAN;
            if (FAULT == ABORTS)
                abort();
            if (FAULT == SEGFAULT)
                *nowhere = 1;
            if (FAULT == SEGFAULT_LATE && calls > LATE)
                *nowhere = 1;
            if (FAULT == DEEP)
                rate += deep(NULL);
            if (FAULT == RAISES_FPE)
                raise(SIGFPE);
            if (FAULT == MUTATED_INPUT)
                ((double *)batch->species[0].data)[i * batch->species[0].stride] = 0.5;
        }
        if (FAULT == NARROW_NAN && c > 0.25 && c < 0.253)
            rate = NAN;
        if (FAULT == EVERY_NTH && fmod(calls, 50.0) == 0.0)
            rate *= 1.5;
        if (FAULT == MAXIMUM_KEPT) {
            most = fmax(most, c);
            rate = -k * most;
        }
        if (FAULT == HIDDEN_STATE)
            rate += calls;
        if (FAULT == NOT_THREAD_SAFE)
            scratch[i % 1024] = rate;
        if (FAULT != UNWRITTEN || c <= 0.5)
            rumple_set(values[0], i, rate);
    }
    if (FAULT == NOT_THREAD_SAFE) {
        usleep(2000);
        for (size_t i = 0; i < batch->count; i++)
            rumple_set(values[0], i, scratch[i % 1024]);
    }
    if (FAULT == BEYOND)
        rumple_set(values[0], batch->count, 1.0);
    return RUMPLE_OK;
}

static RumpleStatus rate_partials(const void *instance, const RumpleBatch *batch,
                                  const RumpleColumnMut *values, const RumpleColumnMut *partials,
                                  RumpleReport *report) {
    for (size_t i = 0; i < batch->count; i++) {
        rumple_set(partials[0], i, FAULT == WRONG_DERIVATIVE ? -2.0 : -1.0);
        rumple_set(partials[1], i, 0.0);
    }
    return rates(instance, batch, values, report);
}

static RumpleStatus length_factor(const void *instance, const RumpleBatch *batch,
                                  const RumpleColumnMut *values, RumpleReport *report) {
    (void)instance, (void)report;
    for (size_t i = 0; i < batch->count; i++) {
        double c = rumple_get(batch->species[0], i);
        if (FAULT == FACTOR_UNWRITTEN && c > 0.5)
            continue;
        rumple_set(values[0], i, FAULT == NEGATIVE_FACTOR && c > 0.5 ? -1.0 : 1.0 + 0.1 * c);
    }
    return RUMPLE_OK;
}

static RumpleStatus length_factor_partials(const void *instance, const RumpleBatch *batch,
                                           const RumpleColumnMut *values,
                                           const RumpleColumnMut *partials, RumpleReport *report) {
    for (size_t i = 0; i < batch->count; i++)
        rumple_set(partials[0], i, FAULT == WRONG_FACTOR_DERIVATIVE ? 0.2 : 0.1);
    return length_factor(instance, batch, values, report);
}

RUMPLE_PLUGIN = {
    RUMPLE_HEADER,
    .descriptor = &descriptor,
    .create = create,
    .destroy = destroy,
    .rates = rates,
    .rate_partials = rate_partials,
    .length_factor = length_factor,
    .length_factor_partials = length_factor_partials,
};
