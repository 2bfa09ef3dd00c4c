/* SPDX-License-Identifier: GPL-3.0-or-later
 * Softening of gas by its smoothing lengths: forces and potentials against direct sums in double, in gas alone and among
 * dark rows, of all rows and of few; what is refused. */
#include "gravity_case.h"
#include "log.h"
#include "scene_case.h"
#include <omp.h>

static const char *const gas_alone[] = {"units={G: 1}", "start={generator: evrard, n: 3000}", "time={end: 1}",
    "output={snapshot_every: 1}", "sph={}", "gravity={softening: 0.01, softening_kernel: spline, softening_adaptive: on}", NULL};
static const char *const gas_and_dark[] = {"units={G: 1}",
    "start={generator: spheres, n: 4000, dark_mass: 1, dark_radius: 1, gas_mass: 0.3, gas_radius: 0.5}", "time={end: 1}",
    "output={snapshot_every: 1}", "sph={}", "gravity={softening: 0.05, softening_kernel: spline, softening_adaptive: on}", NULL};

/* Gravity of the active rows alone, after smoothing lengths are found. */
static void force(struct sim *sim)
{
    sim->want_potential = true;
    sim_find_active(sim);
    for (int hook = HOOK_ARRANGE; hook < HOOK_FORCE; hook++) sim_run_hook(sim, (enum hook)hook);
    for_species(sim, s) memset(s->acc, 0, (size_t)s->n * sizeof *s->acc);
    for (int u = 0; u < sim->n_use; u++)
        if (strcmp(sim->use[u].module->name, "gravity") == 0) sim->use[u].module->hook[HOOK_FORCE](sim, sim->use[u].state);
}

/* The square of the spline's support that a row brings. */
static double support2(const struct species *s, int64_t i, double softening)
{
    const double support = s->kind == GAS ? 2 * (double)s->h[i] : 2.8 * softening;
    return support * support;
}

static void exact_row(const struct sim *sim, const struct species *s, int64_t i, double softening, double sum[4])
{
    double at[3], from[3];
    memset(sum, 0, 4 * sizeof *sum);
    sim_predict(&sim->time, s, i, at);
    for_species(sim, t)
        for (int64_t j = 0; j < t->n; j++) {
            double d[3], r2 = 0;
            sim_predict(&sim->time, t, j, from);
            for (int k = 0; k < 3; k++) {
                d[k] = from[k] - at[k];
                r2 += d[k] * d[k];
            }
            if (s == t && i == j) continue;
            struct pair p = pair_any(SOFT_SPLINE, r2, t->mass[j], 0.5 * (support2(s, i, softening) + support2(t, j, softening)));
            for (int k = 0; k < 3; k++) sum[k] += p.pull * d[k];
            sum[3] -= p.depth;
        }
}

/* 99th percentiles of the errors of the active rows: accelerations, as `accuracy` counts them, and potentials. */
static void errors(const struct sim *sim, double softening, double p99[2])
{
    double *error[2], square = 0;
    int64_t n = 0, rows = 0;
    for_species(sim, s) {
        n += s->n_active;
        rows += s->n;
        for (int64_t i = 0; i < s->n; i++) square += (double)s->grav[i] * (double)s->grav[i];
    }
    const double floor = GRAVITY_FLOOR * sqrt(square / (double)rows);
    for (int k = 0; k < 2; k++) error[k] = mem_array("test", double, n);
    n = 0;
    for_species(sim, s)
        for (int64_t a = 0; a < s->n_active; a++, n++) {
            const int64_t i = s->active[a];
            double exact[4];
            exact_row(sim, s, i, softening, exact);
            const double size = sqrt(exact[0] * exact[0] + exact[1] * exact[1] + exact[2] * exact[2]);
            error[0][n] = gravity_relative_error(s->acc[i], exact) * fmin(1, size / floor);
            error[1][n] = fabs((double)s->pot[i] / exact[3] - 1);
        }
    for (int k = 0; k < 2; k++) {
        p99[k] = gravity_errors_of(error[k], n).p99;
        mem_free(error[k]);
    }
}

