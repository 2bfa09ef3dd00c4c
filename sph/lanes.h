/* SPDX-License-Identifier: GPL-3.0-or-later
 * Between the drivers of SPH and its vectorised loops: a handful of rows, one a lane, meets a list of
 * tile entries, one after the other. lanes_simd.c is compiled for three instruction sets; which of
 * the tables is used is decided once, when the module begins. */
#ifndef TEPHRA_SPH_LANES_H
#define TEPHRA_SPH_LANES_H
#include "pair.h"
#include <stdbool.h>
#include <stdint.h>

enum { SPH_LANES = 8, SPH_TILE = 4096, SPH_BLOCK = 16, SPH_BLOCKS = SPH_TILE / SPH_BLOCK };

/* Rows of a cluster; unused lanes repeat the last row. */
struct sph_lanes {
    float x[SPH_LANES], y[SPH_LANES], z[SPH_LANES], half_h[SPH_LANES];
    float vx[SPH_LANES], vy[SPH_LANES], vz[SPH_LANES], mass[SPH_LANES];
    float p[SPH_LANES], rho[SPH_LANES], half_c[SPH_LANES], balsara[SPH_LANES];
};

/* The rows that a batch may meet, staged: predicted to now, relative to the batch's centre. Place and
 * state are read one entry at a time, the first four by the filter along the tile. */
struct sph_tile {
    float x[SPH_TILE], y[SPH_TILE], z[SPH_TILE], reach[SPH_TILE], mass[SPH_TILE];
    struct sph_place place[SPH_TILE];
    struct sph_state state[SPH_TILE];
    uint16_t list[SPH_TILE + 16];   /* the filter writes a vector at a time */
    float r2[SPH_TILE][SPH_LANES];
    int n;
    /* Boxes of SPH_BLOCK entries that follow each other, and which, in the order of the rows, lie near each other;
     * blocks = 0: not made. */
    float block_centre[3][SPH_BLOCKS], block_half[3][SPH_BLOCKS], block_reach[SPH_BLOCKS];
    int blocks;
};

struct sph_box { float centre[3], half[3]; };

struct sph_density_sums { float rho[SPH_LANES], div[SPH_LANES], curl[3][SPH_LANES], swell[SPH_LANES]; };
struct sph_force_sums { float acc[3][SPH_LANES], du[SPH_LANES], signal[SPH_LANES]; };

/* Search for the radius that holds `target` rows, each lane's own row among them. */
struct sph_search {
    float target;                   /* exact: number of rows; smooth: the sum of w (m_j/m_i) pi */
    float guess[SPH_LANES];         /* in: squared radius; out: the squared radius 4h^2 */
    float limit[SPH_LANES];         /* squared radius within which the tile is complete */
    bool found[SPH_LANES];
};

typedef void sph_density_loop(const struct sph_lanes *i, const struct sph_tile *tile, int n, struct sph_density_sums *sums);
typedef void sph_force_loop(const struct sph_lanes *i, const struct sph_tile *tile, int n, struct sph_viscosity visc,
                            struct sph_force_sums *sums);
typedef void sph_search_loop(const struct sph_lanes *i, struct sph_tile *tile, int n, struct sph_search *search);

struct sph_loops {
    /* Makes the tile's blocks, so that many clusters can be filtered faster. */
    void (*enclose)(struct sph_tile *tile);
    /* Entries of the tile within rows + max(least, their tile->reach) of the box go to tile->list; their number. */
    int (*filter)(struct sph_tile *tile, struct sph_box box, float rows, float least);
    /* Of these, the entries that meet at least one of the lanes stay listed; their number. tile->reach: other h_j. */
    int (*prune)(const struct sph_lanes *i, struct sph_tile *tile, int n, struct sph_meet meet);
    sph_search_loop *search_exact, *search_smooth[SPH_KERNELS];
    sph_density_loop *density[SPH_KERNELS][2];      /* [kernel][grad_h] */
    sph_force_loop *force[SPH_KERNELS][2][2][2];    /* [kernel][grad_h][signal velocity][conducting] */
};
extern const struct sph_loops sph_loops_v2, sph_loops_v3, sph_loops_v4;
#endif
