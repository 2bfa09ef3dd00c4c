/* SPDX-License-Identifier: GPL-3.0-or-later
 * The life of a run. */
#include "run.h"
#include "comm.h"
#include "log.h"
#include "mem.h"
#include "module.h"
#include "output.h"
#include "profile.h"
#include "ranks.h"
#include "signals.h"
#include "steps.h"
#include <math.h>
#include <stdio.h>
#include <unistd.h>

/* The smallest rung says when the next step of any row ends: a longer one cannot end before. */
static int lowest_rung(struct sim *sim)
{
    uint8_t lowest = RUNG_TOP;
    rows_here(sim, ALL_SPECIES, COL(rung), 0);
    for_species(sim, s)
        for (int64_t i = species_from(s); i < species_to(s); i++) lowest = s->rung[i] < lowest ? s->rung[i] : lowest;
    if (sim->spread) comm_min_bytes(&lowest, 1);
    return lowest;
}

static void advance(struct sim *sim)
{
    struct timeline *time = &sim->time;
    int64_t step = (int64_t)1 << lowest_rung(sim), before = time->tick;
    time->tick = (time->tick / step + 1) * step;
    if (time->tick > time->tick_end) time->tick = time->tick_end;
    sim->last_dt = timeline_seconds(time, time->tick - before);
}

/* The forces once more, at the corrected state of the active rows. */
static void evaluate_again(struct sim *sim)
{
    ranks_share_rows(sim);
    for (int h = HOOK_ARRANGE; h <= HOOK_FORCE && !ranks_failed(sim); h++) sim_run_hook(sim, h);
}

bool run_step(struct sim *sim, int last)
{
    bool first = !sim->started;
    if (!first) advance(sim);
    int64_t active = sim_find_active(sim), rows = 0;
    for_species(sim, s) rows += s->n;
    sim->synchronous = active == rows;
    sim->started = true;
    sim->steps += !first;
    sim->updates += first ? 0 : active;
    sim->want_potential = last == HOOK_RECORD && output_records(sim);
    sim->fresh_potential = false;
    for (int h = 0; h <= last; h++) {
        sim_run_hook(sim, h);
        if (h == HOOK_CORRECT && sim->time.evaluations > 1 && !first) evaluate_again(sim);
        if (ranks_failed(sim)) return false;
    }
    return true;
}

/* A file `stop` in the run directory; taken away, so that the continued run does not stop too. */
static bool stop_file(const struct sim *sim)
{
    char path[4096];
    if (!sim->folder) return false;
    snprintf(path, sizeof path, "%s/stop", sim->folder);
    return comm_rank() == 0 && unlink(path) == 0;
}

static bool asked_to_stop(const struct sim *sim, double max_wall)
{
    double stop = signals_stop() || stop_file(sim) || profile_wall() - sim->wall_start > max_wall;
    comm_max(&stop, 1);
    return stop > 0;
}

static bool asked_for_snapshot(void)
{
    double asked = signals_snapshot();
    comm_max(&asked, 1);
    return asked > 0;
}

/* Told once, by rank 0, with the text of the lowest rank that has one. Sound rows give a last snapshot;
 * a lost device leaves rows half done. */
static int failed(struct sim *sim)
{
    double root = sim->failure.set ? comm_rank() : INFINITY;
    comm_min(&root, 1);
    comm_broadcast(&sim->failure, sizeof sim->failure, (int)root);
    rows_here(sim, ALL_SPECIES, COL_ALL, 0);
    ranks_share_rows(sim);
    bool environment = sim->failure.status == STATUS_ENVIRONMENT;
    if (comm_rank() == 0) log_error("%s%s", sim->failure.text, environment ? fail_advice() : "");
    if (environment) return STATUS_ENVIRONMENT;
    if (sim->folder) {
        log_line("the numbers failed; the last state is in snapshot_%03lld.hdf5",
                 (long long)((struct output *)sim_state(sim, "output"))->snapshots);
        output_snapshot(sim);
    }
    return STATUS_NUMBERS;
}

/* CPU time and updates before this run began, or went on. */
struct leg { double cpu; int64_t updates; };

static void summary(const struct sim *sim, const struct leg *before)
{
    const struct output *output = sim_state(sim, "output");
    int64_t updates = sim->updates - before->updates;
    double sum[3] = {profile_cpu() - before->cpu, (double)mem_peak(), (double)mem_process_peak()};
    comm_sum(sum, 3);
    log_line("%lld steps, %lld updates, %.1f CPU s (%.2f microseconds an update), peak memory %.1f MB (of the process%s %.1f MB), "
             "largest energy error %.2e", (long long)sim->steps, (long long)sim->updates, sum[0],
             1e6 * sum[0] / (double)(updates ? updates : 1), sum[1] / 1e6, comm_size() > 1 ? "es" : "", sum[2] / 1e6,
             output->energy.worst);
    if (sim->spread)
        log_line("domains: moved at %lld builds of the tree, kept at %lld, where that was cheaper",
                 (long long)sim->domains_moved, (long long)sim->domains_kept);
    if (before->updates > 0) log_line("%lld of the updates since the run went on, in these CPU s", (long long)updates);
    steps_log_gain(sim);
}

int run_to_end(struct sim *sim, double max_wall)
{
    struct timeline *time = &sim->time;
    struct output *output = sim_state(sim, "output");
    const struct leg before = {profile_cpu(), sim->updates};
    sim->wall_start = profile_wall();
    sim->part_start = (double)time->tick / (double)time->tick_end;
    ranks_settle(sim);
    bool fine = sim->started || run_step(sim, HOOK_RECORD);
    while (fine && time->tick < time->tick_end) {
        output->snapshot_asked |= asked_for_snapshot();
        if (asked_to_stop(sim, max_wall)) {
            output_checkpoint(sim);
            summary(sim, &before);
            log_line("stopped on request at t = %g; go on with: tephra run --restart %s", timeline_now(time), sim->folder);
            return STATUS_STOPPED;
        }
        fine = run_step(sim, HOOK_RECORD);
    }
    if (!fine) return failed(sim);
    summary(sim, &before);
    return STATUS_DONE;
}
