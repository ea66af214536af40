/* A host's loop in C: set five inputs, step, get one output; the output angle moves by 1e-5 rad per step. */

#include <stddef.h>
#include <time.h>

double loop(int (*set)(void *, const unsigned *, size_t, const double *), int (*step)(void *, double, double, int),
            int (*get)(void *, const unsigned *, size_t, double *), void *instance, long steps) {
    const unsigned inputs[5] = {0, 1, 2, 3, 4}, output = 5;
    double u[5] = {0.2, 0.0, 0.2 / -29.0, 0.0, 20.0}, y;
    struct timespec a, b;
    clock_gettime(CLOCK_MONOTONIC, &a);
    for (long k = 0; k < steps; k++) {
        u[2] -= k % 400 < 200 ? 1e-5 : -1e-5;
        if (set(instance, inputs, 5, u) || step(instance, 1e-3 * (double)k, 1e-3, 1) || get(instance, &output, 1, &y))
            return -1.0;
    }
    clock_gettime(CLOCK_MONOTONIC, &b);
    return ((double)(b.tv_sec - a.tv_sec) + 1e-9 * (double)(b.tv_nsec - a.tv_nsec)) / (double)steps;
}
