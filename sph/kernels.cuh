/* SPDX-License-Identifier: GPL-3.0-or-later
 * Between the engine of SPH and the files that hold the kernels of the search and of single rows. */
#ifndef TEPHRA_SPH_KERNELS_CUH
#define TEPHRA_SPH_KERNELS_CUH
#include "walk.cuh"

typedef void search_kernel(struct sph_field, struct sph_wanted, struct sph_quest, struct sph_law, struct sph_rows);
/* 0: exact; 1 + enum sph_kernel: smooth. One warp a block. */
search_kernel *sph_search_kernel(int which);

/* rows_cuda.cu: launches of a thread a row, or a cell. The leaf of each row. */
void sph_launch_leaves(struct device *device, const struct sph_cell *cell, int32_t n, int32_t *leaf);
void sph_launch_places(struct device *device, const struct sph_field *field, const struct sph_rows *rows, struct sph_place *place);
void sph_launch_states(struct device *device, struct sph_law law, const struct sph_rows *rows, struct sph_state *state);
/* h_max of n cells. */
void sph_launch_lengths(struct device *device, const struct sph_cell *cell, int32_t n, const struct sph_rows *rows, float *h_max);
/* What the sums make of the active rows. */
void sph_launch_finish(struct device *device, struct sph_law law, const struct sph_rows *rows, const struct sph_density *sum);
#endif
