/* SPDX-License-Identifier: GPL-3.0-or-later
 * Counter-based numbers: the published known answer of Threefry, moments, independence of order. */
#include "random.h"
#include <Random123/threefry.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <cmocka.h>

/* Random123's kat_vectors, threefry4x64 20 rounds, counter and key zero. */
static void test_known_answer(void **state)
{
    (void)state;
    const uint64_t first = 0x09218ebde6c85537;
    struct random key = {0, 0, 0, 0};
    assert_true(random_uniform(&key, 0) == ((double)(first >> 12) + 0.5) * 0x1p-52);
}

static void test_uniform(void **state)
{
    (void)state;
    enum {N = 400000, BINS = 16};
    double sum = 0.0, square = 0.0;
    int bin[BINS] = {0};
    for (uint64_t i = 0; i < N; i++) {
        struct random key = {7, i / 8, 3, random_stream("test")};
        double x = random_uniform(&key, i % 8);
        assert_true(x > 0.0 && x < 1.0);
        sum += x;
        square += x * x;
        bin[(int)(x * BINS)]++;
    }
    assert_true(fabs(sum / N - 0.5) < 5.0 * sqrt(1.0 / 12 / N));
    assert_true(fabs(square / N - 1.0 / 3) < 5.0 * sqrt(4.0 / 45 / N));
    double chi2 = 0.0;
    for (int b = 0; b < BINS; b++) chi2 += pow(bin[b] - N / BINS, 2) / (N / BINS);
    assert_true(chi2 < 45.0);   /* 15 degrees of freedom: one chance in 1e4 */
}

static void test_normal_and_direction(void **state)
{
    (void)state;
    enum {N = 200000};
    double moment[5] = {0}, mean[3] = {0}, tensor[3] = {0};
    for (uint64_t i = 0; i < N; i++) {
        struct random key = {1, i, 0, random_stream("normal")};
        double x = random_normal(&key, i % 3), e[3];
        for (int k = 1; k < 5; k++) moment[k] += pow(x, k) / N;
        random_direction(&key, 5, e);
        assert_true(fabs(e[0] * e[0] + e[1] * e[1] + e[2] * e[2] - 1.0) < 1e-14);
        for (int k = 0; k < 3; k++) {
            mean[k] += e[k] / N;
            tensor[k] += e[k] * e[k] / N;
        }
    }
    assert_true(fabs(moment[1]) < 5.0 / sqrt(N) && fabs(moment[2] - 1.0) < 5.0 * sqrt(2.0 / N));
    assert_true(fabs(moment[3]) < 5.0 * sqrt(15.0 / N) && fabs(moment[4] - 3.0) < 5.0 * sqrt(96.0 / N));
    for (int k = 0; k < 3; k++) {
        assert_true(fabs(mean[k]) < 5.0 / sqrt(3.0 * N));
        assert_true(fabs(tensor[k] - 1.0 / 3) < 5.0 * sqrt(4.0 / 45 / N));
    }
}

/* Each part of the key matters; the draws of one key differ from each other. */
static void test_keys(void **state)
{
    (void)state;
    const struct random key[] = {
        {1, 2, 3, 4}, {2, 2, 3, 4}, {1, 3, 3, 4}, {1, 2, 4, 4}, {1, 2, 3, 5},
    };
    double x[25];
    for (int i = 0; i < 25; i++) x[i] = random_uniform(&key[i / 5], (uint64_t)(i % 5));
    for (int i = 0; i < 25; i++)
        for (int j = 0; j < i; j++) assert_true(x[i] != x[j]);
    assert_true(random_stream("evrard") != random_stream("plummer"));
    assert_true(random_stream("") == 14695981039346656037u && random_stream("a") == 0xaf63dc4c8601ec8c);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_known_answer), cmocka_unit_test(test_uniform),
        cmocka_unit_test(test_normal_and_direction), cmocka_unit_test(test_keys),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
