/* SPDX-License-Identifier: GPL-3.0-or-later
 * Two modules of the frame: `tree` keeps the octree in step with the rows; `steps`, last in LIMIT,
 * turns the steps that the modules allow into rungs and looks for numbers that failed. */
#include "steps.h"
#include "comm.h"
#include "file/layout.h"
#include "log.h"
#include "mem.h"
#include "module.h"
#include "ranks.h"
#include <math.h>
#include <stdio.h>

/* Rows of a leaf where no module says how many it wants. */
enum { LEAF_ROWS = 32 };

/* The tree is rebuilt whenever at least this part of all rows is active: below it the sort would
 * cost more than the forces on the active rows (0.1 against 1.5 microseconds a row). */
static const double rebuild_share = 1.0 / 2;
/* And once so many updates a row were done since, because rows move away from what were their neighbours. */
static const double rebuild_updates = 1;
/* New rows ask for a tree at the next step: they wait until the updates since the last one have cost several times what
 * a tree costs (0.15 against 2 microseconds a row). */
static const double birth_updates = 1.0 / 2;

static int64_t count_rows(const struct sim *sim)
{
    int64_t rows = 0;
    for_species(sim, s) rows += s->n;
    return rows;
}

bool steps_rebuild_due(const struct sim *sim)
{
    const double rows = (double)count_rows(sim), ending = (double)sim->ending;
    return sim->tree.built < 0 || sim->rebuild_next || ending >= rebuild_share * rows
        || (double)sim->unsorted + ending >= rebuild_updates * rows;
}

bool steps_births_due(const struct sim *sim)
{
    double updates = (double)sim->unsorted, ending = 0;
    for_species(sim, s) ending += (double)s->n_ending;
    if (sim->tree.built == sim->time.tick) updates = ending;    /* `unsorted` does not count the step of the build */
    return updates >= birth_updates * (double)count_rows(sim);
}

static void tree_arrange(struct sim *sim, void *state)
{
    (void)state;
    rows_here(sim, ALL_SPECIES, COL_MOTION | COL(mass) | COL(id), box_closed(&sim->box) ? COL(pos) : 0);
    if (sim->tree.leaf_size == 0) tree_need_leaf(&sim->tree, LEAF_ROWS);
    if (steps_rebuild_due(sim)) {
        box_wrap_rows(sim);
        if (!tree_build(sim)) return;
        ranks_divide(sim);
        sim_find_active(sim);
        sim->rebuild_next = false;
        sim->unsorted = 0;
    } else {
        sim->unsorted += sim->ending;
        tree_refit(sim);
    }
    tree_mark_active(sim);
}

const struct module tree_module = {
    .name = "tree", .doc = "keys, sort, octree, domains", .kind = MODULE_FRAME,
    .resident = true, .hook[HOOK_ARRANGE] = tree_arrange,
};

/* Updates, of all ranks: that each row's own steps would take without rounding, counted where a step begins, and that common
 * ones would take, which are rounded as time.steps: common rounds them. `whole`: these and the updates done when the steps of all
 * rows last ended, so that none is counted halfway. `shortest`: that common step as it would now be, in code units. */
struct counts { double own, common, updates; };
struct steps { struct counts now, whole; double shortest; };

static const struct saved saved[] = {
    {"now", offsetof(struct steps, now), sizeof(struct counts)},
    {"whole", offsetof(struct steps, whole), sizeof(struct counts)},
    {"shortest", offsetof(struct steps, shortest), sizeof(double)},
    {0}
};

/* Not a number, or internal energy gone: found here, in the rows that were just computed. */
static void check_rows(struct sim *sim, const struct species *s)
{
    for (int64_t a = 0; a < s->n_active; a++) {
        int64_t i = s->active[a];
        float sum = s->acc[i][0] + s->acc[i][1] + s->acc[i][2];
        if (!isfinite(sum)) sim_fail(sim, s, i, "acceleration is not finite");
        else if (s->u && !(s->u[i] > 0 && isfinite(s->u[i]))) sim_fail(sim, s, i, "internal energy is not positive");
        else if (!(s->dt[i] > 0)) sim_fail(sim, s, i, "no time step");
        if (sim->failure.set) return;
    }
}

static double shortest_step(struct sim *sim)
{
    double shortest = sim->time.dt_max;
    for_species(sim, s)
        for (int64_t a = 0; a < s->n_active; a++) shortest = fmin(shortest, (double)s->dt[s->active[a]]);
    comm_min(&shortest, 1);
    return shortest;
}

