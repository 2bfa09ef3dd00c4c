/* SPDX-License-Identifier: GPL-3.0-or-later
 * Cooling curves: the table, closed forms, reference times of isochoric cooling, equilibrium of heated
 * gas, and the places where other schemes fail: steps far longer than the cooling time, rates that fall
 * with temperature, metallicities and temperatures beyond the table. */
#include "physics/cooling_curve.h"
#include "constants.h"
#include "data.h"
#include "mem.h"
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>
#include <cmocka.h>

static const double Myr = 1e6 * CONST_YEAR;
static const struct cooling_gas table_gas = {5.0 / 3, NAN, NAN, 1e4, 0};
static const struct cooling_gas constant_gas = {5.0 / 3, 0.6, 0.71, 1e4, 0};

static struct cooling_table *read_table(void)
{
    struct problems problems = {0};
    char *path = data_path("cooling_tables/sutherland_dopita_1993.txt");
    struct cooling_table *table = cooling_table_read(path, &problems);
    assert_int_equal(problems.count, 0);
    mem_free(path);
    return table;
}

static struct cooling_curve *new_curve(double feh, const struct cooling_gas *gas)
{
    struct cooling_table *table = read_table();
    struct cooling_samples *samples = mem_alloc("test", sizeof *samples);
    cooling_table_sample(table, feh, samples);
    struct cooling_curve *curve = cooling_curve_new(samples, gas);
    mem_free(samples);
    cooling_table_free(table);
    return curve;
}

static void assert_near(double value, double wanted, double tolerance)
{
    if (!(fabs(value - wanted) <= tolerance * fabs(wanted)))
        fail_msg("%.10g instead of %.10g: off by %.1e", value, wanted, value / wanted - 1);
}

static double u_of(double t, double mu) { return CONST_K_B * t / ((5.0 / 3 - 1) * mu * CONST_M_PROTON); }

/* --- the table --- */

static void test_table(void **unused)
{
    (void)unused;
    struct cooling_table *table = read_table();
    assert_int_equal(table->n_t, 91);
    assert_int_equal(table->n_z, 8);
    const struct { double feh, log_t, log_l, particle; } known[] = {    /* the published tables */
        {0, 4, -25.65, 2.166}, {0, 8.5, -22.26, 1.034}, {-1, 5, -21.53, 0.973}, {-5, 6, -23.25, 0.965},
        {0.5, 6, -21.35, 1.068}};
    for (size_t i = 0; i < sizeof known / sizeof *known; i++)
        for (int z = 0; z < table->n_z; z++)
            for (int t = 0; t < table->n_t; t++) {
                if (table->feh[z] != known[i].feh || fabs(table->log_t[t] - known[i].log_t) > 1e-9) continue;
                assert_near(table->log_l[z * table->n_t + t], known[i].log_l, 1e-12);
                assert_near(table->particle[z * table->n_t + t], 1e-24 * known[i].particle, 1e-12);
            }
    cooling_table_free(table);
    assert_near(cooling_table_feh(0.02) + 1, 1, 1e-12);
    assert_near(cooling_table_feh(0.002), -1, 1e-12);
    assert_near(cooling_table_feh(0), -5, 1e-12);
}

/* Loss of gas of solar composition per n_H^2 [erg cm^3/s]. */
static double loss_at(const struct cooling_curve *curve, double t)
{
    return (curve->heating - cooling_curve_rate(curve, cooling_curve_u(curve, t), 1)) * pow(2.387e-24, 2);
}

/* Energy per mass and loss of gas of the table's own composition. */
static void test_composition(void **unused)
{
    (void)unused;
    struct cooling_curve *curve = new_curve(0, &table_gas);
    assert_near(curve->node[0].u, 1.5 * CONST_K_B * 1e4 / 2.166e-24, 1e-12);
    assert_near(loss_at(curve, 1e6), pow(10, -21.84), 1e-9);
    for (double t = 1.2e4; t < 1e10; t *= 1.3)
        assert_near(cooling_curve_temperature(curve, cooling_curve_u(curve, t)), t, 1e-12);
    cooling_curve_free(curve);
}

static void write_text(const char *path, const char *text)
{
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs(text, file);
    fclose(file);
}

