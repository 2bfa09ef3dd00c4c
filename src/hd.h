/* SPDX-License-Identifier: GPL-3.0-or-later
 * HD marks the functions of pair.h and cell.h headers, which the C drivers and the CUDA drivers
 * share: always inlined, so that literal flags specialise them inside the loop that calls them.
 * (A flag passed to a function that itself contains the parallel region is not specialised: the
 * loop then is not vectorised and runs 8 times slower; tests/check-vectorised.sh guards this.)
 * This is the one header with a preprocessor switch besides config.h. */
#ifndef TEPHRA_HD_H
#define TEPHRA_HD_H
#ifdef __CUDACC__
#define HD static __host__ __device__ __forceinline__
#else
#define HD static inline __attribute__((always_inline))
#endif
#endif
