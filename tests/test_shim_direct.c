/* SPDX-License-Identifier: GPL-3.0-or-later
 * The kernels of direct_cuda.cu on the host shim: against a plain double sum, bit for bit between
 * shapes of the launch, and at the edges. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "device.h"
#include "gravity/direct_engine.h"
#include "gravity/pair.h"
#include "random.h"

enum { N_MAX = 5000 };

struct set {
    int n;
    double pos[N_MAX][3], mass[N_MAX], acc[N_MAX][3], pot[N_MAX];
    float soft[N_MAX];
    int32_t own[N_MAX];
};

/* Rows crowded as r^3 towards a point off the origin, masses over 2 decades. */
static struct set *make(int n, enum softening_form form)
{
    struct set *s = calloc(1, sizeof *s);
    s->n = n;
    for (int i = 0; i < n; i++) {
        struct random key = {.seed = 1, .id = (uint64_t)i};
        double unit[3], r = pow(random_uniform(&key, 4), 3);
        random_direction(&key, 0, unit);
        for (int k = 0; k < 3; k++) s->pos[i][k] = 50 + 7 * r * unit[k];
        s->mass[i] = pow(100, random_uniform(&key, 5));
        double eps = form == SOFT_COMMON ? 0.05 : 0.1 * random_uniform(&key, 6);
        s->soft[i] = (float)(0.5 * eps * eps);
        s->own[i] = i;
    }
    return s;
}

/* Targets [from, from + n) of a set, in double. */
static void reference(const struct set *s, enum softening_form form, int from, int n, double (*acc)[3], double *pot)
{
    for (int i = from; i < from + n; i++) {
        double a[3] = {0}, depth = 0;
        for (int j = 0; j < s->n; j++) {
            double d[3], r2 = 0;
            for (int k = 0; k < 3; k++) r2 += pow(d[k] = s->pos[j][k] - s->pos[i][k], 2);
            if (j == i) continue;
            struct pair p = pair_any(form, r2, s->mass[j], (double)s->soft[i] + (double)s->soft[j]);
            for (int k = 0; k < 3; k++) a[k] += (double)PAIR_PULL * p.pull * d[k];
            depth += (double)PAIR_DEPTH * p.depth;
        }
        memcpy(acc[i - from], a, sizeof a);
        pot[i - from] = -depth;
    }
}

static struct direct_rows rows(const struct set *s, int from, int n)
{
    return (struct direct_rows){n, s->pos + from, s->mass + from, s->soft + from, s->own + from};
}

/* All of it once: targets [from, from + n) into acc, pot. */
static void compute(const struct set *s, enum softening_form form, enum direct_precision precision, int threads,
                    int from, int n, double (*acc)[3], double *pot)
{
    struct device *device = device_open(DEVICE_CUDA);
    struct direct_engine *engine = direct_engine_create(device, (int)form, precision, threads);
    struct direct_rows sources = rows(s, 0, s->n), targets = rows(s, from, n);
    sources.own = NULL;
    direct_engine_sources(engine, &sources);
    direct_engine_sum(engine, &targets, acc, pot);
    assert_null(device_error(device));
    direct_engine_free(engine);
    device_close(device);
}

/* Root mean square of the relative errors of acc and pot. */
static void errors(int n, double (*acc)[3], const double *pot, double (*acc0)[3], const double *pot0, double rms[2])
{
    rms[0] = rms[1] = 0;
    for (int i = 0; i < n; i++) {
        double e2 = 0, a2 = 0;
        for (int k = 0; k < 3; k++) {
            e2 += pow(acc[i][k] - acc0[i][k], 2);
            a2 += pow(acc0[i][k], 2);
        }
        rms[0] += e2 / a2 / n;
        rms[1] += pow(pot[i] / pot0[i] - 1, 2) / n;
    }
    rms[0] = sqrt(rms[0]);
    rms[1] = sqrt(rms[1]);
}

/* Each form and precision, sources beyond one chunk, against the double sum. */
static void test_accuracy(void **state)
{
    (void)state;
    const double bound[] = {[DIRECT_FLOAT] = 1e-5, [DIRECT_PAIR] = 1e-7};
    static double acc[300][3], pot[300], acc0[300][3], pot0[300];
    for (enum softening_form form = SOFT_COMMON; form <= SOFT_SPLINE; form++) {
        struct set *s = make(N_MAX, form);
        reference(s, form, 4000, 300, acc0, pot0);
        for (enum direct_precision precision = DIRECT_FLOAT; precision <= DIRECT_PAIR; precision++) {
            double rms[2];
            compute(s, form, precision, 0, 4000, 300, acc, pot);
            errors(300, acc, pot, acc0, pot0, rms);
            print_message("form %d, precision %d: rms of acceleration %.2e, of potential %.2e\n", (int)form,
                          (int)precision, rms[0], rms[1]);
            assert_true(rms[0] < bound[precision] && rms[1] < bound[precision]);
        }
        free(s);
    }
}

