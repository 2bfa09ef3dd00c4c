/* SPDX-License-Identifier: GPL-3.0-or-later
 * fmm with mutual acceptance: momentum is kept by a force of all rows whatever its accuracy, for which the one-sided walk is
 * the counter-example; errors stay as asked; bits do not depend on threads. */
#include "gravity_case.h"
#include <omp.h>

/* |sum m a| over sum m |a|. */
static double momentum_rate(const struct sim *sim)
{
    const struct species *s = &sim->species[DARK];
    double rate[3] = {0}, size = 0;
    for (int64_t i = 0; i < s->n; i++) {
        const double a[3] = {(double)s->acc[i][0], (double)s->acc[i][1], (double)s->acc[i][2]};
        for (int k = 0; k < 3; k++) rate[k] += s->mass[i] * a[k];
        size += s->mass[i] * sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
    }
    return sqrt(rate[0] * rate[0] + rate[1] * rate[1] + rate[2] * rate[2]) / size;
}

/* A tenth of the rows in twenty dense clumps, so that many share the error of a far cell; masses differ. */
static struct rows clumped(int64_t n)
{
    struct rows rows = rows_make(n);
    for (int64_t i = 0; i < n; i++) {
        rows.mass[i] *= 1 + (double)(i % 3);
        if (i % 10 == 0)
            for (int k = 0; k < 3; k++) rows.pos[i][k] = rows.pos[i % 200][k] * 2 + 0.01 * rows.pos[i][k];
    }
    return rows;
}

static const char *const forms[] = {"softening=0.01", "softening=0.01 softening_kernel=spline", "softening=0"};

static void test_momentum(void **state)
{
    (void)state;
    struct rows rows = clumped(20000);
    for (double accuracy = 1e-2; accuracy > 5e-5; accuracy /= 10)
        for (int k = 0; k < 3; k++) {
            double rate[2];
            for (int mutual = 0; mutual < 2; mutual++) {
                char *text = mem_format("test", "solver=fmm accuracy=%g mutual=%s %s", accuracy, mutual ? "on" : "off", forms[k]);
                struct sim *sim = rows_forces(rows, text);
                rate[mutual] = momentum_rate(sim);
                sim_free(sim);
                mem_free(text);
            }
            print_message("accuracy %g, %s: momentum %.1e, mutual %.1e\n", accuracy, forms[k], rate[0], rate[1]);
            assert_true(rate[1] < 1e-7);
            if (accuracy > 5e-3) assert_true(rate[0] > 10 * rate[1]);
        }
    rows_free(rows);
}

static void test_errors(void **state)
{
    (void)state;
    struct rows rows = clumped(5000);
    for (double accuracy = 1e-2; accuracy > 5e-5; accuracy /= 10)
        for (int k = 0; k < 3; k++) {
            char *text = mem_format("test", "solver=fmm mutual=on accuracy=%g %s", accuracy, forms[k]);
            const double p99 = check_rows(rows, text, k < 2 ? 0.01 : 0, 1, 0.1).p99;
            print_message("%s: 99 %% err by %.1e\n", text, p99);
            assert_true(p99 <= accuracy);
            mem_free(text);
        }
    rows_free(rows);
}

static void test_threads(void **state)
{
    (void)state;
    struct rows rows = clumped(6000);
    struct sim *sim[2];
    for (int k = 0; k < 2; k++) {
        omp_set_num_threads(k + 1);
        sim[k] = rows_forces(rows, "solver=fmm mutual=on softening=0.01");
    }
    assert_memory_equal(sim[0]->species[DARK].acc, sim[1]->species[DARK].acc, (size_t)rows.n * sizeof(float[3]));
    assert_memory_equal(sim[0]->species[DARK].pot, sim[1]->species[DARK].pot, (size_t)rows.n * sizeof(float));
    for (int k = 0; k < 2; k++) sim_free(sim[k]);
    rows_free(rows);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_momentum), cmocka_unit_test(test_errors), cmocka_unit_test(test_threads)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
