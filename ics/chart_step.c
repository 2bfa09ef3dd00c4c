/* SPDX-License-Identifier: GPL-3.0-or-later
 * `tephra chart step`: where the time of one step goes, by modules, against the number of particles: the
 * slides' chart of one time step. All rows are active and the tree is built anew. */
#include "draw/chart.h"
#include "mem.h"
#include "module.h"
#include "profile.h"
#include "run.h"
#include <math.h>
#include <string.h>

struct chart_step { char *scene; struct param_list n; };

static const struct param params[] = {
    {"scene", PARAM_PATH, "", "none", 0, 0, NULL, "scene whose generator makes the particles; default: Evrard's collapse",
     false, offsetof(struct chart_step, scene)},
    {"n", PARAM_LIST, "", "1e3, 3e3, 1e4, 3e4, 1e5, 3e5, 1e6", 16, 1e9, NULL, "numbers of particles", false,
     offsetof(struct chart_step, n)},
    {0}
};

/* Whether a module has a row of its own; the others together are "rest". */
static bool is_part(const struct module *module)
{
    return module->kind == MODULE_BLOCK ? module->hook[HOOK_FORCE] != NULL : strcmp(module->name, "tree") == 0;
}

/* CPU seconds so far of each module in use. */
static void spent(const struct sim *sim, double *cpu)
{
    for (int u = 0; u < sim->n_use; u++) cpu[u] = 0;
    for (int c = 0; c < sim->n_call; c++) cpu[sim->call[c].use] += profile_spent(sim->profile, c);
}

/* The least of several steps, module by module. */
static void measure(struct sim *sim, int64_t repeats, double *least)
{
    double *before = mem_array("charts", double, sim->n_use), *after = mem_array("charts", double, sim->n_use);
    for (int u = 0; u < sim->n_use; u++) least[u] = INFINITY;
    bool fine = run_step(sim, HOOK_LIMIT);
    for (int64_t k = 0; k < repeats && fine; k++) {
        spent(sim, before);
        sim->rebuild_next = true;
        fine = run_step(sim, HOOK_LIMIT);
        spent(sim, after);
        for (int u = 0; u < sim->n_use; u++) least[u] = fmin(least[u], after[u] - before[u]);
    }
    if (!fine) fail(STATUS_NUMBERS, "%s", sim->failure.text);
    mem_free(before);
    mem_free(after);
}

static void add_rows(struct chart_sheet *sheet, const struct sim *sim, const double *least, int64_t n)
{
    double rest = 0, sum = 0;
    for (int u = 0; u < sim->n_use; u++) {
        const struct module *module = sim->use[u].module;
        sum += least[u];
        if (is_part(module))
            chart_row(sheet, "%lld,%s,%.6f,%.4f", (long long)n, module->name, least[u], 1e6 * least[u] / (double)n);
        else rest += least[u];
    }
    chart_row(sheet, "%lld,rest,%.6f,%.4f", (long long)n, rest, 1e6 * rest / (double)n);
    chart_row(sheet, "%lld,sum,%.6f,%.4f", (long long)n, sum, 1e6 * sum / (double)n);
}

static void make(struct chart_sheet *sheet, const void *state)
{
    const struct chart_step *step = state;
    chart_columns(sheet, "n,part,cpu [s],cpu_per_row [microseconds]");
    for (int k = 0; k < step->n.n; k++) {
        const int64_t n = llround(step->n.value[k]);
        char *rows = mem_format("charts", "start.n=%lld", (long long)n);
        const char *const set[] = {rows, "time.steps=common", NULL};
        struct sim *sim = chart_sim(step->scene ? step->scene : "ics/evrard.yml", set);
        double *least = mem_array("charts", double, sim->n_use);
        measure(sim, chart_repeats(sheet), least);
        add_rows(sheet, sim, least, n);
        mem_free(least);
        mem_free(rows);
        sim_free(sim);
    }
    chart_panel(sheet, &(struct chart_panel){.title = "one step", .x = "n", .y = "cpu", .series = "part", .lines = true});
    chart_panel(sheet, &(struct chart_panel){.title = "one step, for each particle", .x = "n", .y = "cpu_per_row",
                                             .series = "part", .lines = true});
}

const struct chart step_chart = {"step", "CPU time of one step by its parts, against the number of particles", params,
                                 sizeof(struct chart_step), make};
