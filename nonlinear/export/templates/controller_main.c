/*
 * Runs the test vectors: from each state and input of the simulator one step; output and state behind it.
 *
 *     cc -std=c99 -O2 main.c controller.c -o vectors && ./vectors
 */
#include "controller.h"
#include "vectors.h"

#include <stdio.h>
#include <stdlib.h>

static double difference(const void *one, const void *other, const check *of, int j)
{
    const char *a = (const char *)one + of->at;
    const char *b = (const char *)other + of->at;
    double result = 0.0;
    if (of->whole != 0) {
        const int32_t *x = (const int32_t *)(const void *)a;
        const int32_t *y = (const int32_t *)(const void *)b;
        result = (x[j] == y[j]) ? 0.0 : 1.0;
    } else {
        const @REAL@ *x = (const @REAL@ *)(const void *)a;
        const @REAL@ *y = (const @REAL@ *)(const void *)b;
        result = (double)x[j] - (double)y[j];
    }
    return (result < 0.0) ? -result : result;
}

static int compared(const void *one, const void *other, const check *checks, int count, double *worst)
{
    int failed = 0;
    for (int n = 0; n < count; n += 1) {
        for (int j = 0; j < checks[n].count; j += 1) {
            const double off = difference(one, other, &checks[n], j);
            worst[n] = (off > worst[n]) ? off : worst[n];
            failed += (off <= checks[n].bound) ? 0 : 1;
        }
    }
    return failed;
}

static void told(const check *checks, int count, const double *worst)
{
    for (int n = 0; n < count; n += 1) {
        (void)printf("%s,%.3g,%.3g\n", checks[n].name, worst[n], checks[n].bound);
    }
}

int main(void)
{
    static double out_worst[OUT_CHECKS];
    static double state_worst[STATE_CHECKS];
    int failed = 0;
    for (int k = 0; k < VECTORS; k += 1) {
        @prefix@controller_state state = vectors[k].before;
        @prefix@controller_output out = vectors[k].out;
        @prefix@controller_step(&state, &vectors[k].in, &out);
        failed += compared(&out, &vectors[k].out, out_checks, OUT_CHECKS, out_worst);
        failed += compared(&state, &vectors[k].after, state_checks, STATE_CHECKS, state_worst);
    }
    (void)printf("%s\nsignal,difference,bound\n", @prefix@controller_version);
    told(out_checks, OUT_CHECKS, out_worst);
    told(state_checks, STATE_CHECKS, state_worst);
    (void)printf("%d steps, %d outside of the bound\n", VECTORS, failed);
    return (failed == 0) ? EXIT_SUCCESS : EXIT_FAILURE;
}
