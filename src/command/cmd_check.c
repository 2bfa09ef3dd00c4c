/* SPDX-License-Identifier: GPL-3.0-or-later
 * `tephra check`: what would run, in which order, with how much memory and at what cost. The rows
 * are made and the forces at the start computed once, so the figures are this scene's. */
#include "cmd.h"
#include "comm.h"
#include "log.h"
#include "mem.h"
#include "module.h"
#include "profile.h"
#include "run.h"
#include <math.h>
#include <stdio.h>

static const char usage[] =
    "check SCENE.yml [--set block.key=value] [--threads N] [--device auto|cpu|cuda] [--isa v2|v3|v4]";

static void print_step(const struct sim *sim)
{
    printf("one step\n");
    for (int h = 0; h < N_HOOKS; h++) {
        int count = 0;
        for (int c = 0; c < sim->n_call; c++) {
            if (sim->call[c].hook != h) continue;
            if (count++ == 0) printf("  %-8s", hook_names[h]);
            printf(" %s", sim->use[sim->call[c].use].module->name);
        }
        if (count) printf("\n");
    }
    printf("modules\n");
    for (int u = 0; u < sim->n_use; u++)
        printf("  %-10s %s\n", sim->use[u].module->name, sim->use[u].module->doc);
}

/* All parameters, defaults and what a preset means among them. */
static void print_values(const struct sim *sim)
{
    printf("values\n");
    sim_write_used(sim, stdout);
}

static void print_columns(const struct sim *sim)
{
    printf("rows\n");
    for_species(sim, s) {
        size_t keep = 0, step = 0;
        for (int c = 0; c < N_COLUMNS; c++)
            if (species_has(s, c)) *(column_table[c].lifetime == KEEP ? &keep : &step) += species_row_bytes(c);
        printf("  %-6s %12lld rows of %zu bytes kept, %zu during a step:", species_names[s->kind],
               (long long)s->n, keep, step);
        for (int c = 0; c < N_COLUMNS; c++)
            if (species_has(s, c)) printf(" %s", column_table[c].name);
        printf("\n");
    }
}

/* What a run takes at most: the peak so far, or what is held now while the tree is built anew in mid-run, when keys and
 * order of the sort and a spare column come on top (snapshots and pictures take less). */
static double peak_of_run(const struct sim *sim)
{
    double keys = 0, most = 0;
    for_species(sim, s) {
        keys += (double)s->n * sizeof(uint64_t);
        most = fmax(most, keys + (double)s->n * (double)(species_widest(s) + sizeof(int32_t)));
    }
    return fmax((double)mem_peak(), (double)mem_now() + most);
}

/* Updates until the end if every row kept the step that it has at the start. */
static double updates_due(const struct sim *sim)
{
    double updates = 0, run = (double)(sim->time.tick_end - sim->time.tick);
    for_species(sim, s)
        for (int64_t i = 0; i < s->n; i++) updates += run / ldexp(1.0, s->rung[i]);
    return updates;
}

static int check_scene(int argc, char **argv)
{
    struct cmd_options options;
    if (!cmd_parse(&options, argc, argv, "set threads device isa", usage)) return STATUS_DONE;
    if (options.n_arguments != 1) fail(STATUS_INPUT, "usage: tephra %s", usage);
    cmd_set_threads(&options);
    struct sim *sim = cmd_sim(cmd_scene(&options, options.argument[0]));
    cmd_open_device(&options, sim);
    sim_begin(sim);
    problems_report(&sim->problems);
    sim_warn(sim);
    double cpu = profile_cpu();
    bool fine = run_step(sim, HOOK_LIMIT);
    cpu = profile_cpu() - cpu;
    if (!fine) fail(STATUS_NUMBERS, "%s", sim->failure.text);
    int64_t rows = 0;
    for_species(sim, s) rows += s->n;
    if (comm_rank() == 0) {
        print_values(sim);
        print_step(sim);
        print_columns(sim);
        printf("memory\n");
        mem_report(stdout);
        printf("  %.1f MB in a run, %.0f bytes a row: where the tree is built anew, sorting comes on top\n",
               1e-6 * peak_of_run(sim), peak_of_run(sim) / (double)(rows ? rows : 1));
        printf("cost\n  longest step %g, %.3g updates to t = %g with the steps of the start, "
               "%.2g microseconds of CPU each: %.3g CPU s (more where the steps shorten)\n",
               sim->time.dt_max, updates_due(sim), sim->time.start + timeline_seconds(&sim->time, sim->time.tick_end),
               1e6 * cpu / (double)(rows ? rows : 1), updates_due(sim) * cpu / (double)(rows ? rows : 1));
    }
    sim_free(sim);
    return STATUS_DONE;
}

const struct command check_command = {"check", usage, "what would run, its memory and cost", check_scene};
