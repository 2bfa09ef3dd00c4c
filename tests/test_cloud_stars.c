/* SPDX-License-Identifier: GPL-3.0-or-later
 * Stars from clouds: how much and when, where the fragments go, what a birth conserves, the decay of the clouds' mass. */
#include "constants.h"
#include "log.h"
#include "module.h"
#include "run.h"
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
    const char *const fixed[] = {"units={length: pc, mass: Msun, velocity: km/s}", "box={x: 20 kpc, y: 20 kpc, z: 20 kpc}",
                                 "start={generator: cloud_box, n: 20, mass: 1e6 Msun, dispersion: 0}", "time={end: 21 Myr}",
                                 "output={snapshot_every: 1 Myr}", "clouds={coagulation: never}", "cloud_stars={}", NULL};
    return scene_case_make(fixed, set);
}

static double told(struct sim *sim, const char *name) { return scene_case_energy(sim, name); }

enum { MASS, MOMENTUM, CENTRE = MOMENTUM + 3, KINETIC = CENTRE + 3, METALS, N_SUMS };

static void sum_all(const struct sim *sim, double sum[N_SUMS])
{
    memset(sum, 0, N_SUMS * sizeof *sum);
    for_species(sim, s)
        for (int64_t i = 0; i < s->n; i++) {
            sum[MASS] += s->mass[i];
            sum[METALS] += s->metals ? s->metals[i] : 0;
            for (int k = 0; k < 3; k++) {
                sum[MOMENTUM + k] += s->mass[i] * s->vel[i][k];
                sum[CENTRE + k] += s->mass[i] * s->pos[i][k];
                sum[KINETIC] += 0.5 * s->mass[i] * s->vel[i][k] * s->vel[i][k];
            }
        }
}

/* Steps until a birth; sums before and after its EVENT. */
static void until_birth(struct sim *sim, double before[N_SUMS], double after[N_SUMS])
{
    const struct species *star = &sim->species[STAR];
    while (star->n == 0) {
        assert_true(sim->time.tick < sim->time.tick_end && run_step(sim, HOOK_SOURCE));
        sum_all(sim, before);
        sim_run_hook(sim, HOOK_EVENT);
        sum_all(sim, after);
        sim_run_hook(sim, HOOK_LIMIT);
    }
}

/* eps = 0.6 G m/(h f_c e): 0.1032 of 1e6 Msun; the fragments a radius away, on a tetrahedron. */
static void test_birth(void **unused)
{
    (void)unused;
    struct sim *sim = new_sim((const char *const[]){"start.n=1", "sph={}", "feedback={metallicity: 0.01}", "cloud_stars.wait=10 Myr", NULL});
    const struct species *star = &sim->species[STAR], *cloud = &sim->species[CLOUD];
    double before[N_SUMS], after[N_SUMS];
    until_birth(sim, before, after);
    const double G = CONST_G * CONST_M_SUN / CONST_PC / 1e10, eps = 0.6 * G * 1e6 / 50 / (2e-3 * 2.5e5), left = (1 - eps) * 1e6;
    assert_true(star->n == 1 && cloud->n == 4);
    assert_true(fabs(star->mass[0] / (eps * 1e6) - 1) < 1e-6 && fabs(eps - 0.1032) < 1e-4);
    assert_true(fabs(star->metals[0] / (0.01 * star->mass[0]) - 1) < 1e-12);
    assert_true(star->advance[0] > 0 && fabs(star->advance[0] / (0.5 * left * 100) - 1) < 1e-6);
    for (int a = 0; a < 4; a++)
        for (int b = 0; b <= a; b++) {
            double r2 = 0, v2 = 0;
            for (int k = 0; k < 3; k++) {
                r2 += pow(cloud->pos[a][k] - (b < a ? cloud->pos[b] : star->pos[0])[k], 2);
                v2 += pow(cloud->vel[a][k] - (b < a ? cloud->vel[b] : star->vel[0])[k], 2);
            }
            assert_true(fabs(r2 / (2500 * (b < a ? 8.0 / 3 : 1)) - 1) < 1e-9 && fabs(v2 / (100 * (b < a ? 8.0 / 3 : 1)) - 1) < 1e-9);
            assert_true(b == a || cloud->id[a] != cloud->id[b]);
        }
    for (int k = 0; k < N_SUMS; k++)
        if (k != KINETIC) assert_true(fabs(after[k] - before[k]) < 1e-12 * fmax(1e6, fabs(before[k])));
    assert_true(fabs((after[KINETIC] - before[KINETIC]) / -told(sim, "injected_fragments") - 1) < 1e-9);
    sim_free(sim);
}

/* After k waits each cloud has formed stars k times, whatever its clock was: (1 - eps)^k of the mass is left. */
static void test_decay(void **unused)
{
    (void)unused;
    struct sim *sim = new_sim((const char *const[]){"cloud_stars.efficiency=0.1", "cloud_stars.least=0", "cloud_stars.wait=10 Myr", NULL});
    const struct species *cloud = &sim->species[CLOUD];
    double early = 0;
    for (bool go = true; go;) {
        go = sim->time.tick < sim->time.tick_end || !sim->started;
        if (!go) break;
        assert_true(run_step(sim, HOOK_LIMIT));
        double left = 0, myr = timeline_now(&sim->time) * units_cgs(&sim->units, "time") / CONST_YEAR / 1e6;
        for (int64_t i = 0; i < cloud->n; i++) left += cloud->mass[i] / 2e7;
        if (myr > 5 && early == 0) early = left;
        if (myr > 10.9 && myr < 11) assert_true(left < 0.9 + 1e-9 && left > 0.87);
    }
    double left = 0;
    for (int64_t i = 0; i < cloud->n; i++) left += cloud->mass[i] / 2e7;
    print_message("left after two waits and a twentieth: %.4f\n", left);
    assert_true(early < 0.99 && early > 0.91);          /* clocks are spread */
    assert_true(left < 0.81 + 1e-9 && left > 0.79);
    sim_free(sim);
}

