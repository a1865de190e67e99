/* A continuous block over many rows. Stands behind its equations and the macros that name them and their sizes. */

#include <string.h>

/* States at the end of each row, behind that at the start, states[0]. u: held inputs, t: time (s) at the start of each
   row, which is solved in so many steps of h (s). */
EXPORTED void block_rows(long long rows, long long steps, double *states, const double *u, const double *p,
                         const double *t, double h) {
    double x[N_STATE + 1], work[N_WORK + 1]; /* results are written before all arguments are read: none share memory */
    int integer_work[N_INTEGER_WORK + 1];
    for (long long k = 0; k < rows; k++, u += N_INPUTS, t++, states += N_STATE) {
        double *next = states + N_STATE;
        memcpy(next, states, N_STATE * sizeof(double));
        for (long long i = 0; i < steps; i++) {
            double now = *t + (double)i * h;
            memcpy(x, next, N_STATE * sizeof(double));
            const double *arguments[N_ARGUMENTS] = {x, u, p, &now, &h};
            double *results[N_RESULTS] = {next};
            block_advance(arguments, results, integer_work, work, 0);
        }
    }
}

/* Reported signals y after the solver steps, a row per instant. */
EXPORTED void block_outputs(long long rows, const double *x, const double *u, const double *p, const double *t, double *y) {
    double work[N_WORK + 1];
    int integer_work[N_INTEGER_WORK + 1];
    for (long long k = 0; k < rows; k++, x += N_STATE, u += N_INPUTS, t++, y += N_REPORTED) {
        const double *arguments[N_ARGUMENTS] = {x, u, p, t};
        double *results[N_RESULTS] = {y};
        block_output(arguments, results, integer_work, work, 0);
    }
}