/* What is wrong with a user's own table is told with its line. */
static void test_own_table(void **unused)
{
    (void)unused;
    char path[] = "/tmp/tephra-table-XXXXXX";
    close(mkstemp(path));
    const struct { const char *text, *says; } wrong[] = {
        {"4 -23 2\n", ":1: the first line"}, {"metallicity 0 -1\n", ":1: metallicities"},
        {"metallicity 0\nhydrogen_mass 2 3\n", ":2: expects a mass"}, {"metallicity 0\n4 -23\n", ":2: expects log T"},
        {"metallicity 0\n4 x 2\n", ":2: expects log T"}, {"metallicity 0\n4 -23 2\n5 -22 1\n", "hydrogen_mass"},
        {"metallicity 0\nhydrogen_mass 2\n5 -22 1\n4 -23 2\n", "ascend"},
        {"metallicity 0\nhydrogen_mass 2\n", "fewer than two"},
        {"metallicity 0\nhydrogen_mass 2\n4 -23 2\n4.1 -22 4\n", "temperature over mass"}};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        struct problems problems = {0};
        write_text(path, wrong[i].text);
        assert_null(cooling_table_read(path, &problems));
        assert_int_equal(problems.count, 1);
        if (!strstr(problems.text, wrong[i].says)) fail_msg("\"%s\" is not said in %s", wrong[i].says, problems.text);
        mem_free(problems.text);
    }
    struct problems problems = {0};
    write_text(path, "# my own\nmetallicity 0\nhydrogen_mass 2.3\n4 -23 2\n\n7 -22 1\n");
    struct cooling_table *table = cooling_table_read(path, &problems);
    assert_int_equal(problems.count, 0);
    assert_int_equal(table->n_t, 2);
    assert_near(table->hydrogen[0], 2.3e-24, 1e-12);
    cooling_table_free(table);
    unlink(path);
}

/* --- cooling --- */

/* L = L0 (T/T0)^a: T = T0 (1 - (1 - a) t/t_c)^(1/(1-a)), over cells and beyond the last sample. */
static void test_power_law(void **unused)
{
    (void)unused;
    for (double a = -1.5; a < 3.1; a += 0.5) {
        struct cooling_samples *samples = mem_alloc("test", sizeof *samples);
        for (int i = 0; i <= 80; i++) {
            double t = pow(10, 4 + 0.05 * i);
            samples->at[samples->n++] = (struct cooling_sample){t, 1e-22 * pow(t / 1e6, a), 1e-24, 2e-24};
        }
        struct cooling_curve *curve = cooling_curve_new(samples, &constant_gas);
        const double rho = 1e-25;
        for (double t0 = 2e4; t0 < 3e8; t0 *= 7)
            for (double part = 1e-4; part < 1; part *= 3) {
                double u = u_of(t0, 0.6), t_c = -u / cooling_curve_rate(curve, u, rho);
                double x = fabs(a - 1) < 1e-9 ? exp(-part) : 1 - (1 - a) * part;
                double wanted = fabs(a - 1) < 1e-9 ? x : x > 0 ? pow(x, 1 / (1 - a)) : 0;
                double got = cooling_curve_advance(curve, u, rho, part * t_c);
                assert_near(got, fmax(wanted * u, curve->node[0].u), 1e-6);
            }
        cooling_curve_free(curve);
        mem_free(samples);
    }
}

/* Isochoric cooling at n_H = 0.1 cm^-3 with mu = 0.6, X = 0.71, from an independent integration of the
 * published column: temperatures [K] at 1, 3, 10, 30, 100 Myr (0: at the floor), time to reach 1e4 K. */
static void test_isochoric(void **unused)
{
    (void)unused;
    const double rho = 0.1 * CONST_M_PROTON / 0.71, at[5] = {1, 3, 10, 30, 100};
    const struct { double feh, t0, t_cool, t[5], floor; } known[] = {
        {0, 1e7, 43.42, {9.770e6, 9.309e6, 7.714e6, 2.90e6, 0}, 36.32},
        {0, 1e6, 1.066, {1.077e4, 1.003e4, 0, 0, 0}, 3.227},
        {-1, 1e7, 125.2, {9.920e6, 9.761e6, 9.208e6, 7.665e6, 1.964e6}, 113.6},
        {-1, 1e6, 5.466, {7.99e5, 1.09e4, 0, 0, 0}, 7.665},
        {-5, 1e7, 172.8, {9.942e6, 9.827e6, 9.425e6, 8.300e6, 4.781e6}, 220.4},
        {-5, 1e6, 27.39, {9.635e5, 8.905e5, 6.264e5, 0, 0}, 26.05}};
    for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
        struct cooling_curve *curve = new_curve(known[i].feh, &constant_gas);
        double u = u_of(known[i].t0, 0.6);
        assert_near(-u / cooling_curve_rate(curve, u, rho) / Myr, known[i].t_cool, 1e-3);
        for (int k = 0; k < 5; k++) {
            double t = cooling_curve_temperature(curve, cooling_curve_advance(curve, u, rho, at[k] * Myr));
            assert_near(t, fmax(known[i].t[k], 1e4), 1e-3);
        }
        assert_near(cooling_curve_advance(curve, u, rho, known[i].floor * 1.001 * Myr), curve->node[0].u, 1e-12);
        assert_true(cooling_curve_advance(curve, u, rho, known[i].floor * 0.999 * Myr) > curve->node[0].u);
        cooling_curve_free(curve);
    }
}