/* The same bits from every size of block, one or four targets a thread, few targets or all. */
static void test_same_bits(void **state)
{
    (void)state;
    static double acc[N_MAX][3], pot[N_MAX], acc1[N_MAX][3], pot1[N_MAX];
    struct set *s = make(N_MAX, SOFT_PLUMMER);
    compute(s, SOFT_PLUMMER, DIRECT_PAIR, 128, 0, N_MAX, acc, pot);
    for (int threads = 32; threads <= 256; threads *= 2) {
        compute(s, SOFT_PLUMMER, DIRECT_PAIR, threads, 100, 200, acc1, pot1);
        assert_memory_equal(acc + 100, acc1, 200 * sizeof *acc);
        assert_memory_equal(pot + 100, pot1, 200 * sizeof *pot);
    }
    compute(s, SOFT_PLUMMER, DIRECT_PAIR, 256, 0, N_MAX, acc1, pot1);
    assert_memory_equal(acc, acc1, sizeof acc);
    assert_memory_equal(pot, pot1, sizeof pot);
    free(s);
}

/* One escaper at 1e7 radii costs the others nothing in pairs of floats. */
static void test_escaper(void **state)
{
    (void)state;
    static double acc[500][3], pot[500], acc0[500][3], pot0[500];
    double rms[2];
    struct set *s = make(1000, SOFT_PLUMMER);
    s->pos[999][0] = 7e7;
    reference(s, SOFT_PLUMMER, 500, 500, acc0, pot0);
    compute(s, SOFT_PLUMMER, DIRECT_PAIR, 0, 500, 500, acc, pot);
    errors(500, acc, pot, acc0, pot0, rms);
    print_message("escaper: rms of acceleration %.2e, of potential %.2e\n", rms[0], rms[1]);
    assert_true(rms[0] < 1e-6 && rms[1] < 1e-6);
    free(s);
}

/* A row alone, two rows at one place without softening, rows without mass: zeros, no NaN. */
static void test_edges(void **state)
{
    (void)state;
    double acc[2][3] = {{9, 9, 9}, {9, 9, 9}}, pot[2] = {9, 9};
    struct set *s = make(1, SOFT_PLUMMER);
    s->soft[0] = s->soft[1] = 0;
    compute(s, SOFT_PLUMMER, DIRECT_PAIR, 0, 0, 1, acc, pot);
    assert_true(acc[0][0] == 0 && acc[0][1] == 0 && acc[0][2] == 0 && pot[0] == 0);
    s->n = 2;
    s->own[1] = 1;
    s->mass[1] = 1;
    memcpy(s->pos[1], s->pos[0], sizeof s->pos[0]);
    for (enum softening_form form = SOFT_PLUMMER; form <= SOFT_SPLINE; form++) {
        compute(s, form, DIRECT_FLOAT, 0, 0, 2, acc, pot);
        for (int i = 0; i < 2; i++) assert_true(acc[i][0] == 0 && acc[i][1] == 0 && acc[i][2] == 0 && pot[i] == 0);
    }
    s->mass[0] = s->mass[1] = 0;
    compute(s, SOFT_PLUMMER, DIRECT_PAIR, 0, 0, 2, acc, pot);
    assert_true(acc[1][0] == 0 && pot[1] == 0);
    free(s);
}

/* What the frame sees of devices: none, no driver, too little memory. */
static void test_device(void **state)
{
    (void)state;
    assert_int_equal(device_choice("cuda"), DEVICE_CUDA);
    assert_int_equal(device_choice("gpu"), -1);
    assert_null(device_open(DEVICE_CPU));
    setenv("SHIM_DEVICES", "0", 1);
    assert_null(device_open(DEVICE_AUTO));
    setenv("SHIM_DEVICES", "-1", 1);
    assert_null(device_open(DEVICE_AUTO));
    char why[256];
    assert_null(device_find(0, why, sizeof why));
    assert_non_null(strstr(why, "driver"));
    unsetenv("SHIM_DEVICES");
    struct device *device = device_open(DEVICE_AUTO);
    assert_string_equal(device_name(device), "host shim");
    assert_null(device_error(device));
    assert_null(device_alloc(device, "a test", (size_t)2 << 30));
    assert_non_null(strstr(device_error(device), "a test needs 2.15 GB on host shim, where 1.07 GB are free"));
    assert_null(device_alloc(device, "a test", 8));
    device_close(device);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_accuracy), cmocka_unit_test(test_same_bits), cmocka_unit_test(test_escaper),
        cmocka_unit_test(test_edges),    cmocka_unit_test(test_device),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
