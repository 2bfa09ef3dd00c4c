/* SPDX-License-Identifier: GPL-3.0-or-later
 * The block `output` and the hook RECORD: where the steps of all rows end
 * energies, snapshots, pictures and checkpoints as they are due; between them a line of progress. */
#include "output.h"
#include "budget.h"
#include "comm.h"
#include "file/checkpoint.h"
#include "file/snapshot.h"
#include "ghosts.h"
#include "log.h"
#include "mem.h"
#include "module.h"
#include "profile.h"
#include "ranks.h"
#include "signals.h"
#include "steps.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

/* Seconds after which the log has a line again, whatever is due. */
enum { LOG_EVERY = 30 };

static const struct param params[] = {
    {"snapshot_every", PARAM_REAL, "time", NULL, 1e-300, 1e300, NULL, "time between two snapshots", true,
     offsetof(struct output, snapshot_every)},
    {"snapshot_precision", PARAM_CHOICE, "", "double", 0, 0, "double|float",
     "of positions, velocities, masses and mass fractions in snapshots", true, offsetof(struct output, snapshot_precision)},
    {"energy_every", PARAM_REAL, "time", "none", 1e-300, 1e300, NULL,
     "time between two rows of energy.csv, where all steps end; default: wherever they do, 16 rows a snapshot at most", false,
     offsetof(struct output, energy_every)},
    {"picture_every", PARAM_REAL, "time", "none", 1e-300, 1e300, NULL,
     "time between two pictures; default: no pictures but one at the end", true,
     offsetof(struct output, picture_every)},
    {"checkpoint_every", PARAM_REAL, "time", "none", 1e-300, 1e300, NULL,
     "time between two checkpoints; default: snapshot_every", true,
     offsetof(struct output, checkpoint_every)},
    {"energy_limit", PARAM_REAL, "", "0.1", 0, 1e300, NULL,
     "the run stops when the energy is off by more than this part of its largest component", true,
     offsetof(struct output, energy_limit)},
    {"mass_limit", PARAM_REAL, "", "1e-10", 0, 1e300, NULL,
     "the run stops when the mass of all species together is off by more than this part", true,
     offsetof(struct output, mass_limit)},
    {0}
};

static const struct saved saved[] = {
    {"snapshots", offsetof(struct output, snapshots), sizeof(int64_t)},
    {"pictures", offsetof(struct output, pictures), sizeof(int64_t)},
    {"snapshot_asked", offsetof(struct output, snapshot_asked), sizeof(bool)},
    {"energy", offsetof(struct output, energy), sizeof(struct energy)},
    {"recorded", offsetof(struct output, recorded), sizeof(int64_t)},
    {"picture", offsetof(struct output, picture), sizeof(struct picture)},
    {0}
};

static const char *in_folder(const struct sim *sim, char *path, size_t size, const char *format, long long number)
{
    int used = snprintf(path, size, "%s/", sim->folder);
    snprintf(path + used, size - (size_t)used, format, number);
    return path;
}

static void output_declare(struct sim *sim, void *state)
{
    struct output *output = state;
    if (!(output->checkpoint_every > 0)) output->checkpoint_every = output->snapshot_every;
    for (int s = 0; s < N_SPECIES; s++) species_need(&sim->species[s], COLUMN_pot);
}

static bool due(const struct sim *sim, int64_t cadence)
{
    int64_t tick = sim->time.tick;
    return tick == 0 || tick == sim->time.tick_end || (cadence > 0 && tick % cadence == 0);
}

/* Without a cadence of its own: at the first common end of all steps in every sixteenth of a snapshot's
 * interval. To force one would cost the rows that could take longer steps. */
static bool energy_due(const struct sim *sim, const struct output *output)
{
    const int64_t part = sim->time.snapshot / 16;
    if (sim->time.energy > 0) return due(sim, sim->time.energy);
    return due(sim, 0) || sim->time.tick / part != output->recorded / part;
}

