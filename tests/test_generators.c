/* SPDX-License-Identifier: GPL-3.0-or-later
 * Initial conditions: exactly n rows, the centre at rest, mass profiles and energies against the
 * models' own, independence of n and of threads. */
#include "generator_case.h"
#include "mem.h"
#include "module.h"
#include <math.h>
#include <omp.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

static struct sim *make(const struct generator *generator, const char *keys, int64_t n)
{
    return generator_case_make(generator, keys, n, (const double[3]){0, 0, 0});
}

extern const struct generator clumped_generator, evrard_generator, plummer_generator, uniform_generator;

static double norm(const double x[3]) { return sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]); }

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double *sorted_radii(const struct species *s)
{
    double *r = mem_array("test", double, s->n);
    for (int64_t i = 0; i < s->n; i++) r[i] = norm(s->pos[i]);
    qsort(r, (size_t)s->n, sizeof *r, compare);
    return r;
}

/* The largest difference between the rows' mass fraction within r and the model's. */
static double largest_gap(const struct species *s, double (*part)(double))
{
    double *r = sorted_radii(s), gap = 0.0;
    for (int64_t i = 0; i < s->n; i++) gap = fmax(gap, fabs(((double)i + 0.5) / (double)s->n - part(r[i])));
    mem_free(r);
    return gap;
}

static double potential_energy(const struct species *s)
{
    double energy = 0.0;
#pragma omp parallel for reduction(+ : energy) schedule(dynamic, 64)
    for (int64_t i = 1; i < s->n; i++) {
        double sum = 0.0;
        for (int64_t j = 0; j < i; j++) {
            double dx = s->pos[i][0] - s->pos[j][0], dy = s->pos[i][1] - s->pos[j][1], dz = s->pos[i][2] - s->pos[j][2];
            sum -= s->mass[j] / sqrt(dx * dx + dy * dy + dz * dz);
        }
        energy += sum * s->mass[i];
    }
    return energy;
}

/* What holds for every generator: exactly n rows of one species, ids, masses, centre and its velocity. */
static void check_rows(const struct sim *sim, enum species_kind kind, int64_t n, double mass)
{
    const struct species *s = &sim->species[kind];
    for (int k = 0; k < N_SPECIES; k++) assert_int_equal(sim->species[k].n, k == (int)kind ? n : 0);
    assert_int_equal(s->n_own, n);
    double sum = 0.0, pos[3] = {0}, vel[3] = {0}, size = 0.0, speed = 0.0;
    for (int64_t i = 0; i < n; i++) {
        assert_int_equal(s->id[i], i + 1);
        sum += s->mass[i];
        size = fmax(size, norm(s->pos[i]));
        speed = fmax(speed, norm(s->vel[i]));
        for (int k = 0; k < 3; k++) {
            pos[k] += s->pos[i][k] / (double)n;
            vel[k] += s->vel[i][k] / (double)n;
        }
    }
    assert_true(fabs(sum / mass - 1.0) < 1e-10);
    assert_true(norm(pos) <= 1e-14 * size && norm(vel) <= 1e-14 * speed && isfinite(size));
}

static void test_counts(void **state)
{
    (void)state;
    static const int64_t counts[] = {1, 2, 3, 7, 13, 100, 999, 12345};
    for (size_t c = 0; c < sizeof counts / sizeof *counts; c++) {
        struct sim *sim = make(&evrard_generator, "", counts[c]);
        check_rows(sim, GAS, counts[c], 1.0);
        generator_case_free(sim);
        sim = make(&plummer_generator, "species: star", counts[c]);
        check_rows(sim, STAR, counts[c], 1.0);
        generator_case_free(sim);
        sim = make(&uniform_generator, "virial: 0.5, mass: 7", counts[c]);
        check_rows(sim, DARK, counts[c], 7.0);
        generator_case_free(sim);
    }
}

static double evrard_part(double r) { return r < 1.0 ? r * r : 1.0; }

