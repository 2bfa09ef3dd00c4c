/* SPDX-License-Identifier: GPL-3.0-or-later
 * What stars give to gas: the nearest rows against a search of all, what a deposit conserves (in rows in
 * the midst of their step too), and stars without gas near, which keep what is due. */
#include "gravity/contact.h"
#include "physics/deposit.h"
#include "log.h"
#include "mem.h"
#include "module.h"
#include "run.h"
#include "scene_case.h"
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

static struct sim *new_sim(const char *const *set)
{
    const char *const fixed[] = {"units={length: kpc, mass: 1e10 Msun, velocity: km/s}", "box={x: 1, y: 1, z: 2}",
                                 "start={generator: ssp, n: 303, n_h: 0.1 cm^-3, stars: 3, star_mass: 1e-6}", "time={end: 0.1}",
                                 "output={snapshot_every: 0.01}", "sph={}", "feedback={}", NULL};
    return scene_case_make(fixed, set);
}

static const char *const plain[] = {NULL};

struct place { double r2; int32_t row; };

static int nearer(const void *a, const void *b)
{
    const struct place *p = a, *q = b;
    return p->r2 != q->r2 ? (p->r2 > q->r2) - (p->r2 < q->r2) : (p->row > q->row) - (p->row < q->row);
}

static void test_nearest(void **unused)
{
    (void)unused;
    struct sim *sim = new_sim(plain);
    const struct species *gas = &sim->species[GAS];
    assert_true(run_step(sim, HOOK_LIMIT) && run_step(sim, HOOK_LIMIT));
    struct place *all = mem_array("test", struct place, gas->n);
    struct nearest *nearest = mem_alloc("test", sizeof *nearest);
    for (int trial = 0; trial < 40; trial++) {
        double pos[3] = {0.37 * trial - floor(0.37 * trial), 0.61 * trial - floor(0.61 * trial), 0.05 * trial};
        for (int32_t i = 0; i < gas->n; i++) {
            double now[3], r2 = 0;
            sim_predict(&sim->time, gas, i, now);
            for (int k = 0; k < 3; k++) {
                double d = now[k] - pos[k], side = sim->box.side[k];
                d -= side * rint(d / side);
                r2 += d * d;
            }
            all[i] = (struct place){r2, i};
        }
        qsort(all, (size_t)gas->n, sizeof *all, nearer);
        int count = 1 + 6 * trial;
        nearest_gas(sim, pos, count, nearest);
        assert_int_equal(nearest->n, count);
        for (int k = 0; k < count; k++) {
            assert_int_equal(nearest->row[k], all[k].row);
            assert_true(fabs(nearest->r2[k] - all[k].r2) <= 1e-12 * all[k].r2);
        }
    }
    mem_free(all);
    mem_free(nearest);
    sim_free(sim);
}

/* Mass, momentum now, energy now (kinetic and thermal at the rows' own u), metals. */
enum { MASS, MOMENTUM, ENERGY = MOMENTUM + 3, METALS, N_SUMS };

static void sum_gas(const struct sim *sim, double sum[N_SUMS])
{
    const struct species *gas = &sim->species[GAS];
    memset(sum, 0, N_SUMS * sizeof *sum);
    for (int64_t i = 0; i < gas->n; i++) {
        double lag = timeline_lag(&sim->time, gas->rung[i], gas->rung0[i]);
        sum[MASS] += gas->mass[i];
        sum[METALS] += gas->metals[i];
        sum[ENERGY] += gas->mass[i] * (double)gas->u[i];
        for (int k = 0; k < 3; k++) {
            double v = integrate_velocity(gas->vel[i][k], (double)gas->acc[i][k], lag);
            sum[MOMENTUM + k] += gas->mass[i] * v;
            sum[ENERGY] += 0.5 * gas->mass[i] * v * v;
        }
    }
}

