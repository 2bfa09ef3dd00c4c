/* SPDX-License-Identifier: GPL-3.0-or-later
 * Vectors for x86-64-v4 (AVX-512): 16 floats. Takes the place of real.h in kernel files. */
#ifndef TEPHRA_SIMD_V4_H
#define TEPHRA_SIMD_V4_H
#define TEPHRA_REAL_H
#include "hd.h"
#include <immintrin.h>
#include <stdint.h>

enum { LANES = 16 };
#define SIMD_NAME(name) name##_v4
/* Smallest squared length whose power -3/2 times a mass is still a number. */
#define REAL_FLOOR 1e-16f
typedef float real __attribute__((vector_size(64)));
typedef float simd_memory __attribute__((vector_size(64), may_alias, aligned(4)));
typedef int32_t simd_int __attribute__((vector_size(64)));

/* Relative error 2^-14. */
HD real real_rsqrt_guess(real x) { return (real)_mm512_rsqrt14_ps((__m512)x); }
HD real real_max(real a, real b) { return (real)_mm512_max_ps((__m512)a, (__m512)b); }
/* a b + c in one operation, which no reassociation can take apart. */
HD real real_fma(real a, real b, real c) { return (real)_mm512_fmadd_ps((__m512)a, (__m512)b, (__m512)c); }
HD real simd_zip_low(real a, real b)
{ return __builtin_shufflevector(a, b, 0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23); }
HD real simd_zip_high(real a, real b)
{ return __builtin_shufflevector(a, b, 8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31); }
/* Adds the lanes to doubles in memory: sums of floats are promoted before they lose digits. */
HD void simd_promote(double *sum, real x)
{
    __m512d low = _mm512_cvtps_pd(_mm512_castps512_ps256((__m512)x)), high = _mm512_cvtps_pd(_mm512_extractf32x8_ps((__m512)x, 1));
    _mm512_storeu_pd(sum, low + _mm512_loadu_pd(sum));
    _mm512_storeu_pd(sum + LANES / 2, high + _mm512_loadu_pd(sum + LANES / 2));
}
#include "simd.h"
#endif
