/* SPDX-License-Identifier: GPL-3.0-or-later
 * Initial states of the test problems: exactly n rows whatever n, even lattices, masses, energies and the
 * profile of the wave; what they refuse. */
#include "generator_case.h"
#include "ics/lattice.h"
#include "mem.h"
#include "module.h"
#include "ics/exact.h"
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

extern const struct generator tube_generator, wave_generator, sedov_generator, noh_generator, medium_generator;

static const double cube[3] = {1, 1, 1}, none[3] = {0, 0, 0};

/* Distance of row i from its nearest neighbour in the box; every row's is the same in a lattice. */
static double nearest(double (*pos)[3], int64_t n, const double side[3], int64_t i)
{
    double least = INFINITY;
    for (int64_t j = 0; j < n; j++) {
        double r2 = 0;
        for (int k = 0; k < 3; k++) {
            double d = pos[j][k] - pos[i][k];
            d -= side[k] * rint(d / side[k]);
            r2 += d * d;
        }
        if (j != i) least = fmin(least, r2);
    }
    return sqrt(least);
}

static void test_lattice(void **state)
{
    (void)state;
    static const double sides[3][3] = {{1, 1, 1}, {2, 0.2, 0.2}, {1, 0.1, 0.3}};
    static const int64_t counts[] = {997, 1000, 4096, 5003};
    for (int b = 0; b < 3; b++)
        for (int c = 0; c < 4; c++) {
            int64_t n = counts[c];
            double (*pos)[3] = mem_alloc("test", (size_t)n * sizeof *pos);
            lattice_box(n, sides[b], pos);
            double densest = pow(2, 1.0 / 6) * cbrt(sides[b][0] * sides[b][1] * sides[b][2] / (double)n);
            double first = nearest(pos, n, sides[b], 0);
            assert_true(first > 0.95 * densest && first <= densest);
            for (int64_t i = 0; i < n; i += 97) assert_float_equal(nearest(pos, n, sides[b], i) / first, 1, 1e-9);
            for (int64_t i = 0; i < n; i++)
                for (int k = 0; k < 3; k++) assert_true(pos[i][k] >= 0 && pos[i][k] < sides[b][k]);
            mem_free(pos);
        }
}

/* n points of the ball of radius 1; away from its surface the nearest neighbour is 0.8 to 1.1 mean spacings away, and
 * half the ball's radius holds an eighth of the points, within the rows of one surface. */
static void test_glass(void **state)
{
    (void)state;
    static const int64_t counts[] = {1, 60, 3000};
    for (int c = 0; c < 3; c++) {
        int64_t n = counts[c], within = 0;
        double (*pos)[3] = lattice_glass_ball(n), spacing = cbrt(4 * 3.14159265358979 / 3 / (double)n);
        const double open[3] = {1e9, 1e9, 1e9};
        for (int64_t i = 0; i < n; i++) {
            double r = sqrt(pos[i][0] * pos[i][0] + pos[i][1] * pos[i][1] + pos[i][2] * pos[i][2]);
            assert_true(r < 1 + spacing);
            within += r < 0.5;
            double least = r < 1 - 2 * spacing ? nearest(pos, n, open, i) / spacing : 1;
            assert_true(least > 0.8 && least < 1.1);
        }
        if (n > 1000) assert_true(labs((long)(within - n / 8)) < 30);
        mem_free(pos);
    }
}

static void test_counts(void **state)
{
    (void)state;
    const struct generator *const all[] = {&tube_generator, &wave_generator, &sedov_generator, &noh_generator};
    static const int64_t counts[] = {2, 3, 17, 1000, 4321};
    for (int g = 0; g < 4; g++)
        for (int c = 0; c < 5; c++) {
            struct sim *sim = generator_case_make(all[g], "", counts[c], cube);
            const struct species *gas = &sim->species[GAS];
            assert_true(sim->problems.count == 0 && gas->n == counts[c] && gas->n_own == counts[c]);
            for (int64_t i = 0; i < gas->n; i++) assert_true(gas->id[i] == (uint64_t)i + 1 && gas->mass[i] > 0 && gas->u[i] > 0);
            generator_case_free(sim);
        }
}

static void test_tube(void **state)
{
    (void)state;
    struct sim *sim = generator_case_make(&tube_generator, "velocity_left: 0.5, density_right: 0.25", 5000, cube);
    const struct species *gas = &sim->species[GAS];
    double mass[2] = {0}, least = INFINITY, most = 0;
    for (int64_t i = 0; i < gas->n; i++) {
        int side = gas->pos[i][0] >= 0.5;
        mass[side] += gas->mass[i];
        least = fmin(least, gas->mass[i]);
        most = fmax(most, gas->mass[i]);
        assert_true(gas->vel[i][0] == (side ? 0 : 0.5) && gas->vel[i][1] == 0);
        assert_float_equal(gas->u[i], side ? 0.6 : 1.5, 1e-6);      /* P / ((gamma - 1) rho) */
    }
    assert_float_equal(mass[0], 0.5, 1e-12);
    assert_float_equal(mass[1], 0.125, 1e-12);
    assert_true(most / least < 1.001);
    generator_case_free(sim);
    sim = generator_case_make(&tube_generator, "length: 3", 100, (const double[3]){0, 1, 1});
    assert_int_equal(sim->problems.count, 0);
    for (int i = 0; i < 100; i++) assert_true(sim->species[GAS].pos[i][0] > 0 && sim->species[GAS].pos[i][0] < 3);
    generator_case_free(sim);
}

