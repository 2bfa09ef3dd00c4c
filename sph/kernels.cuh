/* SPDX-License-Identifier: GPL-3.0-or-later
 * Between the engine of SPH and the file that holds the kernels of the search. */
#ifndef TEPHRA_SPH_KERNELS_CUH
#define TEPHRA_SPH_KERNELS_CUH
#include "walk.cuh"

typedef void search_kernel(struct sph_field, struct sph_wanted, struct sph_quest, float *);
/* 0: exact; 1 + enum sph_kernel: smooth. One warp a block. */
search_kernel *sph_search_kernel(int which);
#endif