static void test_evrard(void **state)
{
    (void)state;
    const int64_t n = 30000;
    struct sim *sim = make(&evrard_generator, "", n);
    struct species *gas = &sim->species[GAS];
    assert_true(largest_gap(gas, evrard_part) < 3e-3);
    assert_true(fabs(potential_energy(gas) * -1.5 - 1.0) < 3e-3);
    double tensor[3][3] = {{0}};
    for (int64_t i = 0; i < n; i++) {
        assert_true(gas->u[i] == 0.05f && norm(gas->vel[i]) == 0.0);
        for (int k = 0; k < 9; k++) tensor[k / 3][k % 3] += gas->pos[i][k / 3] * gas->pos[i][k % 3] / (double)n;
    }
    for (int k = 0; k < 9; k++)     /* <r^2> is 1/2; round to 2 parts in 1000 */
        assert_true(fabs(6.0 * tensor[k / 3][k % 3] - (k % 4 == 0)) < 2e-3);
    generator_case_free(sim);
    sim = make(&evrard_generator, "mass: 3, radius: 2", 1000);
    check_rows(sim, GAS, 1000, 3.0);
    assert_true(fabsf(sim->species[GAS].u[5] - 0.075f) < 1e-7f);
    assert_true(fabs(potential_energy(&sim->species[GAS]) / (-2.0 / 3.0 * 4.5) - 1.0) < 0.03);
    generator_case_free(sim);
    sim = make(&evrard_generator, "u: 0.25", 10);
    assert_true(sim->species[GAS].u[9] == 0.25f);
    generator_case_free(sim);
}

static const double r0 = 0.5890486225480862;
static double plummer_part(double r) { return pow(1.0 + r0 * r0 / (r * r), -1.5); }
static double cut_part(double r) { return r < 1.0 ? plummer_part(r) / plummer_part(1.0) : 1.0; }

static void test_plummer(void **state)
{
    (void)state;
    const int64_t n = 100000;
    struct sim *sim = make(&plummer_generator, "", n);
    const struct species *s = &sim->species[DARK];
    check_rows(sim, DARK, n, 1.0);
    assert_true(largest_gap(s, plummer_part) < 2.0 / sqrt((double)n));      /* Kolmogorov: one chance in 1500 */
    double *r = sorted_radii(s);
    assert_true(fabs(r[n / 2] - 0.76857) < 0.005);                          /* 2.5 standard errors */
    mem_free(r);
    double kinetic = 0.0, potential = 0.0, radial = 0.0, fraction[4] = {0};
    for (int64_t i = 0; i < n; i++) {
        double depth = 1.0 / sqrt(pow(norm(s->pos[i]), 2) + r0 * r0), v = norm(s->vel[i]), along = 0.0;
        for (int k = 0; k < 3; k++) along += s->vel[i][k] * s->pos[i][k] / norm(s->pos[i]);
        kinetic += 0.5 * v * v / (double)n;
        radial += 0.5 * along * along / (double)n;
        potential -= 0.5 * depth / (double)n;
        double q2 = v * v / (2.0 * depth), power = 1.0;
        for (int k = 0; k < 4; k++) fraction[k] += (power *= q2) / (double)n;
        assert_true(q2 < 1.01);
    }
    assert_true(fabs(potential + 0.5) < 0.003);
    assert_true(fabs(kinetic - 0.25) < 0.003);
    assert_true(fabs(radial / kinetic - 1.0 / 3) < 0.005);
    /* q^2 has the beta distribution (3/2, 9/2): its moments are products of (3/2 + k) / (6 + k). */
    double moment = 1.0;
    for (int k = 0; k < 4; k++) assert_true(fabs(fraction[k] / (moment *= (1.5 + k) / (6.0 + k)) - 1.0) < 0.015);
    generator_case_free(sim);
    sim = make(&plummer_generator, "cut: 1", n);
    check_rows(sim, DARK, n, plummer_part(1.0));
    assert_true(largest_gap(&sim->species[DARK], cut_part) < 2.0 / sqrt((double)n));
    for (int64_t i = 0; i < n; i++) assert_true(norm(sim->species[DARK].pos[i]) < 1.01);
    generator_case_free(sim);
}

