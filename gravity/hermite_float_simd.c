/* SPDX-License-Identifier: GPL-3.0-or-later
 * Acceleration and jerk in floats: positions are sums of two floats, so that their differences keep all digits of a
 * float however close two rows are, and the sums are promoted to doubles every CHUNK vectors of sources. One target and
 * a vector of sources at a time, as in hermite_simd.c. */
#include "pair.h"
#include "kernels.h"

enum { CHUNK = 64 };

struct float_target { real high[3], low[3], vel[3], soft; };

HD struct float_target target_of(const double target[13])
{
    struct float_target t;
    for (int k = 0; k < 3; k++) {
        float high = (float)target[k];
        t.high[k] = real_splat(high);
        t.low[k] = real_splat((float)(target[k] - (double)high));
        t.vel[k] = real_splat((float)target[3 + k]);
    }
    t.soft = real_splat((float)target[12]);
    return t;
}

HD real rates_dot(const real a[3], const real b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

HD real rates_root(real r2)
{
    real y = real_rsqrt_guess(r2);
    return y * (1.5f - 0.5f * r2 * y * y);
}

struct rates { real acc[3], jerk[3]; };

/* The sources of one vector, added. bare: as in hermite_simd.c, a literal where the kernels are made. */
HD void rates_add(struct rates *sum, const struct float_target *t, const struct hermite_floats *s, int64_t j, int bare)
{
    real r[3], v[3];
    for (int k = 0; k < 3; k++) {
        r[k] = real_whole(simd_load(s->high[k] + j) - t->high[k]) + (simd_load(s->low[k] + j) - t->low[k]);
        v[k] = simd_load(s->vel[k] + j) - t->vel[k];
    }
    real mass = simd_load(s->mass + j), r2 = rates_dot(r, r) + (simd_load(s->soft + j) + t->soft), zero = { 0 };
    if (bare) {
        mass = real_if_less(zero, r2, mass, zero);
        r2 = real_max(r2, real_splat(REAL_FLOOR));
    }
    struct pair_rates p = pair_rates(2, rates_root(r2), mass, rates_dot(r, v), zero, zero);
    for (int k = 0; k < 3; k++) {
        sum->acc[k] += p.pull * r[k];
        sum->jerk[k] += p.pull * (v[k] - 3 * p.alpha * r[k]);
    }
}

HD double lanes_of(const double sum[LANES])
{
    double all = 0;
    for (int i = 0; i < LANES; i++) all += sum[i];
    return all;
}

HD void rates_sum(double *sum, const double *target, const struct hermite_floats *s, int64_t from, int64_t to, int bare)
{
    const struct float_target t = target_of(target);
    double promoted[6][LANES] = { { 0 } };
    for (int64_t first = from; first < to; first += CHUNK * LANES) {
        const int64_t end = to < first + CHUNK * LANES ? to : first + CHUNK * LANES;
        struct rates part = { { { 0 } }, { { 0 } } };
        for (int64_t j = first; j < end; j += LANES) rates_add(&part, &t, s, j, bare);
        for (int k = 0; k < 3; k++) {
            simd_promote(promoted[k], part.acc[k]);
            simd_promote(promoted[3 + k], part.jerk[k]);
        }
    }
    for (int w = 0; w < 6; w++) sum[w] = lanes_of(promoted[w]);
}

static void jerk_soft(double *sum, const double *target, const struct hermite_floats *s, int64_t from, int64_t to)
{
    rates_sum(sum, target, s, from, to, 0);
}

static void jerk_bare(double *sum, const double *target, const struct hermite_floats *s, int64_t from, int64_t to)
{
    rates_sum(sum, target, s, from, to, 1);
}

const struct hermite_float_table SIMD_NAME(hermite_float_table) = { { jerk_soft, jerk_bare } };
