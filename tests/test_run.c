/* SPDX-License-Identifier: GPL-3.0-or-later
 * The block time line with modules of the test's own: a Kepler force and steps that the test sets.
 * Both integrators must show their known energy errors (doc/manual/integrators.md) through the
 * whole driver, with rows on different rungs, woken rows, and a last step that is cut. */
#include "mem.h"
#include "module.h"
#include "output.h"
#include "run.h"
#include "scene_case.h"
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

enum { ROWS = 4 };
struct central { double steps, wake; };    /* steps an orbit of row 0; row k takes 2^k times as many */

static const struct param central_params[] = {
    {"steps", PARAM_REAL, "", "100", 1, 1e9, NULL, "steps an orbit", false, offsetof(struct central, steps)},
    {"wake", PARAM_REAL, "", "0", 0, 1, NULL, "wake row 0 now and then", false, offsetof(struct central, wake)},
    {0}
};

static void central_force(struct sim *sim, void *state)
{
    (void)state;
    struct species *s = &sim->species[DARK];
    for (int64_t a = 0; a < s->n_active; a++) {
        int64_t i = s->active[a];
        double r2 = 0;
        for (int k = 0; k < 3; k++) r2 += s->pos[i][k] * s->pos[i][k];
        for (int k = 0; k < 3; k++) s->acc[i][k] += (float)(-s->pos[i][k] / (r2 * sqrt(r2)));
    }
}

static void central_limit(struct sim *sim, void *state)
{
    const struct central *central = state;
    struct species *s = &sim->species[DARK];
    for (int64_t a = 0; a < s->n_active; a++) {
        int64_t i = s->active[a];
        s->dt[i] = (float)(1.00001 * 2 * M_PI / central->steps / (double)((uint64_t)1 << (s->id[i] - 1)));
    }
    for (int64_t i = 0; central->wake > 0 && i < s->n; i++)     /* one octant of the ticks: wake the longest */
        if (s->id[i] == 1 && !timeline_active(&sim->time, s->rung[i]) && (sim->time.tick >> (RUNG_TOP + 2) & 7) == 3)
            s->rung[i] = RUNG_TOP - 3;
}

static const struct module central_module = {
    .name = "central", .doc = "Kepler force", .params = central_params, .state_bytes = sizeof(struct central),
    .hook = {[HOOK_FORCE] = central_force, [HOOK_LIMIT] = central_limit},
};

struct orbit { double e; };
static const struct param orbit_params[] = {
    {"e", PARAM_REAL, "", "0.5", 0, 1, NULL, "eccentricity", false, offsetof(struct orbit, e)}, {0}};

static void orbit_make(struct sim *sim, const void *state, int64_t n)
{
    const struct orbit *orbit = state;
    struct species *s = &sim->species[DARK];
    species_reserve(s, n);
    s->n = n;
    for (int64_t i = 0; i < n; i++) {
        s->id[i] = (uint64_t)i + 1;
        s->mass[i] = 1;
        s->pos[i][i % 3] = 1 + orbit->e;
        s->vel[i][(i + 1) % 3] = sqrt((1 - orbit->e) / (1 + orbit->e));
    }
}

static const struct generator orbit_generator = {
    .name = "orbit", .doc = "Kepler orbits", .params = orbit_params, .state_bytes = sizeof(struct orbit), .make = orbit_make,
};

extern const struct module time_module, tree_module, leapfrog_module, pec_module, ranks_module, steps_module, output_module;
const struct module *const module_list[] = {&time_module, &tree_module, &leapfrog_module, &pec_module, &central_module,
                                            &ranks_module, &steps_module, &output_module, NULL};
const struct generator *const generator_list[] = {&orbit_generator, NULL};
const struct command *const command_list[] = {NULL};

static struct sim *new_sim(const char *const *set)
{
    const char *const fixed[] = {"units={}", "units.G=1", "start={}", "start.generator=orbit", "start.n=4", "time={}",
                                 "output={}", "central={}", NULL};
    return scene_case_make(fixed, set);
}

static double energy(const struct species *s, int64_t i)
{
    double v2 = 0, r2 = 0;
    for (int k = 0; k < 3; k++) {
        v2 += s->vel[i][k] * s->vel[i][k];
        r2 += s->pos[i][k] * s->pos[i][k];
    }
    return 0.5 * v2 - 1 / sqrt(r2);
}

/* Runs to the end; largest and last relative energy error of each row by id, steps taken in all. */
static void run(struct sim *sim, double largest[ROWS], double last[ROWS])
{
    struct species *s = &sim->species[DARK];
    memset(largest, 0, ROWS * sizeof *largest);
    while (!sim->started || sim->time.tick < sim->time.tick_end) {
        assert_true(run_step(sim, HOOK_LIMIT));
        for (int64_t i = 0; i < s->n; i++) {
            if (!timeline_active(&sim->time, s->rung0[i]) || timeline_lag(&sim->time, s->rung[i], s->rung0[i]) > 0) continue;
            int row = (int)s->id[i] - 1;
            last[row] = (energy(s, i) + 0.5) / 0.5;
            largest[row] = fmax(largest[row], fabs(last[row]));
        }
    }
}