/* --- where other schemes fail --- */

/* dt/t_cool from 1e-4 to 100 against Euler's method in steps that change u by 1e-4: they agree, while
 * one explicit step of the same length is wrong from 0.1 on and gives negative energies from 1 on. */
static void test_against_explicit(void **unused)
{
    (void)unused;
    struct cooling_curve *curve = new_curve(0, &constant_gas);
    const double rho = 1e-25;
    double worst = 0, naive[7] = {0};
    for (double t0 = 2e4; t0 < 2e8; t0 *= 3.7)
        for (int e = -4; e <= 2; e++) {
            double u0 = u_of(t0, 0.6), u = u0, dt = pow(10, e) * -u / cooling_curve_rate(curve, u, rho), left = dt;
            while (left > 0 && u > curve->node[0].u) {
                double rate = cooling_curve_rate(curve, u, rho), half = fmin(left, -1e-4 * u / rate);
                u += half * cooling_curve_rate(curve, u + 0.5 * half * rate, rho);
                left -= half;
            }
            double exact = cooling_curve_advance(curve, u0, rho, dt), plain = u0 - pow(10, e) * u0;
            worst = fmax(worst, fabs(log(exact / fmax(u, curve->node[0].u))));
            naive[e + 4] = fmax(naive[e + 4], plain > 0 ? fabs(log(plain / exact)) : INFINITY);
            assert_true(exact >= curve->node[0].u && exact <= u0);
        }
    for (int e = -4; e <= 2; e++)
        print_message("dt/t_cool 1e%d: one explicit step is off by up to %.1e\n", e, naive[e + 4]);
    assert_true(worst < 1e-6);
    assert_true(naive[0] < 1e-6 && naive[3] > 3e-3 && naive[4] == INFINITY && naive[6] == INFINITY);
    cooling_curve_free(curve);
}

/* Where the loss falls with temperature a backward Euler step has three solutions, and bisection of
 * log u finds the lowest: gas of 1e7 K that should lose a tenth of its heat falls below 1e5 K. */
static void test_wrong_root(void **unused)
{
    (void)unused;
    struct cooling_curve *curve = new_curve(0, &constant_gas);
    const double rho = 1e-25, u0 = u_of(1e7, 0.6), dt = 0.1 * -u0 / cooling_curve_rate(curve, u0, rho);
    double low = curve->node[0].u, high = u0;
    for (int i = 0; i < 60; i++) {
        double middle = sqrt(low * high);
        if (middle - u0 - dt * cooling_curve_rate(curve, middle, rho) < 0) low = middle;
        else high = middle;
    }
    assert_true(cooling_curve_temperature(curve, low) < 1e5);
    assert_near(cooling_curve_temperature(curve, cooling_curve_advance(curve, u0, rho, dt)), 9e6, 0.02);
    cooling_curve_free(curve);
}

/* Metallicities: none, between the columns, beyond them. Temperatures: above the table, at and below
 * the floor. Never negative, never more than before. */
static void test_beyond(void **unused)
{
    (void)unused;
    const double feh[] = {-300, -5, -3.7, 0.25, 0.5, 3};
    const double rho = 1e-25;
    double losses[6];
    for (int i = 0; i < 6; i++) {
        struct cooling_curve *curve = new_curve(feh[i], &table_gas);
        losses[i] = -cooling_curve_rate(curve, cooling_curve_u(curve, 1e6), rho);
        double hot = cooling_curve_u(curve, 1e9), hotter = cooling_curve_u(curve, 4e11);
        assert_near(cooling_curve_rate(curve, hotter, rho), 20 * cooling_curve_rate(curve, hot, rho), 1e-9);
        for (double t = 1; t < 1e14; t *= 3)
            for (double dt = 1; dt < 1e30; dt *= 1e3) {
                double u = cooling_curve_u(curve, t), after = cooling_curve_advance(curve, u, rho, dt);
                assert_true(after >= curve->node[0].u && after <= fmax(u, curve->node[0].u));
            }
        cooling_curve_free(curve);
    }
    assert_near(losses[0], losses[1], 1e-12);
    assert_near(losses[4], losses[5], 1e-12);
    assert_true(losses[1] < losses[2] && losses[2] < losses[3] && losses[3] < losses[4]);
}

