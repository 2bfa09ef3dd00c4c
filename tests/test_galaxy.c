/* SPDX-License-Identifier: GPL-3.0-or-later
 * Disc galaxies and their mergers: Freeman's rotation curve, profiles, spins, Toomre's Q and heights of drawn rows, the
 * virial theorem, the Kepler orbit of two. */
#include "generator_case.h"
#include "ics/disc.h"
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

extern const struct generator galaxy_generator, merger_generator;
static const double PI = 3.14159265358979323846, none[3] = {0, 0, 0};

#define HALO "dark_mass: 10, dark_radius: 5, dark_cut: 40, "
#define STARS "bulge_mass: 0.1, bulge_radius: 0.2, disc_mass: 0.5, disc_radius: 1, disc_height: 0.1, disc_q: 1.4, "
#define SHARES "dark_share: 10, bulge_share: 1, disc_share: 9"

static double norm(const double x[3]) { return sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]); }

/* A disc alone is fastest at 2.15 radii, with v^2 = 0.387 G M/a; far out it is a point, and kappa = omega. */
static void test_rotation(void **state)
{
    (void)state;
    const struct disc stars = {.mass = 2, .radius = 0.5, .height = 1e-6, .q = 1}, gas = {0};
    const struct radial part = {.form = RADIAL_DISC, .mass = 2, .radius = 0.5, .cut = NAN};
    struct equilibrium *all = equilibrium_new(3, &part, 1);
    struct disc_field *field = mem_alloc("test", sizeof *field);
    *field = (struct disc_field){.all = all, .spheres = 0, .disc = {&stars, &gas}};
    disc_prepare(field);
    double best = 0, at = 0;
    for (double R = 0.05; R < 5; R += 0.005) {
        if (disc_speed2(field, DISC_STARS, R) <= best) continue;
        best = disc_speed2(field, DISC_STARS, R);
        at = R;
    }
    assert_float_equal(at / 0.5, 2.15, 0.02);
    assert_float_equal(best / (3 * 2 / 0.5), 0.387, 0.001);
    assert_float_equal(disc_kappa(field, 20) / sqrt(disc_speed2(field, DISC_STARS, 20) / 400), 1, 4e-3);
    assert_float_equal(disc_speed2(field, DISC_STARS, 20) * 20 / 6, 1, 4e-3);
    mem_free(field);
    mem_free(all);
}

static void test_counts(void **state)
{
    (void)state;
    static const int64_t counts[] = {3, 40, 1001};
    for (int c = 0; c < 6; c++) {
        const struct generator *generator = c % 2 ? &merger_generator : &galaxy_generator;
        int64_t n = counts[c / 2] + (c % 2 ? 40 : 0);
        struct sim *sim = generator_case_make(generator, c % 2 ? HALO STARS SHARES ", pericentre: 1, separation: 30"
                                              : HALO "disc_mass: 5, disc_share: 1, dark_share: 1", n, none);
        int64_t rows = 0, ids = 0;
        double moment[3] = {0}, pos[3] = {0};
        for_species(sim, s) {
            rows += s->n;
            for (int64_t i = 0; i < s->n; i++) {
                ids += (int64_t)s->id[i];
                for (int k = 0; k < 3; k++) moment[k] += s->mass[i] * s->vel[i][k];
                for (int k = 0; k < 3; k++) pos[k] += s->mass[i] * s->pos[i][k];
            }
        }
        assert_int_equal(rows, n);
        assert_int_equal(ids, n * (n + 1) / 2);
        assert_true(norm(moment) < 1e-11 && norm(pos) < 1e3);
        generator_case_free(sim);
    }
}

