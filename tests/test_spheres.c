/* SPDX-License-Identifier: GPL-3.0-or-later
 * Spheres in equilibrium: profiles against their own derivatives, Eddington's inversion against the distribution
 * functions known in closed form, drawn rows against Jeans' equation and the virial theorem, what is refused. */
#include "generator_case.h"
#include "ics/equilibrium.h"
#include <math.h>
#include <omp.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

extern const struct generator spheres_generator;
static const double PI = 3.14159265358979323846, none[3] = {0, 0, 0};

static double radius(int i) { return exp(log(1e-5) + i * log(1e10) / (EQUILIBRIUM_POINTS - 1)); }

/* Differences across a small interval against the closed forms, inside and beyond the cut. */
static void test_profiles(void **state)
{
    (void)state;
    for (int form = 0; form < 4; form++)
        for (int cut = form == RADIAL_NFW; cut < 2; cut++) {
            struct radial p = {.form = (enum radial_form)form, .mass = 3, .radius = 0.7, .cut = cut ? 5 : NAN};
            radial_prepare(&p);
            for (double r = 0.01; r < 15; r *= 1.37) {
                double d = 1e-4 * r;
                struct radial_point a = radial_at(&p, r - d), at = radial_at(&p, r), b = radial_at(&p, r + d);
                assert_float_equal((b.mass - a.mass) / (2 * d * 4 * PI * r * r * at.rho), 1, 1e-4);
                assert_float_equal((a.outer - b.outer) / (2 * d * 4 * PI * r * at.rho), 1, 1e-4);
                assert_float_equal(log(b.rho / a.rho) / (2 * d * at.slope), 1, 1e-5);
                assert_float_equal((b.slope - a.slope) / (2 * d * at.bend), 1, 1e-3);
            }
            double whole = radial_at(&p, cut ? 5 : 1e6).mass, end = radial_at(&p, radial_end(&p)).mass;
            if (!cut || form == RADIAL_NFW) assert_float_equal(whole, 3, 1e-4);
            if (cut) assert_float_equal(radial_at(&p, 5.000001).outer / radial_at(&p, 4.999999).outer, 1, 1e-5);
            assert_true(end <= 1.35 * whole);
        }
}

/* Hernquist 1990, eq. 17, and Plummer's psi^(7/2) with its coefficient (Binney & Tremaine 2008, eq. 4.83). */
static double hernquist_f(double energy)
{
    double q = sqrt(energy), rest = 1 - q * q;
    return 1 / (8 * sqrt(2) * PI * PI * PI) * pow(rest, -2.5)
        * (3 * asin(q) + q * sqrt(rest) * (1 - 2 * q * q) * (8 * q * q * q * q - 8 * q * q - 3));
}

static double plummer_f(double energy) { return 24 * sqrt(2) / (7 * PI * PI * PI) * pow(energy, 3.5); }

static void test_inversion(void **state)
{
    (void)state;
    double (*const exact[])(double) = {[RADIAL_HERNQUIST] = hernquist_f, [RADIAL_PLUMMER] = plummer_f};
    const enum radial_form forms[] = {RADIAL_HERNQUIST, RADIAL_PLUMMER};
    struct equilibrium_part *part = mem_alloc("test", sizeof *part);
    for (int k = 0; k < 2; k++) {
        struct radial p = {.form = forms[k], .mass = 1, .radius = 1, .cut = NAN};
        struct equilibrium *all = equilibrium_new(1, &p, 1);
        assert_true(equilibrium_velocities(all, 0, part));
        for (int i = 0; i < EQUILIBRIUM_POINTS; i++) {
            double r = radius(i), psi = forms[k] == RADIAL_HERNQUIST ? 1 / (1 + r) : 1 / sqrt(1 + r * r);
            if (r > 1e3) break;
            assert_float_equal(all->psi[i] / psi, 1, 1e-9);
            if (r > 0.01) assert_float_equal(part->f[i] / exact[forms[k]](psi), 1, 2e-3);
        }
        mem_free(all);
    }
    mem_free(part);
}

static double norm(const double x[3]) { return sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]); }

static double potential_energy(const struct sim *sim, double G)
{
    double energy = 0;
    for (int a = 0; a < N_SPECIES; a++)
        for (int b = 0; b <= a; b++) {
            const struct species *s = &sim->species[a], *t = &sim->species[b];
#pragma omp parallel for reduction(- : energy) schedule(dynamic, 64)
            for (int64_t i = 0; i < s->n; i++)
                for (int64_t j = 0; j < (a == b ? i : t->n); j++) {
                    double d[3] = {s->pos[i][0] - t->pos[j][0], s->pos[i][1] - t->pos[j][1], s->pos[i][2] - t->pos[j][2]};
                    energy -= G * s->mass[i] * t->mass[j] / norm(d);
                }
        }
    return energy;
}

#define THREE "dark_profile: nfw, dark_mass: 20, dark_radius: 3, dark_cut: 30, star_mass: 1, star_radius: 0.3, " \
              "gas_mass: 2, gas_radius: 2, gas_cut: 25, dark_share: 6, star_share: 3, gas_share: 1"

/* Twice the kinetic energy and three times the integral of P are minus the potential energy; the velocities
 * have no direction; dispersions are those of Jeans' equation, (1/rho) int rho G M/r^2 dr. */
