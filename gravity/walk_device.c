/* SPDX-License-Identifier: GPL-3.0-or-later
 * Solvers tree and fmm on a device: cells, moments and staged rows of the host's tree go over; accelerations and
 * potentials of the active rows come back. */
#include "device.h"
#include "walk.h"
#include <math.h>

/* The active groups and their targets; row[i] is where target i's force belongs. */
struct wanted { struct walk_groups groups; struct row *row; };

static void wanted_free(struct wanted *w)
{
    mem_free((void *)w->groups.view);
    mem_free((void *)w->groups.first);
    mem_free((void *)w->groups.target);
    mem_free(w->row);
}

/* The active own rows of the leaves of cell n, in the order of the keys, behind `at` others. */
static int32_t list_targets(const struct sim *sim, const struct gravity *g, int32_t n, struct walk_target *target, struct row *row)
{
    const struct gravity_cell *cell = &g->cell[n];
    int32_t at = 0, place = g->leaf[n].first;
    if (sim->tree.active_count[n] == 0) return 0;
    for (int32_t c = cell->child; c < cell->child + cell->n_children; c++) at += list_targets(sim, g, c, target + at, row + at);
    if (cell->n_children > 0) return at;
    const struct node *node = &sim->tree.node[n];
    for (int k = 0; k < N_SPECIES; k++) {
        const struct species *s = &sim->species[k];
        for (int32_t i = node->first[k]; i < node->first[k] + node->count[k]; i++, place++) {
            if (i < s->own || i >= s->own + s->n_own || !timeline_active(&sim->time, s->rung[i])) continue;
            target[at] = (struct walk_target){place, n};
            row[at++] = (struct row){k, i};
        }
    }
    return at;
}

/* Groups with active rows among all groups, and where each one's targets begin. */
static int32_t *active_groups(const struct sim *sim, const struct gravity *g, struct walk_groups *groups)
{
    int32_t *group, all = tree_groups(&sim->tree, ALL_SPECIES, g->opening.group_size, "gravity", &group);
    int32_t *first = mem_array("gravity", int32_t, all + 1);
    for (int32_t i = 0; i < all; i++) {
        if (sim->tree.active_count[group[i]] == 0) continue;
        group[groups->n] = group[i];
        first[groups->n + 1] = first[groups->n] + sim->tree.active_count[group[i]];
        groups->n++;
    }
    groups->first = first;
    return group;
}

static struct wanted wanted_make(struct walk *w)
{
    const struct sim *sim = w->sim;
    struct wanted wanted = {0};
    int32_t *group = active_groups(sim, w->g, &wanted.groups), n = wanted.groups.n;
    const int32_t *first = wanted.groups.first;
    struct gravity_view *view = mem_array("gravity", struct gravity_view, n);
    struct walk_target *target = mem_array("gravity", struct walk_target, first[n]);
    wanted.row = mem_array("gravity", struct row, first[n]);
#pragma omp parallel for schedule(static)
    for (int32_t i = 0; i < n; i++) {
        const int32_t parent = sim->tree.node[group[i]].parent;
        view[i] = walk_view(w, group[i], parent >= 0 ? walk_view(w, parent, 0).unit : 0);
        list_targets(sim, w->g, group[i], target + first[i], wanted.row + first[i]);
    }
    wanted.groups.view = view;
    wanted.groups.target = target;
    mem_free(group);
    return wanted;
}

/* Every leaf is somebody's source. */
static void stage_leaves(const struct sim *sim, const struct gravity *g)
{
#pragma omp parallel for schedule(dynamic, 256)
    for (int32_t n = 0; n < g->n_cells; n++)
        if (g->cell[n].scale > 0 && g->cell[n].n_children == 0) gravity_rows_leaf(sim, g, n);
}

static void send_sources(const struct sim *sim, const struct gravity *g)
{
    int64_t rows = 0;
    for_species(sim, s) rows += s->n;
    stage_leaves(sim, g);
    walk_engine_sources(g->walk_engine, &(struct walk_sources){
        .n_cells = g->n_cells, .n_rows = rows, .cell = g->cell, .leaf = g->leaf, .moment = sim->tree.moment,
        .width = sim->tree.width[NODE_moment], .row = g->row, .soft = g->pair_form == SOFT_COMMON ? NULL : g->soft,
        .order = g->opening.order, .form = (int)g->pair_form, .unit = g->unit, .far_soft2 = g->far_soft2});
}

static void deliver(const struct walk *w, const struct wanted *wanted, float (*field)[4])
{
#pragma omp parallel for schedule(static)
    for (int32_t i = 0; i < wanted->groups.first[wanted->groups.n]; i++) {
        const struct species *s = &w->sim->species[wanted->row[i].species];
        const int32_t n = wanted->row[i].index;
        const float *a = field[i];
        if (s->grav) s->grav[n] = sqrtf(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
        for (int k = 0; k < 3 && w->output == OUTPUT_FORCE; k++) s->acc[n][k] += a[k];
        if (w->potential) s->pot[n] = a[3];
    }
}

bool gravity_walk_device(struct sim *sim, struct gravity *g, enum gravity_output output)
{
    struct walk w = {0};
    walk_open(&w, sim, g, output);
    struct wanted wanted = wanted_make(&w);
    float (*field)[4] = mem_alloc("gravity", (size_t)wanted.groups.first[wanted.groups.n] * sizeof *field);
    if (!g->walk_engine) g->walk_engine = walk_engine_create(sim->device, 0);
    send_sources(sim, g);
    walk_engine_sum(g->walk_engine, &wanted.groups, field);
    const struct walk_counts counts = walk_engine_counts(g->walk_engine);
    const char *error = device_error(sim->device);
    if (!error) deliver(&w, &wanted, field);
    g->pairs = counts.pairs;
    g->cells = counts.cells;
    mem_free(field);
    wanted_free(&wanted);
    walk_close(&w);
    return !error || !sim_leave_device(sim, "gravity", error);
}