/* --- cold gas --- */

typedef void sampler(const struct cooling_table *table, double feh, struct cooling_samples *samples);

static struct cooling_curve *new_cold_curve(double feh, sampler *sample, double heating)
{
    const struct cooling_gas gas = {5.0 / 3, NAN, NAN, 10, heating};
    struct cooling_table *table = read_table();
    struct cooling_samples *samples = mem_alloc("test", sizeof *samples);
    sample(table, feh, samples);
    struct cooling_curve *curve = cooling_curve_new(samples, &gas);
    mem_free(samples);
    cooling_table_free(table);
    return curve;
}

/* The fit below, the table above, and no jump where they meet: at log T = 4.11 for solar metallicity. */
static void test_dalgarno(void **unused)
{
    (void)unused;
    assert_near(cooling_table_dalgarno(1000, 1), 2.238e-26, 1e-9);
    assert_near(cooling_table_dalgarno(5000, 1), 1.0012e-30 * pow(5000, 1.5), 1e-9);
    assert_near(cooling_table_dalgarno(1e4, 0), 2.179e-24, 1e-9);
    for (double feh = -5; feh < 0.6; feh += 0.5) {
        struct cooling_curve *curve = new_cold_curve(feh, cooling_table_sample_low, 0);
        double steepest = 0;
        for (int k = 0; k < curve->n - 1; k++) {
            assert_true(curve->node[k + 1].u > curve->node[k].u);
            if (curve->t[k] > 1e4 && curve->t[k] < 1.2e4) steepest = fmax(steepest, 1 - curve->node[k].power);
        }
        assert_true(steepest < 12);     /* T^5 before the join, up to T^20 and a changing mean mass after it */
        if (feh == 0) {
            double below = pow(10, 4.105);
            assert_near(loss_at(curve, 1e3), 2.238e-26, 2e-3);
            assert_near(loss_at(curve, below), cooling_table_dalgarno(below, 1), 0.01);
            assert_near(loss_at(curve, pow(10, 4.2)), pow(10, -21.99), 1e-6);
        }
        cooling_curve_free(curve);
    }
}

/* The equilibrium that gas reaches from hot and from cold; pressure [K cm^-3] at its turning points.
 * Known: 5007 at 5039 K and 1597 at 184 K (Koyama & Inutsuka 2002, eq. 4). */
static void test_koyama(void **unused)
{
    (void)unused;
    struct cooling_curve *curve = new_cold_curve(0, cooling_table_sample_koyama, COOLING_KOYAMA_HEATING);
    const double nucleus = 1.37 * 1.6733e-24, long_time = 1e12 * CONST_YEAR;
    double highest = 0, lowest = INFINITY, at_highest = 0, at_lowest = 0;
    for (double n = 0.1; n < 2000; n *= 1.005) {
        double hot = cooling_curve_advance(curve, cooling_curve_u(curve, 1e4), n * nucleus, long_time);
        double cold = cooling_curve_advance(curve, cooling_curve_u(curve, 11), n * nucleus, long_time);
        double t = cooling_curve_temperature(curve, hot);
        assert_near(cold, hot, 1e-9);
        if (n < 3 && n * t > highest) highest = n * (at_highest = t);
        if (n > 1 && n < 50 && n * t < lowest) lowest = n * (at_lowest = t);
    }
    assert_near(highest, 5007, 0.01);
    assert_near(at_highest, 5039, 0.01);
    assert_near(lowest, 1597, 0.01);
    assert_near(at_lowest, 184, 0.03);
    cooling_curve_free(curve);
}

/* One row on its way to equilibrium, in many small steps and in one. */
struct pair { double small, past, home; };

static void step_small(const struct cooling_curve *curve, struct pair *p, double rho, double until)
{
    while (p->past < until && fabs(p->small / p->home - 1) > 1e-5) {
        double rate = cooling_curve_rate(curve, p->small, rho);
        double step = fmin(until - p->past, 1e-3 * fmin(p->small, fabs(p->small - p->home)) / fabs(rate));
        p->small += step * cooling_curve_rate(curve, p->small + 0.5 * step * rate, rho);
        p->past += step;
    }
}

/* Heated gas against Euler's method in small steps, from both sides of the equilibrium: it is
 * approached and never passed, however long the step. */
