/* SPDX-License-Identifier: GPL-3.0-or-later
 * Opening by an angle, for the walks of the CPU (many sources in lanes) and of a device (one a thread).
 * A cell is accepted for a target box if the side of the cube within its sphere is below the angle
 * times its distance from the box, if that sphere, widened by the support of the spline, stays clear
 * of the box, and if it lies beyond the reach of unequal softenings. Arithmetic in `real` (see real.h);
 * lengths in one unit, that of the target. */
#ifndef TEPHRA_GRAVITY_JUDGE_H
#define TEPHRA_GRAVITY_JUDGE_H
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
#endif
