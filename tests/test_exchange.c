/* SPDX-License-Identifier: GPL-3.0-or-later
 * Exchange between clouds and gas in a small box: what it conserves, the law of the drag, clouds at the end of their mass, gas
 * rows that grow too light or too heavy, clouds without gas. */
#include "gravity/contact.h"
#include "log.h"
#include "module.h"
#include "run.h"
#include "units.h"
#include "scene_case.h"
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

static struct sim *new_sim(const char *const *set)
{
    const char *const fixed[] = {"units={length: kpc, mass: 1e10 Msun, velocity: km/s}", "box={x: 1, y: 1, z: 1}",
                                 "start={generator: exchange_box, n: 266, clouds: 10, density: 0.01 cm^-3, temperature: 1e7 K}",
                                 "time={end: 0.02}", "output={snapshot_every: 0.01}", "sph={}", "clouds={coagulation: never}",
                                 "exchange={}", NULL};
    return scene_case_make(fixed, set);
}

static double told(struct sim *sim, const char *name) { return scene_case_budget(sim, "exchange", name); }

/* Of all rows now, with thermal energy and what is booked. */
enum { MASS, MOMENTUM, ENERGY = MOMENTUM + 3, METALS, N_SUMS };

static void sum_all(struct sim *sim, double sum[N_SUMS])
{
    memset(sum, 0, N_SUMS * sizeof *sum);
    for_species(sim, s)
        for (int64_t i = 0; i < s->n; i++) {
            double lag = timeline_lag(&sim->time, s->rung[i], s->rung0[i]);
            sum[MASS] += s->mass[i];
            sum[METALS] += s->metals ? s->metals[i] : 0;
            for (int k = 0; k < 3; k++) {
                double v = integrate_velocity(s->vel[i][k], (double)s->acc[i][k], lag);
                sum[MOMENTUM + k] += s->mass[i] * v;
                sum[ENERGY] += 0.5 * s->mass[i] * v * v;
            }
        }
    sum[ENERGY] += scene_case_energy(sim, NULL);
}

/* Events until it has happened, with gas rows at the end and in the midst of their steps. */
static void conserve(const char *const *set, const char *happens)
{
    struct sim *sim = new_sim(set);
    double before[N_SUMS], after[N_SUMS], exchanged = 0;
    for (int step = 0; step < 400 && !(exchanged > 0); step++) {
        assert_true(run_step(sim, HOOK_SOURCE));
        sum_all(sim, before);
        sim_run_hook(sim, HOOK_EVENT);
        sum_all(sim, after);
        for (int64_t i = 0; i < sim->species[GAS].n; i++) assert_true(sim->species[GAS].mass[i] >= 0);
        assert_true(fabs(after[MASS] / before[MASS] - 1) < 1e-13 && fabs(after[METALS] - before[METALS]) < 1e-13 * before[MASS]);
        for (int k = 0; k < 3; k++) assert_true(fabs(after[MOMENTUM + k] - before[MOMENTUM + k]) < 1e-12 * before[MASS] * 100);
        assert_true(fabs(after[ENERGY] / before[ENERGY] - 1) < 1e-6);   /* u is a float */
        sim_run_hook(sim, HOOK_LIMIT);
        exchanged = told(sim, happens);
    }
    print_message("%s: %g\n", happens, exchanged);
    assert_true(exchanged > 0);
    sim_free(sim);
}

static void test_conserves(void **unused)
{
    (void)unused;
    conserve((const char *const[]){"start.speed=50 km/s", "feedback={}", NULL}, "evaporated [");
    conserve((const char *const[]){"start.temperature=5e5 K", "start.density=1 cm^-3", "start.speed=50 km/s", "feedback={}", NULL},
             "condensed [");
    conserve((const char *const[]){"start.speed=50 km/s", "exchange.conduction=none", NULL}, "drag_heat");
    conserve((const char *const[]){"exchange.conduction=sharp", "start.mass=110 Msun", NULL}, "clouds_dissolved");
    conserve((const char *const[]){"start.temperature=5e5 K", "start.density=1 cm^-3", "exchange.light=0.999999", "start.mass=1e6 Msun", NULL}, "gas_merged");
    conserve((const char *const[]){"exchange.heavy=1.5", "start.mass=1e4 Msun", "exchange.least=2e4 Msun", NULL}, "gas_split");
    conserve((const char *const[]){"start.temperature=1e4 K", "start.density=100 cm^-3", "exchange.transition=10 cm^-3",
                                   "start.speed=50 km/s", NULL}, "gas_to_clouds");
}

/* Beyond the usual: a cloud of thirty times the mass of all gas, which condenses on it and feels its drag; gas of 2e9 K; a cut by
 * what rows may give in a step. */
