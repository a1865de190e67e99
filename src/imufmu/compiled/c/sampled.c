/* Many samples of a sampled block in a row. Stands behind its equations and the macros that name them and their sizes.

   x: state with the held inputs, in and out. u, w: inputs and draws, a row per sample. y: reported signals, likewise. */

#include <string.h>

EXPORTED void block_rows(long long rows, double *x, const double *u, const double *p, const double *w, double *y) {
    double next[N_STATE], work[N_WORK + 1]; /* of its own: equations write results before they have read all arguments */
    int integer_work[N_INTEGER_WORK + 1];
    for (long long k = 0; k < rows; k++, u += N_INPUTS, w += N_NORMALS, y += N_REPORTED) {
#if SLOW_STEPS
        double due = 0.0, held[N_HELD + 1], finite[N_HELD + 1];
        memcpy(held, x + N_STATE - N_HELD, N_HELD * sizeof(double));
        const double *step_arguments[N_ARGUMENTS] = {x, u, p, w};
        double *step_results[N_RESULTS] = {next, finite, &due};
        block_step(step_arguments, step_results, integer_work, work, 0);
        memcpy(x, next, N_FAST * sizeof(double));
        memcpy(x + N_STATE - N_HELD, finite, N_HELD * sizeof(double));
        if (due != 0.0) {
            const double *slow_arguments[N_ARGUMENTS] = {&due, x, held, u, p, w};
            double *slow_results[N_RESULTS] = {next};
            block_slow(slow_arguments, slow_results, integer_work, work, 0);
            memcpy(x, next, (N_STATE - N_HELD) * sizeof(double));
        }
        const double *report_arguments[N_ARGUMENTS] = {x, held, u, p, w};
        double *report_results[N_RESULTS] = {y};
        block_report(report_arguments, report_results, integer_work, work, 0);
#else
        const double *arguments[N_ARGUMENTS] = {x, u, p, w};
        double *results[N_RESULTS] = {next, y};
        block_next(arguments, results, integer_work, work, 0);
        memcpy(x, next, sizeof next);
#endif
#if BEGINS_ANEW
        double sound = 0.0;
        const double *sound_arguments[N_ARGUMENTS] = {y};
        double *sound_results[N_RESULTS] = {&sound};
        block_sound(sound_arguments, sound_results, integer_work, work, 0);
        if (sound == 0.0) {
            const double *first_arguments[N_ARGUMENTS] = {u, p, w};
            double *first_results[N_RESULTS] = {x, y};
            block_first(first_arguments, first_results, integer_work, work, 0);
            y[STATUS_AT] += RESTARTED;
        }
#endif
    }
}
