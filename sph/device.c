/* SPDX-License-Identifier: GPL-3.0-or-later
 * The hooks of SPH on a device, where the rows are: cells and groups go over, the largest smoothing length of each cell comes
 * back. What becomes of a row by its sums is told by the formulas of the CPU (row.h). */
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
        cell[n] = (struct sph_cell){.parent = node->parent, .child = node->child, .n_children = node->n_children,
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

/* The active rows of each cell with at most CUT gas rows, cut into equal groups of at most SPH_GROUP. */
static void send_groups(struct sim *sim, struct sph *sph)
{
    const struct species *gas = &sim->species[GAS];
    int32_t *cut, cuts = tree_groups(&sim->tree, GAS_BIT, CUT, "sph", &cut), a = 0;
    struct sph_groups groups = {0};
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
    return (struct sph_plan){(enum sph_kernel)sph->kernel, sph->viscosity == SPH_SIGNAL, sph->meet, sph_viscosity_of(sph),
                             sph_law_of(sph)};
}

/* What tells where gas is and how large; what its state follows from. */
static const uint64_t place = COL_MOTION | COL(mass) | COL(h) | COL(div_v), state = COL(u) | COL(du) | COL(rho);

static struct sph_rows rows_of(struct sim *sim, uint64_t read, uint64_t write)
{
    return (struct sph_rows){rows_there(sim, GAS, read, write), sim->time, rows_scratch(sim, GAS)};
}

/* After a pass: true if it is done; else either the run stops or the CPU does it. */
static bool settled(struct sim *sim)
{
    const char *error = device_error(sim->device);
    return !error || !sim_leave_device(sim, "sph", error);
}

bool sph_device_search(struct sim *sim, struct sph *sph, const struct sph_quest *quest)
{
    const struct sph_plan plan = plan_of(sph);
    const struct sph_rows rows = rows_of(sim, place, COL(h));
    if (!sph->engine) sph->engine = sph_engine_create(sim->device, 0);
    send_cells(sim, sph);
    send_groups(sim, sph);
    sph_engine_places(sph->engine, &rows);
    sph_engine_search(sph->engine, &plan, quest, &rows);
    return settled(sim);
}

bool sph_device_density(struct sim *sim, struct sph *sph)
{
    const struct sph_plan plan = plan_of(sph);
    const uint64_t writes = COL(rho) | COL(div_v) | COL(curl_v) | COL(balsara) | COL(strength) | COL(omega),
                   follows = sph->equation == SPH_ENTROPY ? COL(u) | COL(du_old) : 0;
    const struct sph_rows rows = rows_of(sim, place | state, writes | follows);
    sph_engine_lengths(sph->engine, &rows, sim->tree.h_max);
    sph_engine_places(sph->engine, &rows);
    sph_engine_density(sph->engine, &plan, &rows);
    return settled(sim);
}

bool sph_device_force(struct sim *sim, struct sph *sph)
{
    const struct sph_plan plan = plan_of(sph);
    const struct sph_rows rows = rows_of(sim, place | state | COL(balsara) | COL(omega), COL(acc) | COL(du) | COL(signal));
    sph_engine_force(sph->engine, &plan, &rows);
    return settled(sim);
}