bool output_records(const struct sim *sim)
{
    const struct output *output = sim_state(sim, "output");
    return sim->synchronous && (energy_due(sim, output) || due(sim, sim->time.snapshot) || output->snapshot_asked);
}

static bool picture_due(const struct sim *sim)
{
    return sim->time.picture > 0 ? due(sim, sim->time.picture) : sim->time.tick == sim->time.tick_end;
}

void output_snapshot(struct sim *sim)
{
    char path[4096];
    struct output *output = sim_state(sim, "output");
    ghosts_forget(sim);     /* room for slices of files */
    snapshot_write(sim, in_folder(sim, path, sizeof path, "snapshot_%03lld.hdf5", output->snapshots++),
                   (enum snapshot_precision)output->snapshot_precision);
    output->wrote_snapshot = true;
}

bool output_wrote_snapshot(const struct sim *sim)
{
    const struct output *output = sim_state(sim, "output");
    return output->wrote_snapshot;
}

char *output_companion(const struct sim *sim, const char *module, const char *extension)
{
    const struct output *output = sim_state(sim, "output");
    const char *stem = NULL;
    for (int u = 0; u < sim->n_use; u++)
        if (strcmp(sim->use[u].module->name, module) == 0) stem = sim->use[u].module->companion;
    check(stem && output->wrote_snapshot);
    return mem_format("files", "%s/%s_%03lld.%s", sim->folder, stem, (long long)output->snapshots - 1, extension);
}

void output_advise(const struct sim *sim)
{
    fail_set_advice("the last checkpoint, of t = %g, is whole: tephra run --restart %s", timeline_now(&sim->time), sim->folder);
}

static void write_profiles(struct sim *sim)
{
    char path[4096];
    profile_write(sim, in_folder(sim, path, sizeof path, "profile.csv", 0));
    profile_write_ranks(sim, in_folder(sim, path, sizeof path, "ranks.csv", 0));
}

void output_checkpoint(struct sim *sim)
{
    char path[4096];
    rows_here(sim, ALL_SPECIES, COL_ALL, 0);
    ghosts_forget(sim);
    checkpoint_write(sim, in_folder(sim, path, sizeof path, "checkpoint.hdf5", 0));
    write_profiles(sim);
    output_advise(sim);
}

static void refresh_potential(struct sim *sim)
{
    if (sim->fresh_potential) return;
    ghosts_close(sim);      /* rows may have moved since they were asked for */
    rows_here(sim, ALL_SPECIES, 0, COL(pot));
    for (int u = 0; u < sim->n_use; u++)
        if (sim->use[u].module->potential) sim->use[u].module->potential(sim, sim->use[u].state);
    if (!sim->spread) ranks_share(sim, (uint64_t)1 << COLUMN_pot);  /* one rank writes the snapshot */
    sim->fresh_potential = true;
}

/* Beyond its limit? Compared with the largest component, since the total may nearly vanish. */
static void check_energy(struct sim *sim, const struct output *output)
{
    const struct energy *energy = &output->energy;
    double largest = fabs(energy->first), off = energy->total - energy->first;
    for (int i = 0; i < energy->n; i++) largest = fmax(largest, fabs(energy->value[i]));
    if (isfinite(off) && fabs(off) <= output->energy_limit * largest) return;
    sim_stop(sim, STATUS_NUMBERS,
             "at t = %g the total energy is %g and was %g at the start: off by more than output.energy_limit = %g "
             "of its largest component (shorter steps or a finer accuracy may help)",
             timeline_now(&sim->time), energy->total, energy->first, output->energy_limit);
}

