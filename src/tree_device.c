/* SPDX-License-Identifier: GPL-3.0-or-later
 * The tree on a device: rows go over unless they are there; the order of their keys and the cells come back. */
#include "tree_cells.h"
#include "comm.h"
#include "device.h"
#include "device_rows.h"
#include "mem.h"
#include "sim.h"
#include "tree_engine.h"

static void permute(struct sim *sim, struct tree_engine *engine)
{
    for_species(sim, s) {
        int32_t *order = mem_array("sort", int32_t, s->n);
        tree_engine_order(engine, s->kind, order);
        if (!device_error(sim->device)) species_permute(s, order, s->n);
        mem_free(order);
    }
}

static void fetch_nodes(struct tree *tree, int32_t n)
{
    tree->n_nodes = n;
    tree->n_top = 0;
    tree->capacity = n + n / 32;
    tree->node = mem_resize("tree", tree->node, (size_t)tree->capacity * sizeof *tree->node);
    tree_engine_nodes(tree->engine, tree->node);
}

bool tree_cells_device(struct sim *sim)
{
    struct tree *tree = &sim->tree;
    struct tree_rows rows[N_SPECIES] = {{0}};
    double extent[2][3];
    for_species(sim, s) {
        const struct species there = rows_there(sim, s->kind, COL_MOTION | COL(mass) | COL(id), 0);
        rows[s->kind] = (struct tree_rows){(int32_t)s->n, (const double (*)[3])there.pos, (const double (*)[3])there.vel,
                                           there.mass, (const float (*)[3])there.acc, there.id, there.rung, there.rung0};
    }
    if (!tree->engine) tree->engine = tree_engine_create(sim->device);
    bool finite = tree_engine_rows(tree->engine, &sim->time, rows, extent);
    if (!device_error(sim->device)) {
        if (!finite) return false;      /* the CPU names the row */
        tree_cells_cube(tree, extent[0], extent[1]);
        const int32_t n = tree_engine_build(tree->engine, tree);
        if (!device_error(sim->device)) permute(sim, tree->engine);
        if (!device_error(sim->device)) fetch_nodes(tree, n);
    }
    const char *error = device_error(sim->device);
    return !error || !sim_leave_device(sim, "tree", error);
}
