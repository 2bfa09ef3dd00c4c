/* SPDX-License-Identifier: GPL-3.0-or-later
 * `tephra chart group`: time of the tree with grouped lists against the largest number of rows that share a
 * list, N_GR (Makino 1991): long lists are more pairs, short ones are more walks. */
#include "draw/chart.h"
#include "gravity.h"
#include "log.h"
#include "mem.h"
#include "module.h"
#include <math.h>

struct chart_group { int64_t n, sample, order; double softening, angle; struct param_list group; };

static const struct param params[] = {
    {"n", PARAM_COUNT, "", "1e5", 1000, 1e9, NULL, "number of particles", false, offsetof(struct chart_group, n)},
    {"softening", PARAM_REAL, "", "0.001", 0, 1, NULL, "softening length; G = M = 1", false, offsetof(struct chart_group, softening)},
    {"angle", PARAM_REAL, "", "0.75", 0.05, 2, NULL, "opening angle", false, offsetof(struct chart_group, angle)},
    {"order", PARAM_COUNT, "", "1", 1, 2, NULL, "1 monopoles, 2 quadrupoles", false, offsetof(struct chart_group, order)},
    {"group", PARAM_LIST, "", "10, 20, 50, 100, 200, 350, 500, 700, 1000, 1500, 2500, 3500", 1, 1e5, NULL,
     "sizes of groups", false, offsetof(struct chart_group, group)},
    {"sample", PARAM_COUNT, "", "1000", 10, 1e6, NULL, "particles whose errors are measured", false,
     offsetof(struct chart_group, sample)},
    {0}
};

static struct sim *begin(const struct chart_group *c, const char *set)
{
    char text[5][64];
    snprintf(text[0], sizeof text[0], "start.generator=%s", set);
    snprintf(text[1], sizeof text[1], "start.n=%lld", (long long)c->n);
    snprintf(text[2], sizeof text[2], "gravity.softening=%.9g", c->softening);
    snprintf(text[3], sizeof text[3], "gravity.opening_angle=%.9g", c->angle);
    snprintf(text[4], sizeof text[4], "gravity.order=%lld", (long long)c->order);
    const char *const set_all[] = {"units={G: 1}", "start={}", text[0], text[1], "time={end: 1}", "output={snapshot_every: 1}",
                                   "gravity={solver: tree}", text[2], text[3], text[4], NULL};
    return chart_sim(NULL, set_all);
}

static void sweep(struct chart_sheet *sheet, const struct chart_group *c, const char *set)
{
    struct sim *sim = begin(c, set);
    struct gravity *g = sim_state(sim, "gravity");
    g->checked = 1;
    log_silence(true);
    gravity_force(sim);
    log_silence(false);
    struct gravity_reference reference = gravity_reference_make(sim, g, c->sample);
    for (int i = 0; i < c->group.n; i++) {
        struct gravity_cost least = {INFINITY, INFINITY};
        g->group_size = llround(c->group.value[i]);
        sim->tree.leaf_size = 0;
        gravity_configure(sim, g);
        for (int64_t k = 0; k < chart_repeats(sheet); k++) {
            struct gravity_cost cost = gravity_force(sim);
            if (cost.build + cost.walk < least.build + least.walk) least = cost;
        }
        struct gravity_errors e = gravity_reference_compare(sim, &reference);
        chart_row(sheet, "%s,%d,%.4f,%.4f,%.4f,%.1f,%.1f,%.3e,%.3e", set, g->opening.group_size, least.build, least.walk,
                  least.build + least.walk, (double)g->pairs / (double)c->n, (double)g->cells / (double)c->n, e.rms, e.p99);
    }
    gravity_reference_free(&reference);
    sim_free(sim);
}

static void make(struct chart_sheet *sheet, const void *state)
{
    chart_columns(sheet, "set,group,tree [s],walk [s],cpu [s],rows_per_row,cells_per_row,rms,p99");
    chart_note(sheet, "rows_per_row, cells_per_row: interactions of each row with rows and with cells");
    sweep(sheet, state, "uniform");
    sweep(sheet, state, "plummer");
    chart_panel(sheet, &(struct chart_panel){.title = "time against group size", .x = "group", .y = "cpu",
                                             .series = "set", .lines = true});
    chart_panel(sheet, &(struct chart_panel){.title = "error against group size", .x = "group", .y = "rms",
                                             .series = "set", .lines = true});
}

const struct chart group_chart = {"group", "time of the tree with grouped lists against the size of groups", params,
                                  sizeof(struct chart_group), make};
