/* cvode PROBLEM RTOL ATOL UNTIL EVERY STATES : CVODE's BDF with dense Jacobians on kinetics without space.
 *
 * Prints a line: seconds steps evaluations factorisations. Writes the states at multiples of EVERY as `rumple` keeps
 * them: a header of 16 bytes, then time, step, 1 vertex, the number of species, 1 point of each, the position of the
 * vertex, the species; little-endian numbers of 64 bits. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

#define AT(row, column) SM_ELEMENT_D(matrix, row, column)

static int robertson(realtype t, N_Vector y, N_Vector f, void *data) {
    const double *c = N_VGetArrayPointer(y);
    double *r = N_VGetArrayPointer(f);
    double slow = 0.04 * c[0], middle = 1e4 * c[1] * c[2], fast = 3e7 * c[1] * c[1];
    r[0] = middle - slow;
    r[1] = slow - middle - fast;
    r[2] = fast;
    return 0;
}

static int robertson_jacobian(realtype t, N_Vector y, N_Vector f, SUNMatrix matrix, void *data, N_Vector a, N_Vector b,
                              N_Vector d) {
    const double *c = N_VGetArrayPointer(y);
    AT(0, 0) = -0.04, AT(0, 1) = 1e4 * c[2], AT(0, 2) = 1e4 * c[1];
    AT(1, 0) = 0.04, AT(1, 1) = -1e4 * c[2] - 6e7 * c[1], AT(1, 2) = -1e4 * c[1];
    AT(2, 0) = 0.0, AT(2, 1) = 6e7 * c[1], AT(2, 2) = 0.0;
    return 0;
}

static int oregonator(realtype t, N_Vector y, N_Vector f, void *data) {
    const double *c = N_VGetArrayPointer(y);
    double *r = N_VGetArrayPointer(f);
    r[0] = 77.27 * (c[1] + c[0] * (1.0 - 8.375e-6 * c[0] - c[1]));
    r[1] = (c[2] - (1.0 + c[0]) * c[1]) / 77.27;
    r[2] = 0.161 * (c[0] - c[2]);
    return 0;
}

static int oregonator_jacobian(realtype t, N_Vector y, N_Vector f, SUNMatrix matrix, void *data, N_Vector a, N_Vector b,
                               N_Vector d) {
    const double *c = N_VGetArrayPointer(y);
    AT(0, 0) = 77.27 * (1.0 - 2.0 * 8.375e-6 * c[0] - c[1]), AT(0, 1) = 77.27 * (1.0 - c[0]), AT(0, 2) = 0.0;
    AT(1, 0) = -c[1] / 77.27, AT(1, 1) = -(1.0 + c[0]) / 77.27, AT(1, 2) = 1.0 / 77.27;
    AT(2, 0) = 0.161, AT(2, 1) = 0.0, AT(2, 2) = -0.161;
    return 0;
}

static int brusselator(realtype t, N_Vector y, N_Vector f, void *data) {
    const double *c = N_VGetArrayPointer(y);
    double *r = N_VGetArrayPointer(f);
    double q = c[0] * c[0] * c[1];
    r[0] = 1.0 + q - 4.0 * c[0];
    r[1] = 3.0 * c[0] - q;
    return 0;
}

static int brusselator_jacobian(realtype t, N_Vector y, N_Vector f, SUNMatrix matrix, void *data, N_Vector a,
                                N_Vector b, N_Vector d) {
    const double *c = N_VGetArrayPointer(y);
    AT(0, 0) = 2.0 * c[0] * c[1] - 4.0, AT(0, 1) = c[0] * c[0];
    AT(1, 0) = 3.0 - 2.0 * c[0] * c[1], AT(1, 1) = -c[0] * c[0];
    return 0;
}

struct problem {
    const char *name;
    int species;
    double start[3];
    CVRhsFn rates;
    CVLsJacFn jacobian;
};

static const struct problem problems[] = {
    {"robertson", 3, {1.0, 0.0, 0.0}, robertson, robertson_jacobian},
    {"oregonator", 3, {1.0, 2.0, 3.0}, oregonator, oregonator_jacobian},
    {"brusselator", 2, {1.0, 1.0}, brusselator, brusselator_jacobian},
};

static void keep(FILE *file, double time, uint64_t step, int species, const double *values) {
    const double position[3] = {0.0, 0.0, 0.0};
    const uint64_t head[3] = {step, 1, species}, one = 1;
    fwrite(&time, 8, 1, file);
    fwrite(head, 8, 3, file);
    for (int k = 0; k < species; k++) fwrite(&one, 8, 1, file);
    fwrite(position, 8, 3, file);
    fwrite(values, 8, species, file);
}

int main(int count, char **arguments) {
    if (count != 7) {
        fprintf(stderr, "usage: cvode PROBLEM RTOL ATOL UNTIL EVERY STATES\n");
        return 2;
    }
    const struct problem *problem = NULL;
    for (size_t k = 0; k < sizeof problems / sizeof *problems; k++)
        if (!strcmp(problems[k].name, arguments[1])) problem = &problems[k];
    FILE *file = fopen(arguments[6], "wb");
    if (!problem || !file) {
        fprintf(stderr, "cvode: no problem %s, or %s cannot be written\n", arguments[1], arguments[6]);
        return 2;
    }
    double until = atof(arguments[4]), every = atof(arguments[5]);
    fwrite("rumple states 1\n", 1, 16, file);
    SUNContext context;
    SUNContext_Create(NULL, &context);
    N_Vector y = N_VNew_Serial(problem->species, context);
    double *values = N_VGetArrayPointer(y);
    memcpy(values, problem->start, problem->species * sizeof *values);
    keep(file, 0.0, 0, problem->species, values);
    void *solver = CVodeCreate(CV_BDF, context);
    CVodeInit(solver, problem->rates, 0.0, y);
    CVodeSStolerances(solver, atof(arguments[2]), atof(arguments[3]));
    CVodeSetMaxNumSteps(solver, 10000000);
    SUNMatrix matrix = SUNDenseMatrix(problem->species, problem->species, context);
    SUNLinearSolver linear = SUNLinSol_Dense(y, matrix, context);
    CVodeSetLinearSolver(solver, linear, matrix);
    CVodeSetJacFn(solver, problem->jacobian);
    struct timespec begin, end;
    long steps = 0, evaluations = 0, set_ups = 0;
    double seconds = 0.0;
    for (int output = 1; (output - 1) * every < until; output++) {
        double time, target = fmin(output * every, until);
        clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &begin);
        CVodeSetStopTime(solver, target);
        int ended = CVode(solver, target, y, &time, CV_NORMAL);
        clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &end);
        seconds += end.tv_sec - begin.tv_sec + 1e-9 * (end.tv_nsec - begin.tv_nsec);
        if (ended < 0) {
            fprintf(stderr, "cvode: stopped at %g with %d\n", time, ended);
            return 1;
        }
        CVodeGetNumSteps(solver, &steps);
        keep(file, target, steps, problem->species, values);
    }
    CVodeGetNumRhsEvals(solver, &evaluations);
    CVodeGetNumLinSolvSetups(solver, &set_ups);
    printf("%.9g %ld %ld %ld\n", seconds, steps, evaluations, set_ups);
    return fclose(file) == 0 ? 0 : 1;
}
