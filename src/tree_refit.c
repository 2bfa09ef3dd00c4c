/* SPDX-License-Identifier: GPL-3.0-or-later
 * The octree between two builds: refit, follow, and which cells hold active rows. */
#include "tree_box.h"
#include "comm.h"
#include "ghosts.h"
#include "mem.h"
#include <string.h>

/* Cells below which a loop is not worth waking threads for. */
enum { MANY = 8192 };

static void drift(struct node *node, double dt)
{
    float growth = above((double)node->speed * dt);
    for (int k = 0; k < 3; k++) {
        node->pos[k] += dt * (double)node->vel[k];
        node->low[k] = below((double)(node->low[k] - growth));
        node->high[k] = above((double)(node->high[k] + growth));
    }
    node->slack += growth;
}

static void fit_leaf(const struct sim *sim, struct node *node)
{
    open_box(node);
    for (const struct species *s = sim->species; s < sim->species + N_SPECIES; s++)
        for (int64_t i = node->first[s->kind], end = i + node->count[s->kind]; i < end; i++) widen_for_row(sim, node, s, i);
}

static void fit_inner(const struct tree *tree, struct node *node)
{
    open_box(node);
    for (int32_t k = 0; k < node->n_children; k++) widen_for_child(node, &tree->node[node->child + k]);
}

/* A box is fitted anew when it has grown, on every side, by this part of its width. In Sedov's explosion with
 * steps of 1:1e4, where a few hot rows cross the gas while the rest sleeps, walks otherwise meet their boxes everywhere. */
static const float loose = 1.0f / 8;

static bool is_loose(const struct node *node)
{
    float width = 0;
    for (int k = 0; k < 3; k++) {
        const float side = node->high[k] - node->low[k];
        width = side > width ? side : width;
    }
    return node->slack > loose * width;
}

/* Cells above what was fitted, whose rows are of several ranks: the same on every rank. */
static void fit_tops(struct sim *sim)
{
    struct tree *tree = &sim->tree;
    ghosts_share_tops(sim, NULL);
    for (int32_t n = tree->n_top - 1; n >= 0; n--) {
        struct node *node = &tree->node[n];
        if (node->slack > 0) continue;
        if (node->place == NODE_TOP) fit_inner(tree, node);
        if (node->parent >= 0) tree->node[node->parent].slack = 0;
    }
}

void tree_refit(struct sim *sim)
{
    struct tree *tree = &sim->tree;
    double dt = timeline_seconds(&sim->time, sim->time.tick - tree->fitted);
    int64_t fitted = 0;
    tree->fitted = sim->time.tick;
    ghosts_close(sim);
    if (!(dt > 0)) return;
#pragma omp parallel for reduction(+ : fitted) if (tree->n_nodes > MANY)
    for (int32_t n = 0; n < tree->n_nodes; n++) {
        struct node *node = &tree->node[n];
        drift(node, dt);
        if (!is_own_leaf(node) || !is_loose(node)) continue;
        fit_leaf(sim, node);
        fitted++;
    }
    if (tree->n_top > 0) comm_sum_int(&fitted, 1);
    for (int32_t n = tree->n_nodes - 1; n >= 0 && fitted > 0; n--) {
        struct node *node = &tree->node[n];
        if (node->slack > 0 || node->place != NODE_OWN) continue;
        if (node->n_children > 0) fit_inner(tree, node);
        if (node->parent >= 0 && tree->node[node->parent].place == NODE_OWN) tree->node[node->parent].slack = 0;
    }
    if (tree->n_top > 0 && fitted > 0) fit_tops(sim);
}

/* Lists of rows of some species, ascending, from a place on: cells are visited in the order of the keys, and every row is passed
 * once, in its leaf, instead of searched for in all cells above. */
struct rows {
    int n;
    struct { const int32_t *at, *end; int species; } list[N_SPECIES];
};

static void rows_add(struct rows *rows, int species, const int32_t *row, int64_t n)
{
    if (n == 0) return;
    rows->list[rows->n].at = row;
    rows->list[rows->n].end = row + n;
    rows->list[rows->n++].species = species;
}

static inline int32_t end_of(const struct node *node, int species) { return node->first[species] + node->count[species]; }

/* Whether the next row of a species lies in this cell; those before it have been passed. */
static bool reaches(const struct rows *rows, const struct node *node)
{
    for (int k = 0; k < rows->n; k++) {
        const int s = rows->list[k].species;
        if (rows->list[k].at < rows->list[k].end && *rows->list[k].at < end_of(node, s)) return true;
    }
    return false;
}

/* Passes the rows of a leaf; returns how many. */
static int32_t pass(struct rows *rows, const struct node *leaf)
{
    int32_t passed = 0;
    for (int k = 0; k < rows->n; k++) {
        const int32_t *const from = rows->list[k].at, end = end_of(leaf, rows->list[k].species);
        while (rows->list[k].at < rows->list[k].end && *rows->list[k].at < end) rows->list[k].at++;
        passed += (int32_t)(rows->list[k].at - from);
    }
    return passed;
}

