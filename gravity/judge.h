/* SPDX-License-Identifier: GPL-3.0-or-later
 * Opening by an angle and by an error, for the walks of the CPU (many sources in lanes) and of a device (one a thread).
 * By an angle a cell is accepted for a target box if the side of the cube within its sphere is below the angle
 * times its distance from the box, if that sphere, widened by the support of the spline, stays clear
 * of the box, and if it lies beyond the reach of unequal softenings. Arithmetic in `real` (see real.h);
 * lengths in one unit, that of the target. What an error bounds is explained in walk.c. */
#ifndef TEPHRA_GRAVITY_JUDGE_H
#define TEPHRA_GRAVITY_JUDGE_H
#include "kernels.h"
#include "real.h"

typedef __typeof__(real_splat(0) < real_splat(0)) judge_mask;

/* Distance along one axis, d from a box's centre. */
HD real judge_outside(real d, float half)
{
    real away = real_max(d, -d) - half;
    return real_max(away, real_splat(0));
}

/* Squared distance of a place from the box. */
HD real judge_box2(real dx, real dy, real dz, const float *half)
{
    real x = judge_outside(dx, half[0]), y = judge_outside(dy, half[1]), z = judge_outside(dz, half[2]);
    return x * x + y * y + z * z;
}

/* distance2: squared distance of the cell's centre from the box. */
HD judge_mask judge_angle(real reach, real distance2, float theta2, real support, float near2)
{
    real side2 = 4.f / 3.f * reach * reach, edge = reach + support;
    return (side2 < theta2 * distance2) & (edge * edge < distance2) & (distance2 >= near2);
}

/* A source as the errors see it: power[k - 2] of order k belongs to lengths in units of `scale`. */
struct judge_source { real mass, reach, scale; const real *power; };

HD real judge_root(real x2)
{
    real y = real_rsqrt_guess(x2);
    if (REAL_GUESS) y *= 1.5f - 0.5f * x2 * y * y;
    return y;
}

/* Error of the acceleration through the local expansion times d^2, against the tolerance: Dehnen
 * (2014), eq. 16: sum over k of binomial(P, k) |M_k| r^(P-k) / d^P; no dipole. d2: squared distance of the centres.
 * *too_large: the target is, since the part of its size, that of k = 0, is beyond by itself. */
HD judge_mask judge_local(struct judge_source s, const struct gravity_view *v, real d2, int order, real support,
                          judge_mask *too_large)
{
    real sum = s.reach + v->radius, edge = sum + support;
    judge_mask fits = (sum * sum < v->theta2 * d2) & (edge * edge < d2) & (d2 >= v->near2)
                    & (v->radius * v->radius < v->theta2_target * d2);
    real y = judge_root(real_max(d2, real_splat(REAL_FLOOR)));
    real t = v->radius * y, u = s.scale * y, power = u * u;
    real error = s.mass * t * t + s.power[0] * power, size = s.mass * t * t;
    for (int k = 3; k <= order; k++) {
        size *= t;
        power *= u;
        error = error * t + s.power[k - 2] * power;
    }
    *too_large = size >= v->tolerance * d2;
    return fits & (error < v->tolerance * d2);
}

/* May the cell act on the rows of a group, as a quadrupole? Its sphere never touches the group's box, the square of the
 * distance from which is least2. */
HD judge_mask judge_cell(struct judge_source s, const struct gravity_view *v, real least2, real support)
{
    real edge = s.reach + support;
    judge_mask fits = (s.reach * s.reach < v->theta2_cell * least2) & (edge * edge < least2) & (least2 >= v->near2);
    real y = judge_root(real_max(least2, real_splat(REAL_FLOOR))), u = s.scale * y;
    return fits & (v->quadrupole * s.power[0] * u * u * s.reach * y < v->tolerance * least2);
}
#endif
