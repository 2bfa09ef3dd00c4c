/* SPDX-License-Identifier: GPL-3.0-or-later
 * Condensation and evaporation: closed forms against the rates in kg/s integrated step by step, trajectories and a closed
 * box worked out elsewhere, the end of a cloud, no chatter where the branches meet. */
#include "physics/conduction.h"
#include "constants.h"
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

static const struct conduction smooth = {50, 0.5, 1, false}, sharp = {50, 0.5, 1, true};

/* As printed: kg/s with T in K and h in pc. */
static double printed_rate(double T, double n, double m)
{
    double h = 50 * sqrt(m / 1e6), s = pow(T / 1.54e7, 2) / (n * h), kg = 1e3 * CONST_YEAR / CONST_M_SUN;
    if (s < 0.03) return 0.825 * pow(T, 2.5) * h / s * kg;
    return -27.5 * pow(T, 2.5) * h * (s > 1 ? pow(s, -0.625) : 1) * kg;
}

/* Midpoint steps, many. */
static double by_steps(double T, double n, double m, double time)
{
    enum { STEPS = 200000 };
    for (int k = 0; k < STEPS && m > 0; k++) {
        double half = m + 0.5 * time / STEPS * printed_rate(T, n, m);
        m += time / STEPS * printed_rate(T, n, half > 0 ? half : m);
    }
    return m;
}

static void near(double got, double wanted, double part)
{
    if (!(fabs(got - wanted) <= part * fabs(wanted))) print_message("%.10g, %.10g expected\n", got, wanted);
    assert_true(fabs(got - wanted) <= part * fabs(wanted));
}

static void test_fixed_bath(void **unused)
{
    (void)unused;
    const struct { double T, n, m, time; } cases[] = {{1e7, 0.01, 1e5, 5e7}, {1e6, 0.01, 1e4, 2e9}, {1e6, 0.01, 1e4, 8.5e9},
                                                      {1e6, 0.1, 1e5, 1e9}, {5e4, 0.1, 1e3, 1e9}, {3e6, 0.001, 1e6, 1e8}};
    for (int c = 0; c < 6; c++)
        near(conduction_advance(&sharp, cases[c].T, cases[c].n, cases[c].m, cases[c].time),
             by_steps(cases[c].T, cases[c].n, cases[c].m, cases[c].time), 1e-6);
    near(conduction_advance(&smooth, 1e7, 0.01, 1e5, 5e7), 53449, 1e-5);
    near(conduction_advance(&smooth, 1e6, 0.01, 1e4, 2e9), 6111.8, 1e-5);
    assert_true(conduction_advance(&smooth, 1e7, 0.01, 1e5, 4.511e8) > 0 && conduction_advance(&smooth, 1e7, 0.01, 1e5, 4.513e8) == 0);
    near(conduction_advance(&smooth, 1e6, 0.01, 1e4, 8.392e9), 71.12, 2e-3);
    assert_true(conduction_advance(&smooth, 1e6, 0.01, 1e4, 1.045e10) > 0 && conduction_advance(&smooth, 1e6, 0.01, 1e4, 1.046e10) == 0);
    assert_true(conduction_advance(&smooth, 9e4, 1e-6, 1e2, 1e9) > 1e2);     /* below 1e5 K nothing evaporates */
    near(conduction_advance(&smooth, 1e6, 0.1, 1e6, 1.29e9), 2.718e6, 5e-3);
}

/* The blend: fine parts of a time and the whole; where the branches are equal nothing moves. */
static void test_blend(void **unused)
{
    (void)unused;
    double T = 1e6, n = 0.01, m = 1e4 * 9, whole = conduction_advance(&smooth, T, n, m, 1e9), parts = m;
    double s = conduction_sigma(&smooth, T, n, m);
    assert_true(s > 0.015 && s < 0.06);
    for (int k = 0; k < 1000; k++) parts = conduction_advance(&smooth, T, n, parts, 1e6);
    near(parts, whole, 1e-7);
    double even = 1e6 * pow(pow(T / 1.54e7, 2) / (n * 0.03) / 50, 2);
    assert_true(fabs(conduction_rate(&smooth, T, n, even)) < 1e-9 * fabs(conduction_rate(&sharp, T, n, even * 1.01)));
    near(conduction_rate(&sharp, T, n, 1.0001 * even), -conduction_rate(&sharp, T, n, 0.9999 * even), 1e-3);
}

/* One cloud and as much gas in a fixed volume. */
static void test_closed_box(void **unused)
{
    (void)unused;
    const double times[4] = {1e8, 1e9, 3e9, 1e10};
    const struct { double T, n, m, cloud[4], end; } rows[3] = {
        {3e6, 0.01, 1e4, {7624, 1563, 0, 0}, 1.5e6}, {5e5, 0.1, 1e5, {1.0548e5, 1.4997e5, 1.9284e5, 1.9842e5}, 5e5},
        {1e7, 0.01, 1e5, {3.425e4, 0, 0, 0}, 5e6}};
    for (int r = 0; r < 3; r++)
        for (int k = 0; k < 4; k++) {
            struct conduction_zones z = {rows[r].m, rows[r].m, rows[r].T, rows[r].n, 30.5};
            conduction_zones(&smooth, &z, times[k]);
            near(z.cloud, rows[r].cloud[k], 0.01);
            near(z.cloud + z.gas, 2 * rows[r].m, 1e-12);
            if (k == 3) near(z.T, rows[r].end, 1e-4);
            if (k == 3 && r == 1) near(conduction_sigma(&smooth, z.T, z.n, z.cloud), 0.03, 0.01);
        }
}

/* At the place where condensation and evaporation balance, by steps of any length: within 1 % of it, and never back and forth. */
static void test_no_chatter(void **unused)
{
    (void)unused;
    const struct conduction *laws[2] = {&smooth, &sharp};
    const double steps[3] = {1e6, 1e8, 3e9};
    for (int l = 0; l < 2; l++)
        for (int s = 0; s < 3; s++) {
            struct conduction_zones z = {1e5, 1e5, 5e5, 0.1, 30.5};
            int turns = 0;
            double last = 0;
            for (double t = 0; t < 6e10; t += steps[s] < 1e8 ? 20 * steps[s] : steps[s]) {
                double before = z.cloud;
                for (int k = 0; k < (steps[s] < 1e8 ? 20 : 1); k++) conduction_zones(laws[l], &z, steps[s]);
                turns += (z.cloud - before) * last < 0;
                if (z.cloud != before) last = z.cloud - before;
            }
            print_message("%s, steps of %.0e yr: sigma_0 ends at %.5f\n", l ? "sharp" : "smooth", steps[s],
                          conduction_sigma(laws[l], z.T, z.n, z.cloud));
            near(conduction_sigma(laws[l], z.T, z.n, z.cloud), 0.03, 0.01);
            assert_int_equal(turns, 0);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_fixed_bath), cmocka_unit_test(test_blend),
                                       cmocka_unit_test(test_closed_box), cmocka_unit_test(test_no_chatter)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
