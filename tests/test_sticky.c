/* SPDX-License-Identifier: GPL-3.0-or-later
 * Cold clouds: what a pair conserves, meetings within one step, rates against n sigma v, Haff's law of cooling and
 * Smoluchowski's law of coagulation. */
#include "physics/meetings.h"
#include "physics/partners.h"
#include "log.h"
#include "mem.h"
#include "module.h"
#include "random.h"
#include "run.h"
#include "scene_case.h"
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

static const double PI = 3.14159265358979323846;
static const double none[3] = {0};

static struct sim *new_sim(const char *const *set)
{
    static const char *const fixed[] = {"units={length: kpc, mass: 1e10 Msun, velocity: km/s}", NULL};
    return scene_case_make(fixed, set);
}

/* --- pairs --- */

static void draw_pair(struct body pair[2], uint64_t trial)
{
    const struct random key = {5, trial, 0, random_stream("test_sticky")};
    for (int b = 0; b < 2; b++) {
        pair[b] = (struct body){.mass = 0.1 + random_uniform(&key, (uint64_t)b), .radius = 0.2 + random_uniform(&key, 2 + (uint64_t)b)};
        for (int k = 0; k < 3; k++) {
            pair[b].pos[k] = random_normal(&key, 4 + (uint64_t)(3 * b + k));
            pair[b].vel[k] = random_normal(&key, 10 + (uint64_t)(3 * b + k));
        }
    }
}

/* Mass, momentum, angular momentum about the origin, kinetic energy. */
enum { MASS, MOMENTUM, ANGULAR = MOMENTUM + 3, KINETIC = ANGULAR + 3, N_SUMS };

static void add_up(const struct body *b, double sum[N_SUMS])
{
    const double *x = b->pos, *v = b->vel;
    sum[MASS] += b->mass;
    for (int k = 0; k < 3; k++) {
        int p = (k + 1) % 3, q = (k + 2) % 3;
        sum[MOMENTUM + k] += b->mass * v[k];
        sum[ANGULAR + k] += b->mass * (x[p] * v[q] - x[q] * v[p]);
        sum[KINETIC] += 0.5 * b->mass * v[k] * v[k];
    }
}

static void check_sums(const struct body before[2], const struct body *after, int n, const double spin[3], double lost)
{
    double a[N_SUMS] = {0}, b[N_SUMS] = {0};
    for (int k = 0; k < 2; k++) add_up(&before[k], a);
    for (int k = 0; k < n; k++) add_up(&after[k], b);
    for (int k = 0; k < 3; k++) b[ANGULAR + k] += spin[k];
    b[KINETIC] += lost;
    assert_true(lost >= 0);
    for (int k = 0; k < N_SUMS; k++) assert_true(fabs(a[k] - b[k]) < 1e-13 * (1 + fabs(a[k])));
}

static void test_pairs(void **unused)
{
    (void)unused;
    const struct viscosity viscosity = {1, 2, 0.5};
    int met = 0, rubbed = 0;
    for (uint64_t trial = 0; trial < 2000; trial++) {
        struct body pair[2], now[2];
        double r[3], v[3], spin[3] = {0}, at[3], time, d2 = 0;
        draw_pair(pair, trial);
        const double reach = pair[0].radius + pair[1].radius;
        for (int k = 0; k < 3; k++) {
            r[k] = pair[1].pos[k] - pair[0].pos[k];
            v[k] = pair[1].vel[k] - pair[0].vel[k];
        }
        memcpy(now, pair, sizeof now);
        double lost = collide_merge(&now[0], &now[1], none, spin);
        check_sums(pair, now, 1, spin, lost);
        memcpy(now, pair, sizeof now);
        lost = collide_rub(&now[0], &now[1], none, &viscosity, 0.3);
        check_sums(pair, now, 2, none, lost);
        rubbed += lost > 0;
        if (!collide_contact(r, v, reach, -2, &time)) continue;
        met++;
        for (int k = 0; k < 3; k++) at[k] = r[k] + time * v[k];
        for (int k = 0; k < 3; k++) d2 += at[k] * at[k];
        assert_true(time >= -2 && time <= 0 && (fabs(sqrt(d2) - reach) < 1e-9 || (time == -2 && d2 < reach * reach)));
        memcpy(now, pair, sizeof now);
        lost = 0;
        assert_true(collide_bounce(&now[0], &now[1], none, 0.2, time, &lost));
        check_sums(pair, now, 2, none, lost);
        for (int b = 0; b < 2; b++)     /* they were where they met */
            for (int k = 0; k < 3; k++)
                assert_true(fabs(now[b].pos[k] + time * now[b].vel[k] - pair[b].pos[k] - time * pair[b].vel[k]) < 1e-12);
        for (int k = 0; k < 3; k++) {
            r[k] = now[1].pos[k] - now[0].pos[k];
            v[k] = now[1].vel[k] - now[0].vel[k];
        }
        assert_false(collide_contact(r, v, reach, time, &time));    /* and separate */
    }
    assert_true(met > 100 && rubbed > 50);
}

