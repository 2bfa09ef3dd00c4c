/* SPDX-License-Identifier: GPL-3.0-or-later
 * Hermite's schemes for one component. A scheme of order 2p knows p derivatives f^(0) to f^(p-1) of the acceleration
 * from the sources, at both ends of a step; the polynomial of degree 2p-1 through them is the acceleration in between.
 * Its integral is the corrector (Makino & Aarseth 1992, PASJ 44, 141, for p = 2; Nitadori & Makino 2008, New Astronomy
 * 13, 498, for p = 3 and 4), its higher derivatives at the end serve the predictor and the step. */
#ifndef TEPHRA_GRAVITY_HERMITE_SCHEME_H
#define TEPHRA_GRAVITY_HERMITE_SCHEME_H
#include "hermite_predict.h"

/* Integral over a step of length 1: sum_m weight[p][m] (f0^(m) + (-1)^m f1^(m)). */
static const double hermite_weight[HERMITE_P_MAX + 1][HERMITE_P_MAX] = {
    [2] = {1.0 / 2, 1.0 / 12},
    [3] = {1.0 / 2, 1.0 / 10, 1.0 / 120},
    [4] = {1.0 / 2, 3.0 / 28, 1.0 / 84, 1.0 / 1680},
};

/* Derivative k = p to 2p-1 at the end of a step of length 1: sum_m of [p][k-p][0][m] f0^(m) + [p][k-p][1][m] f1^(m). */
static const double hermite_end[HERMITE_P_MAX + 1][HERMITE_P_MAX][2][HERMITE_P_MAX] = {
    [2] = {{{6, 2}, {-6, 4}},
           {{12, 6}, {-12, 6}}},
    [3] = {{{-60, -24, -3}, {60, -36, 9}},
           {{-360, -168, -24}, {360, -192, 36}},
           {{-720, -360, -60}, {720, -360, 60}}},
    [4] = {{{840, 360, 60, 4}, {-840, 480, -120, 16}},
           {{10080, 4680, 840, 60}, {-10080, 5400, -1200, 120}},
           {{50400, 24480, 4680, 360}, {-50400, 25920, -5400, 480}},
           {{100800, 50400, 10080, 840}, {-100800, 50400, -10080, 840}}},
};

/* A quantity q at the end of a step, from itself and its p derivatives at the start and the end, d0 and d1. */
HD double hermite_integrate(int p, double q, const double *d0, const double *d1, double dt)
{
    double sum = 0;
    for (int m = p - 1; m >= 0; m--)
        sum = dt * (hermite_weight[p][m] * (m % 2 ? d0[m] - d1[m] : d0[m] + d1[m]) + sum);
    return q + sum;
}

/* Fills f1[p] to f1[2p-1] from the p derivatives at both ends. */
HD void hermite_interpolate(int p, const double *f0, double *f1, double dt)
{
    double power[HERMITE_DERIVATIVES] = {1};
    for (int m = 1; m < 2 * p; m++) power[m] = power[m - 1] * dt;
    for (int k = p; k < 2 * p; k++) {
        const double *at0 = hermite_end[p][k - p][0], *at1 = hermite_end[p][k - p][1];
        double sum = 0;
        for (int m = 0; m < p; m++) sum += power[m] * (at0[m] * f0[m] + at1[m] * f1[m]);
        f1[k] = sum / power[k];
    }
}
#endif