static void test_extremes(void **unused)
{
    (void)unused;
    static const char *const heavy[] = {"start.clouds=1", "start.n=257", "start.mass=1e9 Msun", "start.temperature=5e5 K",
                                        "start.density=1 cm^-3", "start.speed=50 km/s", "feedback={}", NULL};
    conserve(heavy, "condensed [");
    conserve((const char *const[]){"start.temperature=2e9 K", "start.speed=50 km/s", "time.dt_max=2e-5", NULL}, "evaporated [");
    conserve((const char *const[]){"start.mass=1e7 Msun", "start.temperature=5e5 K", "start.density=1 cm^-3", "exchange.change=1e-4",
                                   "exchange.every=1 Myr", NULL}, "condensation_cut");
    struct sim *sim = new_sim(heavy);
    const struct species *gas = &sim->species[GAS];
    double all = 0;
    for (int64_t i = 0; i < gas->n; i++) all += gas->mass[i];
    assert_true(sim->species[CLOUD].mass[0] > 10 * all);
    for (int k = 0; k < 2000 && !(told(sim, "drag_heat") > 0); k++) assert_true(run_step(sim, HOOK_LIMIT));
    for (int64_t i = 0; i < gas->n; i++)
        for (int k = 0; k < 3; k++) assert_true(gas->mass[i] >= 0 && fabs(gas->vel[i][k]) < 200);
    assert_true(sim->species[CLOUD].vel[0][0] > 45 && sim->species[CLOUD].vel[0][0] < 50);
    sim_free(sim);
}

/* Gas below `coldest` does not condense, warmer gas does. */
static void test_coldest(void **unused)
{
    (void)unused;
    for (int cold = 0; cold < 2; cold++) {
        struct sim *sim = new_sim((const char *const[]){"start.temperature=5e4 K", "start.density=1 cm^-3",
                                  cold ? "exchange.coldest=1e5 K" : "exchange.coldest=1e4 K", NULL});
        for (int k = 0; k < 20; k++) assert_true(run_step(sim, HOOK_LIMIT));
        assert_true((told(sim, "condensed [") > 0) == !cold && told(sim, "evaporated [") == 0);
        sim_free(sim);
    }
}

/* |dv| = dv0/(1 + t/t_d), t_d = m/(C pi h^2 rho dv0), of a cloud so light that the gas does not feel it. */
static void test_drag(void **unused)
{
    (void)unused;
    struct sim *sim = new_sim((const char *const[]){"start.clouds=1", "start.n=257", "start.mass=1e-4 Msun", "exchange.least=0",
                              "exchange.conduction=none", "start.speed=100 km/s", "start.density=1 cm^-3", "clouds.power=0",
                              "clouds.radius=0.05 pc", NULL});
    struct species *cloud = &sim->species[CLOUD];
    const struct species *gas = &sim->species[GAS];
    assert_true(run_step(sim, HOOK_LIMIT) && run_step(sim, HOOK_SOURCE));
    double time = 0, start = cloud->vel[0][0], rho = (double)gas->rho[0], h = 5e-5, step = timeline_step(&sim->time, cloud->rung0[0]);
    assert_true(step > 0);
    double td = cloud->mass[0] / (0.5 * acos(-1) * h * h * rho * start);
    for (int k = 0; k < 50; k++) {
        sim_run_hook(sim, HOOK_EVENT);
        time += step;
    }
    double left = cloud->vel[0][0] / start, wanted = 1 / (1 + time / td);
    print_message("after %.3g t_d: %.8f, %.8f expected\n", time / td, left, wanted);
    assert_true(time > 0.1 * td && fabs(left / wanted - 1) < 3e-6);
    sim_free(sim);
}

/* Clouds far from all gas, and gas without clouds, are left alone. */
static void test_alone(void **unused)
{
    (void)unused;
    struct sim *sim = new_sim((const char *const[]){"start.clouds=1", NULL});
    struct species *cloud = &sim->species[CLOUD], *gas = &sim->species[GAS];
    assert_true(run_step(sim, HOOK_LIMIT) && run_step(sim, HOOK_SOURCE));
    for (int64_t i = 0; i < gas->n; i++) gas->h[i] = 1e-6f;
    double mass = cloud->mass[0], speed = cloud->vel[0][0];
    sim_run_hook(sim, HOOK_EVENT);
    assert_true(cloud->mass[0] == mass && cloud->vel[0][0] == speed);
    sim_free(sim);
    sim = new_sim((const char *const[]){"start.clouds=0", NULL});
    while (sim->time.tick < sim->time.tick_end || !sim->started) assert_true(run_step(sim, HOOK_LIMIT));
    sim_free(sim);
}

int main(void)
{
    log_silence(true);
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_conserves), cmocka_unit_test(test_drag), cmocka_unit_test(test_alone),
                                       cmocka_unit_test(test_extremes), cmocka_unit_test(test_coldest)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
