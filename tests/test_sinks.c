/* SPDX-License-Identifier: GPL-3.0-or-later
 * Sinks: what a birth and a swallow conserve, the exact mass of a collapse without pressure, and gas that becomes none. */
#include "module.h"
#include "run.h"
#include "scene_case.h"
#include "sph/sph.h"
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

/* rho ~ 1/r within 1, M = 1, G = 1, at rest. */
static struct sim *new_sim(const char *const *set)
{
    const char *const fixed[] = {"units={G: 1}", "start={generator: evrard, n: 2000}", "time={end: 1}", "output={snapshot_every: 0.125}",
                                 "gravity={softening: 0.02}", "sph={eos: isothermal, sound_speed: 0.05}",
                                 "sinks={density: 20, radius: 0.1}", NULL};
    return scene_case_make(fixed, set);
}

enum { MASS, MOMENTUM, CENTRE = MOMENTUM + 3, SPIN = CENTRE + 3, KINETIC = SPIN + 3, N_SUMS };

/* Of rows as they are now; spin: about the origin, with what sinks hold. */
static void sum_all(const struct sim *sim, double sum[N_SUMS])
{
    memset(sum, 0, N_SUMS * sizeof *sum);
    for_species(sim, s)
        for (int64_t i = 0; i < s->n; i++) {
            double x[3], v[3], lag = timeline_lag(&sim->time, s->rung[i], s->rung0[i]);
            if (species_gone(s, i)) continue;
            sim_predict(&sim->time, s, i, x);
            sum[MASS] += s->mass[i];
            for (int k = 0; k < 3; k++) {
                v[k] = s->vel[i][k] + lag * (double)s->acc[i][k];
                sum[MOMENTUM + k] += s->mass[i] * v[k];
                sum[CENTRE + k] += s->mass[i] * x[k];
                sum[KINETIC] += 0.5 * s->mass[i] * v[k] * v[k];
            }
            for (int k = 0; k < 3; k++) {
                const int p = (k + 1) % 3, q = (k + 2) % 3;
                sum[SPIN + k] += s->mass[i] * (x[p] * v[q] - x[q] * v[p]) + (s->spin ? s->spin[i][k] : 0);
            }
        }
}

static double swallowed(struct sim *sim) { return scene_case_budget(sim, "sinks", "sink_mass"); }

/* Goes on to the next EVENT in which sinks swallow; sums before and after it. False at the end. */
static bool until_meal(struct sim *sim, double before[N_SUMS], double after[N_SUMS])
{
    const double had = swallowed(sim);
    while (sim->time.tick < sim->time.tick_end || !sim->started) {
        assert_true(run_step(sim, HOOK_SOURCE));
        sum_all(sim, before);
        sim_run_hook(sim, HOOK_EVENT);
        sum_all(sim, after);
        sim_run_hook(sim, HOOK_LIMIT);
        if (swallowed(sim) > had) return true;
    }
    return false;
}

/* Of all births and swallows up to t = 5/8. */
static void test_conserved(void **unused)
{
    (void)unused;
    struct sim *sim = new_sim((const char *const[]){"time.end=0.625", NULL});
    const struct species *star = &sim->species[STAR];
    double before[N_SUMS], after[N_SUMS], worst = 0, lost = 0;
    int meals = 0;
    for (; until_meal(sim, before, after); meals++) {
        for (int k = 0; k < KINETIC; k++) worst = fmax(worst, fabs(after[k] - before[k]));
        lost += before[KINETIC] - after[KINETIC];
    }
    print_message("%d meals: sums change by %.1e at most; kinetic energy lost %.6g, told %.6g\n", meals, worst, lost,
                  scene_case_energy(sim, "radiated_sinks"));
    assert_true(meals > 5 && star->n == 1 && star->mass[0] == swallowed(sim));
    assert_true(worst < 1e-13);     /* masses and radii are 1 */
    assert_true(fabs(scene_case_energy(sim, "radiated_sinks") / lost - 1) < 1e-9);
    sim_free(sim);
}

/* Time after which the shell that began at r has fallen to the radius, by the mass r^2 within: a cycloid. */
static double time_of(double r, double radius)
{
    double eta = acos(sqrt(radius / r));
    return sqrt(r / 2) * (eta + 0.5 * sin(2 * eta));
}

/* Nearly without pressure: the sink has what has crossed its radius, but for rows that wait; -8.5 % of 2000, -4.4 % of 8000. */
static void test_free_fall(void **unused)
{
    (void)unused;
    struct sim *sim = new_sim((const char *const[]){"time.end=0.875", "start.n=8000", NULL});
    while (sim->time.tick < sim->time.tick_end || !sim->started) assert_true(run_step(sim, HOOK_LIMIT));
    double low = 0.1, high = 1;
    for (int i = 0; i < 60; i++) {
        double r = 0.5 * (low + high);
        if (time_of(r, 0.1) < 0.875) low = r;
        else high = r;
    }
    print_message("in %d sinks %.4f, exact %.4f\n", (int)sim->species[STAR].n, swallowed(sim), low * low);
    assert_true(sim->species[STAR].n == 1 && fabs(swallowed(sim) / (low * low) - 1) < 0.06);
    sim_free(sim);
}

/* Gas that its heat holds, and gas that expands, is as dense, and becomes no sink. */
static void test_none(void **unused)
{
    (void)unused;
    struct sim *hot = new_sim((const char *const[]){"sph.sound_speed=0.7", "time.end=0.25", "sinks.density=2", NULL});
    struct sim *wide = new_sim((const char *const[]){"sph.sound_speed=0.05", "time.end=0.015625", "output.snapshot_every=0.015625",
                                                     "sinks.density=1.5", NULL});
    struct species *gas = &wide->species[GAS];
    for (int64_t i = 0; i < gas->n; i++)
        for (int k = 0; k < 3; k++) gas->vel[i][k] = 2 * gas->pos[i][k];
    struct sim *const both[] = {hot, wide};
    for (int b = 0; b < 2; b++) {
        double densest = 0;
        while (both[b]->time.tick < both[b]->time.tick_end || !both[b]->started) {
            assert_true(run_step(both[b], HOOK_LIMIT));
            const struct species *now = &both[b]->species[GAS];
            for (int64_t i = 0; i < now->n; i++) densest = fmax(densest, (double)now->rho[i]);
        }
        print_message("densest %.3g: %d sinks\n", densest, (int)both[b]->species[STAR].n);
        assert_true(densest > (b == 0 ? 2 : 1.5) && both[b]->species[STAR].n == 0);
        sim_free(both[b]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_conserved), cmocka_unit_test(test_free_fall), cmocka_unit_test(test_none)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