/* Stars of the disc between 2 and 2.4 radii: Q = sigma kappa/(3.36 G Sigma), height, mean rotation below the circle's. */
static void test_disc(void **state)
{
    (void)state;
    struct sim *sim = generator_case_make(&galaxy_generator, HALO STARS SHARES, 200000, none);
    assert_int_equal(sim->problems.count, 0);
    const struct species *star = &sim->species[STAR];
    const struct radial part[] = {{.form = RADIAL_NFW, .mass = 10, .radius = 5, .cut = 40},
                                  {.form = RADIAL_HERNQUIST, .mass = 0.1, .radius = 0.2, .cut = 3},
                                  {.form = RADIAL_DISC, .mass = 0.5, .radius = 1, .cut = NAN}};
    struct equilibrium *all = equilibrium_new(1, part, 3);
    const struct disc stars = {.mass = 0.5, .radius = 1, .height = 0.1, .q = 1.4}, gas = {0};
    struct disc_field *field = mem_alloc("test", sizeof *field);
    *field = (struct disc_field){.all = all, .spheres = 2, .disc = {&stars, &gas}};
    disc_prepare(field);
    double sum[6] = {0}, mass = 0;
    const int64_t first = 10000;    /* the bulge's rows come first */
    for (int64_t i = first; i < star->n; i++) {
        const double *x = star->pos[i], *v = star->vel[i], R = hypot(x[0], x[1]);
        if (R < 2 || R > 2.4) continue;
        double out = (x[0] * v[0] + x[1] * v[1]) / R, round = (x[0] * v[1] - x[1] * v[0]) / R;
        const double terms[6] = {1, out * out, round, round * round, x[2] * x[2], v[2] * v[2]};
        for (int k = 0; k < 6; k++) sum[k] += terms[k];
        mass += star->mass[i];
    }
    double n = sum[0], sigma = sqrt(sum[1] / n), kappa = disc_kappa(field, 2.2), v2 = disc_speed2(field, DISC_STARS, 2.2);
    double surface = mass / (PI * (2.4 * 2.4 - 4));
    assert_float_equal(surface / (0.5 / (2 * PI) * exp(-2.2)), 1, 0.03);
    assert_float_equal(sigma * kappa / (3.36 * surface), 1.4, 0.06);
    assert_float_equal(sum[4] / n / (PI * PI / 12 * 0.01), 1, 0.06);
    assert_true(sum[2] / n < sqrt(v2) && sum[2] / n > 0.85 * sqrt(v2));
    assert_true(sum[5] / n > PI * surface * 0.1 && sum[5] / n < 3 * PI * surface * 0.1);  /* more than its own weight */
    mem_free(field);
    mem_free(all);
    generator_case_free(sim);
}

/* 2 K = -W for all rows together; the disc is thin and its W is that of a disc. */
static void test_virial(void **state)
{
    (void)state;
    struct sim *sim = generator_case_make(&galaxy_generator, HALO STARS SHARES, 12000, none);
    double twice = 0, energy = 0;
    for (int a = 0; a < N_SPECIES; a++) {
        const struct species *s = &sim->species[a];
        for (int64_t i = 0; i < s->n; i++) twice += s->mass[i] * pow(norm(s->vel[i]), 2);
        for (int b = 0; b <= a; b++) {
            const struct species *t = &sim->species[b];
#pragma omp parallel for reduction(- : energy) schedule(dynamic, 64)
            for (int64_t i = 0; i < s->n; i++)
                for (int64_t j = 0; j < (a == b ? i : t->n); j++) {
                    double d[3] = {s->pos[i][0] - t->pos[j][0], s->pos[i][1] - t->pos[j][1], s->pos[i][2] - t->pos[j][2]};
                    energy -= s->mass[i] * t->mass[j] / norm(d);
                }
        }
    }
    assert_float_equal(twice / -energy, 1, 0.03);
    generator_case_free(sim);
}

