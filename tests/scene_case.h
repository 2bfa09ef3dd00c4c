/* SPDX-License-Identifier: GPL-3.0-or-later
 * For the tests of modules in whole scenes: a simulation with its rows, before the first step, and what its modules tell. */
#ifndef TEPHRA_TESTS_SCENE_CASE_H
#define TEPHRA_TESTS_SCENE_CASE_H
#include "module.h"
#include "scene.h"
#include "start.h"
#include <string.h>

/* fixed, then set: assignments as --set takes them, each list NULL-ended. */
static inline struct sim *scene_case_make(const char *const *fixed, const char *const *set)
{
    struct problems problems = {0};
    struct scene *scene = scene_new(".");
    for (const char *const *s = fixed; *s; s++) scene_set(scene, *s, &problems);
    for (const char *const *s = set; *s; s++) scene_set(scene, *s, &problems);
    problems_report(&problems);
    struct sim *sim = sim_new(scene, SIM_RUN);
    problems_report(&sim->problems);
    start_load(sim);
    problems_report(&sim->problems);
    sim_begin(sim);
    return sim;
}

/* The sum of the columns that begin with a name; NULL: of all. */
struct scene_case_tap { struct energy_sink sink; const char *name; double sum; int columns; };

static inline void scene_case_pick(struct energy_sink *sink, const char *column, double value)
{
    struct scene_case_tap *tap = (struct scene_case_tap *)sink;
    if (tap->name && strncmp(column, tap->name, strlen(tap->name)) != 0) return;
    tap->sum += value;
    tap->columns++;
}

/* Of a module's columns of budget.csv; such a column there must be. */
static inline double scene_case_budget(struct sim *sim, const char *module, const char *name)
{
    struct scene_case_tap tap = {{scene_case_pick}, name, 0, 0};
    for (int u = 0; u < sim->n_use; u++)
        if (strcmp(sim->use[u].module->name, module) == 0) sim->use[u].module->budget(sim, sim->use[u].state, &tap.sink);
    check(tap.columns > 0);
    return tap.sum;
}

/* Of the energies that all modules tell. */
static inline double scene_case_energy(struct sim *sim, const char *name)
{
    struct scene_case_tap tap = {{scene_case_pick}, name, 0, 0};
    for (int u = 0; u < sim->n_use; u++)
        if (sim->use[u].module->energy) sim->use[u].module->energy(sim, sim->use[u].state, &tap.sink);
    return tap.sum;
}
#endif
