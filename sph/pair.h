/* SPDX-License-Identifier: GPL-3.0-or-later
 * Pair formulas of SPH, shared by the C and the CUDA drivers; each force is the exact opposite of its
 * partner's. Two formulations: with the mean smoothing length h_ij = (h_i + h_j)/2 and W_ij =
 * W(r, h_ij) (Monaghan 1992, eq. 3.3), or, grad_h, with each row's own h and the terms of grad h
 * (Springel & Hernquist 2002, eq. 10; Price 2012, eqs. 30 and 35). Viscosity: Monaghan & Gingold 1983,
 * or with the signal velocity (Monaghan 1997). Flags are literals at each call. A pair out of reach
 * gives zeros, and so does a row with itself, except for its own density. */
#ifndef TEPHRA_SPH_PAIR_H
#define TEPHRA_SPH_PAIR_H
#include "kernel.h"
#include <stdbool.h>

/* A row as a pair sees it: position and velocity about the tile's centre, now. Halves are kept, not
 * wholes, of what pairs average. */
struct sph_place { float x, y, z, half_h, vx, vy, vz, mass; };
/* What only the force needs: P/rho^2 (grad_h: over Omega), density, sound speed, the factor of the
 * viscosity (Balsara's, and its strength where that changes). */
struct sph_state { float p, rho, half_c, balsara; };

/* Rows i and j meet within own h_i + max(least h_i, other h_j): the sum of both, or the larger of 2h_i and 2h_j. */
struct sph_meet { float own, least, other; };

/* Monaghan's alpha and beta, epsilon that keeps the denominator of mu from 0; work: 1, or 0 where u is
 * to change by viscosity alone (the entropy equation); conduct: 4 alpha_u/(gamma (gamma - 1)), which makes alpha_u u of
 * the square of half a sound speed. */
struct sph_viscosity { float alpha, beta, epsilon, work, conduct; };

/* swell: -h d/dh of h^3 m_j W, over h^3; its sum is 3 rho Omega. Only grad_h has it. */
struct sph_density { float rho, div, curl_x, curl_y, curl_z, swell; };
struct sph_force { float ax, ay, az, du, signal; };

/* From i to j. */
struct sph_gap { float x, y, z, vx, vy, vz, r2, vr; };

HD struct sph_gap sph_gap(struct sph_place i, struct sph_place j)
{
    struct sph_gap g = {j.x - i.x, j.y - i.y, j.z - i.z, j.vx - i.vx, j.vy - i.vy, j.vz - i.vz, 0, 0};
    g.r2 = g.x * g.x + g.y * g.y + g.z * g.z;
    g.vr = g.vx * g.x + g.vy * g.y + g.vz * g.z;
    return g;
}

/* 1/r; where r = 0 a large number, which only ever multiplies 0. */
HD float sph_inverse_length(float r2)
{
    return 1.0f / sqrtf(r2 > 1e-30f ? r2 : 1e-30f);
}

/* Terms of rho_i, rho_i div v_i and rho_i curl v_i. */
HD struct sph_density sph_density_pair(struct sph_place i, struct sph_place j, enum sph_kernel kind, bool grad_h)
{
    struct sph_gap g = sph_gap(i, j);
    float r1 = sph_inverse_length(g.r2), h1 = 1.0f / (i.half_h + (grad_h ? i.half_h : j.half_h)), q = g.r2 * r1 * h1;
    float m = j.mass * h1 * h1 * h1, dw = sph_kernel_slope(q, kind);
    float slope = m * h1 * r1 * dw;
    return (struct sph_density){m * sph_kernel(q, kind), -slope * g.vr,
        slope * (g.vy * g.z - g.vz * g.y), slope * (g.vz * g.x - g.vx * g.z), slope * (g.vx * g.y - g.vy * g.x),
        -m * q * dw};
}

/* The work of a pair is shared: heat in equal halves, while a pair that expands pays each row's part by
 * its own pressure. Both conserve energy; halves would let warm neighbours drain a cold row below
 * zero (Evrard's expanding skirt: 4e-3 of the energy by t = 3).
 * Acceleration of i, rate of its u, and the signal velocity c_i + c_j - 3 w_ij between the two
 * (Monaghan 1997), 0 beyond the kernel. One reciprocal serves h, the denominator of mu and rho_ij:
 * their product is of the order of a mass, so it cannot overflow where the three do not. */