static void check_errors(struct sim *sim, const char *solver, double softening, double limit)
{
    double p99[2];
    force(sim);
    errors(sim, softening, p99);
    print_message("%s: 99 %% of accelerations err by %.1e, of potentials by %.1e\n", solver, p99[0], p99[1]);
    assert_true(p99[0] <= limit && p99[1] <= limit);
}

static const struct { const char *solver; double limit; } solvers_of[] = {
    {"gravity.solver=direct", 2e-6}, {"gravity.solver=tree", 1e-3}, {"gravity.solver=fmm", 1e-3}};

/* |sum m a| over sum m |a| of all rows. */
static double momentum(const struct sim *sim)
{
    double rate[3] = {0}, size = 0;
    for_species(sim, s)
        for (int64_t i = 0; i < s->n; i++) {
            const float *a = s->acc[i];
            for (int k = 0; k < 3; k++) rate[k] += s->mass[i] * (double)a[k];
            size += s->mass[i] * sqrt((double)a[0] * (double)a[0] + (double)a[1] * (double)a[1] + (double)a[2] * (double)a[2]);
        }
    return sqrt(rate[0] * rate[0] + rate[1] * rate[1] + rate[2] * rate[2]) / size;
}

static void test_adaptive(void **state)
{
    (void)state;
    for (int v = 0; v < 3; v++)
        for (int k = 0; k < 2; k++) {
            const char *const set[] = {solvers_of[v].solver, NULL};
            struct sim *sim = scene_case_make(k ? gas_and_dark : gas_alone, set);
            check_errors(sim, solvers_of[v].solver, k ? 0.05 : 0.01, solvers_of[v].limit);
            if (v == 0) assert_true(momentum(sim) < 1e-6);
            sim_free(sim);
        }
}

/* At the next step a tenth of the gas is active; others keep their lengths. */
static void test_few(void **state)
{
    (void)state;
    enum { RUNG = 30 };
    for (int v = 1; v < 3; v++) {
        struct sim *sim = scene_case_make(gas_and_dark, (const char *const[]){solvers_of[v].solver, NULL});
        force(sim);
        for_species(sim, s)
            for (int64_t i = 0; i < s->n; i++) s->rung[i] = s->rung0[i] = s->kind == GAS && i % 10 == 0 ? RUNG : RUNG_TOP;
        sim->time.tick = (int64_t)1 << RUNG;
        check_errors(sim, solvers_of[v].solver, 0.05, solvers_of[v].limit);
        assert_true(sim->species[GAS].n_active > 50 && sim->species[DARK].n_active == 0);
        sim_free(sim);
    }
}

static int problems_of(const char *const *set)
{
    struct problems problems = {0};
    struct scene *scene = scene_new(".");
    for (; *set; set++) scene_set(scene, *set, &problems);
    struct sim *sim = sim_new(scene, SIM_FORCES);
    if (sim->problems.count == 0) sim_begin(sim);
    const int n = problems.count + sim->problems.count;
    sim_free(sim);
    return n;
}

static void test_refused(void **state)
{
    (void)state;
    const char *const ways[][5] = {
        {"gravity={softening_adaptive: on, softening_kernel: spline}", "units={G: 1}", "sph={}"},
        {"gravity={softening_adaptive: on}", "units={G: 1}", "sph={}"},
        {"gravity={softening_adaptive: on, softening_kernel: spline, softening_gas: 0.1}", "units={G: 1}", "sph={}"},
        {"gravity={softening_adaptive: on, softening_kernel: spline}", "units={G: 1}"}};
    for (int k = 0; k < 4; k++) assert_int_equal(problems_of(ways[k]), k > 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_adaptive), cmocka_unit_test(test_few), cmocka_unit_test(test_refused)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