static void test_equilibrium(void **state)
{
    (void)state;
    struct sim *sim = generator_case_make(&spheres_generator, THREE, 20000, none);
    const struct species *dark = &sim->species[DARK], *star = &sim->species[STAR], *gas = &sim->species[GAS];
    assert_int_equal(sim->problems.count, 0);
    assert_int_equal(dark->n, 12000);
    assert_int_equal(star->n, 6000);
    assert_int_equal(gas->n, 2000);
    double twice = 0, squares[3] = {0};
    for (int s = 0; s < N_SPECIES; s++)
        for (int64_t i = 0; i < sim->species[s].n; i++) {
            const struct species *t = &sim->species[s];
            twice += t->mass[i] * pow(norm(t->vel[i]), 2) + (t->u ? 2 * t->mass[i] * (double)t->u[i] : 0);
        }
    assert_float_equal(twice / -potential_energy(sim, 1), 1, 0.02);
    const struct radial parts[] = {{.form = RADIAL_NFW, .mass = 20, .radius = 3, .cut = 30},
                                    {.form = RADIAL_HERNQUIST, .mass = 1, .radius = 0.3, .cut = NAN},
                                    {.form = RADIAL_HERNQUIST, .mass = 2, .radius = 2, .cut = 25}};
    struct equilibrium *all = equilibrium_new(1, parts, 3);
    struct equilibrium_part *part = mem_alloc("test", sizeof *part);
    equilibrium_temperatures(all, 1, part);     /* of gas in the stars' place: their sigma^2 */
    double sum = 0, wanted = 0, radial = 0;
    int64_t within = 0;
    for (int64_t i = 0; i < star->n; i++) {
        double r = norm(star->pos[i]), along = 0, place = (log(r) - all->first) / all->step;
        for (int k = 0; k < 3; k++) {
            squares[k] += star->vel[i][k] * star->vel[i][k];
            along += star->vel[i][k] * star->pos[i][k] / r;
        }
        if (r < 0.1 || r > 3) continue;
        sum += pow(norm(star->vel[i]), 2) / 3;
        radial += along * along;
        wanted += part->u[(int)place];
        within++;
    }
    assert_true(within > 3000);
    assert_float_equal(sum / wanted, 1, 0.03);
    assert_float_equal(radial / sum, 1, 0.05);
    mem_free(part);
    mem_free(all);
    generator_case_free(sim);
}

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Rows by radius against the mass within; rows come from their ids, whatever the threads. */
static void test_rows(void **state)
{
    (void)state;
    const int64_t n = 50000;
    omp_set_num_threads(1);
    struct sim *sim = generator_case_make(&spheres_generator, "dark_mass: 2, dark_radius: 0.5", n, none);
    omp_set_num_threads(3);
    struct sim *again = generator_case_make(&spheres_generator, "dark_mass: 2, dark_radius: 0.5", n, none);
    const struct species *dark = &sim->species[DARK];
    assert_memory_equal(dark->pos, again->species[DARK].pos, (size_t)n * sizeof *dark->pos);
    assert_memory_equal(dark->vel, again->species[DARK].vel, (size_t)n * sizeof *dark->vel);
    double *r = mem_array("test", double, n), gap = 0;
    for (int64_t i = 0; i < n; i++) r[i] = norm(dark->pos[i]);
    qsort(r, (size_t)n, sizeof *r, compare);
    for (int64_t i = 0; i < n; i++) gap = fmax(gap, fabs((i + 0.5) / (double)n - pow(r[i] / (r[i] + 0.5), 2)));
    assert_true(gap < 2 / sqrt((double)n));     /* Kolmogorov: one chance in 1500 */
    mem_free(r);
    generator_case_free(sim);
    generator_case_free(again);
}

static void test_counts(void **state)
{
    (void)state;
    static const int64_t counts[] = {3, 4, 17, 1001};
    for (int c = 0; c < 4; c++) {
        struct sim *sim = generator_case_make(&spheres_generator,
            "dark_mass: 1, star_mass: 1, gas_mass: 1, star_radius: 0.5, gas_radius: 2", counts[c], none);
        int64_t n = 0, ids = 0;
        for_species(sim, s) {
            n += s->n;
            for (int64_t i = 0; i < s->n; i++) ids += (int64_t)s->id[i];
        }
        assert_int_equal(n, counts[c]);
        assert_int_equal(ids, n * (n + 1) / 2);
        generator_case_free(sim);
    }
}

static void test_refused(void **state)
{
    (void)state;
    static const char *const cases[] = {"", "dark_profile: nfw, dark_mass: 1",
        "dark_mass: 1, dark_share: 2, star_mass: 1",
        "dark_profile: nfw, dark_mass: 100, dark_cut: 10, star_profile: plummer, star_mass: 0.01, star_radius: 0.2"};
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        struct sim *sim = generator_case_make(&spheres_generator, cases[c], 1000, none);
        assert_int_equal(sim->problems.count, 1);
        mem_free(sim->problems.text);
        generator_case_free(sim);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_profiles), cmocka_unit_test(test_inversion), cmocka_unit_test(test_equilibrium),
        cmocka_unit_test(test_rows), cmocka_unit_test(test_counts), cmocka_unit_test(test_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
