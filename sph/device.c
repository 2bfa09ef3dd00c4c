/* SPDX-License-Identifier: GPL-3.0-or-later
 * The hooks of SPH on a device: cells and rows as they are now go over, what the sums say of the active rows comes
 * back. What becomes of a row by them is told where the CPU tells it (smooth.c, density.c). */
#include "device.h"
#include "engine.h"
#include "mem.h"
#include "sph.h"
#include <math.h>

/* Gas rows of a cell whose active rows are cut into groups: large enough that few groups are left over half full. */
enum { CUT = 4 * SPH_GROUP };

static void send_cells(struct sim *sim, struct sph *sph)
{
    const struct tree *tree = &sim->tree;
    struct sph_cell *cell = mem_array("sph", struct sph_cell, tree->n_nodes);
#pragma omp parallel for schedule(static)
    for (int32_t n = 0; n < tree->n_nodes; n++) {
        const struct node *node = &tree->node[n];
        cell[n] = (struct sph_cell){.h_max = tree->h_max[n], .child = node->child, .n_children = node->n_children,
                                    .first = node->first[GAS], .count = node->count[GAS]};
        for (int k = 0; k < 3; k++) {
            cell[n].pos[k] = node->pos[k];
            cell[n].vel[k] = node->vel[k];
            cell[n].low[k] = node->low[k];
            cell[n].high[k] = node->high[k];
        }
    }
    sph_engine_cells(sph->engine, cell, tree->n_nodes);
    mem_free(cell);
}

static void send_rows(struct sim *sim, struct sph *sph)
{
    const struct tree *tree = &sim->tree;
    const int64_t rows = sim->species[GAS].n;
    int32_t *leaf = mem_array("sph", int32_t, rows);
    struct sph_place *place = mem_array("sph", struct sph_place, rows);
#pragma omp parallel for schedule(dynamic, 256)
    for (int32_t n = 0; n < tree->n_nodes; n++) {
        const struct node *node = &tree->node[n];
        if (node->n_children > 0) continue;
        const double vel[3] = {(double)node->vel[0], (double)node->vel[1], (double)node->vel[2]};
        for (int32_t i = node->first[GAS]; i < node->first[GAS] + node->count[GAS]; i++) {
            leaf[i] = n;
            place[i] = sph_place_about(node->pos, vel, sim, i);
        }
    }
    sph_engine_rows(sph->engine, &(struct sph_rows){rows, leaf, place});
    mem_free(leaf);
    mem_free(place);
}

static void send_state(struct sim *sim, struct sph *sph)
{
    const int64_t rows = sim->species[GAS].n;
    struct sph_state *state = mem_array("sph", struct sph_state, rows);
#pragma omp parallel for schedule(static)
    for (int64_t i = 0; i < rows; i++) state[i] = sph_state_row(sim, sph, (int32_t)i);
    sph_engine_state(sph->engine, state, rows);
    mem_free(state);
}

/* The active rows of each cell with at most CUT gas rows, cut into equal groups of at most SPH_GROUP. */
static void send_groups(struct sim *sim, struct sph *sph)
{
    const struct species *gas = &sim->species[GAS];
    int32_t *cut, cuts = tree_groups(&sim->tree, GAS_BIT, CUT, "sph", &cut), a = 0;
    struct sph_groups groups = {.row = gas->active, .n_rows = gas->n_active};
    struct sph_group *group = mem_array("sph", struct sph_group, cuts + gas->n_active / SPH_GROUP);
    for (int32_t c = 0; c < cuts; c++) {
        const struct node *node = &sim->tree.node[cut[c]];
        int32_t from = a, end = node->first[GAS] + node->count[GAS];
        while (a < gas->n_active && gas->active[a] < end) a++;
        for (int32_t parts = (a - from + SPH_GROUP - 1) / SPH_GROUP; parts > 0; parts--) {
            struct sph_group *g = &group[groups.n++];
            *g = (struct sph_group){.first = from, .n = (a - from) / parts};
            for (int k = 0; k < 3; k++) {
                g->pos[k] = node->pos[k];
                g->vel[k] = node->vel[k];
            }
            from += g->n;
        }
    }
    groups.group = group;
    sph_engine_groups(sph->engine, &groups);
    mem_free(group);
    mem_free(cut);
}

static struct sph_plan plan_of(const struct sph *sph)
{
    return (struct sph_plan){(enum sph_kernel)sph->kernel, sph->grad_h, sph->viscosity == SPH_SIGNAL, sph->meet,
                             sph_viscosity_of(sph)};
}

/* After a pass: true if its results are there; else either the run stops or the CPU does it. */
static bool sound(struct sim *sim, bool *settled)
{
    const char *error = device_error(sim->device);
    *settled = !error || !sim_leave_device(sim, "sph", error);
    return !error;
}

bool sph_device_search(struct sim *sim, struct sph *sph, const struct sph_quest *quest, float *radius2)
{
    bool settled;
    const struct sph_plan plan = plan_of(sph);
    if (!sph->engine) sph->engine = sph_engine_create(sim->device, 0);
    send_cells(sim, sph);
    send_rows(sim, sph);
    send_groups(sim, sph);
    sph_engine_search(sph->engine, &plan, quest, radius2);
    if (!sound(sim, &settled))
        for (int64_t a = 0; a < sim->species[GAS].n_active; a++) radius2[a] = SPH_FAR;
    return settled;
}

bool sph_device_density(struct sim *sim, struct sph *sph)
{
    bool settled;
    const struct species *gas = &sim->species[GAS];
    const struct sph_plan plan = plan_of(sph);
    struct sph_density *sum = mem_array("sph", struct sph_density, gas->n_active);
    send_cells(sim, sph);
    send_rows(sim, sph);
    sph_engine_density(sph->engine, &plan, sum);
    if (sound(sim, &settled)) {
#pragma omp parallel for schedule(static)
        for (int64_t a = 0; a < gas->n_active; a++) sph_finish_density(sim, sph, gas->active[a], &sum[a]);
    }
    mem_free(sum);
    return settled;
}

bool sph_device_force(struct sim *sim, struct sph *sph)
{
    bool settled;
    const struct species *gas = &sim->species[GAS];
    const struct sph_plan plan = plan_of(sph);
    struct sph_force *sum = mem_array("sph", struct sph_force, gas->n_active);
    send_state(sim, sph);
    sph_engine_force(sph->engine, &plan, sum);
    const bool there = sound(sim, &settled);
    for (int64_t a = 0; there && a < gas->n_active; a++) {
        const int32_t i = gas->active[a];
        const struct sph_force f = sum[a];
        gas->acc[i][0] += f.ax;
        gas->acc[i][1] += f.ay;
        gas->acc[i][2] += f.az;
        if (gas->du) gas->du[i] += f.du;
        if (gas->signal) gas->signal[i] = f.signal;
    }
    mem_free(sum);
    return settled;
}
