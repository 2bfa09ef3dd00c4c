/* SPDX-License-Identifier: GPL-3.0-or-later
 * A simulation: all state of one run. What belongs to the process instead (log, memory by owner, signals, advice on
 * failure, instruction set) is static in its one file; tests/check-style knows them. */
#ifndef TEPHRA_SIM_H
#define TEPHRA_SIM_H
#include "box.h"
#include "device_rows.h"
#include "fail.h"
#include "integrate.h"
#include "scene.h"
#include "species.h"
#include "timeline.h"
#include "tree.h"
#include "units.h"
#include <string.h>

struct module;
struct profile;
struct device;
struct start;
struct ghosts;
struct domains;

struct use { const struct module *module; void *state; };   /* a module of this scene */
struct call { int hook, use; };                             /* one entry of the step */

/* What went wrong: with the numbers (the driver writes a last snapshot and ends with 3) or with the
 * environment (it names the last checkpoint and ends with 5). */
struct failure { bool set; enum status status; char text[512]; };

struct sim {
    struct scene *scene;
    struct problems problems;
    struct units units;
    struct timeline time;
    struct box box;
    struct species species[N_SPECIES];
    struct tree tree;
    struct use *use; int n_use;         /* modules in the list's order */
    struct call *call; int n_call;      /* the step, flat */
    struct start *start;                /* where the rows come from (start.h) */
    struct profile *profile;
    struct device *device;  /* NULL: the CPU */
    bool device_needed;     /* --device cuda: the CPU is no way out */
    bool device_left;       /* something did not fit there: the CPU goes on */
    struct failure failure;
    uint64_t seed;
    char *folder;           /* the run directory; NULL where nothing is written */
    bool synchronous;       /* the steps of all rows end now */
    bool want_potential;    /* this step is recorded: FORCE shall fill pot too */
    bool fresh_potential;   /* pot is of the present positions */
    int64_t steps, updates; /* steps done; row updates done */
    bool kelvin;            /* u of the gas was given as temperatures and has layout_kelvin's mean mass: who knows
                               a better one corrects it in `begin` */
    bool started;           /* the forces at the start are known */
    double last_dt;         /* length of the step that ends now */
    double wall_start, part_start; /* for the ETA only: clock, and part of the run done, at the start */
    bool spread;            /* every rank holds its own rows, and others' where it asked for them (ghosts.h); else it holds all */
    const char *whole;      /* why every rank must hold all rows; NULL: no reason */
    struct ghosts *ghosts;
    struct domains *domains;            /* of the last build (tree_cells.h); builds at which they moved, and were kept */
    int64_t domains_moved, domains_kept;
    int64_t ending;         /* rows of all ranks whose step ends now */
    int64_t unsorted;       /* updates of rows, of all ranks, since the tree was built */
    bool rebuild_next;      /* the tree is rebuilt at the next step in any case (after a checkpoint) */
};

/* Loops over the species that have rows. */
#define for_species(sim, table) \
    for (__typeof__((sim)->species[0]) *table = (sim)->species; table < (sim)->species + N_SPECIES; table++) \
        if (table->n > 0)

/* What a simulation is made for: SIM_FORCES has no time, no integrator and no output; SIM_START has rows and the
 * parameters that make them, those of the gas too, and no columns but those that the caller asks for. */
enum sim_purpose { SIM_RUN, SIM_FORCES, SIM_START };

/* Reads units, start and the block of every module in use, and lets the modules ask for columns.
 * Mistakes are collected in sim->problems: report them before going on. Owns the scene from now on. */
struct sim *sim_new(struct scene *scene, enum sim_purpose purpose);
/* After the rows are there: columns, module states. */
void sim_begin(struct sim *sim);
/* What the scene seems not to mean, and what each module says of its settings: warnings in the log. */
void sim_warn(struct sim *sim);
void sim_free(struct sim *sim);
/* Runs every call of one hook, timed; whatever fails meanwhile, since other ranks go on. */
void sim_run_hook(struct sim *sim, int hook);
/* Lists the rows whose step ends at the present tick; returns how many of all ranks. */
int64_t sim_find_active(struct sim *sim);
/* used.yml: a scene that reproduces the run. */
void sim_write_used(const struct sim *sim, FILE *stream);
/* State of the module in use by that name, or NULL. */
void *sim_state(const struct sim *sim, const char *module);
/* Whether the simulation uses the module of that name, which may have no state. */
bool sim_uses(const struct sim *sim, const char *module);
/* The real parameter of that name of any module in use, such as "gamma"; else the fallback. */
double sim_real(const struct sim *sim, const char *name, double fallback);
/* Records that a number failed: "energy of gas particle 42 is NaN (rho ..., h ..., u ...)". */
void sim_fail(struct sim *sim, const struct species *table, int64_t row, const char *what);
/* The device that modules may use, or NULL. */
static inline struct device *sim_device(const struct sim *sim) { return sim->device_left ? NULL : sim->device; }
/* After an error of the device that struck a module: true if the CPU goes on without it (--device auto, lack of
 * memory), which is logged; else the run stops. */
bool sim_leave_device(struct sim *sim, const char *module, const char *error);
/* Records any other failure of a run, unless one is recorded. Not from a parallel region. */
void sim_stop(struct sim *sim, enum status status, const char *format, ...) __attribute__((format(printf, 3, 4)));
/* Position of a row now, predicted if its step goes on: what a walk stages (any thread). */
static inline void sim_predict(const struct timeline *time, const struct species *s, int64_t i, double pos[3])
{
    double t = timeline_lag(time, s->rung[i], s->rung0[i]);
    if (t == 0) memcpy(pos, s->pos[i], sizeof s->pos[i]);   /* at every full step: nothing else is read */
    for (int k = 0; k < 3 && t != 0; k++)
        pos[k] = integrate_position(s->pos[i][k], s->vel[i][k], (double)s->acc[i][k], t);
}
#endif
