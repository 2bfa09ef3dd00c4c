/* SPDX-License-Identifier: GPL-3.0-or-later
 * Hermite's schemes: the coefficients on polynomials, and the pair sums against derivatives found by other
 * means (power series in long double). Whole runs: check-hermite.sh. */
#include "../gravity/hermite_scheme.h"
#include "../gravity/gravity.h"
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

/* Derivatives 0 to n-1 at t of the polynomial with coefficients c[0 .. degree]. */
static void derive(const double *c, int degree, double t, double *d, int n)
{
    for (int k = 0; k < n; k++) {
        d[k] = 0;
        for (int m = degree; m >= k; m--) {
            double factor = 1;
            for (int j = 0; j < k; j++) factor *= m - j;
            d[k] += factor * c[m] * pow(t, m - k);
        }
    }
}

/* A polynomial of degree 2p-1 is integrated and interpolated without error, one of degree 2p is not. */
static void test_coefficients(void **state)
{
    (void)state;
    for (int p = HERMITE_P_MIN; p <= HERMITE_P_MAX; p++)
        for (int more = 0; more < 2; more++) {
            const double t0 = 0.3, t1 = 0.7;
            const int degree = 2 * p - 1 + more;
            double c[10], f0[8], f1[8], exact[8], integral = 0;
            for (int m = 0; m <= degree; m++) {
                c[m] = 1 / (1.0 + m) * (m % 3 ? 1 : -1);
                integral += c[m] * (pow(t1, m + 1) - pow(t0, m + 1)) / (m + 1);
            }
            derive(c, degree, t0, f0, p);
            derive(c, degree, t1, exact, 2 * p);
            memcpy(f1, exact, sizeof f1);
            hermite_interpolate(p, f0, f1, t1 - t0);
            double error = fabs(hermite_integrate(p, 5, f0, f1, t1 - t0) - 5 - integral);
            assert_true(more ? error > 1e-10 : error < 4e-15);
            for (int k = p; k < 2 * p; k++)
                assert_true(more ? fabs(f1[k] - exact[k]) > 1e-6 : fabs(f1[k] - exact[k]) <= 1e-9 * (1 + fabs(exact[k])));
        }
    const double d[4] = {1, 2, 3, 4};
    assert_true(fabs(hermite_taylor(d, 4, 0.5) - (1 + 2 * 0.5 + 3 * 0.125 + 4 * 0.125 / 6)) < 1e-15);
}

/* --- pair sums --- */

enum { TERMS = 4, ROWS = 61 };

/* Acceleration along each axis and its derivatives by power series in t: r(t), then q = r.r + eps2, then q^(-3/2) from
 * q u' = -3/2 q' u, then products. */
static void series_pair(long double r[3][TERMS], long double mass, long double eps2, long double sum[TERMS][3])
{
    long double q[TERMS] = {0}, u[TERMS];
    for (int n = 0; n < TERMS; n++)
        for (int k = 0; k < 3; k++)
            for (int m = 0; m <= n; m++) q[n] += r[k][m] * r[k][n - m];
    q[0] += eps2;
    if (q[0] == 0) return;
    u[0] = powl(q[0], -1.5L);
    for (int n = 1; n < TERMS; n++) {
        u[n] = 0;
        for (int m = 1; m <= n; m++) u[n] += (-1.5L * m - (n - m)) * q[m] * u[n - m] / (n * q[0]);
    }
    long double factorial = 1;
    for (int n = 0; n < TERMS; n++) {
        if (n > 1) factorial *= n;
        for (int k = 0; k < 3; k++)
            for (int m = 0; m <= n; m++) sum[n][k] += mass * factorial * r[k][m] * u[n - m];
    }
}

static double draw(unsigned *seed)
{
    *seed = *seed * 1664525u + 1013904223u;
    return *seed / 4294967296.0 - 0.5;
}

