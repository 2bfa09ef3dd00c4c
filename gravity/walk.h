/* SPDX-License-Identifier: GPL-3.0-or-later
 * Private to the walks: what one thread carries, and its group of target rows (group.c). */
#ifndef TEPHRA_GRAVITY_WALK_H
#define TEPHRA_GRAVITY_WALK_H
#include "mem.h"
#include "stage.h"
#include "walk_engine.h"

/* A growing list of cells. */
struct list { int32_t *item; int64_t n, capacity; };
static inline void list_reserve(struct list *list, int64_t n)
{
    if (n <= list->capacity) return;
    list->capacity = n + n / 2 + 64;
    list->item = mem_resize("gravity", list->item, (size_t)list->capacity * sizeof *list->item);
}
static inline void list_add(struct list *list, int32_t item)
{
    list_reserve(list, list->n + 1);
    list->item[list->n++] = item;
}

struct row { int32_t species, index; };

struct walk {
    struct sim *sim;
    const struct gravity *g;
    enum gravity_output output;
    bool potential;
    double theta, alpha;        /* of the opening, scaled */
    float quadrupole;           /* |M_2| is this times power[0] */
    struct list waiting;        /* a stack: sources handed down, level below level */
    struct list parents, parents_far, opened, opened_far, local, near, far;   /* of the present target; `far` is a stack too */
    struct list verdict;        /* one a source being judged */
    struct list path;           /* from the task to the root */
    struct gravity_targets targets;
    struct row *row;            /* of the targets */
    bool lone;                  /* the target is one row, picked out of its group */
    struct gravity_sources own, sources;    /* the group's rows; a tile of others */
    struct stage stage;         /* about the group's centre */
    int64_t pairs, cells;       /* counted interactions */
    bool missing;               /* the present target has met a cell that is not here as it needs it */
    bool domain;                /* what is missing for large targets is asked for with all that the own cells may need */
    double low[3], high[3];     /* box of the active rows */
    const int64_t *everywhere;  /* active rows of all ranks in the first n_everywhere cells; the others are this rank's alone */
    int32_t n_everywhere;
    struct list again;          /* targets for which something was missing */
};

/* w: zeros, or of an earlier walk, whose memory serves again: a step of one row would spend half its time on that. */
void walk_open(struct walk *w, struct sim *sim, const struct gravity *g, enum gravity_output output);
void walk_close(struct walk *w);
/* Cell n as a target; unit of its parent, 0: none. */
struct gravity_view walk_view(const struct walk *w, int32_t n, double parent_unit);
/* Judges waiting[from, to) and whatever is opened on the way; what is left waits behind `to`. */
void walk_judge(struct walk *w, const struct gravity_view *v, int64_t from, int64_t to);
/* Listed cells, about the target's centre. */
struct gravity_far walk_far(const struct walk *w, const struct gravity_view *v, const struct list *list);
/* The parent's expansion about this target's centre, in its unit. */
void walk_inherit(float *local, const float *parent, const struct gravity_view *from, const struct gravity_view *to, int order);
/* Asks for the rows of the leaves in `near` that are not here. */
void walk_want_rows(struct walk *w, int32_t target);

/* What a target has from its parent: sources waiting[first, end), and, unless the view is NULL, an expansion. */
struct walk_inherited { int64_t first, end; const struct gravity_view *view; const float *local; };
/* Active rows of all ranks in the first *n cells, those that may hold other ranks' rows; the caller's. All ranks. None are counted
 * unless it `counts`. */
int64_t *walk_count_active(const struct sim *sim, bool counts, int32_t *n);
/* Whether the rows of a target cell are better served one by one, and that (walk_row.c). */
bool walk_has_few(const struct walk *w, int32_t n);
void walk_rows(struct walk *w, int32_t n, const struct walk_inherited *from);

/* The active own rows of a cell become the targets; all its rows act on them. Cells that act on them
 * have the unit of length `unit`. */
void walk_begin_group(struct walk *w, const double centre[3], double unit, const struct node *node);
/* The same of one row of the cell alone. */
void walk_begin_row(struct walk *w, const double centre[3], double unit, const struct node *node, struct row row);
/* Depth and acceleration of the first target. */
void walk_add_field(struct walk *w, const double field[4]);
void walk_add_local(struct walk *w, const float *local);
/* The rows of these leaves, but for the group's own, act on the targets. */
void walk_add_leaves(struct walk *w, const struct list *leaves, int32_t own);
/* Rows [from, to) of a species, likewise, by tiles. */
void walk_add_range(struct walk *w, const struct species *s, int64_t from, int64_t to);
/* Sums to the rows. */
void walk_end_group(struct walk *w);
#endif