static void test_deposit(void **unused)
{
    (void)unused;
    struct sim *sim = new_sim(plain);
    struct species *gas = &sim->species[GAS];
    double before[N_SUMS], after[N_SUMS];
    assert_true(run_step(sim, HOOK_LIMIT));
    for (int64_t i = 0; i < gas->n; i += 2) gas->rung[i] = gas->rung0[i] = RUNG_TOP - 8;
    assert_true(run_step(sim, HOOK_CORRECT));
    assert_true(gas->n_active > 0 && gas->n_active < gas->n);  /* others are in the midst of their step */
    struct nearest *nearest = mem_alloc("test", sizeof *nearest);
    struct deposit_wishes wishes = {0};
    const double pos[3] = {0.01, 0.99, 0.4};
    double (*place)[3] = mem_alloc("test", (size_t)gas->n * sizeof *place);
    for (int64_t i = 0; i < gas->n; i++) sim_predict(&sim->time, gas, i, place[i]);
    nearest_gas(sim, pos, 50, nearest);
    assert_true(deposit_reaches(sim, nearest));
    struct deposit deposit = {.vel = {30, -20, 10}, .mass = 1e-8, .element = {1e-9, 5e-10, 1e-11}, .energy = 1e-3};
    sum_gas(sim, before);
    deposit_to_gas(sim, &deposit, nearest, &wishes);
    sum_gas(sim, after);
    assert_true(fabs(after[MASS] - before[MASS] - 1e-8) < 1e-18);
    assert_true(fabs(after[METALS] - before[METALS] - 1e-9) < 1e-19);
    for (int k = 0; k < 3; k++) assert_true(fabs(after[MOMENTUM + k] - before[MOMENTUM + k] - 1e-8 * deposit.vel[k]) < 1e-17);
    double given = 1e-3 + 0.5e-8 * (900 + 400 + 100);
    assert_true(fabs(after[ENERGY] - before[ENERGY] - given) < 1e-5 * given);   /* u is a float */
    for (int64_t i = 0; i < gas->n; i++) {
        double now[3];
        sim_predict(&sim->time, gas, i, now);
        for (int k = 0; k < 3; k++) assert_true(fabs(now[k] - place[i][k]) < 1e-14);
    }
    assert_true(wishes.n > 0);                  /* hot gas that sleeps shall wake */
    int32_t row = wishes.list[0].row;
    assert_true(wishes.list[0].rung < gas->rung[row]);
    deposit_wake(sim, &wishes);
    assert_true(wishes.n == 0 && gas->rung[row] < gas->rung0[row]);
    mem_free(wishes.list);
    mem_free(place);
    mem_free(nearest);
    sim_free(sim);
}

/* A deposit of the given form; what the sums gain. */
static double deposit_once(struct sim *sim, struct deposit *deposit, double gain[N_SUMS])
{
    struct nearest *nearest = mem_alloc("test", sizeof *nearest);
    struct deposit_wishes wishes = {0};
    double before[N_SUMS];
    nearest_gas(sim, deposit->pos, 50, nearest);
    sum_gas(sim, before);
    double given = deposit_to_gas(sim, deposit, nearest, &wishes);
    sum_gas(sim, gain);
    for (int k = 0; k < N_SUMS; k++) gain[k] -= before[k];
    mem_free(wishes.list);
    mem_free(nearest);
    return given;
}

/* Rows heated at random: by what they should, in the mean as much as is due; at most what is due if that is much. */
static void test_jumps(void **unused)
{
    (void)unused;
    struct sim *sim = new_sim(plain);
    double gain[N_SUMS], mass = sim->species[GAS].mass[0], sum = 0;
    enum { TRIALS = 400 };
    assert_true(run_step(sim, HOOK_LIMIT));
    struct deposit deposit = {.pos = {0.3, 0.7, 0.5}, .form = DEPOSIT_JUMPS, .rise = 1e4};
    const double jump = mass * deposit.rise;
    deposit.energy = 3 * jump;
    for (int trial = 0; trial < TRIALS; trial++) {
        deposit.key = (struct random){1, (uint64_t)trial, 0, random_stream("test")};
        double given = deposit_once(sim, &deposit, gain), jumps = given / jump;
        assert_true(fabs(jumps - rint(jumps)) < 1e-9);
        assert_true(fabs(gain[ENERGY] - given) <= 1e-4 * jump);     /* u is a float */
        sum += jumps;
    }
    assert_true(fabs(sum / TRIALS - 3) < 4 * sqrt(3.0 / TRIALS));
    deposit.energy = 500 * jump;
    assert_true(fabs(deposit_once(sim, &deposit, gain) / deposit.energy - 1) < 1e-12);
    sim_free(sim);
}

/* Radial momentum: none in sum, as much as asked or as the energy allows, and the energy told is the energy gained. */
static void test_push(void **unused)
{
    (void)unused;
    struct sim *sim = new_sim(plain);
    double gain[N_SUMS];
    assert_true(run_step(sim, HOOK_LIMIT));
    struct deposit deposit = {.pos = {0.3, 0.7, 0.5}, .form = DEPOSIT_PUSH, .momentum = 1e-2, .energy = 1e3};
    double given = deposit_once(sim, &deposit, gain);
    assert_true(given > 0 && given < deposit.energy);
    assert_true(fabs(gain[ENERGY] / given - 1) < 1e-9);
    for (int k = 0; k < 3; k++) assert_true(fabs(gain[MOMENTUM + k]) < 1e-12 * deposit.momentum);
    deposit.energy = 0.1 * given;
    assert_true(fabs(deposit_once(sim, &deposit, gain) / deposit.energy - 1) < 1e-9);
    assert_true(fabs(gain[ENERGY] / deposit.energy - 1) < 1e-6);
    for (int k = 0; k < 3; k++) assert_true(fabs(gain[MOMENTUM + k]) < 1e-12 * deposit.momentum);
    sim_free(sim);
}