/* Viscosity in one step and in many: dw/dt = -(A w + B w^2) at a fixed distance. */
static void test_viscosity(void **unused)
{
    (void)unused;
    const struct viscosity viscosity = {1, 2, 0.5};
    struct body start[2] = {{1, 1, {0}, {0}, {0}}, {2, 1.5, {1.2, 0, 0}, {-3, 0.5, 0}, {0}}}, once[2], often[2];
    memcpy(once, start, sizeof once);
    memcpy(often, start, sizeof often);
    double lost = collide_rub(&once[0], &once[1], none, &viscosity, 0.2), sum = 0;
    for (int k = 0; k < 100; k++) sum += collide_rub(&often[0], &often[1], none, &viscosity, 0.002);
    assert_true(lost > 0.05 && fabs(sum / lost - 1) < 1e-12);
    for (int k = 0; k < 3; k++) assert_true(fabs(once[1].vel[k] - often[1].vel[k]) < 1e-12);
}

/* --- several in one step --- */

static int met_order[8][2], n_met;

static bool bounce_all(void *data, struct party *a, struct party *b, const double shift[3], double time)
{
    (void)data;
    met_order[n_met][0] = (int)a->id;
    met_order[n_met++][1] = (int)b->id;
    double lost = 0;
    return collide_bounce(&a->body, &b->body, shift, 1, time, &lost);
}

/* Equal elastic clouds on a line: the first hits the second, that the third, all in one step, and the third leaves with the
 * velocity of the first. The same whatever the order of the parties. */
static void test_three(void **unused)
{
    (void)unused;
    const struct meetings_rule rule = {bounce_all, NULL};
    for (int turn = 0; turn < 3; turn++) {
        struct party party[3];
        const struct couple couple[3] = {{0, 1, {0}}, {1, 2, {0}}, {0, 2, {0}}};
        for (int k = 0; k < 3; k++) {
            int who = (k + turn) % 3;       /* at the step's start at x = 0, 3, 6; the first with speed 5 */
            party[k] = (struct party){{1, 0.5, {3 * who + (who == 0 ? 10 : 0), 0, 0}, {who == 0 ? 5 : 0, 0, 0}, {0}},
                                      (uint64_t)who + 1, k, 0, 2, -1, -INFINITY};
        }
        n_met = 0;
        assert_int_equal(meetings_run(party, 3, couple, 3, &rule), 0);
        assert_int_equal(n_met, 2);
        assert_true(met_order[0][0] + met_order[0][1] == 3 && met_order[1][0] + met_order[1][1] == 5);
        const double place[3] = {2, 5, 12}, speed[3] = {0, 0, 5};
        for (int k = 0; k < 3; k++) {
            int who = (k + turn) % 3;
            assert_true(fabs(party[k].body.pos[0] - place[who]) < 1e-12 && fabs(party[k].body.vel[0] - speed[who]) < 1e-12);
        }
    }
}

/* Three that meet at one moment: ties go by ids. */
static void test_tie(void **unused)
{
    (void)unused;
    const struct meetings_rule rule = {bounce_all, NULL};
    const struct couple couple[2] = {{0, 1, {0}}, {1, 2, {0}}};
    struct party party[3] = {{{1, 0.5, {1, 0, 0}, {1, 0, 0}, {0}}, 30, 0, 0, 2, -1, -INFINITY}, {{1, 0.5, {0, 0, 0}, {0}, {0}}, 20, 1, 0, 2, -1, -INFINITY},
                             {{1, 0.5, {-1, 0, 0}, {-1, 0, 0}, {0}}, 10, 2, 0, 2, -1, -INFINITY}};
    n_met = 0;
    meetings_run(party, 3, couple, 2, &rule);
    assert_true(n_met >= 2 && met_order[0][0] + met_order[0][1] == 30);
    assert_true(fabs(party[0].body.vel[0] + party[1].body.vel[0] + party[2].body.vel[0]) < 1e-14);
}

/* --- gases of clouds --- */

static double told(struct sim *sim, const char *name) { return scene_case_budget(sim, "clouds", name); }

