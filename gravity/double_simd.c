/* SPDX-License-Identifier: GPL-3.0-or-later
 * Pair sums in double, for references: sources in lanes, left to the compiler's vectoriser. Here
 * `real` is a double although a vector header was included first. */
#include <math.h>
#define real           double
#define REAL_GUESS     0
#define real_splat     double_splat
#define real_rsqrt_guess double_rsqrt
#define real_max       double_max
#define real_if_less   double_if_less
HD double double_splat(double x) { return x; }
HD double double_rsqrt(double x) { return 1 / sqrt(x); }
HD double double_max(double a, double b) { return a > b ? a : b; }
HD double double_if_less(double a, double b, double x, double y) { return a < b ? x : y; }
#undef REAL_FLOOR
#define REAL_FLOOR 1e-150
#include "pair.h"
#include "kernels.h"

HD void double_row(double sum[4], const double target[4], const struct gravity_exact *s, enum softening_form form)
{
    double ax = 0, ay = 0, az = 0, depth = 0;
#pragma omp simd reduction(+ : ax, ay, az, depth)
    for (int j = 0; j < s->n; j++) {
        double dx = s->x[j] - target[0], dy = s->y[j] - target[1], dz = s->z[j] - target[2];
        struct pair p = pair_any(form, dx * dx + dy * dy + dz * dz, s->mass[j], s->soft[j] + target[3]);
        ax += p.pull * dx;
        ay += p.pull * dy;
        az += p.pull * dz;
        depth += p.depth;
    }
    sum[0] += PAIR_PULL * ax;
    sum[1] += PAIR_PULL * ay;
    sum[2] += PAIR_PULL * az;
    sum[3] += PAIR_DEPTH * depth;
}

#define EXACT(name, form) \
    static void name(double sum[4], const double target[4], const struct gravity_exact *s) { double_row(sum, target, s, form); }
EXACT(plummer, SOFT_PLUMMER)
EXACT(spline, SOFT_SPLINE)

const struct gravity_exact_table SIMD_NAME(gravity_exact_table) = { { plummer, plummer, spline } };
