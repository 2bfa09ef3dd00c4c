/* SPDX-License-Identifier: GPL-3.0-or-later
 * Vectors for x86-64-v2 (SSE 4.2): 4 floats. Takes the place of real.h in kernel files. */
#ifndef TEPHRA_SIMD_V2_H
#define TEPHRA_SIMD_V2_H
#define TEPHRA_REAL_H
#include "hd.h"
#include <immintrin.h>
#include <stdint.h>

enum { LANES = 4 };
#define SIMD_NAME(name) name##_v2
/* Smallest squared length whose power -3/2 times a mass is still a number. */
#define REAL_FLOOR 1e-16f
typedef float real __attribute__((vector_size(16)));
typedef float simd_memory __attribute__((vector_size(16), may_alias, aligned(4)));
/* At most eight lanes, the rows of a cluster of gas. */
enum { SPAN = 4 };
typedef float span __attribute__((vector_size(16)));
typedef float span_memory __attribute__((vector_size(16), may_alias, aligned(4)));
typedef int32_t span_int __attribute__((vector_size(16)));
typedef int32_t simd_int __attribute__((vector_size(16)));

/* Doubles. */
enum { WIDE = 2 };
typedef double wide __attribute__((vector_size(16)));
typedef double wide_memory __attribute__((vector_size(16), may_alias, aligned(8)));
typedef int64_t wide_int __attribute__((vector_size(16)));
/* Keeps -ffast-math from taking a product, or a difference, apart again. */
HD real real_whole(real x) { __asm__("" : "+x"(x)); return x; }
HD wide wide_whole(wide x) { __asm__("" : "+x"(x)); return x; }
HD wide wide_rsqrt(wide x) { return 1 / (wide)_mm_sqrt_pd((__m128d)x); }
HD wide wide_rsqrt3(wide x) { return 1.7320508075688772 / (wide)_mm_sqrt_pd((__m128d)x); }  /* times the root of 3 */

#define SIMD_GUESS_ERROR 3.7e-4f    /* relative: 1.5 * 2^-12 */
HD real real_rsqrt_guess(real x) { return (real)_mm_rsqrt_ps((__m128)x); }
HD real real_max(real a, real b) { return (real)_mm_max_ps((__m128)a, (__m128)b); }
HD real real_fma(real a, real b, real c) { return a * b + c; }
HD real simd_zip_low(real a, real b) { return __builtin_shufflevector(a, b, 0, 4, 1, 5); }
HD real simd_zip_high(real a, real b) { return __builtin_shufflevector(a, b, 2, 6, 3, 7); }
/* Adds the lanes to doubles in memory: sums of floats are promoted before they lose digits. */
HD void simd_promote(double *sum, real x)
{
    __m128d low = _mm_cvtps_pd((__m128)x), high = _mm_cvtps_pd(_mm_movehl_ps((__m128)x, (__m128)x));
    _mm_storeu_pd(sum, low + _mm_loadu_pd(sum));
    _mm_storeu_pd(sum + LANES / 2, high + _mm_loadu_pd(sum + LANES / 2));
}
/* Numbers (from `first` on) of the lanes where the mask is set; writes up to LANES of them. How many. */
HD int simd_pack(uint16_t *to, simd_int mask, int first)
{
    int bits = _mm_movemask_ps((__m128)mask), n = 0;
    for (int l = 0; l < LANES; l++) {
        to[n] = (uint16_t)(first + l);
        n += bits >> l & 1;
    }
    return n;
}
/* Vectors of SPAN lanes: the bits of a mask, the smaller and the larger of two. */
HD int span_bits(span_int mask) { return _mm_movemask_ps((__m128)mask); }
HD span span_min(span a, span b) { return (span)_mm_min_ps((__m128)a, (__m128)b); }
HD span span_max(span a, span b) { return (span)_mm_max_ps((__m128)a, (__m128)b); }
#include "simd.h"
#endif
