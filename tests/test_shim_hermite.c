/* SPDX-License-Identifier: GPL-3.0-or-later
 * The kernels of hermite_cuda.cu on the host shim: against the CPU's sums in double, predicted rows among them, bit for bit
 * between shapes of the launch, and at the edges. */
#include "device.h"
#include "gravity/gravity.h"
#include "gravity/hermite_engine.h"
#include "gravity/hermite_predict.h"
#include "random.h"
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { N_MAX = 2000, ROOM = 2048, WIDTH = 3 * (2 + 4) + 2, NOW = 64 };

static const double tick_length = 1e-3;

struct set {
    int n, p;
    bool bare;
    double state[WIDTH][N_MAX];
    int64_t began[N_MAX];
    int32_t place[N_MAX];
};

/* Rows crowded as r^3 about a point off the origin, states of up to 64 ticks ago; two of them at one place. */
static struct set *make(int n, int p, bool bare)
{
    struct set *s = calloc(1, sizeof *s);
    s->n = n;
    s->p = p;
    s->bare = bare;
    for (int i = 0; i < n; i++) {
        struct random key = {.seed = 1, .id = (uint64_t)i};
        double unit[3], r = pow(random_uniform(&key, 4), 3);
        random_direction(&key, 0, unit);
        for (int k = 0; k < 3; k++) s->state[k][i] = 3 + r * unit[k];
        for (int c = 3; c < 3 * (2 + hermite_kept(p)); c++) s->state[c][i] = random_uniform(&key, (unsigned)(8 + c)) - 0.5;
        s->state[3 * (2 + hermite_kept(p))][i] = random_uniform(&key, 5) / n;
        s->state[3 * (2 + hermite_kept(p)) + 1][i] = bare ? (i % 5 == 0) * 1e-8 : 1e-6;
        s->began[i] = NOW - (i % 64);
        s->place[i] = i;
    }
    for (int c = 0; c < 6 && n > 7; c++) s->state[c][7] = s->state[c][3];
    if (n > 7) s->began[7] = s->began[3] = NOW;
    return s;
}

static struct hermite_engine *fill(struct device *device, const struct set *s, int threads)
{
    const struct hermite_units units = {0x1p-10, 0.5, {0.1, -0.2, 0.3}};
    struct hermite_engine *engine = hermite_engine_create(device, s->p, s->bare, threads);
    const int width = hermite_engine_width(engine);
    double *state = calloc((size_t)(width * s->n), sizeof *state);
    for (int c = 0; c < width; c++) memcpy(state + c * s->n, s->state[c], (size_t)s->n * sizeof *state);
    hermite_engine_rows(engine, s->n, &units);
    hermite_engine_put(engine, &(struct hermite_states){s->n, s->place, state, s->began});
    free(state);
    return engine;
}

static const struct hermite_now now = {NOW, tick_length};

/* Sums of targets [from, from + n), of a device that is made for it. */
static void compute(const struct set *s, int derivatives, int threads, int from, int n, double *sum)
{
    struct device *device = device_open(DEVICE_CUDA);
    struct hermite_engine *engine = fill(device, s, threads);
    hermite_engine_sum(engine, &now, derivatives, s->place + from, n, sum);
    assert_null(device_error(device));
    hermite_engine_free(engine);
    device_close(device);
}

/* The CPU's sums in double over rows that were predicted by their Taylor series; size: of the terms without their signs, found
 * pair by pair. */
static void reference(const struct set *s, int derivatives, int from, int n, double *sum, double *size)
{
    static double column[14][ROOM];
    struct hermite_rows rows = {.n = s->n, .mass = column[12], .soft = column[13]};
    const int terms = 2 + hermite_kept(s->p);
    memset(column, 0, sizeof column);
    for (int k = 0; k < 3; k++) {
        double **const part[4] = {&rows.pos[k], &rows.vel[k], &rows.acc[k], &rows.jerk[k]};
        for (int d = 0; d < 4; d++) *part[d] = column[3 * d + k];
    }
    for (int i = 0; i < ROOM; i++) column[13][i] = 1;
    for (int i = 0; i < s->n; i++) {
        for (int k = 0; k < 3; k++) {
            double d[6];
            for (int c = 0; c < terms; c++) d[c] = s->state[3 * c + k][i];
            for (int c = 0; c < 4 && c < terms; c++)
                column[3 * c + k][i] = hermite_taylor(d + c, terms - c, (double)(NOW - s->began[i]) * tick_length);
        }
        column[12][i] = s->state[3 * terms][i];
        column[13][i] = s->state[3 * terms + 1][i];
    }
    const struct gravity_kernels *kernels = gravity_kernels_find(ISA_V2);
    hermite_sum *all = kernels->hermite->sum[s->bare][derivatives - 2];
    for (int i = from; i < from + n; i++) {
        double target[13], *to = sum + (i - from) * 3 * derivatives, *most = size + (i - from) * 3 * derivatives;
        for (int c = 0; c < 12; c++) target[c] = column[c][i];
        target[12] = column[13][i];
        all(to, target, &rows, 0, s->n);
        memset(most, 0, (size_t)(3 * derivatives) * sizeof *most);
        for (int j = 0; j < s->n; j += 2) {     /* two lanes of the kernels of x86-64-v2 at once */
            double pair[12];
            all(pair, target, &rows, j, j + 2 < s->n ? j + 2 : s->n);
            for (int w = 0; w < 3 * derivatives; w++) most[w] += fabs(pair[w]);
        }
    }
}

