/* SPDX-License-Identifier: GPL-3.0-or-later
 * Gravity of a few active rows among many that sleep, alone in their cells or next to each other, against direct sums in
 * double: errors as asked, the same bits on any number of threads. */
#include "gravity_case.h"
#include <omp.h>

enum { ROWS = 20000, RUNG = 30 };

/* Rows at rest or moving; the first force is of all. */
static struct sim *begin(struct rows rows, const char *settings)
{
    struct sim *sim = rows_forces(rows, settings);
    struct species *s = &sim->species[DARK];
    for (int64_t i = 0; i < s->n; i++)
        for (int k = 0; k < 3; k++) s->vel[i][k] = 0.01 * random_normal(&(struct random){5, s->id[i], 0, 0}, (uint64_t)k);
    sim->time.dt_max = 1;
    sim->time.tick_end = INT64_MAX;
    return sim;
}

/* The force of n rows, each `stride` rows from the next, at the end of their step; all others sleep. */
static void force_few(struct sim *sim, int64_t n, int64_t stride)
{
    struct species *s = &sim->species[DARK];
    for (int64_t i = 0; i < s->n; i++) s->rung[i] = s->rung0[i] = RUNG_TOP;
    for (int64_t k = 0; k < n; k++) s->rung[k * stride] = s->rung0[k * stride] = RUNG;
    memset(s->acc, 0, (size_t)s->n * sizeof *s->acc);
    sim->time.tick = (int64_t)1 << RUNG;
    sim->want_potential = true;
    sim_find_active(sim);
    assert_int_equal(s->n_active, n);
    sim_run_hook(sim, HOOK_ARRANGE);
    sim_run_hook(sim, HOOK_FORCE);
    assert_true(sim->tree.built < sim->time.tick);
}

/* 99th percentile of the errors of the active rows: accelerations as `accuracy` counts them, potentials. */
static void few_errors(struct sim *sim, double p99[2])
{
    const struct species *s = &sim->species[DARK];
    double (*exact)[4] = mem_alloc("test", (size_t)s->n_active * sizeof *exact), *error[2], square = 0;
    gravity_direct_rows(sim, sim_state(sim, "gravity"), s, s->active, s->n_active, exact);
    for (int k = 0; k < 2; k++) error[k] = mem_array("test", double, s->n_active);
    for (int64_t i = 0; i < s->n; i++) square += (double)s->grav[i] * (double)s->grav[i];
    const double floor = GRAVITY_FLOOR * sqrt(square / (double)s->n);
    for (int64_t i = 0; i < s->n_active; i++) {
        const double size = sqrt(exact[i][0] * exact[i][0] + exact[i][1] * exact[i][1] + exact[i][2] * exact[i][2]);
        error[0][i] = gravity_relative_error(s->acc[s->active[i]], exact[i]) * fmin(1, size / floor);
        error[1][i] = fabs((double)s->pot[s->active[i]] / exact[i][3] - 1);
    }
    for (int k = 0; k < 2; k++) {
        p99[k] = gravity_errors_of(error[k], s->n_active).p99;
        mem_free(error[k]);
    }
    mem_free(exact);
}

static void test_errors(void **state)
{
    (void)state;
    struct rows rows = rows_make(ROWS);
    const char *const kernel[] = {"", "softening_kernel=spline", "softening_dark=0.05"};
    const struct { int64_t n, stride; } set[] = {{400, 50}, {1000, 20}, {300, 1}, {1, 1}};
    for (double accuracy = 1e-2; accuracy > 5e-6; accuracy /= 10)
        for (int k = 0; k < 3; k++) {
            char *text = mem_format("test", "solver=fmm softening=0.01 accuracy=%g %s", accuracy, kernel[k]);
            struct sim *sim = begin(rows, text);
            for (int i = 0; i < 4; i++) {
                double p99[2];
                force_few(sim, set[i].n, set[i].stride);
                few_errors(sim, p99);
                print_message("%s, %d rows: %.2e (potentials %.2e)\n", text, (int)set[i].n, p99[0], p99[1]);
                if (p99[0] > accuracy || p99[1] > accuracy)
                    fail_msg("%s, %d rows: 99 %% err by %.2e (potentials %.2e)", text, (int)set[i].n, p99[0], p99[1]);
            }
            sim_free(sim);
            mem_free(text);
        }
    rows_free(rows);
}

static void test_threads(void **state)
{
    (void)state;
    struct rows rows = rows_make(ROWS);
    struct sim *sim[2];
    for (int k = 0; k < 2; k++) {
        omp_set_num_threads(k + 1);
        sim[k] = begin(rows, "solver=fmm softening=0.01");
        force_few(sim[k], 1000, 20);
    }
    assert_memory_equal(sim[0]->species[DARK].acc, sim[1]->species[DARK].acc, ROWS * sizeof(float[3]));
    assert_memory_equal(sim[0]->species[DARK].pot, sim[1]->species[DARK].pot, ROWS * sizeof(float));
    for (int k = 0; k < 2; k++) sim_free(sim[k]);
    rows_free(rows);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_errors), cmocka_unit_test(test_threads)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