static double kinetic(const struct sim *sim)
{
    const struct species *cloud = &sim->species[CLOUD];
    double sum = 0;
    for (int64_t i = 0; i < cloud->n; i++)
        for (int k = 0; k < 3; k++) sum += 0.5 * cloud->mass[i] * cloud->vel[i][k] * cloud->vel[i][k];
    return sum;
}

/* 1000 clouds of radius 50 pc and 1e6 Msun that fill the part phi of a box; 7 km/s. */
static struct sim *gas_of_clouds(double phi, double end, const char *const *more)
{
    double volume = 1000 * 4 * PI / 3 * 0.05 * 0.05 * 0.05 / phi, side = cbrt(volume);
    char box[100], time[60];
    snprintf(box, sizeof box, "box={x: %.17g, y: %.17g, z: %.17g}", side, side, side);
    snprintf(time, sizeof time, "time={end: %.17g}", end);
    const char *set[16] = {box, time, "start={generator: cloud_box, n: 1000, mass: 1e6 Msun, places: lattice}",
                           "output={snapshot_every: 0.01}", "clouds={coagulation: never}"};
    int n = 5;
    for (const char *const *m = more; *m; m++) set[n++] = *m;
    set[n] = NULL;
    return new_sim(set);
}

/* Carnahan & Starling (1969): by how much more often spheres meet than points would. */
static double contact_value(double phi) { return (1 - 0.5 * phi) / pow(1 - phi, 3); }

/* Collisions of a cloud in unit time: 4 sqrt(pi) n d^2 sigma. */
static double frequency(double phi, double sigma)
{
    double d = 0.1, n = phi / (PI / 6 * d * d * d);
    return 4 * sqrt(PI) * n * d * d * sigma;
}

static void run_out(struct sim *sim)
{
    while (sim->time.tick < sim->time.tick_end || !sim->started) assert_true(run_step(sim, HOOK_LIMIT));
}

/* Mean of some runs of so many events each, which is to be 1, and the standard error of that mean. */
struct mean { double sum, square; int n; };
static void mean_add(struct mean *m, double x)
{
    m->sum += x;
    m->square += x * x;
    m->n++;
}
static void check_mean(const struct mean *m, double events, const char *what)
{
    const double wanted = 1;
    double mean = m->sum / m->n, error = sqrt((m->square / m->n - mean * mean) / (m->n - 1));
    error = fmax(error, 1 / sqrt(m->n * events));   /* few runs do not tell their own error */
    print_message("%s: %.4g +- %.2g, %.4g expected\n", what, mean, error, wanted);
    assert_true(fabs(mean - wanted) < 3 * error && error < 0.04 * wanted);
}

/* Elastic clouds: collisions over what n sigma v times the contact value says, at low and high filling, with steps in which
 * a cloud crosses its diameter, and many diameters. The mean speed is that of the rows. */
static double rate_of(double phi, const char *crossing, int run)
{
    char seed[40], way[40], every[60];
    snprintf(seed, sizeof seed, "start.seed=%d", run + 1);
    snprintf(way, sizeof way, "clouds.crossing=%s", crossing);
    double nu = frequency(phi, 7) * contact_value(phi), length = 1.5 / nu, mixed = 3 / nu;
    snprintf(every, sizeof every, "output.snapshot_every=%.3g", length / 8);
    struct sim *sim = gas_of_clouds(phi, mixed + length, (const char *const[]){"clouds.restitution=1", every, way, seed, NULL});
    double sigma = sqrt(2 * kinetic(sim) / (3 * 1000 * 1e-4));
    while (timeline_now(&sim->time) < mixed) assert_true(run_step(sim, HOOK_LIMIT));
    double from = timeline_now(&sim->time), before = told(sim, "cloud_collisions [");
    run_out(sim);
    double wanted = 500 * nu * sigma / 7 * (timeline_now(&sim->time) - from), got = told(sim, "cloud_collisions [") - before;
    assert_true(told(sim, "cloud_postponed") == 0);
    sim_free(sim);
    return got / wanted;
}

static void test_rates(void **unused)
{
    (void)unused;
    const struct { double phi; const char *crossing, *text; } cases[] = {
        {1e-3, "20", "rate at filling 0.001, long steps"}, {0.03, "20", "rate at filling 0.03, long steps"},
        {0.2, "20", "rate at filling 0.2, long steps"}, {0.2, "1", "rate at filling 0.2, short steps"}};
    for (int c = 0; c < 4; c++) {
        struct mean rate = {0};
        for (int run = 0; run < 3; run++) mean_add(&rate, rate_of(cases[c].phi, cases[c].crossing, run));
        check_mean(&rate, 750, cases[c].text);
    }
}

