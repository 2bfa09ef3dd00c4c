/* SPDX-License-Identifier: GPL-3.0-or-later
 * For the tests of modules in whole scenes: a simulation with its rows, before the first step. */
#ifndef TEPHRA_TESTS_SCENE_CASE_H
#define TEPHRA_TESTS_SCENE_CASE_H
#include "module.h"
#include "scene.h"
#include "start.h"

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
#endif
