/* SPDX-License-Identifier: GPL-3.0-or-later
 * Black holes among stars: every solver and both kernels give their pairs the softening of their own, against plain
 * sums over all rows in double. Whole runs: check-black-holes.sh. */
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
#include <string.h>
#include <cmocka.h>

enum { STARS = 3000, HOLES = 3, ROWS = STARS + HOLES };
static const double eps_star = 0.2, eps_hole = 0.02;

static double eps_of(uint64_t id) { return id <= STARS ? eps_star : eps_hole; }

/* Stars about the origin and heavy holes in their midst, with their forces. */
static struct sim *forces(const char *settings)
{
    struct scene *scene = scene_new(".");
    struct problems problems = {0};
    char *gravity = mem_format("test", "gravity={softening: %g, %s}", eps_star, settings),
         *holes = mem_format("test", "black_holes={softening: %g}", eps_hole);
    scene_set(scene, "units={}", &problems);
    scene_set(scene, gravity, &problems);
    scene_set(scene, holes, &problems);
    struct sim *sim = sim_new(scene, SIM_FORCES);
    assert_int_equal(problems.count + sim->problems.count, 0);
    struct species *s = &sim->species[STAR];
    species_reserve(s, ROWS);
    s->n = s->n_own = ROWS;
    for (int64_t i = 0; i < ROWS; i++) {
        struct random key = {7, (uint64_t)i, 0, random_stream("test_black_holes")};
        s->id[i] = (uint64_t)i + 1;
        s->hole[i] = i >= STARS;
        s->mass[i] = s->hole[i] ? 0.05 : 1.0 / STARS;
        for (int k = 0; k < 3; k++) s->pos[i][k] = (s->hole[i] ? 0.05 : 1) * random_normal(&key, (uint64_t)k);
    }
    sim_begin(sim);
    sim_find_active(sim);
    sim->want_potential = true;
    sim_run_hook(sim, HOOK_ARRANGE);
    sim_run_hook(sim, HOOK_FORCE);
    mem_free(gravity);
    mem_free(holes);
    return sim;
}

/* Acceleration and potential of row i from all others. */
static void sum_of(const struct species *s, int64_t i, enum softening_form form, double sum[4])
{
    const double ratio = form == SOFT_SPLINE ? 2.8 : 1;
    memset(sum, 0, 4 * sizeof *sum);
    for (int64_t j = 0; j < s->n; j++) {
        double d[3], r2 = 0, a = ratio * eps_of(s->id[i]), b = ratio * eps_of(s->id[j]);
        for (int k = 0; k < 3; k++) {
            d[k] = s->pos[j][k] - s->pos[i][k];
            r2 += d[k] * d[k];
        }
        struct pair p = pair_any(form, r2, s->mass[j], 0.5 * (a * a + b * b));
        for (int k = 0; k < 3; k++) sum[k] += p.pull * d[k];
        if (j != i) sum[3] -= p.depth;
    }
}

static void test_softening(void **unused)
{
    (void)unused;
    static const struct { const char *settings; double most, all; } of[] = {
        {"solver: direct, precision: double", 1e-6, 1e-6}, {"solver: direct", 1e-5, 1e-5},
        {"solver: tree, accuracy: 1e-3", 1e-2, 1e-3}, {"solver: fmm, accuracy: 1e-3", 1e-2, 1e-3},
        {"solver: fmm, accuracy: 1e-4, softening_kernel: spline", 1e-3, 1e-4},
        {"solver: direct, softening_kernel: spline", 1e-5, 1e-5}};
    for (size_t c = 0; c < sizeof of / sizeof *of; c++) {
        struct sim *sim = forces(of[c].settings);
        const struct species *s = &sim->species[STAR];
        double sum = 0, holes = 0;
        for (int64_t i = 0; i < ROWS; i++) {
            double exact[4], d2 = 0, a2 = 0;
            sum_of(s, i, strstr(of[c].settings, "spline") ? SOFT_SPLINE : SOFT_PLUMMER, exact);
            for (int k = 0; k < 3; k++) {
                d2 += ((double)s->acc[i][k] - exact[k]) * ((double)s->acc[i][k] - exact[k]);
                a2 += exact[k] * exact[k];
            }
            sum += d2 / a2 / ROWS;
            if (s->hole[i]) holes = fmax(holes, sqrt(d2 / a2));
            assert_true(fabs((double)s->pot[i] - exact[3]) < of[c].most * fabs(exact[3]));
        }
        if (!(sqrt(sum) < of[c].all && holes < of[c].most)) fail_msg("%s: rms %g, holes %g", of[c].settings, sqrt(sum), holes);
        sim_free(sim);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_softening)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