/* Rows that move, some at one place and some with no softening; targets are rows too. */
static void test_pair_sums(void **state)
{
    (void)state;
    enum { ROOM = 64 };
    static double column[14][ROOM];
    static float narrow[14][ROOM];
    static const double most[3] = {3e-7, 6e-7, 2e-6};     /* in floats */
    double worst[TERMS] = {0};
    static const double power[TERMS] = {1, 1, 0.5, 1.0 / 6};
    for (int bare = 0; bare < 2; bare++) {
        struct hermite_rows rows = {.n = ROWS, .mass = column[12], .soft = column[13]};
        unsigned seed = 5;
        memset(column, 0, sizeof column);
        for (int k = 0; k < 3; k++) {
            double **const part[4] = {&rows.pos[k], &rows.vel[k], &rows.acc[k], &rows.jerk[k]};
            for (int d = 0; d < 4; d++) *part[d] = column[3 * d + k];
            for (int d = 0; d < 4; d++)
                for (int i = 0; i < ROWS; i++) (*part[d])[i] = draw(&seed) * (d + 1);
            rows.pos[k][7] = rows.pos[k][3];    /* two at one place, which move apart */
        }
        for (int i = 0; i < ROOM; i++) {
            rows.mass[i] = i < ROWS ? 1 + draw(&seed) : 0;
            rows.soft[i] = bare ? (i % 5 == 0) * 1e-4 : 1e-4;
        }
        rows.soft[3] = rows.soft[7] = bare ? 0 : 1e-4;
        struct hermite_floats floats = {.mass = narrow[12], .soft = narrow[13]};
        for (int k = 0; k < 3; k++) {
            float **const part[4] = {&floats.high[k], &floats.low[k], &floats.vel[k], &floats.acc[k]};
            for (int d = 0; d < 4; d++) *part[d] = narrow[3 * d + k];
        }
        for (int i = 0; i < ROOM; i++) {
            for (int k = 0; k < 3; k++) {
                floats.high[k][i] = (float)rows.pos[k][i];
                floats.low[k][i] = (float)(rows.pos[k][i] - (double)floats.high[k][i]);
                floats.vel[k][i] = (float)rows.vel[k][i];
                floats.acc[k][i] = (float)rows.acc[k][i];
            }
            floats.mass[i] = (float)rows.mass[i];
            floats.soft[i] = (float)rows.soft[i];
        }
        for (int isa = 0; isa < N_ISA; isa++) {
            if (!isa_runs((enum isa)isa)) continue;
            const struct gravity_kernels *kernels = gravity_kernels_find((enum isa)isa);
            const struct hermite_table *table = kernels->hermite;
            for (int i = 0; i < ROWS; i++) {
                long double exact[TERMS][3] = {{0}};
                double target[13], size[TERMS] = {0};
                for (int k = 0; k < 3; k++)
                    for (int d = 0; d < 4; d++) target[3 * d + k] = column[3 * d + k][i];
                target[12] = rows.soft[i];
                for (int j = 0; j < ROWS; j++) {
                    long double r[3][TERMS], one[TERMS][3] = {{0}};
                    for (int k = 0; k < 3; k++)
                        for (int d = 0; d < TERMS; d++)
                            r[k][d] = power[d] * ((long double)column[3 * d + k][j] - (long double)target[3 * d + k]);
                    if (j != i) series_pair(r, rows.mass[j], (long double)rows.soft[j] + (long double)target[12], one);
                    for (int d = 0; d < TERMS; d++)
                        for (int k = 0; k < 3; k++) {
                            exact[d][k] += one[d][k];
                            size[d] += (double)fabsl(one[d][k]);
                        }
                }
                for (int derivatives = 2; derivatives <= TERMS; derivatives++) {
                    const int form = derivatives - 2;
                    double sum[3 * TERMS], sum_float[3 * TERMS] = {0};
                    table->sum[bare][form](sum, target, &rows, 0, ROWS);
                    const bool also = derivatives < 4;
                    if (also) kernels->hermite_float->sum[bare][form](sum_float, target, &floats, 0, ROWS);
                    for (int d = 0; d < derivatives; d++)
                        for (int k = 0; k < 3; k++) {
                            const double e = (double)exact[d][k], off = fabs(sum[3 * d + k] - e), off_float = also ? fabs(sum_float[3 * d + k] - e) : 0;
                            if (off > 2e-14 * size[d] || (also && off_float > most[d] * size[d]))
                                fail_msg("isa %d, %d derivatives, row %d: derivative %d is %.17g, in floats %.17g, not %.17g", isa,
                                         derivatives, i, d, sum[3 * d + k], sum_float[3 * d + k], e);
                            worst[d] = fmax(worst[d], off_float / size[d]);
                        }
                }
            }
        }
    }
    print_message("pairs in floats: largest errors %.2g %.2g %.2g of the sums of absolute terms\n", worst[0], worst[1], worst[2]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_coefficients), cmocka_unit_test(test_pair_sums)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
