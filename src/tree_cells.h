/* SPDX-License-Identifier: GPL-3.0-or-later
 * Private to the tree: rows into key order, their division among ranks, and the cells that the keys imply. */
#ifndef TEPHRA_TREE_CELLS_H
#define TEPHRA_TREE_CELLS_H
#include "key.h"
#include "species.h"

struct sim;
struct tree;

struct cells {
    struct sim *sim;
    struct tree *tree;
    double scale;                       /* grid cells a unit length: 2^42 / side */
    uint64_t *high[N_SPECIES];          /* upper half of the key, of the rows that are here whatever happens, in their order */
    int64_t from[N_SPECIES];            /* the first of these rows */
};

/* The root's cube of rows within low and high: its side a power of two and its corner on a grid of an eighth of that, so
 * that the cells stay put while the outermost rows move a little. */
void tree_cells_cube(struct tree *tree, const double low[3], const double high[3]);
/* Sorts every species by key (ties by id) and makes the cells with their row ranges; geometry is
 * left to tree.c. NULL, with sim_fail, if a position is not finite. */
struct cells *tree_cells_begin(struct sim *sim);
/* Splits a leaf although it is small. Its children are the last nodes; none if its rows lie at one place. */
void tree_cells_split(struct cells *cells, int32_t leaf);
void tree_cells_end(struct cells *cells);

/* All of it, and the centres and boxes of all cells, on the device of the simulation (tree_device.c). False where the CPU
 * has to do it: a position is not finite, or rows do not fit (--device auto). Other faults of the device stop the run. */
bool tree_cells_device(struct sim *sim);

/* For domains.c. The whole key of a row that is here. */
struct key tree_cells_key(const struct cells *cells, int s, int64_t row);
/* First row of [from, to) whose octant at `level` is at least `wanted`; the rows agree above that level. */
int32_t tree_cells_boundary(const struct cells *cells, int s, int32_t from, int32_t to, int level, int wanted);
int32_t tree_cells_add(struct tree *tree, int32_t count);
/* Level at which keys between these two first lie in different octants; beyond KEY_LEVELS if never. */
int tree_cells_level(struct key first, struct key last);

/* domains.c. Sends every row to the rank in whose domain (sim->domains) its key lies: work is even among ranks, or nearly so
 * where that is cheaper, and no cell with less than largest_group rows is cut. Rows are in key order before; after it, those
 * from each rank are. */
struct domains;
void domains_exchange(struct cells *cells);
/* The cells that hold rows of several ranks and, below these, each rank's topmost cells with their row ranges. */
void domains_tops(struct cells *cells);
void domains_free(struct domains *domains);
#endif