/* Rows by mass against the integral of the exact density, state against the exact one. */
static void test_wave(void **state)
{
    (void)state;
    const double amplitude = 0.1, gamma = 5.0 / 3;
    struct sim *sim = generator_case_make(&wave_generator, "amplitude: 0.1", 2000, cube);
    const struct species *gas = &sim->species[GAS];
    double within[20] = {0}, exact[20] = {0};
    for (int64_t i = 0; i < gas->n; i++) {
        struct exact_state at = exact_wave(gamma, amplitude, gas->pos[i][0], 0);
        assert_float_equal(gas->vel[i][0], at.v, 1e-9);
        assert_float_equal(gas->u[i], at.p / ((gamma - 1) * at.rho), 1e-6);
        for (int k = (int)(20 * gas->pos[i][0]); k < 20; k++) within[k] += gas->mass[i];
    }
    for (int k = 0; k < 200000; k++) exact[k / 10000] += exact_wave(gamma, amplitude, (k + 0.5) / 200000, 0).rho / 200000;
    for (int k = 1; k < 20; k++) exact[k] += exact[k - 1];
    for (int k = 0; k < 20; k++) assert_float_equal(within[k], exact[k], 2e-3);     /* a layer of rows or two */
    assert_float_equal(within[19], exact[19], 1e-9);
    generator_case_free(sim);
}

static void test_sedov(void **state)
{
    (void)state;
    struct sim *sim = generator_case_make(&sedov_generator, "energy: 3, hot: 10, u: 1e-4", 3000, cube);
    const struct species *gas = &sim->species[GAS];
    double energy = 0, moment[3] = {0};
    int64_t hot = 0;
    for (int64_t i = 0; i < gas->n; i++) {
        energy += gas->mass[i] * (double)gas->u[i];
        if (gas->u[i] < 1) continue;
        hot++;
        for (int k = 0; k < 3; k++) moment[k] += gas->pos[i][k] - 0.5;
    }
    assert_float_equal(energy, 3 + 1e-4, 1e-5);
    assert_true(hot >= 10 && hot < 40);
    for (int k = 0; k < 3; k++) assert_float_equal(moment[k], 0, 1e-9);     /* as many on either side */
    generator_case_free(sim);
}

static void test_noh(void **state)
{
    (void)state;
    struct sim *sim = generator_case_make(&noh_generator, "", 3000, none);
    const struct species *gas = &sim->species[GAS];
    double mass = 0;
    for (int64_t i = 0; i < gas->n; i++) {
        double r = 0, v = 0, along = 0;
        for (int k = 0; k < 3; k++) {
            r += gas->pos[i][k] * gas->pos[i][k];
            v += gas->vel[i][k] * gas->vel[i][k];
            along += gas->pos[i][k] * gas->vel[i][k];
        }
        mass += gas->mass[i];
        assert_true(r < 1.01 && fabs(sqrt(v) - 1) < 0.01);
        assert_true(along / sqrt(r * v) < -0.99 || r < 0.02);
    }
    assert_float_equal(mass, 4.0 / 3 * 3.14159265358979, 1e-9);
    generator_case_free(sim);
}

/* n_H and T into code units. */
static void test_medium(void **state)
{
    (void)state;
    struct sim *sim = generator_case_make(&medium_generator, "density: 2, u: 0.5", 1000, cube);
    assert_float_equal(sim->species[GAS].mass[0], 2e-3, 1e-12);
    assert_true(sim->species[GAS].u[999] == 0.5f);
    struct sim *shaken = generator_case_make(&medium_generator, "density: 2, u: 0.5, jitter: 0.3", 1000, cube);
    double largest = 0;
    for (int64_t i = 0; i < 1000; i++)
        for (int k = 0; k < 3; k++) {
            double d = shaken->species[GAS].pos[i][k] - sim->species[GAS].pos[i][k];
            largest = fmax(largest, fabs(d - rint(d)));
        }
    assert_true(largest > 0.029 && largest < 0.03);     /* of a spacing of 0.1 */
    generator_case_free(shaken);
    generator_case_free(sim);
}

static void test_refused(void **state)
{
    (void)state;
    const struct { const struct generator *generator; const char *keys; const double *side; int problems; } cases[] = {
        {&tube_generator, "", none, 3}, {&tube_generator, "length: 1", none, 2}, {&wave_generator, "", none, 3},
        {&medium_generator, "u: 1", cube, 1}, {&medium_generator, "n_h: 1, temperature: 10", cube, 2},
        {&medium_generator, "", cube, 2}};
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        struct sim *sim = generator_case_make(cases[c].generator, cases[c].keys, 100, cases[c].side);
        assert_int_equal(sim->problems.count, cases[c].problems);
        assert_int_equal(sim->species[GAS].n, 0);
        mem_free(sim->problems.text);
        generator_case_free(sim);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_lattice), cmocka_unit_test(test_glass), cmocka_unit_test(test_counts), cmocka_unit_test(test_tube),
        cmocka_unit_test(test_wave), cmocka_unit_test(test_sedov), cmocka_unit_test(test_noh),
        cmocka_unit_test(test_medium), cmocka_unit_test(test_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
