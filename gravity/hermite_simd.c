/* SPDX-License-Identifier: GPL-3.0-or-later
 * Acceleration, jerk, snap and crackle in double: one target and a vector of sources at a time, so that a few
 * active rows are as cheap a pair as many. `real` is a vector of doubles here. */
#define real           wide
#define REAL_GUESS     0
#define real_splat     wide_splat
#define real_rsqrt_guess wide_rsqrt
#define real_max       wide_max
#define real_if_less   wide_if_less
HD wide wide_splat(double x) { return x - (wide){ 0 }; }
HD wide wide_if_less(wide a, wide b, wide x, wide y)
{ wide_int mask = a < b; return (wide)(((wide_int)x & mask) | ((wide_int)y & ~mask)); }
HD wide wide_max(wide a, wide b) { return wide_if_less(a, b, b, a); }
#undef REAL_FLOOR
#define REAL_FLOOR 1e-150
#include "pair.h"
#include "kernels.h"

HD wide load(const double *p) { return (wide)*(const wide_memory *)p; }
HD wide dot(const wide a[3], const wide b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
HD double lanes(wide x)
{
    double sum = 0;
    for (int i = 0; i < WIDE; i++) sum += x[i];
    return sum;
}

/* derivatives and bare are literals where this is called; bare: a softening may be zero, and such rows at one place
 * do not pull. */
HD void rates_sum(double *sum, const double *target, const struct hermite_rows *s, int64_t from, int64_t to,
                  int derivatives, bool bare)
{
    wide total[4][3] = { { { 0 } } };
    for (int64_t j = from; j < to; j += WIDE) {
        wide r[3], v[3], a[3], c[3], second = { 0 }, third = { 0 };
        for (int k = 0; k < 3; k++) {
            r[k] = load(s->pos[k] + j) - target[k];
            v[k] = load(s->vel[k] + j) - target[3 + k];
            if (derivatives > 2) a[k] = load(s->acc[k] + j) - target[6 + k];
            if (derivatives > 3) c[k] = load(s->jerk[k] + j) - target[9 + k];
        }
        wide mass = load(s->mass + j), r2 = dot(r, r) + (load(s->soft + j) + target[12]);
        if (bare) {
            mass = wide_if_less((wide){ 0 }, r2, mass, (wide){ 0 });
            r2 = wide_max(r2, wide_splat(REAL_FLOOR));
        }
        if (derivatives > 2) second = dot(v, v) + dot(r, a);
        if (derivatives > 3) third = 3 * dot(v, a) + dot(r, c);
        struct pair_rates p = pair_rates(derivatives, wide_rsqrt3(r2), mass, dot(r, v), second, third);
        wide alpha3 = wide_whole(p.alpha3), alpha6, beta3, alpha9, beta9, gamma3;
        if (derivatives > 2) {
            alpha6 = wide_whole(alpha3 + alpha3);
            beta3 = wide_whole(p.beta3);
        }
        if (derivatives > 3) {
            alpha9 = wide_whole(3 * alpha3);
            beta9 = wide_whole(3 * beta3);
            gamma3 = wide_whole(p.gamma3);
        }
        for (int k = 0; k < 3; k++) {
            total[0][k] += p.pull * r[k];
            wide jerk = v[k] - alpha3 * r[k];
            total[1][k] += p.pull * jerk;
            if (derivatives < 3) continue;
            wide snap = a[k] - alpha6 * jerk - beta3 * r[k];
            total[2][k] += p.pull * snap;
            if (derivatives < 4) continue;
            total[3][k] += p.pull * (c[k] - alpha9 * snap - beta9 * jerk - gamma3 * r[k]);
        }
    }
    for (int d = 0; d < derivatives; d++)
        for (int k = 0; k < 3; k++) sum[3 * d + k] = PAIR_RATES * lanes(total[d][k]);
}

#define RATES(name, derivatives, bare) \
    static void name(double *sum, const double *target, const struct hermite_rows *s, int64_t from, int64_t to) \
    { rates_sum(sum, target, s, from, to, derivatives, bare); }
RATES(jerk_soft, 2, false)
RATES(snap_soft, 3, false)
RATES(crackle_soft, 4, false)
RATES(jerk_bare, 2, true)
RATES(snap_bare, 3, true)
RATES(crackle_bare, 4, true)

const struct hermite_table SIMD_NAME(hermite_table) = {
    .sum = { { jerk_soft, snap_soft, crackle_soft }, { jerk_bare, snap_bare, crackle_bare } },
    .lanes = WIDE,
};