/* Rows exchange mass; what is lost or comes from nowhere is a fault. */
static void check_mass(struct sim *sim, const struct output *output)
{
    const struct energy *energy = &output->energy;
    double off = fabs(energy->all - energy->all_first);
    if (sim->failure.set || (isfinite(off) && off <= output->mass_limit * energy->all_first)) return;
    sim_stop(sim, STATUS_NUMBERS,
             "at t = %g the mass of all rows is %.15g and was %.15g at the start: off by more than output.mass_limit = %g",
             timeline_now(&sim->time), energy->all, energy->all_first, output->mass_limit);
}

static void log_state(const struct sim *sim, struct output *output)
{
    output->logged = profile_wall();
    int64_t rows = 0;
    for_species(sim, s) rows += s->n;
    const struct energy *energy = &output->energy;
    double wall = profile_wall() - sim->wall_start, part = (double)sim->time.tick / (double)sim->time.tick_end;
    double left = part > sim->part_start ? wall * (1 - part) / (part - sim->part_start) : 0;
    log_line("t %-10.6g step %-8lld updates/row %-8.1f K %-11.5g U %-11.5g W %-11.5g error %+.2e  %.0f s, ETA %.0f s",
             timeline_now(&sim->time), (long long)sim->steps, (double)sim->updates / (double)(rows ? rows : 1),
             energy->value[0], energy->value[1], energy->value[2], energy->error, wall, left);
}

static void progress(const struct sim *sim)
{
    enum { WIDTH = 40 };
    double part = (double)sim->time.tick / (double)sim->time.tick_end;
    char bar[WIDTH + 1];
    for (int i = 0; i < WIDTH; i++) bar[i] = i < part * WIDTH ? '#' : '.';
    bar[WIDTH] = '\0';
    double wall = profile_wall() - sim->wall_start;
    log_progress("[%s] t = %.6g  step %lld  ETA %.0f s", bar, timeline_now(&sim->time), (long long)sim->steps,
                 part > sim->part_start ? wall * (1 - part) / (part - sim->part_start) : 0.0);
}

static void record_energies(struct sim *sim, struct output *output)
{
    output->recorded = sim->time.tick;
    refresh_potential(sim);
    energy_measure(sim, &output->energy);
    if (sim->folder) {
        energy_write(sim, &output->energy, "energy.csv");
        budget_write(sim, "budget.csv");
    }
    if (due(sim, sim->time.snapshot) || profile_wall() - output->logged > LOG_EVERY) log_state(sim, output);
    else progress(sim);
    if (due(sim, sim->time.snapshot)) steps_log_smallest(sim);
    check_energy(sim, output);
    check_mass(sim, output);
}

static void write_files(struct sim *sim, struct output *output)
{
    char path[4096];
    if (due(sim, sim->time.snapshot) || output->snapshot_asked) output_snapshot(sim);
    output->snapshot_asked = false;
    if (picture_due(sim)) {
        picture_write(sim, in_folder(sim, path, sizeof path, "picture_%03lld.png", output->pictures++),
                      &output->picture);
    }
    if (due(sim, sim->time.checkpoint) && sim->time.tick > 0) {
        sim->rebuild_next = true;   /* so that a run continued from here takes the same steps */
        output_checkpoint(sim);
    }
    if (due(sim, sim->time.snapshot)) write_profiles(sim);
}

static void output_record(struct sim *sim, void *state)
{
    struct output *output = state;
    output->wrote_snapshot = false;
    if (!sim->synchronous) {
        progress(sim);
        return;
    }
    const bool records = output_records(sim);
    if (records || due(sim, sim->time.checkpoint) || picture_due(sim)) rows_here(sim, ALL_SPECIES, COL_ALL, 0);
    if (records) record_energies(sim, output);
    if (sim->folder && !sim->failure.set) write_files(sim, output);
}

const struct module output_module = {
    .name = "output", .doc = "energies, snapshots, pictures, checkpoints", .kind = MODULE_DRIVER,
    .params = params, .state_bytes = sizeof(struct output), .saved = saved,
    .declare = output_declare, .resident = true, .hook[HOOK_RECORD] = output_record,
};
