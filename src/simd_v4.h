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
/* At most eight lanes, the rows of a cluster of gas. */
enum { SPAN = 8 };
typedef float span __attribute__((vector_size(32)));
typedef float span_memory __attribute__((vector_size(32), may_alias, aligned(4)));
typedef int32_t span_int __attribute__((vector_size(32)));
typedef int32_t simd_int __attribute__((vector_size(64)));

/* Doubles. */
enum { WIDE = 8 };
typedef double wide __attribute__((vector_size(64)));
typedef double wide_memory __attribute__((vector_size(64), may_alias, aligned(8)));
typedef int64_t wide_int __attribute__((vector_size(64)));
/* Keeps -ffast-math from taking a product, or a difference, apart again. */
HD real real_whole(real x) { __asm__("" : "+v"(x)); return x; }
HD wide wide_whole(wide x) { __asm__("" : "+v"(x)); return x; }
/* The guess, right to 2^-14, and the series of (1 - e)^(-1/2) for what is left: cheaper than a root and a division. */
HD wide wide_rsqrt(wide x)
{
    wide y = (wide)_mm512_rsqrt14_pd((__m512d)x), e = 1 - x * (y * y);
    return y + y * (e * (0.5 + e * (0.375 + e * 0.3125)));
}
/* The same times the root of 3, which is in the coefficients. */
HD wide wide_rsqrt3(wide x)
{
    const double root = 1.7320508075688772;
    wide y = (wide)_mm512_rsqrt14_pd((__m512d)x), e = 1 - x * (y * y);
    return y * (root + e * (0.5 * root + e * (0.375 * root + e * (0.3125 * root))));
}

#define SIMD_GUESS_ERROR 6.2e-5f    /* relative: 2^-14 */
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
/* Numbers (from `first` on) of the lanes where the mask is set; writes up to LANES of them. How many. */
HD int simd_pack(uint16_t *to, simd_int mask, int first)
{
    const __m512i lanes = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    __mmask16 bits = _mm512_movepi32_mask((__m512i)mask);
    __m512i numbers = _mm512_maskz_compress_epi32(bits, _mm512_add_epi32(lanes, _mm512_set1_epi32(first)));
    _mm256_storeu_si256((__m256i *)to, _mm512_cvtepi32_epi16(numbers));
    return __builtin_popcount(bits);
}
/* Vectors of SPAN lanes: the bits of a mask, the smaller and the larger of two. */
HD int span_bits(span_int mask) { return _mm256_movemask_ps((__m256)mask); }
HD span span_min(span a, span b) { return (span)_mm256_min_ps((__m256)a, (__m256)b); }
HD span span_max(span a, span b) { return (span)_mm256_max_ps((__m256)a, (__m256)b); }
#include "simd.h"
#endif