/* Collisions: nothing before clouds have become one, then after a free-fall time, 5.86 Myr of 1e6 Msun. */
static void test_collision(void **unused)
{
    (void)unused;
    const char *const set[] = {"start.n=2", "start.mass=5e5 Msun", "cloud_stars.trigger=collision", "clouds.coagulation=always",
                               "clouds.crossing=0.1", "time.end=12 Myr", "output.snapshot_every=0.1 Myr", NULL};
    struct sim *sim = new_sim(set);
    struct species *cloud = &sim->species[CLOUD];
    const struct species *star = &sim->species[STAR];
    const double myr = units_cgs(&sim->units, "time") / CONST_YEAR / 1e6;
    double joined = 0, born = 0;
    for (int b = 0; b < 2; b++)
        for (int k = 0; k < 3; k++) {
            cloud->pos[b][k] = 1e4 + (k == 0 ? 200 * b : 0);
            cloud->vel[b][k] = k == 0 ? 50 - 100 * b : 0;
        }
    while (born == 0) {
        assert_true((sim->time.tick < sim->time.tick_end || !sim->started) && run_step(sim, HOOK_LIMIT));
        int64_t live = species_live(cloud);
        if (joined == 0 && live == 1) joined = timeline_now(&sim->time) * myr;
        if (star->n > 0) born = timeline_now(&sim->time) * myr;
    }
    print_message("one after %.3f Myr, stars %.3f Myr later\n", joined, born - joined);
    assert_true(joined > 1 && joined < 1.7 && fabs(born - joined - 5.86) < 0.15);
    sim_free(sim);
}

/* Clouds heavier than `heavy` do not wait: a free-fall time, 10.4 Myr at 1e7 Msun. */
static void test_heavy(void **unused)
{
    (void)unused;
    const char *const set[] = {"start.mass=1e7 Msun", "cloud_stars.wait=1e4 Myr", "cloud_stars.heavy=5e6 Msun", "time.end=12 Myr", NULL};
    struct sim *sim = new_sim(set);
    const struct species *cloud = &sim->species[CLOUD], *star = &sim->species[STAR];
    const double myr = units_cgs(&sim->units, "time") / CONST_YEAR / 1e6;
    double first = 0;
    while (sim->time.tick < sim->time.tick_end || !sim->started) {
        assert_true(run_step(sim, HOOK_LIMIT));
        if (star->n > 0 && first == 0) first = timeline_now(&sim->time) * myr;
    }
    assert_true(first > 10.4 && first < 12);
    assert_true(star->n >= 19 && star->n <= 21 && cloud->n == 20 + 3 * star->n);   /* a clock may have run out by itself */
    sim_free(sim);
}

/* A cloud whose children use up the numbers goes on under another id. */
static void test_long_line(void **unused)
{
    (void)unused;
    struct sim *sim = new_sim((const char *const[]){"start.n=1", "cloud_stars.wait=0.5 Myr", "cloud_stars.efficiency=1e-3",
                              "cloud_stars.least=0", "time.end=2.5 Myr", "output.snapshot_every=0.125 Myr", NULL});
    const struct species *cloud = &sim->species[CLOUD], *star = &sim->species[STAR];
    sim->species[CLOUD].children[0] = UINT8_MAX - 9;
    while (sim->time.tick < sim->time.tick_end || !sim->started) assert_true(run_step(sim, HOOK_LIMIT));
    assert_true(star->n > 300);         /* 1 + 4 + 16 + 64 + 256 */
    for (int64_t a = 0; a < cloud->n; a++)
        for (int64_t b = 0; b < a; b++) assert_true(cloud->id[a] != cloud->id[b]);
    for (int64_t a = 0; a < star->n; a++) {
        for (int64_t b = 0; b < a; b++) assert_true(star->id[a] != star->id[b]);
        for (int64_t b = 0; b < cloud->n; b++) assert_true(star->id[a] != cloud->id[b]);
    }
    sim_free(sim);
}

/* Families without end: no two ids alike in six generations of four. */
static void test_ids(void **unused)
{
    (void)unused;
    enum { MOST = 5461 };
    static uint64_t id[MOST];
    int n = 1, from = 0;
    id[0] = 12345;
    for (int generation = 0; generation < 6; generation++) {
        int to = n;
        for (; from < to; from++)
            for (unsigned child = 1; child <= 4 && n < MOST; child++) id[n++] = species_heir(id[from], child);
    }
    assert_int_equal(n, MOST);
    for (int a = 0; a < n; a++)
        for (int b = 0; b < a; b++) assert_true(id[a] != id[b]);
}

int main(void)
{
    log_silence(true);
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_birth), cmocka_unit_test(test_decay), cmocka_unit_test(test_collision),
                                       cmocka_unit_test(test_ids), cmocka_unit_test(test_heavy), cmocka_unit_test(test_long_line)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
