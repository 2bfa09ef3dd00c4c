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
/* At most eight lanes, the rows of a cluster of gas. */
enum { SPAN = 8 };
typedef float span __attribute__((vector_size(32)));
typedef float span_memory __attribute__((vector_size(32), may_alias, aligned(4)));
typedef int32_t span_int __attribute__((vector_size(32)));
typedef int32_t simd_int __attribute__((vector_size(32)));

/* Doubles. */
enum { WIDE = 4 };
typedef double wide __attribute__((vector_size(32)));
typedef double wide_memory __attribute__((vector_size(32), may_alias, aligned(8)));
typedef int64_t wide_int __attribute__((vector_size(32)));
/* Keeps -ffast-math from taking a product, or a difference, apart again. */
HD real real_whole(real x) { __asm__("" : "+x"(x)); return x; }
HD wide wide_whole(wide x) { __asm__("" : "+x"(x)); return x; }
HD wide wide_rsqrt(wide x) { return 1 / (wide)_mm256_sqrt_pd((__m256d)x); }
HD wide wide_rsqrt3(wide x) { return 1.7320508075688772 / (wide)_mm256_sqrt_pd((__m256d)x); }  /* times the root of 3 */

#define SIMD_GUESS_ERROR 3.7e-4f    /* relative: 1.5 * 2^-12 */
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
/* Numbers (from `first` on) of the lanes where the mask is set; writes up to LANES of them. How many. */
HD int simd_pack(uint16_t *to, simd_int mask, int first)
{
    unsigned bits = (unsigned)_mm256_movemask_ps((__m256)mask);
    uint64_t bytes = _pdep_u64(bits, 0x0101010101010101u) * 0xff, lanes = _pext_u64(0x0706050403020100u, bytes);
    __m128i numbers = _mm_cvtepu8_epi16(_mm_cvtsi64_si128((long long)lanes));
    _mm_storeu_si128((__m128i *)to, _mm_add_epi16(numbers, _mm_set1_epi16((short)first)));
    return __builtin_popcount(bits);
}
/* Vectors of SPAN lanes: the bits of a mask, the smaller and the larger of two. */
HD int span_bits(span_int mask) { return _mm256_movemask_ps((__m256)mask); }
HD span span_min(span a, span b) { return (span)_mm256_min_ps((__m256)a, (__m256)b); }
HD span span_max(span a, span b) { return (span)_mm256_max_ps((__m256)a, (__m256)b); }
#include "simd.h"
#endif