/* Sonine's first correction to the Maxwellian of a gas that cools (van Noije & Ernst 1998). */
static double sonine(double e)
{
    return 16 * (1 - e) * (1 - 2 * e * e) / (81 - 17 * e + 30 * e * e * (1 - e));
}

/* T = T0/(1 + t/tau)^2, 1/tau = (1 - e^2) nu/6 (Haff 1983), nu with the contact value and Sonine's correction. */
static void test_haff(void **unused)
{
    (void)unused;
    const double phi = 0.005, e = 0.8;
    struct mean rate = {0};
    for (int run = 0; run < 3; run++) {
        char seed[40];
        snprintf(seed, sizeof seed, "start.seed=%d", run + 1);
        double nu = frequency(phi, 7) * contact_value(phi), tau = 6 / ((1 - e * e) * nu * (1 + 3 * sonine(e) / 16));
        struct sim *sim = gas_of_clouds(phi, tau, (const char *const[]){"clouds.restitution=0.8", "output.snapshot_every=0.1", seed, NULL});
        double start = kinetic(sim), sigma = sqrt(2 * start / (3 * 1000 * 1e-4));
        run_out(sim);
        mean_add(&rate, (sqrt(start / kinetic(sim)) - 1) * 7 / sigma);
        double lost = start - kinetic(sim), booked = scene_case_energy(sim, "radiated_clouds");
        assert_true(fabs(lost / booked - 1) < 1e-12);
        sim_free(sim);
    }
    check_mean(&rate, 5800, "tau of Haff's law over the measured one");
}

/* Places and velocities drawn anew. */
static void stir(struct sim *sim, int run)
{
    struct species *cloud = &sim->species[CLOUD];
    sim->rebuild_next = true;           /* its cells know the old velocities */
    for (int64_t i = 0; i < cloud->n; i++) {
        const struct random key = {(uint64_t)run, cloud->id[i], (uint64_t)sim->time.tick, random_stream("anew")};
        for (int k = 0; k < 3; k++) {
            cloud->vel[i][k] = 7 * random_normal(&key, (uint64_t)k);
            cloud->pos[i][k] = sim->box.side[k] * random_uniform(&key, 6 + (uint64_t)k);
        }
    }
}

/* N = N0/(1 + N0 K t/2 V) (Smoluchowski 1916) with the constant kernel K = pi d^2 4 sigma/sqrt(pi): radii that do not depend on
 * the mass, all that meet become one, places and velocities drawn anew at every step. Half of the pairs that
 * are drawn within reach approach each other: 2/3 pi d^3 more for each step. */
static void test_smoluchowski(void **unused)
{
    (void)unused;
    const double phi = 0.001, d = 0.1, halving = 2 / frequency(phi, 7);
    struct mean number = {0};
    for (int run = 0; run < 3; run++) {
        char seed[40];
        snprintf(seed, sizeof seed, "start.seed=%d", run + 1);
        struct sim *sim = gas_of_clouds(phi, 2 * halving, (const char *const[]){"clouds={coagulation: always, power: 0, most: 1e30}",
                                        "time.steps=common", "output.snapshot_every=0.02", seed, NULL});
        double past = 0, volume = sim->box.side[0] * sim->box.side[1] * sim->box.side[2], mass = 0;
        while (sim->time.tick < sim->time.tick_end || !sim->started) {
            assert_true(run_step(sim, HOOK_LIMIT));
            if (sim->time.tick > 0) past += 500 / volume * (4 * sqrt(PI) * d * d * 7 * sim->last_dt + 2 * PI / 3 * d * d * d);
            stir(sim, run);
        }
        for (int64_t i = 0; i < sim->species[CLOUD].n; i++) mass += sim->species[CLOUD].mass[i];
        assert_true(fabs(mass / 0.1 - 1) < 1e-12 && past > 2);
        mean_add(&number, told(sim, "clouds [") * (1 + past) / 1000);
        sim_free(sim);
    }
    check_mean(&number, 667, "clouds left over Smoluchowski's number");
}

/* A ball thrown up from the ground with speed w under -g, seen at the end of a step in which it came down and bounced: what it is
 * given is what it had when it met, so that its energy is that of the exact motion but for the square of the time since. */