HD struct sph_force sph_mean_pair(struct sph_place i, struct sph_state si, struct sph_place j, struct sph_state sj,
                                  struct sph_viscosity visc, enum sph_kernel kind, bool signal_velocity)
{
    struct sph_gap g = sph_gap(i, j);
    float h = i.half_h + j.half_h, r1 = sph_inverse_length(g.r2);
    float d = signal_velocity ? 1.0f : g.r2 + visc.epsilon * h * h, rho2 = si.rho + sj.rho, d_rho = d * rho2;
    float all = 1.0f / (h * d_rho), h1 = all * d_rho, h2 = h1 * h1, q = g.r2 * r1 * h1;
    float slope = j.mass * r1 * (h2 * h2) * sph_kernel_slope(q, kind);
    float closing = g.vr < 0.0f ? g.vr : 0.0f, c = si.half_c + sj.half_c;
    float h_all = h * all, mu = signal_velocity ? closing * r1 : closing * h * (h_all * rho2);
    float stress = si.p + sj.p + mu * (visc.beta * mu - visc.alpha * c) * (h_all * d) * (si.balsara + sj.balsara);
    float f = slope * stress;
    float heat = slope * g.vr * (g.vr > 0.0f ? si.p : 0.5f * stress);
    float signal = q < 2.0f ? 2.0f * c - 3.0f * closing * r1 : 0.0f;
    return (struct sph_force){f * g.x, f * g.y, f * g.z, heat, signal};
}

/* Each pressure acts through its own kernel, and pays for its own work; the viscosity, shared in
 * halves, through the mean of both. */
HD struct sph_force sph_grad_h_pair(struct sph_place i, struct sph_state si, struct sph_place j, struct sph_state sj,
                                    struct sph_viscosity visc, enum sph_kernel kind, bool signal_velocity)
{
    struct sph_gap g = sph_gap(i, j);
    float r1 = sph_inverse_length(g.r2), r = g.r2 * r1, h = i.half_h + j.half_h, m = j.mass * r1;
    float hi1 = 0.5f / i.half_h, hj1 = 0.5f / j.half_h, hi2 = hi1 * hi1, hj2 = hj1 * hj1;
    float slope_i = m * (hi2 * hi2) * sph_kernel_slope(r * hi1, kind);
    float slope_j = m * (hj2 * hj2) * sph_kernel_slope(r * hj1, kind);
    float d = signal_velocity ? 1.0f : g.r2 + visc.epsilon * h * h, rho2 = si.rho + sj.rho, all = 1.0f / (d * rho2);
    float closing = g.vr < 0.0f ? g.vr : 0.0f, c = si.half_c + sj.half_c;
    float mu = signal_velocity ? closing * r1 : closing * h * (all * rho2);
    float rub = 0.5f * (slope_i + slope_j) * mu * (visc.beta * mu - visc.alpha * c) * (all * d) * (si.balsara + sj.balsara);
    float own = slope_i * si.p, f = own + slope_j * sj.p + rub;
    float signal = r * (hi1 < hj1 ? hi1 : hj1) < 2.0f ? 2.0f * c - 3.0f * closing * r1 : 0.0f;
    return (struct sph_force){f * g.x, f * g.y, f * g.z, g.vr * (visc.work * own + 0.5f * rub), signal};
}

/* Rate of i's u by artificial conduction (Price 2008, J. Comput. Phys. 227, 10040, eq. 28, with eq. 29 for the speed): what
 * viscosity is to a jump of the velocity it is to one of u, which it spreads over the kernel until the pressure is even. */
HD float sph_conduct_pair(struct sph_place i, struct sph_state si, struct sph_place j, struct sph_state sj,
                          struct sph_viscosity visc, enum sph_kernel kind, bool grad_h)
{
    struct sph_gap g = sph_gap(i, j);
    float r1 = sph_inverse_length(g.r2), r = g.r2 * r1, h1 = 1.0f / (i.half_h + j.half_h), h2 = h1 * h1;
    float hi1 = 0.5f / i.half_h, hj1 = 0.5f / j.half_h, hi2 = hi1 * hi1, hj2 = hj1 * hj1;
    float slope = grad_h ? 0.5f * (hi2 * hi2 * sph_kernel_slope(r * hi1, kind) + hj2 * hj2 * sph_kernel_slope(r * hj1, kind))
                         : h2 * h2 * sph_kernel_slope(r * h1, kind);
    float per_rho = 2.0f / (si.rho + sj.rho), jump = fabsf(si.p * si.rho * si.rho - sj.p * sj.rho * sj.rho);
    float more = si.half_c * si.half_c - sj.half_c * sj.half_c;
    return j.mass * slope * visc.conduct * more * per_rho * sqrtf(jump * per_rho);
}

HD struct sph_force sph_force_pair(struct sph_place i, struct sph_state si, struct sph_place j, struct sph_state sj,
                                   struct sph_viscosity visc, enum sph_kernel kind, bool grad_h, bool signal_velocity)
{
    return grad_h ? sph_grad_h_pair(i, si, j, sj, visc, kind, signal_velocity)
                  : sph_mean_pair(i, si, j, sj, visc, kind, signal_velocity);
}
#endif