/* Twenty pi is ten orbits; snapshots of 2 pi / 100 make that the longest step. */
static void test_leapfrog_blocks(void **unused)
{
    (void)unused;
    const char *const set[] = {"time.end=62.83185307179586", "output.snapshot_every=0.06283185307179587",
                               "output.energy_every=0.06283185307179587", NULL};
    const double known[ROWS] = {1.0322e-2, 2.6189e-3, 6.5716e-4, 1.6444e-4};
    double largest[ROWS], last[ROWS];
    struct sim *sim = new_sim(set);
    run(sim, largest, last);
    for (int k = 0; k < ROWS; k++) {
        assert_true(fabs(largest[k] / known[k] - 1) < 0.01);
        assert_true(fabs(last[k]) < 1e-5);              /* what float accelerations leave */
    }
    assert_int_equal(sim->updates, 1000 * (1 + 2 + 4 + 8));
    assert_int_equal(sim->steps, 8000);
    sim_free(sim);
}

static void test_pec_blocks(void **unused)
{
    (void)unused;
    const char *const set[] = {"time.end=62.83185307179586", "output.snapshot_every=0.06283185307179587",
                               "output.energy_every=0.06283185307179587", "time.integrator=pec", NULL};
    const double known[3] = {-1.7309e-1, -1.8786e-2, -2.3295e-3};
    double largest[ROWS], last[ROWS];
    struct sim *sim = new_sim(set);
    run(sim, largest, last);
    for (int k = 0; k < 3; k++) assert_true(fabs(last[k] / known[k] - 1) < 0.01);
    sim_free(sim);
}

/* Twice the forces, half of what pec loses (test_integrate.c has the exact figures). */
static void test_pec_twice(void **unused)
{
    (void)unused;
    const char *const set[] = {"time.end=62.83185307179586", "output.snapshot_every=0.06283185307179587",
                               "output.energy_every=0.06283185307179587", "time.integrator=pec", "time.evaluations=2", NULL};
    const double known[3] = {-8.8916e-2, -9.3591e-3, -1.1639e-3};
    double largest[ROWS], last[ROWS];
    struct sim *sim = new_sim(set);
    run(sim, largest, last);
    for (int k = 0; k < 3; k++) assert_true(fabs(last[k] / known[k] - 1) < 0.01);
    assert_int_equal(sim->steps, 8000);
    sim_free(sim);
}

/* Energies where all steps end anyway: no step is shortened for them. Given a cadence, they keep it. */
static void test_energy_rows(void **unused)
{
    (void)unused;
    const char *const own[] = {"time.end=6.283185307179586", "output.snapshot_every=1.5707963267948966", "central.steps=200",
                               "output.energy_limit=1e300", NULL};
    const char *const given[] = {"time.end=6.283185307179586", "output.snapshot_every=1.5707963267948966", "central.steps=200",
                                 "output.energy_limit=1e300",
                                 "output.energy_every=0.04908738521234052", NULL};
    const char *const wide[] = {"time.end=6.283185307179586", "output.snapshot_every=1.5707963267948966", "central.steps=2.5",
                               "output.energy_limit=1e300", NULL};
    const char *const *const set[] = {own, given, wide};
    const int rows_due[] = {1 + 64, 1 + 128, 1 + 4}, updates_due[] = {256 * 15, 256 * 15, 4 * (1 + 2 + 4 + 8)};
    for (int k = 0; k < 3; k++) {
        struct sim *sim = new_sim(set[k]);
        const struct output *output = sim_state(sim, "output");
        int rows = 0;
        while (!sim->started || sim->time.tick < sim->time.tick_end) {
            assert_true(run_step(sim, HOOK_RECORD));
            rows += output->recorded == sim->time.tick;
        }
        assert_int_equal(rows, rows_due[k]);
        assert_int_equal(sim->updates, updates_due[k]);
        sim_free(sim);
    }
}

/* Longest steps are 4 times longer than what rows take, and the end is no multiple of anything. */
static void test_cut_end(void **unused)
{
    (void)unused;
    const char *const set[] = {"time.end=10.3", "output.snapshot_every=0.2513274122871835",
                               "output.energy_every=0.2513274122871835", NULL};
    double largest[ROWS], last[ROWS];
    struct sim *sim = new_sim(set);
    run(sim, largest, last);
    assert_true(fabs(timeline_now(&sim->time) - 10.3) < 1e-6);
    for (int k = 0; k < ROWS; k++) assert_true(largest[k] < 1.1e-2 / (double)(1 << 2 * k));
    sim_free(sim);
}

static void test_common_steps(void **unused)
{
    (void)unused;
    const char *const set[] = {"time.end=6.283185307179586", "output.snapshot_every=0.06283185307179587",
                               "output.energy_every=0.06283185307179587", "time.steps=common", NULL};
    double largest[ROWS], last[ROWS];
    struct sim *sim = new_sim(set);
    run(sim, largest, last);
    assert_int_equal(sim->updates, ROWS * 800);
    assert_int_equal(sim->steps, 800);
    sim_free(sim);
}

/* A row that is woken within its step ends it early: no harm to its orbit. */
static void test_woken(void **unused)
{
    (void)unused;
    const char *const set[] = {"time.end=62.83185307179586", "output.snapshot_every=0.06283185307179587",
                               "output.energy_every=0.06283185307179587", "central.wake=1", NULL};
    double largest[ROWS], last[ROWS];
    struct sim *sim = new_sim(set);
    run(sim, largest, last);
    assert_true(sim->updates > 1000 * 15 + 100);
    assert_true(largest[0] < 1.2e-2);
    sim_free(sim);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_leapfrog_blocks), cmocka_unit_test(test_pec_blocks), cmocka_unit_test(test_pec_twice),
        cmocka_unit_test(test_cut_end), cmocka_unit_test(test_common_steps), cmocka_unit_test(test_woken),
        cmocka_unit_test(test_energy_rows),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
