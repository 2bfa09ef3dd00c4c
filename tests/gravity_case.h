/* SPDX-License-Identifier: GPL-3.0-or-later
 * For the tests of gravity: sets of rows, their forces under some settings, and direct sums in double to hold them against. */
#ifndef TEPHRA_TESTS_GRAVITY_CASE_H
#define TEPHRA_TESTS_GRAVITY_CASE_H
#include "gravity/gravity.h"
#include "mem.h"
#include "module.h"
#include "random.h"
#include "scene.h"
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

struct rows { int64_t n; double (*pos)[3], *mass; };

/* Normally distributed rows of unit mass. */
static inline struct rows rows_make(int64_t n)
{
    struct rows rows = {n, mem_alloc("test", (size_t)n * sizeof(double[3])), mem_array("test", double, n)};
    for (int64_t i = 0; i < n; i++) {
        struct random key = {7, (uint64_t)i, 0, random_stream("test_gravity")};
        rows.mass[i] = 1.0 / (double)n;
        for (int k = 0; k < 3; k++) rows.pos[i][k] = random_normal(&key, (uint64_t)k);
    }
    return rows;
}

static inline void rows_free(struct rows rows)
{
    mem_free(rows.pos);
    mem_free(rows.mass);
}

/* Acceleration and potential, in double. */
static inline double (*rows_exact(struct rows rows, double eps, enum softening_form form))[4]
{
    double (*sum)[4] = mem_alloc("test", (size_t)rows.n * sizeof *sum), length = form == SOFT_SPLINE ? 2.8 * eps : eps;
    for (int64_t i = 0; i < rows.n; i++)
        for (int64_t j = 0; j < rows.n; j++) {
            double d[3], r2 = 0;
            for (int k = 0; k < 3; k++) {
                d[k] = rows.pos[j][k] - rows.pos[i][k];
                r2 += d[k] * d[k];
            }
            struct pair p = pair_any(form, r2, rows.mass[j], length * length);
            for (int k = 0; k < 3; k++) sum[i][k] += p.pull * d[k];
            if (i != j) sum[i][3] -= p.depth;
        }
    return sum;
}

/* Without rows yet, under `settings` ("solver=tree opening_angle=0.5 ..."). */
static inline struct sim *gravity_sim(const char *settings)
{
    struct scene *scene = scene_new(".");
    struct problems problems = {0};
    scene_set(scene, "units={}", &problems);
    scene_set(scene, "gravity={}", &problems);
    char *list = mem_text("test", settings), *rest = NULL;
    for (char *word = strtok_r(list, " ", &rest); word; word = strtok_r(NULL, " ", &rest)) {
        char *assignment = mem_format("test", "gravity.%s", word);
        scene_set(scene, assignment, &problems);
        mem_free(assignment);
    }
    mem_free(list);
    struct sim *sim = sim_new(scene, SIM_FORCES);
    assert_int_equal(problems.count + sim->problems.count, 0);
    return sim;
}

/* Dark rows with their forces. */
static inline struct sim *rows_forces(struct rows rows, const char *settings)
{
    struct sim *sim = gravity_sim(settings);
    struct species *s = &sim->species[DARK];
    species_reserve(s, rows.n);
    s->n = s->n_own = rows.n;
    for (int64_t i = 0; i < s->n; i++) {
        s->id[i] = (uint64_t)i;
        s->mass[i] = rows.mass[i];
        memcpy(s->pos[i], rows.pos[i], sizeof s->pos[i]);
    }
    sim_begin(sim);
    sim_find_active(sim);
    sim->want_potential = true;
    sim_run_hook(sim, HOOK_ARRANGE);
    sim_run_hook(sim, HOOK_FORCE);
    return sim;
}

/* Relative errors of the accelerations, against the larger of their size and `floor` of the rms. */
static inline struct gravity_errors rows_errors(const struct sim *sim, double (*exact)[4], double floor)
{
    const struct species *s = &sim->species[DARK];
    double *error = mem_array("test", double, s->n), square = 0;
    for (int64_t i = 0; i < s->n; i++)
        for (int k = 0; k < 3; k++) square += exact[i][k] * exact[i][k];
    floor *= sqrt(square / (double)s->n);
    for (int64_t i = 0; i < s->n; i++) {
        const double *e = exact[s->id[i]];
        double d2 = 0, a2 = 0;
        for (int k = 0; k < 3; k++) {
            assert_true(isfinite(s->acc[i][k]));
            d2 += ((double)s->acc[i][k] - e[k]) * ((double)s->acc[i][k] - e[k]);
            a2 += e[k] * e[k];
        }
        double size = fmax(sqrt(a2), floor);
        error[i] = size > 0 ? sqrt(d2) / size : sqrt(d2);
    }
    struct gravity_errors e = gravity_errors_of(error, s->n);
    mem_free(error);
    return e;
}

static inline double largest_potential_error(const struct sim *sim, double (*exact)[4])
{
    const struct species *s = &sim->species[DARK];
    double most = 0;
    for (int64_t i = 0; i < s->n; i++) {
        double e = exact[s->id[i]][3];
        most = fmax(most, fabs(((double)s->pot[i] - e) / (e < 0 ? e : 1)));
    }
    return most;
}

/* Errors of the set under the settings, as `accuracy` counts them; the largest of accelerations, each against
 * its own size, below `acc`, of potentials below `pot`. */
static inline struct gravity_errors check_rows(struct rows rows, const char *settings, double eps, double acc, double pot)
{
    bool spline = strstr(settings, "softening_kernel=spline") != NULL;
    double (*exact)[4] = rows_exact(rows, eps, spline ? SOFT_SPLINE : SOFT_PLUMMER);
    char *all = mem_format("test", "softening=%.17g %s", eps, settings);
    struct sim *sim = rows_forces(rows, all);
    double most = rows_errors(sim, exact, 0).max, potential = largest_potential_error(sim, exact);
    if (most > acc || potential > pot)
        print_message("%s: largest error %.2e of accelerations, %.2e of potentials\n", all, most, potential);
    assert_true(most <= acc);
    assert_true(potential <= pot);
    struct gravity_errors e = rows_errors(sim, exact, 1e-2);
    sim_free(sim);
    mem_free(all);
    mem_free(exact);
    return e;
}

static const char *const solvers[] = {"solver=direct", "solver=tree accuracy=1e-3", "solver=fmm accuracy=1e-3"};
#endif
