/* SPDX-License-Identifier: GPL-3.0-or-later
 * Vectors for x86-64-v3 (AVX2 and FMA): 8 floats. Takes the place of real.h in kernel files. */
#ifndef TEPHRA_SIMD_V3_H
#define TEPHRA_SIMD_V3_H
#define TEPHRA_REAL_H
#include "hd.h"
#include <immintrin.h>
#include <stdint.h>

enum { LANES = 8 };
#define SIMD_NAME(name) name##_v3
/* Smallest squared length whose power -3/2 times a mass is still a number. */
#define REAL_FLOOR 1e-16f
typedef float real __attribute__((vector_size(32)));
typedef float simd_memory __attribute__((vector_size(32), may_alias, aligned(4)));
typedef int32_t simd_int __attribute__((vector_size(32)));

/* Relative error 1.5 * 2^-12. */
HD real real_rsqrt_guess(real x) { return (real)_mm256_rsqrt_ps((__m256)x); }
HD real real_max(real a, real b) { return (real)_mm256_max_ps((__m256)a, (__m256)b); }
/* a b + c in one operation, which no reassociation can take apart. */
HD real real_fma(real a, real b, real c) { return (real)_mm256_fmadd_ps((__m256)a, (__m256)b, (__m256)c); }
HD real simd_zip_low(real a, real b) { return __builtin_shufflevector(a, b, 0, 8, 1, 9, 2, 10, 3, 11); }
HD real simd_zip_high(real a, real b) { return __builtin_shufflevector(a, b, 4, 12, 5, 13, 6, 14, 7, 15); }
/* Adds the lanes to doubles in memory: sums of floats are promoted before they lose digits. */
HD void simd_promote(double *sum, real x)
{
    __m256d low = _mm256_cvtps_pd(_mm256_castps256_ps128((__m256)x)), high = _mm256_cvtps_pd(_mm256_extractf128_ps((__m256)x, 1));
    _mm256_storeu_pd(sum, low + _mm256_loadu_pd(sum));
    _mm256_storeu_pd(sum + LANES / 2, high + _mm256_loadu_pd(sum + LANES / 2));
}
#include "simd.h"
#endif