/* The step that all rows would take: on a rung, and not beyond the end. 0: there is none. */
static double common_step(const struct sim *sim, double shortest)
{
    const int rung = timeline_rung(&sim->time, shortest);
    const int64_t ticks = rung < 0 ? 0 : (int64_t)1 << rung, left = sim->time.tick_end - sim->time.tick;
    return timeline_seconds(&sim->time, left > 0 && left < ticks ? left : ticks);
}

static void choose_rungs(struct sim *sim, struct species *s, double common, double *updates)
{
    for (int64_t a = 0; a < s->n_active; a++) {
        int64_t i = s->active[a];
        int rung = timeline_rung(&sim->time, common > 0 ? common : (double)s->dt[i]);
        if (rung < 0) {
            sim_fail(sim, s, i, "the step it needs is shorter than the tick");
            return;
        }
        s->rung[i] = s->rung0[i] = (uint8_t)rung;
        *updates += timeline_seconds(&sim->time, (int64_t)1 << rung) / fmin((double)s->dt[i], sim->time.dt_max);
    }
}

static void steps_limit(struct sim *sim, void *state)
{
    struct steps *steps = state;
    double own = 0;
    rows_here(sim, ALL_SPECIES, COL_MOTION | COL(u) | COL(dt), COL(rung) | COL(rung0));
    if (steps->shortest > 0) steps->now.common += (double)count_rows(sim) * sim->last_dt / steps->shortest;
    steps->now.updates = (double)sim->updates;
    if (sim->synchronous) steps->whole = steps->now;
    for_species(sim, s) if (!sim->failure.set) check_rows(sim, s);
    const double shortest = shortest_step(sim);
    steps->shortest = common_step(sim, shortest);
    for_species(sim, s)
        if (!sim->failure.set) choose_rungs(sim, s, sim->time.common ? shortest : 0, &own);
    comm_sum(&own, 1);
    steps->now.own += own;
    if (ranks_failed(sim)) return;
    ranks_share_rows(sim);
    tree_follow(sim);
}

static void describe_row(const struct sim *sim, const struct species *s, int64_t i, char *text, size_t size)
{
    struct step_reason reason = {sim->time.dt_max, "the longest step"};
    for (int u = 0; u < sim->n_use; u++)
        if (sim->use[u].module->reason) sim->use[u].module->reason(sim, sim->use[u].state, s, i, &reason);
    float *kelvin = s->u ? mem_array("frame", float, species_to(s) - species_from(s)) : NULL;
    bool known = kelvin && layout_temperatures(sim, kelvin);
    int used = snprintf(text, size, "smallest step %.4g by %s: %s particle %llu", (double)s->dt[i],
                        reason.dt <= 1.001 * (double)s->dt[i] ? reason.text : "another criterion", species_names[s->kind],
                        (unsigned long long)s->id[i]);
    if (s->rho) used += snprintf(text + used, size - (size_t)used, ", rho %.4g", (double)s->rho[i]);
    if (s->h) used += snprintf(text + used, size - (size_t)used, ", h %.4g", (double)s->h[i]);
    if (known) snprintf(text + used, size - (size_t)used, ", T %.4g K", (double)kelvin[i - species_from(s)]);
    else if (s->u) snprintf(text + used, size - (size_t)used, ", u %.4g", (double)s->u[i]);
    mem_free(kelvin);
}

void steps_log_smallest(struct sim *sim)
{
    const struct species *table = NULL;
    int64_t row = 0;
    char text[512] = "";
    for_species(sim, s)
        for (int64_t a = 0; a < s->n_active; a++) {
            int64_t i = s->active[a];
            if (table && s->dt[i] >= table->dt[row]) continue;
            table = s;
            row = i;
        }
    const double own = table ? (double)table->dt[row] : INFINITY;
    double least = own, root;
    comm_min(&least, 1);
    root = own == least ? comm_rank() : INFINITY;
    comm_min(&root, 1);
    if (!isfinite(root)) return;
    if ((int)root == comm_rank() && table) describe_row(sim, table, row, text, sizeof text);
    comm_broadcast(text, sizeof text, (int)root);
    log_line("%s", text);
}

void steps_log_gain(const struct sim *sim)
{
    const struct counts *whole = &((const struct steps *)sim_state(sim, "steps"))->whole;
    if (sim->time.common || !(whole->updates > 0) || !(whole->own > 0)) return;
    log_line("steps of their own: %.2f times fewer updates than common ones; ideal, without powers of two: %.2f (%.0f %%)",
             whole->common / whole->updates, whole->common / whole->own, 100 * whole->own / whole->updates);
}

const struct module steps_module = {
    .name = "steps", .doc = "rungs from allowed steps", .kind = MODULE_DRIVER,
    .state_bytes = sizeof(struct steps), .saved = saved, .resident = true, .hook[HOOK_LIMIT] = steps_limit,
};
