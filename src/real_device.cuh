/* SPDX-License-Identifier: GPL-3.0-or-later
 * `real` on a device: a float a thread. Takes the place of real.h in .cu files. */
#ifndef TEPHRA_REAL_DEVICE_CUH
#define TEPHRA_REAL_DEVICE_CUH
#define TEPHRA_REAL_H
#include "hd.h"
#include "launch.cuh"

/* Smallest squared length whose power -3/2 times a mass (1 at most there) is still a number. */
#define REAL_FLOOR 1e-24f
typedef float real;
enum { REAL_GUESS = 0 };

HD real real_splat(float x) { return x; }
/* Relative error 2^-22.9 (CUDA C++ Programming Guide, table of intrinsic functions). */
HD real real_rsqrt_guess(real x) { return rsqrtf(x); }
HD real real_max(real a, real b) { return fmaxf(a, b); }
HD real real_fma(real a, real b, real c) { return fmaf(a, b, c); }
HD real real_if_less(real a, real b, real x, real y) { return a < b ? x : y; }
#endif