/* Both orders, with and without softening, and the derivatives at the start: largest error relative to the terms' sizes. */
static void test_accuracy(void **state)
{
    (void)state;
    enum { TARGETS = 150 };
    static const double bound[4] = {6e-7, 2.5e-6, 8e-6, 1e-5};
    static double sum[TARGETS * 12], exact[TARGETS * 12], size[TARGETS * 12];
    for (int p = 2; p <= 3; p++)
        for (int bare = 0; bare < 2; bare++)
            for (int derivatives = p; derivatives <= 4; derivatives += 4 - p) {
                struct set *s = make(N_MAX, p, bare);
                double worst[4] = {0};
                compute(s, derivatives, 0, 0, TARGETS, sum);
                reference(s, derivatives, 0, TARGETS, exact, size);
                for (int w = 0; w < TARGETS * 3 * derivatives; w++) {
                    const int d = w / 3 % derivatives;
                    worst[d] = fmax(worst[d], fabs(sum[w] - exact[w]) / size[w]);
                }
                print_message("order %d, %s softening, %d derivatives: largest errors %.1e %.1e %.1e %.1e of the terms\n", 2 * p,
                              bare ? "any" : "one", derivatives, worst[0], worst[1], worst[2], worst[3]);
                for (int d = 0; d < derivatives; d++) assert_true(worst[d] < bound[d]);
                free(s);
            }
}

/* The same bits from every size of block, one or several targets a thread, few targets or all, and from any order of puts. */
static void test_same_bits(void **state)
{
    (void)state;
    static double sum[N_MAX * 9], one[N_MAX * 9];
    struct set *s = make(N_MAX, 3, true);
    compute(s, 3, 128, 0, N_MAX, sum);
    for (int threads = 32; threads <= 64; threads *= 2) {
        compute(s, 3, threads, 900, 100, one);
        assert_memory_equal(sum + 900 * 9, one, 100 * 9 * sizeof *one);
    }
    struct device *device = device_open(DEVICE_CUDA);
    struct set *other = make(N_MAX, 3, true);
    for (int i = 100; i < 130; i++) other->state[0][i] += 1;
    struct hermite_engine *engine = fill(device, other, 0);
    enum { PUT = 30 };
    double part[WIDTH * PUT];
    for (int c = 0; c < hermite_engine_width(engine); c++) memcpy(part + c * PUT, s->state[c] + 100, PUT * sizeof *part);
    hermite_engine_sum(engine, &now, 3, s->place, 50, one);
    assert_memory_not_equal(sum, one, 50 * 9 * sizeof *one);
    hermite_engine_put(engine, &(struct hermite_states){PUT, s->place + 100, part, s->began + 100});
    hermite_engine_sum(engine, &now, 3, s->place, 50, one);
    assert_memory_equal(sum, one, 50 * 9 * sizeof *one);
    hermite_engine_free(engine);
    device_close(device);
    free(other);
    free(s);
}

/* Many targets: several a thread, the sums of every one in the same order. */
static void test_many(void **state)
{
    (void)state;
    enum { TARGETS = 4200, ROWS = 200 };
    static double sum[TARGETS * 6], one[ROWS * 6];
    static int32_t target[TARGETS];
    struct set *s = make(ROWS, 2, false);
    struct device *device = device_open(DEVICE_CUDA);
    for (int i = 0; i < TARGETS; i++) target[i] = i % ROWS;
    for (int threads = 32; threads <= 128; threads *= 4) {
        struct hermite_engine *engine = fill(device, s, threads);
        hermite_engine_sum(engine, &now, 2, target, TARGETS, sum);
        hermite_engine_sum(engine, &now, 2, target, ROWS, one);
        for (int i = 0; i < TARGETS; i++) assert_memory_equal(sum + i * 6, one + i % ROWS * 6, 6 * sizeof *one);
        hermite_engine_free(engine);
    }
    device_close(device);
    free(s);
}

/* A row alone; two at one place without softening: zeros, no NaN. */
static void test_edges(void **state)
{
    (void)state;
    double sum[18];
    for (int n = 1; n <= 2; n++) {
        struct set *s = make(n, 3, true);
        for (int i = 0; i < n; i++) {
            for (int c = 0; c < 3; c++) s->state[c][i] = 1;
            s->state[WIDTH - 1][i] = 0;
            s->began[i] = NOW;
        }
        memset(sum, 0xff, sizeof sum);
        compute(s, 3, 0, 0, n, sum);
        for (int w = 0; w < n * 9; w++) assert_true(sum[w] == 0);
        free(s);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_accuracy), cmocka_unit_test(test_same_bits),
                                       cmocka_unit_test(test_many), cmocka_unit_test(test_edges)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
