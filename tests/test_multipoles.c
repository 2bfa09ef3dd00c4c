/* SPDX-License-Identifier: GPL-3.0-or-later
 * Cells on targets, as the solver `tree` walks them, are exact to their order: with monopoles the error falls as the square of
 * the cell's size, with quadrupoles as the cube, of the force and of the potential, against direct sums in double. */
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
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

/* Rows of the cell, then targets far away, then two that hold the corners of the cube, so that its planes (4 and 8 are two of
 * them) miss the cell. Only the cell has mass to speak of. */
enum { CELL_ROWS = 200, TARGETS = 16, CORNERS = 2, ROWS = CELL_ROWS + TARGETS + CORNERS };
static const double eps = 0.5, centre = 5.5, place = -5;

/* Skewed and flat, so that every moment is there. */
static void place_rows(struct species *s, double size)
{
    for (int i = 0; i < ROWS; i++) {
        struct random key = {11, (uint64_t)i, 0, random_stream("test_multipoles")};
        s->id[i] = (uint64_t)i;
        s->mass[i] = i < CELL_ROWS ? (0.5 + random_uniform(&key, 3)) / CELL_ROWS : 1e-12;
        for (int k = 0; k < 3; k++) {
            double x = random_uniform(&key, (uint64_t)k);
            if (i < CELL_ROWS) s->pos[i][k] = centre + size * (x * x - 0.3) / (1 + k);
            else if (i < CELL_ROWS + TARGETS) s->pos[i][k] = place + 0.1 * x;
            else s->pos[i][k] = i % 2 ? 16 : -16;
        }
    }
}

static struct sim *forces(const char *order, double size)
{
    const char *const setting[] = {"units={}", "gravity={}", "gravity.solver=tree", "gravity.opening_angle=0.7",
                                   "gravity.softening=0.5", "gravity.group_size=32", order};
    struct scene *scene = scene_new(".");
    struct problems problems = {0};
    for (size_t k = 0; k < sizeof setting / sizeof *setting; k++) scene_set(scene, setting[k], &problems);
    struct sim *sim = sim_new(scene, SIM_FORCES);
    assert_int_equal(problems.count + sim->problems.count, 0);
    struct species *s = &sim->species[DARK];
    species_reserve(s, ROWS);
    s->n = s->n_own = ROWS;
    place_rows(s, size);
    sim_begin(sim);
    sim_find_active(sim);
    sim->want_potential = true;
    sim_run_hook(sim, HOOK_ARRANGE);
    sim_run_hook(sim, HOOK_FORCE);
    return sim;
}

/* Largest relative errors at the targets: force, potential. */
static void errors(const char *order, double size, double error[2])
{
    struct sim *sim = forces(order, size);
    const struct species *s = &sim->species[DARK];
    const struct gravity *g = sim_state(sim, "gravity");
    assert_true(g->cells >= TARGETS && g->pairs < CELL_ROWS * CELL_ROWS + CELL_ROWS * TARGETS);     /* cells acted, not rows */
    error[0] = error[1] = 0;
    for (int i = 0; i < ROWS; i++) {
        if (s->id[i] < CELL_ROWS || s->id[i] >= CELL_ROWS + TARGETS) continue;
        double a[3] = {0}, pot = 0, off = 0, whole = 0;
        for (int j = 0; j < ROWS; j++) {
            double d[3], r2 = eps * eps;
            for (int k = 0; k < 3; k++) {
                d[k] = s->pos[j][k] - s->pos[i][k];
                r2 += d[k] * d[k];
            }
            for (int k = 0; k < 3; k++) a[k] += s->mass[j] * d[k] / (r2 * sqrt(r2));
            if (i != j) pot -= s->mass[j] / sqrt(r2);
        }
        for (int k = 0; k < 3; k++) {
            off += ((double)s->acc[i][k] - a[k]) * ((double)s->acc[i][k] - a[k]);
            whole += a[k] * a[k];
        }
        error[0] = fmax(error[0], sqrt(off / whole));
        error[1] = fmax(error[1], fabs((double)s->pot[i] / pot - 1));
    }
    sim_free(sim);
}

/* A cell of half the size: 2^(order + 1) times less, but for the next order's share. */
static void check_order(const char *setting, int order)
{
    double whole[2], half[2];
    errors(setting, 3.2, whole);
    errors(setting, 1.6, half);
    for (int i = 0; i < 2; i++) {
        print_message("%s: error of the %s %.2e, of half the size %.2e\n", setting, i ? "potential" : "force", whole[i], half[i]);
        assert_true(half[i] > 1e-6);        /* floats are better */
        assert_true(whole[i] / half[i] > ldexp(0.85, order + 1));
        assert_true(whole[i] / half[i] < ldexp(1.2, order + 2));
    }
}

static void test_monopole(void **state)
{
    (void)state;
    check_order("gravity.order=1", 1);
}

static void test_quadrupole(void **state)
{
    (void)state;
    check_order("gravity.order=2", 2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_monopole), cmocka_unit_test(test_quadrupole)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
