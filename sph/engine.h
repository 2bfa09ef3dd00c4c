/* SPDX-License-Identifier: GPL-3.0-or-later
 * SPH on a device: one warp for a group of up to 32 active rows searches their smoothing lengths, sums
 * densities, sums forces; each time it walks the tree for the rows in reach. engine_cuda.cu is built where
 * nvcc works, engine_none.c elsewhere.
 *
 * Rows stay on the device (device_rows.h). Formulas and the rules of the search are the CPU's (pair.h, row.h, search.h). A
 * row's sums run over its neighbours in the order of the walk, which depends on the tree alone. */
#ifndef TEPHRA_SPH_ENGINE_H
#define TEPHRA_SPH_ENGINE_H
#include "row.h"

struct device;
struct sph_engine;

enum { SPH_GROUP = 32 };

/* A cell: its box about its centre, its velocity, its gas rows. The parent of the root is -1. */
struct sph_cell {
    double pos[3];
    float vel[3], low[3], high[3];
    int32_t parent, child, n_children, first, count;
};

/* Group i: entries [first, first + n) of the active rows; centre and velocity: where its floats begin. */
struct sph_group { double pos[3]; float vel[3]; int32_t first, n; };
struct sph_groups { int32_t n; const struct sph_group *group; };

/* What to do with which formulas. */
struct sph_plan {
    enum sph_kernel kernel;
    bool signal;
    struct sph_meet meet;
    struct sph_viscosity visc;
    struct sph_law law;
};

/* Search: the squared radius that holds `target` (exact: rows; smooth: m_j w pi over m_i, h = radius/2) and lies within `most`,
 * times scale, makes h. A row looks first margin times as far as it expects to, or, where it knows nothing, as far as the smallest
 * cell around suggests that holds `rows`; one that finds nothing keeps its h, or takes `lone`. */
struct sph_quest { bool smooth; float target, most, margin, rows, lone; double scale; };

/* The rows now: the table as kernels see it (rows_there), the time, and room for what a pass needs of each row (rows_scratch). */
struct sph_rows { struct species gas; struct timeline time; void *scratch; };

/* warps of a block of the sums: 1, 2 or 4; 0 chooses. */
struct sph_engine *sph_engine_create(struct device *device, int warps);
void sph_engine_free(struct sph_engine *engine);
/* What the walks see; it stays until the next call. */
void sph_engine_cells(struct sph_engine *engine, const struct sph_cell *cell, int32_t n);
void sph_engine_groups(struct sph_engine *engine, const struct sph_groups *groups);
/* Places of all rows now, from pos, vel, acc, mass, h, div_v and the rungs. After the cells. */
void sph_engine_places(struct sph_engine *engine, const struct sph_rows *rows);
/* Largest smoothing length in each cell, with room for what sleeping rows grow by; they come home, one a cell. */
void sph_engine_lengths(struct sph_engine *engine, const struct sph_rows *rows, float *h_max);
/* Set h; rho, div_v, curl_v and what follows from them; acc, du and signal (all added to, but for signal) of the active rows.
 * They set nothing if the device failed (device_error). */
void sph_engine_search(struct sph_engine *engine, const struct sph_plan *plan, const struct sph_quest *quest,
                       const struct sph_rows *rows);
void sph_engine_density(struct sph_engine *engine, const struct sph_plan *plan, const struct sph_rows *rows);
void sph_engine_force(struct sph_engine *engine, const struct sph_plan *plan, const struct sph_rows *rows);
#endif
