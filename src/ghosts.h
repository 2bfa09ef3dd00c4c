/* SPDX-License-Identifier: GPL-3.0-or-later
 * Copies of other ranks' cells and rows. Each rank holds a pruned copy of the one octree: its own branches whole, and the
 * topmost cells of the others, closed. A walk that must go into a closed cell, or needs rows that are not here, says so
 * (ghosts_want), leaves what it was about undone, and is repeated after ghosts_open, until no rank wants anything. So what is
 * here follows from what was asked for, whatever the criterion, and is exact. Where nothing is spread (sim->spread), nothing
 * of all this happens.
 *
 * Copies are as fresh as they were when they came; ghosts_share and ghosts_share_nodes bring what has changed since. They are
 * closed when the rows begin to move again. */
#ifndef TEPHRA_GHOSTS_H
#define TEPHRA_GHOSTS_H
#include "tree.h"

struct sim;
struct ghosts;

/* How much of a row is asked for. */
enum ghost_rows { GHOST_NONE, GHOST_MOTION, GHOST_ALL };    /* no rows; position, velocity, mass, steps; whatever rows share */

/* Which cells below the wanted one are likely to be needed too, and come at once: those whose side is above `angle` times their
 * distance from the box [low, high] (INFINITY: those that meet it), or, if `domain`, from all of this rank's own cells. Of cells
 * with at most `leaf` rows (0: of cells that are not split) the rows come, not the children. */
struct ghost_want { double low[3], high[3]; float angle; int32_t leaf; bool domain; enum ghost_rows rows; };

/* Any thread. rows: those of the cell are needed; else its children. */
void ghosts_want(const struct sim *sim, int32_t node, bool rows, const struct ghost_want *want);
/* Exchanges what all ranks want; false if that is nothing. New cells are the last ones. All ranks. */
bool ghosts_open(struct sim *sim);
/* Whether the rows of a cell are here. */
bool ghosts_have_rows(const struct sim *sim, int32_t node, enum ghost_rows rows);
/* Columns of the rows that other ranks hold copies of (GHOST_ALL); all ranks. */
void ghosts_share(struct sim *sim, uint64_t columns);
/* A node column of the topmost cells, and of the cells that were opened; all ranks. */
void ghosts_share_top_column(struct sim *sim, enum node_column column);
void ghosts_share_node_column(struct sim *sim, enum node_column column);
/* The cells that were opened are closed; their rows' memory stays for the next ones. */
void ghosts_close(struct sim *sim);
/* And the rows' memory is given back, before the tree is built anew. */
void ghosts_forget(struct sim *sim);
void ghosts_free(struct ghosts *ghosts);
/* Ghost rows and cells that came, rounds of asking, bytes sent for them, and for the topmost cells, since the start. */
struct ghost_counts { int64_t cells, rows, rounds, bytes, top_bytes; };
struct ghost_counts ghosts_counts(const struct sim *sim);

/* For tree.c: the topmost cells as their ranks have them, with `closest` of each unless NULL; of those alone that have moved. */
void ghosts_share_tops(struct sim *sim, float *closest);
void ghosts_share_moved(struct sim *sim, bool *moved);
#endif