static void test_falls(void **unused)
{
    (void)unused;
    const double g = 2, w = 1, e = 0.5;
    double error[2];
    for (int fine = 0; fine < 2; fine++) {
        const double since = fine ? 0.005 : 0.01, v = w + g * since;     /* it met `since` ago, and has fallen on */
        struct body ground = {1e12, 1, {0}, {0}, {0}}, ball = {1, 1, {2 - w * since - 0.5 * g * since * since, 0, 0}, {-v, 0, 0}, {-g, 0, 0}};
        double r[3] = {ball.pos[0], 0, 0}, time, lost = 0;
        assert_true(collide_contact(r, ball.vel, 2, -10 * since, &time));
        assert_true(collide_bounce(&ground, &ball, none, e, time, &lost));
        double energy = 0.5 * ball.vel[0] * ball.vel[0] + g * (ball.pos[0] - 2);
        error[fine] = fabs(energy - 0.5 * e * e * w * w);
        assert_true(fabs(lost - 0.5 * (1 - e * e) * w * w) < 2 * g * since * since * 2);
        assert_false(collide_bounce(&ground, &ball, none, e, time, &lost));
    }
    assert_true(error[0] < 0.002 && error[1] < 0.3 * error[0]);
}

/* Clouds on a line, each at its place [kpc] with its speed along it. */
static struct sim *on_a_line(int n, const double *x, const double *speed, const char *mass, const char *const *more)
{
    char start[100];
    snprintf(start, sizeof start, "start={generator: cloud_box, n: %d, mass: %s, dispersion: 0}", n, mass);
    const char *set[16] = {"box={x: 8, y: 8, z: 8}", "time={end: 0.05}", start, "output={snapshot_every: 0.0125}", "clouds={}"};
    int m = 5;
    for (; *more; more++) set[m++] = *more;
    struct sim *sim = new_sim(set);
    struct species *cloud = &sim->species[CLOUD];
    for (int i = 0; i < n; i++)
        for (int k = 0; k < 3; k++) {
            cloud->pos[i][k] = 4 + (k == 0 ? x[i] : 0);
            cloud->vel[i][k] = k == 0 ? speed[i] : 0;
        }
    return sim;
}

/* Two that are bound become one as long as both together have no more than `most`, 1e7 Msun; heavier ones bounce without loss. */
static void test_mass_limit(void **unused)
{
    (void)unused;
    const double x[2] = {0, 0.5}, speed[2] = {5, -5};
    const struct { const char *mass; int left; } cases[] = {{"4.999e6 Msun", 1}, {"5.001e6 Msun", 2}};
    for (int c = 0; c < 2; c++) {
        struct sim *sim = on_a_line(2, x, speed, cases[c].mass, (const char *const[]){NULL});
        const double before = kinetic(sim);
        run_out(sim);
        assert_true(told(sim, "cloud_collisions [") == 1 && told(sim, "cloud_coagulations [") == 2 - cases[c].left);
        assert_true(told(sim, "clouds [") == cases[c].left);
        if (cases[c].left == 2) assert_true(fabs(kinetic(sim) / before - 1) < 1e-12);
        else assert_true(kinetic(sim) < 1e-12 * before);
        sim_free(sim);
    }
}

/* One hits the second, which would at once hit the third; while it rests it passes through. */
static void test_rest(void **unused)
{
    (void)unused;
    const double x[3] = {0, 0.15, 0.26}, speed[3] = {10, 0, 0};
    for (int rests = 0; rests < 2; rests++) {
        struct sim *sim = on_a_line(3, x, speed, "1e6 Msun", (const char *const[]){"clouds.coagulation=never", "clouds.restitution=1",
                                    rests ? "clouds.rest=3" : "clouds.rest=0", NULL});
        run_out(sim);
        const struct species *cloud = &sim->species[CLOUD];
        double last = 0;
        for (int64_t i = 0; i < 3; i++)
            if (cloud->id[i] == 3) last = cloud->vel[i][0];
        assert_true(told(sim, "cloud_collisions [") == (rests ? 1 : 2) && fabs(last - (rests ? 0 : 10)) < 1e-9);
        assert_true((cloud->rested != NULL) == rests);
        sim_free(sim);
    }
}

int main(void)
{
    log_silence(true);
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_pairs), cmocka_unit_test(test_viscosity), cmocka_unit_test(test_three),
                                       cmocka_unit_test(test_tie), cmocka_unit_test(test_falls), cmocka_unit_test(test_rates),
                                       cmocka_unit_test(test_haff), cmocka_unit_test(test_smoluchowski),
                                       cmocka_unit_test(test_mass_limit), cmocka_unit_test(test_rest)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
