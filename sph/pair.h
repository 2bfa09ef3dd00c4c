/* SPDX-License-Identifier: GPL-3.0-or-later
 * Pair formulas of SPH, shared by the C and the CUDA drivers. Every pair uses the mean smoothing
 * length h_ij = (h_i + h_j)/2 and W_ij = W(r, h_ij), so that each force is the exact opposite of its
 * partner's (Monaghan 1992, eq. 3.3; viscosity: Monaghan & Gingold 1983; switch: Balsara 1995).
 * A pair out of reach gives zeros, and so does a row with itself, except for its own density. */
#ifndef TEPHRA_SPH_PAIR_H
#define TEPHRA_SPH_PAIR_H
#include "kernel.h"

/* A row as a pair sees it: position and velocity about the tile's centre, now. Halves are kept, not
 * wholes, of what pairs average. */
struct sph_place { float x, y, z, half_h, vx, vy, vz, mass; };
/* What only the force needs: P/rho^2, density, sound speed, Balsara's factor. */
struct sph_state { float p, rho, half_c, balsara; };

/* Monaghan's alpha and beta, and epsilon that keeps the denominator of mu from 0. */
struct sph_viscosity { float alpha, beta, epsilon; };

struct sph_density { float rho, div, curl_x, curl_y, curl_z; };
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
HD struct sph_density sph_density_pair(struct sph_place i, struct sph_place j, enum sph_kernel kind)
{
    struct sph_gap g = sph_gap(i, j);
    float r1 = sph_inverse_length(g.r2), h1 = 1.0f / (i.half_h + j.half_h), q = g.r2 * r1 * h1;
    float m = j.mass * h1 * h1 * h1;
    float slope = m * h1 * r1 * sph_kernel_slope(q, kind);
    return (struct sph_density){m * sph_kernel(q, kind), -slope * g.vr,
        slope * (g.vy * g.z - g.vz * g.y), slope * (g.vz * g.x - g.vx * g.z), slope * (g.vx * g.y - g.vy * g.x)};
}

/* The work of a pair is shared: heat in equal halves, while a pair that expands pays each row's part by
 * its own pressure. Both conserve energy; halves would let warm neighbours drain a cold row below
 * zero (Evrard's expanding skirt: 4e-3 of the energy by t = 3).
 * Acceleration of i, rate of its u, and the signal velocity c_i + c_j - 3 w_ij between the two
 * (Monaghan 1997), 0 beyond the kernel. One reciprocal serves h, the denominator of mu and rho_ij:
 * their product is of the order of a mass, so it cannot overflow where the three do not. */
HD struct sph_force sph_force_pair(struct sph_place i, struct sph_state si, struct sph_place j, struct sph_state sj,
                                   struct sph_viscosity visc, enum sph_kernel kind)
{
    struct sph_gap g = sph_gap(i, j);
    float h = i.half_h + j.half_h, r1 = sph_inverse_length(g.r2);
    float d = g.r2 + visc.epsilon * h * h, rho2 = si.rho + sj.rho, d_rho = d * rho2, all = 1.0f / (h * d_rho);
    float h1 = all * d_rho, h2 = h1 * h1, q = g.r2 * r1 * h1;
    float slope = j.mass * r1 * (h2 * h2) * sph_kernel_slope(q, kind);
    float closing = g.vr < 0.0f ? g.vr : 0.0f, c = si.half_c + sj.half_c;
    float h_all = h * all, mu = closing * h * (h_all * rho2);
    float stress = si.p + sj.p + mu * (visc.beta * mu - visc.alpha * c) * (h_all * d) * (si.balsara + sj.balsara);
    float f = slope * stress;
    float heat = slope * g.vr * (g.vr > 0.0f ? si.p : 0.5f * stress);
    float signal = q < 2.0f ? 2.0f * c - 3.0f * closing * r1 : 0.0f;
    return (struct sph_force){f * g.x, f * g.y, f * g.z, heat, signal};
}
#endif