/* Rows of 1000 and of 2000 differ by the shift of the centre alone; threads change no bit. */
static void test_independence(void **state)
{
    (void)state;
    const struct generator *const generators[] = {&plummer_generator, &uniform_generator};
    for (int g = 0; g < 2; g++) {
        const char *keys = g == 0 ? "" : "virial: 0.3";
        omp_set_num_threads(1);
        struct sim *few = make(generators[g], keys, 1000), *many = make(generators[g], keys, 2000);
        omp_set_num_threads(4);
        struct sim *again = make(generators[g], keys, 2000);
        const struct species *a = &few->species[DARK], *b = &many->species[DARK], *c = &again->species[DARK];
        for (int i = 0; i < 1000; i++)
            for (int k = 0; k < 3; k++) {
                assert_true(fabs(a->pos[i][k] - b->pos[i][k] - (a->pos[0][k] - b->pos[0][k])) < 1e-12);
                assert_true(fabs(a->vel[i][k] - b->vel[i][k] - (a->vel[0][k] - b->vel[0][k])) < 1e-12);
            }
        assert_memory_equal(b->pos, c->pos, 2000 * sizeof *b->pos);
        assert_memory_equal(b->vel, c->vel, 2000 * sizeof *b->vel);
        generator_case_free(few);
        generator_case_free(many);
        generator_case_free(again);
    }
}

static double uniform_part(double r) { return fmin(1.0, r * r * r); }

static void test_uniform(void **state)
{
    (void)state;
    const int64_t n = 100000;
    struct sim *sim = make(&uniform_generator, "virial: 0.5", n);
    const struct species *s = &sim->species[DARK];
    assert_true(largest_gap(s, uniform_part) < 2.0 / sqrt((double)n));
    double kinetic = 0.0;
    for (int64_t i = 0; i < n; i++) kinetic += 0.5 * pow(norm(s->vel[i]), 2) / (double)n;
    assert_true(fabs(kinetic / 0.3 - 1.0) < 0.01);
    generator_case_free(sim);
    sim = make(&uniform_generator, "species: gas", 1000);
    check_rows(sim, GAS, 1000, 1.0);
    const struct species *gas = &sim->species[GAS];
    for (int i = 0; i < 1000; i++) assert_true(norm(gas->vel[i]) == 0.0 && gas->u[i] == 0.05f);
    generator_case_free(sim);
}

/* Hernquist's halo alone, then clumps alone: their centres are drawn from the halo, and half the rows lie
 * closer to another row than any would in a halo without clumps. */
static double hernquist_part(double r) { return r * r / ((r + 1) * (r + 1)) / 0.98; }

static double mean_nearest(const struct species *s)
{
    double sum = 0;
    for (int64_t i = 0; i < s->n; i++) {
        double least = INFINITY;
        for (int64_t j = 0; j < s->n; j++) {
            double d[3] = {s->pos[i][0] - s->pos[j][0], s->pos[i][1] - s->pos[j][1], s->pos[i][2] - s->pos[j][2]};
            if (i != j) least = fmin(least, norm(d));
        }
        sum += log(least) / (double)s->n;
    }
    return exp(sum);
}

static void test_clumped(void **state)
{
    (void)state;
    const int64_t n = 100000, few = 2000;
    struct sim *sim = make(&clumped_generator, "fraction: 0", n);
    check_rows(sim, DARK, n, 1.0);
    assert_true(largest_gap(&sim->species[DARK], hernquist_part) < 2.0 / sqrt((double)n));
    generator_case_free(sim);
    struct sim *smooth = make(&clumped_generator, "fraction: 0", few), *clumps = make(&clumped_generator, "fraction: 1", few);
    assert_true(mean_nearest(&clumps->species[DARK]) < 0.3 * mean_nearest(&smooth->species[DARK]));
    generator_case_free(smooth);
    generator_case_free(clumps);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_counts), cmocka_unit_test(test_evrard), cmocka_unit_test(test_plummer),
        cmocka_unit_test(test_independence), cmocka_unit_test(test_uniform), cmocka_unit_test(test_clumped),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
