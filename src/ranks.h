/* SPDX-License-Identifier: GPL-3.0-or-later
 * Rows on several ranks. A rank works on its own rows, those in its domain: an interval of the keys, cut between cells of
 * the tree, so that forces do not depend on the number of ranks.
 *
 * Where no module of the scene stands against it, rows are spread: a rank holds its own, and cells and rows of others as far
 * as it asked for them (ghosts.h). Else every rank holds all rows, in the same order, and what each computes is
 * sent to all after H, DENSITY and the end of the step. */
#ifndef TEPHRA_RANKS_H
#define TEPHRA_RANKS_H
#include "species.h"
#include <stdbool.h>

struct sim;

/* Rows of a cell that is not cut between domains, if nobody has larger groups: well below a domain. */
enum { RANKS_ATOM = 512 };

/* Whether rows can be spread from the start on: nothing that is known before they are there stands against it. */
bool ranks_will_spread(const struct sim *sim);
/* Rows that every rank has made become spread. */
void ranks_spread(struct sim *sim);
/* Before the first step: rows become spread if they are not, or are taken together again if a module has found what stands
 * against it; the log says which it is. */
void ranks_settle(struct sim *sim);
/* Of values of the rows [species_from, species_to), those of all rows. */
void ranks_sum(const struct sim *sim, double *values, int count);
void ranks_max(const struct sim *sim, double *values, int count);
/* What is wrong (NULL: nothing) on the first rank that has something to tell becomes a problem on all of them. */
void ranks_tell(struct sim *sim, const char *wrong);
/* After a build: each rank's own rows, balanced by the updates due until the next full step. */
void ranks_divide(struct sim *sim);
/* Sends columns of the own active rows to the other ranks; of spread rows, of all those that have been asked for.
 * `columns`: bits 1 << COLUMN_x. */
void ranks_share(struct sim *sim, uint64_t columns);
/* In EVENT: room for new rows at the end of a species, the same on every rank; returns the first. Columns are
 * zero. They are the last rank's, and no cell's, until the tree is rebuilt at the next step. */
int64_t ranks_append(struct sim *sim, enum species_kind kind, int64_t rows);
/* In EVENT: takes a row, on every rank alike. It loses its mass now, is in no snapshot, and is dropped when the tree is
 * rebuilt, at the next step if it is gas. The species must be marked `shrinks`. */
void ranks_remove(struct sim *sim, enum species_kind kind, int64_t row);
/* At the end of a step: every KEEP column of the active rows, and the rungs of sleepers that any
 * rank has woken. Of spread rows nothing: they are asked for anew. */
void ranks_share_rows(struct sim *sim);
/* Whether sim->failure is set on any rank. */
bool ranks_failed(const struct sim *sim);
#endif
