/* SPDX-License-Identifier: GPL-3.0-or-later
 * A simulation: all state of one run. There are no mutable globals. */
#ifndef TEPHRA_SIM_H
#define TEPHRA_SIM_H
#include "fail.h"
#include "scene.h"
#include "species.h"
#include "timeline.h"
#include "tree.h"
#include "units.h"

struct module;
struct profile;

struct use { const struct module *module; void *state; };   /* a module of this scene */
struct call { int hook, use; };                             /* one entry of the step */

/* What went wrong with the numbers; the driver writes a last snapshot and ends with 3. */
struct failure { bool set; char text[512]; };

struct sim {
    struct scene *scene;
    struct problems problems;
    struct units units;
    struct timeline time;
    struct species species[N_SPECIES];
    struct tree tree;
    struct use *use; int n_use;         /* modules in the list's order */
    struct call *call; int n_call;      /* the step, flat */
    struct profile *profile;
    struct failure failure;
    char *used, *version;   /* texts for files: used.yml, and what made the run; NULL = none */
    uint64_t seed;
    int threads;
    bool want_potential;    /* this step is recorded: FORCE shall fill pot too */
    bool fresh_potential;   /* pot is of the present positions */
    int64_t steps, updates; /* steps done; row updates done */
    int64_t rebuild_rung;   /* the tree is rebuilt where 2^rebuild_rung divides the tick */
};

/* Loops over the species that have rows. */
#define for_species(sim, table) \
    for (struct species *table = (sim)->species; table < (sim)->species + N_SPECIES; table++) \
        if (table->n > 0)

/* State of the module in use by that name, or NULL. */
void *sim_state(const struct sim *sim, const char *module);
/* Records that a number failed: "energy of gas particle 42 is NaN (rho ..., h ..., u ...)". */
void sim_fail(struct sim *sim, const struct species *table, int64_t row, const char *what);
/* Position, and velocity if asked for, of a row now: what a walk stages (any thread). */
static inline void sim_predict(const struct timeline *time, const struct species *s, int64_t i, double pos[3])
{
    double t = timeline_lag(time, s->rung[i], s->rung0[i]);
    for (int k = 0; k < 3; k++) pos[k] = s->pos[i][k] + t * (s->vel[i][k] + 0.5 * t * (double)s->acc[i][k]);
}
#endif