/* Gas far away: stars keep their mass and pay all of it when gas is near again. */
static void test_no_gas(void **unused)
{
    (void)unused;
    const char *const coarse[] = {"time.dt_max=0.01", NULL};
    struct sim *sim = new_sim(coarse);
    struct species *gas = &sim->species[GAS], *star = &sim->species[STAR];
    log_silence(true);
    float *h = mem_array("test", float, gas->n);
    while (sim->time.tick < sim->time.tick_end) {
        assert_true(run_step(sim, HOOK_SOURCE));
        for (int64_t i = 0; i < gas->n; i++) {
            h[i] = gas->h[i];
            gas->h[i] = 1e-6f;
        }
        sim_run_hook(sim, HOOK_EVENT);
        for (int64_t i = 0; i < gas->n; i++) gas->h[i] = h[i];
        for (int64_t i = 0; i < star->n; i++) assert_true(star->mass[i] == star->mass_born[i]);
        sim_run_hook(sim, HOOK_LIMIT);
    }
    double all = 0;
    for (int64_t i = 0; i < gas->n; i++) all -= gas->mass[i];
    sim_run_hook(sim, HOOK_EVENT);
    for (int64_t i = 0; i < gas->n; i++) all += gas->mass[i];
    for (int64_t i = 0; i < star->n; i++) assert_true(fabs(star->mass[i] / star->mass_born[i] - 0.9042) < 1e-3);
    for (int64_t i = 0; i < star->n; i++) all += star->mass[i] - star->mass_born[i];
    assert_true(fabs(all) < 1e-17);
    log_silence(false);
    mem_free(h);
    sim_free(sim);
}

/* Potential of all other rows at a row's place. */
static double potential_at(const struct sim *sim, enum species_kind kind, int64_t row)
{
    double sum = 0, at[3], now[3];
    sim_predict(&sim->time, &sim->species[kind], row, at);
    for_species(sim, s)
        for (int64_t i = 0; i < s->n; i++) {
            if (s->kind == kind && i == row) continue;
            sim_predict(&sim->time, s, i, now);
            sum += s->mass[i] * gravity_pair(sim, kind, s->kind, sqrt(pow(now[0] - at[0], 2) + pow(now[1] - at[1], 2) + pow(now[2] - at[2], 2)));
        }
    return sum;
}

/* Mass that goes from a cloud to the gas around rises by what direct sums say, in the mean of the draws: as much as is always looked
 * at, and a fifth of it. */
static void test_rise(void **unused)
{
    (void)unused;
    enum { TRIALS = 400 };
    struct sim *sim = scene_case_make((const char *const[]){"units={length: kpc, mass: 1e10 Msun, velocity: km/s}",
        "start={generator: dwarf, n: 1200}", "time={end: 0.1}", "output={snapshot_every: 0.01}", "gravity={softening: 0.1}", "sph={}",
        "clouds={}", NULL}, plain);
    struct nearest *nearest = mem_alloc("test", sizeof *nearest);
    double share[NEAREST_MOST], worst = 0;
    log_silence(true);
    assert_true(run_step(sim, HOOK_LIMIT) && run_step(sim, HOOK_LIMIT));
    for (int64_t row = 0; row < 100; row += 20) {
        double exact = -potential_at(sim, CLOUD, row), at[3];
        sim_predict(&sim->time, &sim->species[CLOUD], row, at);
        nearest_gas(sim, at, 50, nearest);
        deposit_shares(sim, nearest, share);
        for (int k = 0; k < nearest->n; k++) exact += share[k] * potential_at(sim, GAS, nearest->row[k]);
        const double depth = fabs(potential_at(sim, CLOUD, row));
        for (int whole = 0; whole < 2; whole++) {
            const double mass = whole ? 1e-5 : 2e-6;
            double sum = 0, square = 0;
            for (int trial = 0; trial < TRIALS; trial++) {
                const struct random key = {1, (uint64_t)trial, 0, random_stream("test")};
                double rise = deposit_rise(sim, nearest, CLOUD, row, mass, &key) / mass;
                sum += rise / TRIALS;
                square += rise * rise / TRIALS;
            }
            const double error = sqrt(fmax(square - sum * sum, 0) / TRIALS);
            if (whole) worst = fmax(worst, fabs(sum - exact) / depth);
            assert_true(fabs(sum - exact) < 3.5 * error + 0.005 * depth);
        }
        assert_true(deposit_rise(sim, nearest, CLOUD, row, 0, &(struct random){0}) == 0);
    }
    print_message("rise of the potential: off by %.2g of its depth at most\n", worst);
    mem_free(nearest);
    sim_free(sim);
}

/* Mass from nowhere ends the run. */
static void test_mass_limit(void **unused)
{
    (void)unused;
    struct sim *sim = new_sim(plain);
    log_silence(true);
    assert_true(run_step(sim, HOOK_RECORD) && run_step(sim, HOOK_RECORD) && !sim->failure.set);
    sim->species[GAS].mass[0] *= 1 + 1e-6;
    while (!sim->failure.set && sim->time.tick < sim->time.tick_end) run_step(sim, HOOK_RECORD);
    log_silence(false);
    assert_true(sim->failure.set);
    assert_non_null(strstr(sim->failure.text, "output.mass_limit"));
    sim_free(sim);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_nearest), cmocka_unit_test(test_deposit),
                                       cmocka_unit_test(test_jumps), cmocka_unit_test(test_push),
                                       cmocka_unit_test(test_no_gas), cmocka_unit_test(test_rise),
                                       cmocka_unit_test(test_mass_limit)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
