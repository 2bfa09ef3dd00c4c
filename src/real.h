/* SPDX-License-Identifier: GPL-3.0-or-later
 * `real` is the arithmetic type of the formulas in pair.h and cell.h: a double here, a vector of
 * floats where a simd_v*.h header was included first, a float on a device (real_device.h). Those
 * headers define this one's guard and take its place. */
#ifndef TEPHRA_REAL_H
#define TEPHRA_REAL_H
#include "hd.h"
#include <math.h>

/* Smallest squared length whose power -3/2 times a mass is still a number. */
#define REAL_FLOOR 1e-150
typedef double real;

HD real real_splat(double x) { return x; }
/* real_rsqrt_guess is good to a few digits only, so that the caller adds a Newton step. */
enum { REAL_GUESS = 0 };
/* 1/sqrt(x) */
HD real real_rsqrt_guess(real x) { return 1.0 / sqrt(x); }
HD real real_max(real a, real b) { return a > b ? a : b; }
HD real real_fma(real a, real b, real c) { return a * b + c; }
/* a < b ? x : y */
HD real real_if_less(real a, real b, real x, real y) { return a < b ? x : y; }
#endif