/* Energy and angular momentum of two points are the orbit's; spins point where inclination and azimuth say. */
static void test_orbit(void **state)
{
    (void)state;
    for (int bound = 0; bound < 2; bound++) {
        const char *keys = bound ? HALO "pericentre: 2, separation: 30, eccentricity: 0.9, disc_mass: 0.5, dark_share: 1, disc_share: 1"
                                 : HALO "pericentre: 2, separation: 30, disc_mass: 0.5, dark_share: 1, disc_share: 1, "
                                   "inclination_2: 1, azimuth_2: 0.5";
        struct sim *sim = generator_case_make(&merger_generator, keys, 8000, none);
        assert_int_equal(sim->problems.count, 0);
        const struct species *dark = &sim->species[DARK], *star = &sim->species[STAR];
        double x[3] = {0}, v[3] = {0}, total = 0, spin[2][3] = {{0}}, middle[2][3] = {{0}};
        for (int64_t i = 0; i < 4000; i++) {
            int g = i >= 2000;
            total += dark->mass[i] + star->mass[i];
            for (int k = 0; k < 3; k++) {
                v[k] += (g ? 1 : -1) * star->vel[i][k] / 2000;
                middle[g][k] += star->pos[i][k] / 2000;
            }
        }
        for (int k = 0; k < 3; k++) x[k] = (middle[1][k] - middle[0][k]);
        for (int64_t i = 0; i < 4000; i++)
            for (int k = 0; k < 3; k++) {
                int g = i >= 2000, p = (k + 1) % 3, q = (k + 2) % 3;
                double mean = g ? 0.5 : -0.5;
                spin[g][k] += (star->pos[i][p] - middle[g][p]) * (star->vel[i][q] - mean * v[q])
                            - (star->pos[i][q] - middle[g][q]) * (star->vel[i][p] - mean * v[p]);
            }
        double r = norm(x), energy = 0.5 * norm(v) * norm(v) - total / 30, turn = x[0] * v[1] - x[1] * v[0];
        assert_float_equal(r, 30, 0.2);     /* discs are not shifted to their centre of mass */
        assert_float_equal(energy, bound ? -total * 0.1 / 4 : 0, 1e-3 * total / 30);
        assert_float_equal(turn / sqrt(total * 2 * (bound ? 1.9 : 2)), 1, 0.01);
        assert_true(x[0] * v[0] + x[1] * v[1] < 0);
        const double i2 = bound ? PI / 3 : 1, w2 = bound ? -PI / 6 : 0.5;
        const double wanted[3] = {sin(i2) * cos(w2), sin(i2) * sin(w2), cos(i2)};
        for (int k = 0; k < 3; k++) assert_float_equal(spin[1][k] / norm(spin[1]), wanted[k], 0.01);
        generator_case_free(sim);
    }
    struct sim *sim = generator_case_make(&merger_generator, HALO "pericentre: 2, separation: 50, eccentricity: 0.8", 100, none);
    assert_int_equal(sim->problems.count, 1);   /* 18 is the largest distance of that orbit */
    mem_free(sim->problems.text);
    generator_case_free(sim);
}

/* One black hole at rest in the middle of each galaxy, with the ids of its galaxy: as far apart and as fast as the orbit. */
static void test_holes(void **state)
{
    (void)state;
    struct sim *sim = generator_case_make(&merger_generator, HALO "pericentre: 2, separation: 30, disc_mass: 0.5, dark_share: 1, "
                                          "disc_share: 1, holes: 1, hole_mass: 0.01", 401, none);
    const struct species *star = &sim->species[STAR];
    double x[3] = {0}, v[3] = {0}, total = 0;
    int64_t holes = 0, rows = 0;
    assert_int_equal(sim->problems.count, 0);
    for_species(sim, s)
        for (int64_t i = 0; i < s->n; i++) {
            total += s->mass[i];
            rows++;
        }
    for (int64_t i = 0; i < star->n; i++) {
        if (!star->hole[i]) continue;
        assert_int_equal(star->id[i], holes ? 401 : 201);       /* the last of each galaxy */
        assert_float_equal(star->mass[i], 0.01, 1e-15);
        for (int k = 0; k < 3; k++) x[k] += (holes ? 1 : -1) * star->pos[i][k];
        for (int k = 0; k < 3; k++) v[k] += (holes ? 1 : -1) * star->vel[i][k];
        holes++;
    }
    assert_int_equal(holes, 2);
    assert_int_equal(rows, 401);
    assert_float_equal(norm(x), 30, 1e-12);
    assert_float_equal(norm(v) * norm(v) / (2 * total / 30), 1, 1e-12);
    generator_case_free(sim);
}

static void test_refused(void **state)
{
    (void)state;
    static const char *const cases[] = {HALO "gas_mass: 1", HALO "disc_mass: 1, dark_share: 1", HALO "disc_mass: 1e-6",
        HALO "disc_mass: 1, dark_fixed: on", HALO "disc_mass: 1, holes: 1",
        HALO "disc_mass: 300, disc_radius: 0.05"};
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        struct sim *sim = generator_case_make(&galaxy_generator, cases[c], 1000, none);
        if (c < 5) assert_int_equal(sim->problems.count, 1);
        mem_free(sim->problems.text);
        generator_case_free(sim);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rotation), cmocka_unit_test(test_counts), cmocka_unit_test(test_disc),
        cmocka_unit_test(test_virial), cmocka_unit_test(test_orbit), cmocka_unit_test(test_holes),
        cmocka_unit_test(test_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