/* Returns how many rows lie in the cell. */
static int32_t mark(struct tree *tree, int32_t n, struct rows *rows)
{
    const struct node *node = &tree->node[n];
    int32_t active = 0;
    for (int32_t c = node->child; c >= 0 && c < node->child + node->n_children; c++)
        if (reaches(rows, &tree->node[c])) active += mark(tree, c, rows);
    if (node->child < 0) active = pass(rows, node);
    tree->active_count[n] = active;
    return active;
}

void tree_mark_active(struct sim *sim)
{
    struct tree *tree = &sim->tree;
    if (tree->n_nodes == 0) return;
    int64_t idle = 0;
    struct rows rows = {0};
    for_species(sim, s) {
        rows_add(&rows, s->kind, s->active, s->n_active);
        idle += s->n - s->n_active;
    }
    if (idle > 0) {     /* rows of other ranks are none of the active ones */
        memset(tree->active_count, 0, (size_t)tree->n_nodes * sizeof *tree->active_count);
        if (rows.n > 0) mark(tree, 0, &rows);
        return;
    }
    for (int32_t n = 0; n < tree->n_nodes; n++) tree->active_count[n] = (int32_t)node_rows(&tree->node[n], ALL_SPECIES);
}

static void follow(struct sim *sim, int32_t n, struct rows *rows)
{
    struct node *node = &sim->tree.node[n];
    for (int32_t c = node->child; c >= 0 && c < node->child + node->n_children; c++) {
        if (!reaches(rows, &sim->tree.node[c])) continue;
        follow(sim, c, rows);
        widen_for_child(node, &sim->tree.node[c]);
    }
    const bool away = node_is_closed(node);     /* another rank's alone */
    for (int k = 0; k < rows->n && node->child < 0; k++) {
        const struct species *s = &sim->species[rows->list[k].species];
        const int32_t end = end_of(node, s->kind);
        for (; rows->list[k].at < rows->list[k].end && *rows->list[k].at < end; rows->list[k].at++)
            if (!away) widen_for_row(sim, node, s, *rows->list[k].at);
    }
}

/* Whether an ascending list has a row of [first, end). */
static bool has_row(const int32_t *from, const int32_t *to, int32_t first, int32_t end)
{
    while (from < to) {
        const int32_t *middle = from + (to - from) / 2;
        if (*middle < first) from = middle + 1;
        else if (*middle < end) return true;
        else to = middle;
    }
    return false;
}

/* The cells of several ranks follow from their topmost cells: of those that have followed rows. */
static void follow_tops(struct sim *sim, const struct rows *rows)
{
    struct tree *tree = &sim->tree;
    bool *moved = mem_array("tree", bool, tree->n_top);
    for (int32_t n = 0; n < tree->n_top; n++)
        for (int k = 0; k < rows->n && !moved[n]; k++) {
            const int s = rows->list[k].species;
            moved[n] = has_row(rows->list[k].at, rows->list[k].end, tree->node[n].first[s], end_of(&tree->node[n], s));
        }
    ghosts_share_moved(sim, moved);
    for (int32_t n = tree->n_top - 1; n > 0; n--) {
        struct node *node = &tree->node[n];
        if (!moved[n]) continue;
        widen_for_child(&tree->node[node->parent], node);
        moved[node->parent] = true;
    }
    mem_free(moved);
}

void tree_follow(struct sim *sim)
{
    if (sim->tree.n_nodes == 0) return;
    struct rows rows = {0};
    for_species(sim, s) rows_add(&rows, s->kind, s->ending, s->n_ending);
    const struct rows all = rows;
    follow(sim, 0, &rows);
    if (sim->tree.n_top > 0) follow_tops(sim, &all);
}

void tree_follow_rows(struct sim *sim, enum species_kind kind, const int32_t *row, int64_t n)
{
    struct rows rows = {0};
    rows_add(&rows, kind, row, n);
    if (sim->tree.n_nodes > 0) follow(sim, 0, &rows);
}

struct sweep { const struct sim *sim; tree_measure *measure; const void *data; };

static void sweep_paths(const struct sweep *sweep, int32_t n, struct rows *rows)
{
    const struct tree *tree = &sweep->sim->tree;
    const struct node *node = &tree->node[n];
    for (int32_t c = node->child; c >= 0 && c < node->child + node->n_children; c++)
        if (reaches(rows, &tree->node[c])) sweep_paths(sweep, c, rows);
    if (node->child < 0) pass(rows, node);
    if (!node_is_closed(node)) sweep->measure(sweep->sim, sweep->data, n);      /* closed: another rank's alone */
}

void tree_sweep(struct sim *sim, enum species_kind kind, const int32_t *row, int64_t n_rows, tree_measure *measure, const void *of)
{
    const struct tree *tree = &sim->tree;
    if (tree->n_nodes == 0) return;
    if (row) {
        struct rows rows = {0};
        rows_add(&rows, kind, row, n_rows);
        sweep_paths(&(struct sweep){sim, measure, of}, 0, &rows);
        return;
    }
#pragma omp parallel for schedule(dynamic, 1024)
    for (int32_t n = 0; n < tree->n_fixed; n++)
        if (is_own_leaf(&tree->node[n])) measure(sim, of, n);
    for (int32_t n = tree->n_fixed - 1; n >= 0; n--)
        if (tree->node[n].n_children > 0 && tree->node[n].place == NODE_OWN) measure(sim, of, n);
}
