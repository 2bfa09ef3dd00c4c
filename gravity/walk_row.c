/* SPDX-License-Identifier: GPL-3.0-or-later
 * fmm where few rows are active: a target cell with few of them (of all ranks, so that it is the same cell on any number)
 * makes no local expansion. Each of its rows is a target of its own, without extent: cells act on it by all their moments,
 * so they may be larger and the rows nearby fewer. What the cell has inherited, expansion and sources, each row takes on. */
#include "cell.h"
#include "comm.h"
#include "ghosts.h"
#include "walk.h"
#include <string.h>

/* A group's walk and its sums cost as much as those of so many rows on their own: measured (doc/benchmarks.md). */
enum { FEW_ROWS = 8 };
/* A row without extent has none of the terms of its size, by which the bound on a group's errors is the larger: with these its
 * errors are those of groups, from an accuracy of 1e-2 to 1e-5 (tests/test_gravity_few.c). */
static const float theta_row = 0.8f;    /* reach / distance */
static const double stricter = 0.4;     /* part of a group's tolerance */

int64_t *walk_count_active(const struct sim *sim, bool counts, int32_t *n)
{
    *n = comm_size() == 1 || !counts ? 0 : sim->spread ? sim->tree.n_top : sim->tree.n_nodes;
    int64_t *count = mem_array("gravity", int64_t, *n);
    for (int32_t i = 0; i < *n; i++) count[i] = sim->tree.active_count[i];
    if (*n > 0) comm_sum_int(count, *n);
    return count;
}

bool walk_has_few(const struct walk *w, int32_t n)
{
    const int64_t active = n < w->n_everywhere ? w->everywhere[n] : w->sim->tree.active_count[n];
    return active <= FEW_ROWS && active < node_rows(&w->sim->tree.node[n], ALL_SPECIES);
}

static struct gravity_view row_view(const struct walk *w, const struct species *s, int64_t i, int32_t leaf)
{
    struct gravity_view v = walk_view(w, leaf, 0);
    const double factor = v.unit / w->g->unit;
    v.unit = w->g->unit;
    v.support *= (float)factor;
    v.near2 *= (float)(factor * factor);
    v.tolerance *= (float)(stricter / (factor * factor));
    v.theta2 = theta_row * theta_row;
    v.theta2_cell = 0;      /* where all moments do not serve, some do not */
    v.radius = 0;
    v.self = NULL;
    memset(v.half, 0, sizeof v.half);
    sim_predict(&w->sim->time, s, i, v.centre);
    return v;
}

static void settle_row(struct walk *w, const struct gravity_view *v, struct row row, const struct walk_inherited *from)
{
    const int order = w->g->opening.order;
    float local[CELL_TERMS_MAX] = {0};
    double field[4] = {0};
    if (from->view) walk_inherit(local, from->local, from->view, v, order);
    const struct gravity_far far = walk_far(w, v, &w->local);
    if (far.n > 0) w->g->kernels->far->on_row[order - GRAVITY_ORDER_MIN](field, &far);
    for (int k = 0; k < 4; k++) field[k] += (double)local[k];
    walk_begin_row(w, v->centre, v->unit, &w->sim->tree.node[v->cell], row);
    walk_add_field(w, field);
    walk_add_leaves(w, &w->near, v->cell);
    w->cells += far.n;
    walk_end_group(w);
}

/* The active rows of a leaf: looks whether all is here that they need, or sums. */
static void visit_leaf(struct walk *w, int32_t leaf, const struct walk_inherited *from, bool look)
{
    const struct node *node = &w->sim->tree.node[leaf];
    for (int k = 0; k < N_SPECIES; k++) {
        const struct species *s = &w->sim->species[k];
        for (int32_t i = node->first[k]; i < node->first[k] + node->count[k]; i++) {
            if (i < s->own || i >= s->own + s->n_own || !timeline_active(&w->sim->time, s->rung[i])) continue;
            const struct gravity_view v = row_view(w, s, i, leaf);
            walk_judge(w, &v, from->first, from->end);
            if (look) walk_want_rows(w, leaf);
            else settle_row(w, &v, (struct row){k, i}, from);
        }
    }
}

void walk_rows(struct walk *w, int32_t n, const struct walk_inherited *from)
{
    const struct gravity_cell *cell = &w->g->cell[n];
    if (w->sim->tree.active_count[n] == 0) return;
    if (cell->n_children > 0) {
        for (int32_t c = cell->child; c < cell->child + cell->n_children; c++) walk_rows(w, c, from);
        return;
    }
    if (w->sim->spread) visit_leaf(w, n, from, true);
    if (w->missing) {
        list_add(&w->again, n);
        w->missing = false;
    } else {
        visit_leaf(w, n, from, false);
    }
}
