/* SPDX-License-Identifier: GPL-3.0-or-later
 * Both integrators in the double reference path, against their exact amplification on a harmonic
 * oscillator and against measured energy errors of Kepler orbits started at apocentre (the table of
 * doc/manual/integrators.md). */
#include "integrate.h"
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

struct state { double x[2], v[2], a[2]; };


static void oscillator(struct state *s, double omega)
{
    for (int k = 0; k < 2; k++) s->a[k] = -omega * omega * s->x[k];
}

static void kepler(struct state *s, double gm)
{
    double r2 = s->x[0] * s->x[0] + s->x[1] * s->x[1], r3 = r2 * sqrt(r2);
    for (int k = 0; k < 2; k++) s->a[k] = -gm * s->x[k] / r3;
}

enum { LEAPFROG, PEC, PEC_TWICE };

static void step(struct state *s, void (*f)(struct state *, double), double strength, double dt, int pec)
{
    double old[2] = {s->a[0], s->a[1]};
    for (int k = 0; k < 2; k++) {
        s->x[k] = integrate_position(s->x[k], s->v[k], old[k], dt);
        s->v[k] = integrate_velocity(s->v[k], old[k], dt);
    }
    f(s, strength);
    for (int k = 0; k < 2; k++) {
        double change = integrate_correction(old[k], s->a[k], dt);
        s->v[k] += change;
        if (pec) s->x[k] += integrate_shift(change, dt);
    }
    if (pec == PEC_TWICE) f(s, strength);
}

static double kepler_energy(const struct state *s)
{
    return 0.5 * (s->v[0] * s->v[0] + s->v[1] * s->v[1]) - 1 / hypot(s->x[0], s->x[1]);
}

/* Ten orbits of semi-major axis 1; the relative energy change at the end and the largest on the way. */
static void orbit(double e, int steps, int pec, double *end, double *largest)
{
    struct state s = {{1 + e, 0}, {0, sqrt((1 - e) / (1 + e))}, {0, 0}};
    kepler(&s, 1);
    double start = kepler_energy(&s);
    *largest = 0;
    for (int i = 0; i < 10 * steps; i++) {
        step(&s, kepler, 1, 2 * M_PI / steps, pec);
        *end = (kepler_energy(&s) - start) / fabs(start);
        *largest = fmax(*largest, fabs(*end));
    }
}

/* References of both tables: kick-drift-kick as kicks and drifts, and Heun's scheme with both velocities, in a script of
 * some lines elsewhere: the same maps in other words, to five digits.
 * pec loses energy secularly; the figures fall as the cube of the step. */
static void test_pec_kepler(void **unused)
{
    (void)unused;
    const struct { double e; int steps, pec; double change; } table[] = {
        {0, 100, PEC, -8.0411e-3}, {0, 200, PEC, -9.7815e-4}, {0, 400, PEC, -1.2183e-4},
        {0.5, 100, PEC, -1.7309e-1}, {0.5, 200, PEC, -1.8786e-2}, {0.5, 400, PEC, -2.3295e-3},
        {0.5, 100, PEC_TWICE, -8.8916e-2}, {0.5, 200, PEC_TWICE, -9.3591e-3}, {0.5, 400, PEC_TWICE, -1.1639e-3},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        double end = 0, largest;
        orbit(table[i].e, table[i].steps, table[i].pec, &end, &largest);
        assert_true(fabs(end / table[i].change - 1) < 0.001);
    }
}

/* Kick-drift-kick errs within an orbit and comes back. */
static void test_leapfrog_kepler(void **unused)
{
    (void)unused;
    const struct { int steps; double largest, end; } table[] = {
        {50, 3.9001e-2, 2e-7}, {100, 1.0322e-2, 6e-9}, {200, 2.6189e-3, 1e-10}, {400, 6.5716e-4, 2e-12},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        double end = 0, largest;
        orbit(0.5, table[i].steps, 0, &end, &largest);
        assert_true(fabs(largest / table[i].largest - 1) < 0.001);
        assert_true(fabs(end) < table[i].end);
    }
}

/* Largest of |x|, |v|/omega after many steps from (1, 0), in units of the start. */
static double growth(double z, int steps, int pec)
{
    struct state s = {{1, 0}, {0, 0}, {0, 0}};
    oscillator(&s, 1);
    for (int i = 0; i < steps && fabs(s.x[0]) < 1e30; i++) step(&s, oscillator, 1, z, pec);
    return fmax(fabs(s.x[0]), fabs(s.v[0]));
}

/* Stable up to omega dt = 2 (leapfrog), sqrt 2 (pec), 2 (pec evaluated twice), unstable beyond. */
static void test_stability_limits(void **unused)
{
    (void)unused;
    const double limit[3] = {2, sqrt(2), 2};
    for (int pec = 0; pec < 3; pec++) {
        assert_true(growth(0.99 * limit[pec], 20000, pec) < 20);
        assert_true(growth(1.01 * limit[pec], 20000, pec) > 1e6);
    }
}

/* Energy lost in a period of the oscillator, for small z: (pi/2) z^3 by pec, half of it if evaluated twice,
 * by leapfrog nothing. */
static void test_oscillator_drift(void **unused)
{
    (void)unused;
    int steps = 63 * 16;
    double z = 2 * M_PI / steps;
    for (int pec = 0; pec < 3; pec++) {
        struct state s = {{1, 0}, {0, 0}, {0, 0}};
        oscillator(&s, 1);
        for (int i = 0; i < 100 * steps; i++) step(&s, oscillator, 1, z, pec);
        double lost = 1 - (s.x[0] * s.x[0] + s.v[0] * s.v[0]);
        double expected = 1 - exp(-100 * M_PI / (2 * fmax(pec, 1)) * z * z * z);
        if (pec) assert_true(fabs(lost / expected - 1) < 0.01);
        else assert_true(fabs(lost) < 1e-4 * z);
    }
}

/* The internal energy stays positive whatever its rate, and follows small rates exactly. */
static void test_energy_positive(void **unused)
{
    (void)unused;
    assert_true(integrate_energy(1, -0.25f, 1) == 0.75f);
    assert_true(integrate_energy(1, 3, 1) == 4);
    for (float du = -1; du > -1e38f; du *= 10) {
        float u = integrate_energy(1, du, 1);
        assert_true(u > 0 && u < 0.5f);
    }
    float below = integrate_energy(1, -0.5001f, 1), above = integrate_energy(1, -0.4999f, 1);
    assert_true(fabsf((above - below) / 2e-4f - 1) < 0.01f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_pec_kepler), cmocka_unit_test(test_leapfrog_kepler),
        cmocka_unit_test(test_stability_limits), cmocka_unit_test(test_oscillator_drift),
        cmocka_unit_test(test_energy_positive),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
