/* SPDX-License-Identifier: GPL-3.0-or-later
 * Private to the tree: rows into key order, and the cells that the keys imply. */
#ifndef TEPHRA_TREE_CELLS_H
#define TEPHRA_TREE_CELLS_H
#include <stdint.h>

struct sim;

/* Sorts every species by key (ties by id) and makes the cells with their row ranges; geometry is
 * left to tree.c. NULL, with sim_fail, if a position is not finite. */
struct cells;
struct cells *tree_cells_begin(struct sim *sim);
/* Splits a leaf although it is small. Its children are the last nodes; none if its rows lie at one place. */
void tree_cells_split(struct cells *cells, int32_t leaf);
void tree_cells_end(struct cells *cells);
#endif
