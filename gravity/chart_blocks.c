/* SPDX-License-Identifier: GPL-3.0-or-later
 * `tephra chart blocks`: how many stars of a cluster end their steps together, and the number of steps, against the
 * number of stars, with each scheme's default eta (Harfst et al. 2007, New Astronomy 12, 357: N_act goes as N^(2/3)). */
#include "draw/chart.h"
#include "hermite.h"
#include "mem.h"
#include <math.h>
#include <stdio.h>

struct chart_blocks { double end; struct param_list n, orders; };

static const struct param params[] = {
    {"n", PARAM_LIST, "", "1000, 4000, 16000", 2, 1e7, NULL, "stars", false, offsetof(struct chart_blocks, n)},
    {"end", PARAM_REAL, "", "0.125", 1e-3, 1e3, NULL, "time at which a run ends, in N-body units", false,
     offsetof(struct chart_blocks, end)},
    {"orders", PARAM_LIST, "", "4, 6", 4, 8, NULL, "which schemes", false, offsetof(struct chart_blocks, orders)},
    {0}
};

static void measure(struct chart_sheet *sheet, const struct chart_blocks *chart, int64_t n, int order)
{
    char name[32], text[3][64];
    snprintf(name, sizeof name, "hermite%d", order);
    snprintf(text[0], sizeof text[0], "time.integrator=hermite%d", order);
    snprintf(text[1], sizeof text[1], "start.n=%lld", (long long)n);
    snprintf(text[2], sizeof text[2], "time.end=%.9g", chart->end);
    const char *set[] = {text[0], text[1], text[2], "output.energy_limit=1e300", NULL};
    struct sim *sim = chart_sim("ics/cluster.yml", set);
    const struct hermite *h = sim_state(sim, name);
    chart_run(sim);
    const double steps = (double)sim->steps;
    bool told = false;      /* what is of the whole run: in the first row */
    for (int k = 0; k < HERMITE_BLOCKS; k++) {
        char all[64] = ",,";
        if (h->block[k] == 0) continue;
        if (!told)
            snprintf(all, sizeof all, "%.6g,%.6g,%.6g", steps / chart->end, (double)sim->updates / (double)n / chart->end,
                     (double)sim->updates / steps);
        told = true;
        chart_row(sheet, "order %d,order %d n = %lld,%lld,%lld,%lld,%.4g,%s", order, order, (long long)n, (long long)n, 1LL << k,
                  (long long)h->block[k], (double)h->block[k] / steps, all);
    }
    sim_free(sim);
}

static void make(struct chart_sheet *sheet, const void *state)
{
    const struct chart_blocks *chart = state;
    chart_columns(sheet, "scheme,run,n,rows,steps,share_of_steps,steps_per_time,updates_per_row_and_time,mean_block");
    chart_note(sheet, "Plummer's sphere, G = M = 1, E = -1/4, eps = 1e-4, default eta; steps in which `rows` to 2 rows - 1 "
                      "rows ended theirs; times in N-body units");
    for (int o = 0; o < chart->orders.n; o++) {
        char name[64];
        for (int a = 0; a < chart->n.n; a++) measure(sheet, chart, (int64_t)chart->n.value[a], (int)chart->orders.value[o]);
        snprintf(name, sizeof name, "order %d", (int)chart->orders.value[o]);
        chart_panel(sheet, &(struct chart_panel){.title = name, .x = "rows", .y = "share_of_steps", .series = "n",
                                                 .where = "scheme", .is = name, .lines = true});
    }
    static const char *const against[] = {"steps_per_time", "mean_block"};
    for (int p = 0; p < 2; p++)
        chart_panel(sheet, &(struct chart_panel){.title = against[p], .x = "n", .y = against[p], .series = "scheme",
                                                 .lines = true});
}

const struct chart blocks_chart = {"blocks", "stars of a cluster that step together, and steps, against their number", params,
                                   sizeof(struct chart_blocks), make};
