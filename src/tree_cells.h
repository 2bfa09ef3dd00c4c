/* SPDX-License-Identifier: GPL-3.0-or-later
 * Private to the tree: rows into key order, and the cells that the keys imply. */
#ifndef TEPHRA_TREE_CELLS_H
#define TEPHRA_TREE_CELLS_H
#include <stdbool.h>

struct sim;

/* Sorts every species by key (ties by id) and makes the cells with their row ranges; geometry is
 * left to tree.c. False, with sim_fail, if a position is not finite. */
bool tree_cells(struct sim *sim);
#endif