static double worst_of_heated(sampler *sample, double heating)
{
    struct cooling_curve *curve = new_cold_curve(0, sample, heating);
    const double nucleus = 1.37 * 1.6733e-24;
    double worst = 0;
    for (double n = 0.3; n < 100; n *= 3)
        for (double t = 20; t < 5e6; t *= 2.7) {
            double u0 = cooling_curve_u(curve, t), rho = n * nucleus;
            struct pair pair = {u0, 0, cooling_curve_advance(curve, u0, rho, 1e40)};
            for (double dt = 1e-4 * u0 / fabs(cooling_curve_rate(curve, u0, rho)); dt < 1e20; dt *= 10) {
                double exact = cooling_curve_advance(curve, u0, rho, dt);
                step_small(curve, &pair, rho, dt);
                assert_true((exact - u0) * (pair.home - u0) >= 0);
                assert_true(fabs(exact - u0) <= fabs(pair.home - u0) * (1 + 1e-12));
                worst = fmax(worst, fabs(log(exact / pair.small)));
            }
        }
    cooling_curve_free(curve);
    return worst;
}

static void test_heated(void **unused)
{
    (void)unused;
    double two_phases = worst_of_heated(cooling_table_sample_koyama, COOLING_KOYAMA_HEATING);
    double table = worst_of_heated(cooling_table_sample_low, 30 * COOLING_KOYAMA_HEATING);
    print_message("heated gas: largest error %.1e, %.1e\n", two_phases, table);
    assert_true(two_phases < 1.5e-3 && table < 1.5e-3);
}

static double cpu_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

enum { ROWS = 100000 };

/* Gas of random temperatures and its cooling times at density rho. */
static void random_rows(const struct cooling_curve *curve, double rho, double *u, double *t_cool)
{
    uint64_t seed = 1;
    for (int i = 0; i < ROWS; i++) {
        seed = seed * 6364136223846793005u + 1442695040888963407u;      /* Knuth's MMIX generator */
        u[i] = cooling_curve_u(curve, pow(10, 4.2 + 4 * (double)(seed >> 11) * 0x1p-53));
        t_cool[i] = u[i] / fabs(cooling_curve_rate(curve, u[i], rho));
    }
}

/* Best of five, in seconds a row. */
static double cost(const struct cooling_curve *curve, double rho, double ratio, const double *u, const double *t_cool)
{
    double best = INFINITY, sum = 0;
    for (int repeat = 0; repeat < 5; repeat++) {
        double began = cpu_seconds();
        for (int i = 0; i < ROWS; i++) sum += cooling_curve_advance(curve, u[i], rho, ratio * t_cool[i]);
        best = fmin(best, (cpu_seconds() - began) / ROWS);
    }
    assert_true(sum > 0);
    return best;
}

/* CPU time a row and step: like that of a few powers, however long the step. */
static void test_cost(void **unused)
{
    (void)unused;
    const double rho = 1e-25, heated_rho = 2.3e-24;
    double longest = 0;
    struct cooling_curve *curve = new_curve(0, &table_gas);
    struct cooling_curve *heated = new_cold_curve(0, cooling_table_sample_koyama, COOLING_KOYAMA_HEATING);
    double *u = mem_array("test", double, ROWS), *t_cool = mem_array("test", double, ROWS);
    for (double ratio = 1e-4; ratio < 200; ratio *= 10) {
        random_rows(curve, rho, u, t_cool);
        double cooled = cost(curve, rho, ratio, u, t_cool);
        random_rows(heated, heated_rho, u, t_cool);
        double balanced = cost(heated, heated_rho, ratio, u, t_cool);
        print_message("dt/t_cool %g: %.0f ns, heated %.0f ns\n", ratio, 1e9 * cooled, 1e9 * balanced);
        longest = fmax(longest, fmax(cooled, balanced));
    }
    if (longest > 120e-9) print_message("longer than 120 ns: a slow processor, or a build for debugging\n");
    assert_true(longest < 2e-6);
    mem_free(u);
    mem_free(t_cool);
    cooling_curve_free(curve);
    cooling_curve_free(heated);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_table), cmocka_unit_test(test_composition), cmocka_unit_test(test_own_table),
        cmocka_unit_test(test_power_law), cmocka_unit_test(test_isochoric),
        cmocka_unit_test(test_against_explicit), cmocka_unit_test(test_wrong_root), cmocka_unit_test(test_beyond),
        cmocka_unit_test(test_dalgarno), cmocka_unit_test(test_koyama), cmocka_unit_test(test_heated),
        cmocka_unit_test(test_cost),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
