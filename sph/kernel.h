/* SPDX-License-Identifier: GPL-3.0-or-later
 * Smoothing kernels W(r, h) = w(q) / h^3, q = r/h, all with support 2h, and their slopes dw/dq.
 * Cubic spline: Monaghan & Lattanzio 1985, written as a difference of clipped cubes so that no
 * branch remains. Wendland C2 and C4: Dehnen & Aly 2012, table 1. `kind` is a literal at each call. */
#ifndef TEPHRA_SPH_KERNEL_H
#define TEPHRA_SPH_KERNEL_H
#include "hd.h"
#include <math.h>

enum sph_kernel { SPH_CUBIC, SPH_WENDLAND_C2, SPH_WENDLAND_C4, SPH_KERNELS };

#define SPH_PI 3.14159265358979324f

HD float sph_positive(float x) { return x > 0.0f ? x : 0.0f; }

/* w(q): integral of 4 pi q^2 w over [0, 2] is 1. */
HD float sph_kernel(float q, enum sph_kernel kind)
{
    float outer = sph_positive(2.0f - q), inner = sph_positive(1.0f - q);
    float s = 0.5f * outer, s2 = s * s;
    if (kind == SPH_WENDLAND_C2) return 21.0f / (16.0f * SPH_PI) * s2 * s2 * (1.0f + 2.0f * q);
    if (kind == SPH_WENDLAND_C4)
        return 495.0f / (256.0f * SPH_PI) * s2 * s2 * s2 * (1.0f + q * (3.0f + q * (35.0f / 12.0f)));
    return 1.0f / SPH_PI * (0.25f * outer * outer * outer - inner * inner * inner);
}

/* dw/dq, never positive. */
HD float sph_kernel_slope(float q, enum sph_kernel kind)
{
    float outer = sph_positive(2.0f - q), inner = sph_positive(1.0f - q);
    float s = 0.5f * outer, s2 = s * s;
    if (kind == SPH_WENDLAND_C2) return -105.0f / (16.0f * SPH_PI) * q * s2 * s;
    if (kind == SPH_WENDLAND_C4)
        return -495.0f / (256.0f * SPH_PI) * (14.0f / 3.0f) * q * (1.0f + 2.5f * q) * s2 * s2 * s;
    return 1.0f / SPH_PI * (3.0f * inner * inner - 0.75f * outer * outer);
}

/* Part of a row's own term w(0) that its density counts too much, for n neighbours (Dehnen & Aly 2012,
 * eqs. 18 and 19): a row sits where the kernels around it are highest. None for the cubic spline. */
static inline float sph_kernel_excess(float n, enum sph_kernel kind)
{
    if (kind == SPH_WENDLAND_C2) return 0.0294f * powf(n / 100, -0.977f);
    if (kind == SPH_WENDLAND_C4) return 0.01342f * powf(n / 100, -1.579f);
    return 0;
}
#endif
