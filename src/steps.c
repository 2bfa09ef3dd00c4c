/* SPDX-License-Identifier: GPL-3.0-or-later
 * Two modules of the frame: `tree` keeps the octree in step with the rows; `steps`, last in LIMIT,
 * turns the steps that the modules allow into rungs and looks for numbers that failed. */
#include "comm.h"
#include "module.h"
#include "ranks.h"
#include <math.h>

/* Smallest group that the rest of the program makes of a leaf, unless a module wants less. */
enum { LEAF_ROWS = 32 };

static void tree_declare(struct sim *sim, void *state)
{
    (void)state;
    tree_need_leaf(&sim->tree, LEAF_ROWS);
}

static void tree_arrange(struct sim *sim, void *state)
{
    (void)state;
    if (sim->tree.built < 0 || sim->rebuild_next || timeline_active(&sim->time, (int)sim->rebuild_rung)) {
        box_wrap_rows(sim);
        tree_build(sim);
        if (sim->failure.set) return;
        ranks_divide(sim);
        sim_find_active(sim);
        sim->rebuild_next = false;
    } else {
        tree_refit(sim);
    }
    tree_mark_active(sim);
}

const struct module tree_module = {
    .name = "tree", .doc = "keys, sort, octree, domains", .kind = MODULE_FRAME,
    .declare = tree_declare, .hook[HOOK_ARRANGE] = tree_arrange,
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

static void choose_rungs(struct sim *sim, struct species *s, double common)
{
    for (int64_t a = 0; a < s->n_active; a++) {
        int64_t i = s->active[a];
        int rung = timeline_rung(&sim->time, common > 0 ? common : (double)s->dt[i]);
        if (rung < 0) {
            sim_fail(sim, s, i, "the step it needs is shorter than the tick");
            return;
        }
        s->rung[i] = s->rung0[i] = (uint8_t)rung;
    }
}

/* The tree is rebuilt whenever at least this part of all rows is active: below it the sort would
 * cost more than the forces on the active rows (0.1 against 1.5 microseconds a row). */
static const double rebuild_share = 1.0 / 16;

static void choose_rebuild(struct sim *sim)
{
    int64_t rows[RUNG_TOP + 2] = {0};
    for_species(sim, s)
        for (int64_t i = s->own; i < s->own + s->n_own; i++) {
            rows[s->rung[i]]++;
            rows[RUNG_TOP + 1]++;
        }
    comm_sum_int(rows, RUNG_TOP + 2);
    int rung = 0;
    for (int64_t sum = rows[0]; rung < RUNG_TOP && (double)sum < rebuild_share * (double)rows[RUNG_TOP + 1];)
        sum += rows[++rung];
    sim->rebuild_rung = rung;
}

static void steps_limit(struct sim *sim, void *state)
{
    (void)state;
    for_species(sim, s) if (!sim->failure.set) check_rows(sim, s);
    double common = sim->time.common ? shortest_step(sim) : 0;
    for_species(sim, s) if (!sim->failure.set) choose_rungs(sim, s, common);
    if (ranks_failed(sim)) return;
    ranks_share_rows(sim);
    if (timeline_synchronous(&sim->time)) choose_rebuild(sim);
    tree_follow(sim);
}

const struct module steps_module = {
    .name = "steps", .doc = "rungs from allowed steps", .kind = MODULE_DRIVER,
    .hook[HOOK_LIMIT] = steps_limit,
};
