/* SPDX-License-Identifier: GPL-3.0-or-later
 * SPH on a device: one warp for a group of up to 32 active rows searches their smoothing lengths, sums
 * densities, sums forces; each time it walks the tree for the rows in reach. engine_cuda.cu is built where
 * nvcc works, engine_none.c elsewhere.
 *
 * Formulas and the rules of the search are the CPU's (pair.h, search.h). A row's sums run over its
 * neighbours in the order of the walk, which depends on the tree alone. */
#ifndef TEPHRA_SPH_ENGINE_H
#define TEPHRA_SPH_ENGINE_H
#include "pair.h"
#include <stdint.h>

struct device;
struct sph_engine;

enum { SPH_GROUP = 32 };

/* A cell: its box about its centre, its velocity, the largest h within, its gas rows. */
struct sph_cell {
    double pos[3];
    float vel[3], low[3], high[3], h_max;
    int32_t child, n_children, first, count;
};

/* All gas rows now, about the centre and the velocity of the leaf that holds them. */
struct sph_rows {
    int64_t n;
    const int32_t *leaf;
    const struct sph_place *place;
};

/* Group i: rows row[group[i].first] and on, n of them; centre and velocity: where its floats begin. */
struct sph_group { double pos[3]; float vel[3]; int32_t first, n; };
struct sph_groups { int32_t n; const struct sph_group *group; const int32_t *row; int64_t n_rows; };

/* What to do with which formulas. */
struct sph_plan {
    enum sph_kernel kernel;
    bool grad_h, signal;
    struct sph_meet meet;
    struct sph_viscosity visc;
};

/* Search: the squared radius that holds `target` (exact: rows; smooth: m_j w pi over m_i, h = radius/2), SPH_FAR where
 * there are not so many within `most`. reach: one a row, where to look first; within it the radius is expected. */
struct sph_quest { bool smooth; float target, most, margin; const float *reach; };

/* warps of a block of the sums: 1, 2 or 4; 0 chooses. */
struct sph_engine *sph_engine_create(struct device *device, int warps);
void sph_engine_free(struct sph_engine *engine);
/* Send what the walks see; it stays until the next call. The state is of FORCE alone. */
void sph_engine_cells(struct sph_engine *engine, const struct sph_cell *cell, int32_t n);
void sph_engine_rows(struct sph_engine *engine, const struct sph_rows *rows);
void sph_engine_state(struct sph_engine *engine, const struct sph_state *state, int64_t n);
void sph_engine_groups(struct sph_engine *engine, const struct sph_groups *groups);
/* One result a row of the groups, in their order. Set nothing if the device failed (device_error). */
void sph_engine_search(struct sph_engine *engine, const struct sph_plan *plan, const struct sph_quest *quest, float *radius2);
void sph_engine_density(struct sph_engine *engine, const struct sph_plan *plan, struct sph_density *sum);
void sph_engine_force(struct sph_engine *engine, const struct sph_plan *plan, struct sph_force *sum);
#endif
