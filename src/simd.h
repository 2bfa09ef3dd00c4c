/* SPDX-License-Identifier: GPL-3.0-or-later
 * What the vector headers simd_v2.h, simd_v3.h and simd_v4.h share. They define LANES, the types
 * `real` (floats) and `simd_int` (as many int32), SIMD_NAME, the guess of 1/sqrt, the promotion to
 * double and the two interleavings; everything else is GCC's vector extension, which clang has too. */
#ifndef TEPHRA_SIMD_H
#define TEPHRA_SIMD_H
#include "hd.h"

enum { REAL_GUESS = 1 };

HD real real_splat(float x) { return x - (real){0}; }
HD real real_if(simd_int mask, real x, real y)
{ return (real)(((simd_int)x & mask) | ((simd_int)y & ~mask)); }
HD real real_if_less(real a, real b, real x, real y) { return real_if(a < b, x, y); }
HD real simd_load(const float *p) { return (real)*(const simd_memory *)p; }
HD void simd_store(float *p, real x) { *(simd_memory *)p = (simd_memory)x; }
HD simd_int simd_load_int(const int32_t *p) { return (simd_int)simd_load((const float *)p); }

HD span span_load(const float *p) { return (span)*(const span_memory *)p; }
HD void span_store(float *p, span x) { *(span_memory *)p = (span_memory)x; }
HD span span_splat(float x) { return x - (span){0}; }
HD span span_if(span_int mask, span x, span y) { return (span)(((span_int)x & mask) | ((span_int)y & ~mask)); }

/* Rows become columns: lane i of v[j] and lane j of v[i] change places. */
HD void simd_transpose(real v[LANES])
{
    for (int stage = 1; stage < LANES; stage *= 2) {
        real w[LANES];
        for (int i = 0; i < LANES / 2; i++) {
            w[2 * i] = simd_zip_low(v[i], v[i + LANES / 2]);
            w[2 * i + 1] = simd_zip_high(v[i], v[i + LANES / 2]);
        }
        for (int i = 0; i < LANES; i++) v[i] = w[i];
    }
}

/* Lane i of the result is the sum of the lanes of v[i]. */
HD real simd_sums(real v[LANES])
{
    for (int half = LANES / 2; half > 0; half /= 2)
        for (int i = 0; i < half; i++) v[i] = simd_zip_low(v[i], v[i + half]) + simd_zip_high(v[i], v[i + half]);
    return v[0];
}
#endif
