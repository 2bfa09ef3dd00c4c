/* SPDX-License-Identifier: GPL-3.0-or-later
 * Acceleration, jerk and snap in floats: positions are sums of two floats, so that their differences keep all digits of a
 * float however close two rows are, and the sums are promoted to doubles every CHUNK vectors of sources. One target and
 * a vector of sources at a time, as in hermite_simd.c. */
#include "pair.h"
#include "kernels.h"

enum { CHUNK = 64 };

struct float_target { real high[3], low[3], vel[3], acc[3], soft; };

HD struct float_target target_of(const double target[13])
{
    struct float_target t;
    for (int k = 0; k < 3; k++) {
        float high = (float)target[k];
        t.high[k] = real_splat(high);
        t.low[k] = real_splat((float)(target[k] - (double)high));
        t.vel[k] = real_splat((float)target[3 + k]);
        t.acc[k] = real_splat((float)target[6 + k]);
    }
    t.soft = real_splat((float)target[12]);
    return t;
}

HD real rates_dot(const real a[3], const real b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* sqrt(3/r2): the root of 3 is in the coefficients of Newton's step, rounded; its cube is taken out of the sums as it is. */
static const float newton[2] = { (float)(1.5 * PAIR_ROOT3), (float)(0.5 * PAIR_ROOT3) };

HD real rates_root(real r2)
{
    real y = real_rsqrt_guess(r2);
    return y * (newton[0] - newton[1] * r2 * y * y);
}

HD double rates_factor(void)
{
    double root = (double)newton[0] - (double)newton[1];
    return 1 / (root * root * root);
}

struct rates { real f[3][3]; };

/* The sources of one vector, added. derivatives and bare: as in hermite_simd.c, literals where the kernels are made. */
HD void rates_add(struct rates *sum, const struct float_target *t, const struct hermite_floats *s, int64_t j, int derivatives,
                  int bare)
{
    real r[3], v[3], a[3], zero = { 0 }, second = zero;
    for (int k = 0; k < 3; k++) {
        r[k] = real_whole(simd_load(s->high[k] + j) - t->high[k]) + (simd_load(s->low[k] + j) - t->low[k]);
        v[k] = simd_load(s->vel[k] + j) - t->vel[k];
        if (derivatives > 2) a[k] = simd_load(s->acc[k] + j) - t->acc[k];
    }
    real mass = simd_load(s->mass + j), r2 = rates_dot(r, r) + (simd_load(s->soft + j) + t->soft);
    if (bare) {
        mass = real_if_less(zero, r2, mass, zero);
        r2 = real_max(r2, real_splat(REAL_FLOOR));
    }
    if (derivatives > 2) second = rates_dot(v, v) + rates_dot(r, a);
    struct pair_rates p = pair_rates(derivatives, rates_root(r2), mass, rates_dot(r, v), second, zero);
    real alpha3 = real_whole(p.alpha3), alpha6, beta3;
    if (derivatives > 2) {
        alpha6 = real_whole(alpha3 + alpha3);
        beta3 = real_whole(p.beta3);
    }
    for (int k = 0; k < 3; k++) {
        sum->f[0][k] += p.pull * r[k];
        real jerk = v[k] - alpha3 * r[k];
        sum->f[1][k] += p.pull * jerk;
        if (derivatives > 2) sum->f[2][k] += p.pull * (a[k] - alpha6 * jerk - beta3 * r[k]);
    }
}

HD double lanes_of(const double sum[LANES])
{
    double all = 0;
    for (int i = 0; i < LANES; i++) all += sum[i];
    return all;
}

HD void rates_sum(double *sum, const double *target, const struct hermite_floats *s, int64_t from, int64_t to, int derivatives,
                  int bare)
{
    const struct float_target t = target_of(target);
    double promoted[9][LANES] = { { 0 } };
    for (int64_t first = from; first < to; first += CHUNK * LANES) {
        const int64_t end = to < first + CHUNK * LANES ? to : first + CHUNK * LANES;
        struct rates part = { { { { 0 } } } };
        for (int64_t j = first; j < end; j += LANES) rates_add(&part, &t, s, j, derivatives, bare);
        for (int w = 0; w < 3 * derivatives; w++) simd_promote(promoted[w], part.f[w / 3][w % 3]);
    }
    for (int w = 0; w < 3 * derivatives; w++) sum[w] = rates_factor() * lanes_of(promoted[w]);
}

#define RATES(name, derivatives, bare) \
    static void name(double *sum, const double *target, const struct hermite_floats *s, int64_t from, int64_t to) \
    { rates_sum(sum, target, s, from, to, derivatives, bare); }
RATES(jerk_soft, 2, 0)
RATES(snap_soft, 3, 0)
RATES(jerk_bare, 2, 1)
RATES(snap_bare, 3, 1)

const struct hermite_float_table SIMD_NAME(hermite_float_table) = { { { jerk_soft, snap_soft }, { jerk_bare, snap_bare } } };
