/* SPDX-License-Identifier: GPL-3.0-or-later
 * The block `time`: the length of a run and its steps. At the start of LIMIT every active row may
 * take the longest step; what the modules leave of it becomes its rung at the end (steps.c). */
#include "log.h"
#include "module.h"
#include "output.h"
#include <math.h>
#include <string.h>

struct time_block {
    double end, dt_max;
    char *integrator;
    int criterion, steps;
    int64_t evaluations;
};

enum { SIGNAL, CLASSIC };
enum { INDIVIDUAL, COMMON };

static const struct param params[] = {
    {"end", PARAM_REAL, "time", NULL, 0, 0, NULL, "time at which the run ends", true,
     offsetof(struct time_block, end)},
    {"integrator", PARAM_TEXT, "", "leapfrog", 0, 0, NULL,
     "leapfrog (kick-drift-kick), pec (predictor-corrector); hermite4, hermite6, hermite8: direct N-body", false,
     offsetof(struct time_block, integrator)},
    {"evaluations", PARAM_COUNT, "", "1", 1, 2, NULL,
     "pec: forces a step; the second, at the corrected state, serves as the next start value", false,
     offsetof(struct time_block, evaluations)},
    {"criterion", PARAM_CHOICE, "", "signal", 0, 0, "signal|classic",
     "time-step criterion: signal velocity, or 0.1 min(sqrt(2h/|a|), h/|v|, h/c, u/|du|)", false,
     offsetof(struct time_block, criterion)},
    {"steps", PARAM_CHOICE, "", "individual", 0, 0, "individual|common",
     "a step for each row, in powers of two, or the shortest of them for all", false,
     offsetof(struct time_block, steps)},
    {"dt_max", PARAM_REAL, "time", "none", 1e-300, 1e300, NULL,
     "longest step; default: the shortest of the output cadences", false,
     offsetof(struct time_block, dt_max)},
    {0}
};

/* A run has 4e6 longest steps at most (time_begin): what comes after 2^22 of them never does, and its ticks still count. */
enum { CADENCE_TOP = 22 };

/* Ticks of a cadence, a power-of-two multiple of the longest step near what was asked. */
static int64_t cadence_ticks(const struct timeline *time, double every, const char *what)
{
    if (!(every > 0)) return 0;
    double power = fmax(round(log2(every / time->dt_max)), 0), got = time->dt_max * exp2(power);
    if (fabs(got - every) > 1e-9 * every)
        log_line("output.%s: %g is not a power-of-two multiple of the longest step, %g taken", what, every, got);
    return (int64_t)1 << (RUNG_TOP + (int)fmin(power, CADENCE_TOP));
}

static void time_declare(struct sim *sim, void *state)
{
    struct time_block *block = state;
    struct timeline *time = &sim->time;
    const struct output *output = sim_state(sim, "output");
    double shortest = output->snapshot_every;
    if (output->energy_every > 0) shortest = fmin(shortest, output->energy_every);
    if (output->checkpoint_every > 0) shortest = fmin(shortest, output->checkpoint_every);
    time->dt_max = shortest;
    while (output->picture_every > 0 && time->dt_max > output->picture_every * (1 + 1e-12)) time->dt_max /= 2;
    while (block->dt_max > 0 && time->dt_max > block->dt_max * (1 + 1e-12)) time->dt_max /= 2;
    time->snapshot = cadence_ticks(time, output->snapshot_every, "snapshot_every");
    time->energy = output->energy_every > 0 ? cadence_ticks(time, output->energy_every, "energy_every") : 0;
    time->checkpoint = cadence_ticks(time, output->checkpoint_every, "checkpoint_every");
    if (output->picture_every > 0) {
        double steps = round(output->picture_every / time->dt_max);
        time->picture = (int64_t)fmin(steps, 1 << CADENCE_TOP) << RUNG_TOP;
        if (fabs(steps * time->dt_max - output->picture_every) > 1e-9 * output->picture_every)
            log_line("output.picture_every: %g is not a multiple of the longest step, %g taken", output->picture_every,
                     steps * time->dt_max);
    }
    time->evaluations = (int)block->evaluations;
    if (block->evaluations > 1 && strcmp(block->integrator, "pec") != 0)
        problems_add(&sim->problems, "time.evaluations: has a meaning only with time.integrator: pec");
    time->common = block->steps == COMMON;
    time->classic = block->criterion == CLASSIC;
    for (int s = 0; s < N_SPECIES; s++) species_need(&sim->species[s], COLUMN_dt);
}

/* The end lies on a grid of 2^-20 of the longest step, so that a run can be continued from it. */
static void time_begin(struct sim *sim, void *state)
{
    const struct time_block *block = state;
    const int grid = 20;
    double steps = (block->end - sim->time.start) / sim->time.dt_max;
    const char *place = scene_place(sim->scene, "time", "end");
    if (block->end < sim->time.start)
        problems_add(&sim->problems, "%s: time.end = %g: the rows are of t = %g already; give a later end", place, block->end,
                     sim->time.start);
    else if (!(steps < 4e6))
        problems_add(&sim->problems, "%s: time.end = %g: the run starts at %g and its longest step is %g: 4e6 of them at most "
                     "are possible; give an earlier end, or a larger time.dt_max or output.snapshot_every", place, block->end,
                     sim->time.start, sim->time.dt_max);
    else sim->time.tick_end = llround(ldexp(steps, grid)) << (RUNG_TOP - grid);
}

static void time_limit(struct sim *sim, void *state)
{
    (void)state;
    rows_here(sim, ALL_SPECIES, 0, COL(dt));
    for_species(sim, s)
        for (int64_t a = 0; a < s->n_active; a++) s->dt[s->active[a]] = (float)sim->time.dt_max;
}

const struct module time_module = {
    .name = "time", .doc = "length of the run, integrator, steps", .kind = MODULE_DRIVER,
    .params = params, .state_bytes = sizeof(struct time_block),
    .declare = time_declare, .begin = time_begin, .resident = true,
    .hook[HOOK_LIMIT] = time_limit,
};
