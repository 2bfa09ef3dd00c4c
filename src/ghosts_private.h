/* SPDX-License-Identifier: GPL-3.0-or-later
 * Private to ghosts.c and ghosts_tops.c: what a rank knows of the others' cells and rows. */
#ifndef TEPHRA_GHOSTS_PRIVATE_H
#define TEPHRA_GHOSTS_PRIVATE_H
#include "ghosts.h"
#include <stdbool.h>
#include <stddef.h>

/* A message, growing. */
struct buffer { char *data; size_t n, capacity; };

/* Rows [first, first + n) of a species; cells [first, first + n). */
struct span { int32_t kind, first, n; };
struct spans { struct span *span; int64_t n, capacity; };

/* Exchanged with one rank since the last closing: rows with all that is shared, and cells. */
struct peer { struct spans rows_out, rows_in, cells_out, cells_in; };

struct wish { int32_t node; bool rows; struct ghost_want want; };
struct asked { int32_t there; bool rows; struct ghost_want want; };

/* Of a cell that is away: whose it is, its number there, and which of its rows' columns are here. */
struct away { int32_t owner, there; int8_t rows; };

struct ghosts {
    struct peer *peer;          /* one a rank */
    struct wish *wish;
    int64_t n_wishes, wishes_room;
    struct away *away;          /* one a cell */
    int32_t away_room;
    bool used;                  /* something was opened since the last forgetting */
    struct ghost_counts counts;
    int32_t *top, *top_from;    /* the topmost cells of all ranks, in the order of these; where each rank's begin, and their end */
};

/* Of this simulation; made at the first call. */
struct ghosts *ghosts_of(struct sim *sim);
void ghosts_reserve_away(struct ghosts *g, const struct tree *tree);
void ghosts_put(struct buffer *b, const void *from, size_t bytes);
/* *from moves on. */
void ghosts_take(const char **from, void *to, size_t bytes);
#endif
