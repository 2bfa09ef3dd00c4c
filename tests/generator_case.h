/* SPDX-License-Identifier: GPL-3.0-or-later
 * For the tests of generators: a dimensionless simulation with rows by one of them. */
#ifndef TEPHRA_TESTS_GENERATOR_CASE_H
#define TEPHRA_TESTS_GENERATOR_CASE_H
#include "mem.h"
#include "module.h"

/* Rows by `keys` ("mass: 2, radius: 3") in a box of these sides, 0 for open ones. */
static inline struct sim *generator_case_make(const struct generator *generator, const char *keys, int64_t n, const double side[3])
{
    struct sim *sim = mem_alloc("test", sizeof *sim);
    sim->units = (struct units){false, 1, 1, 1, 1};
    sim->seed = 1;
    for (int s = 0; s < N_SPECIES; s++) sim->species[s].kind = (enum species_kind)s;
    for (int k = 0; k < 3; k++) sim->box.side[k] = side[k];
    species_need(&sim->species[GAS], COLUMN_u);
    void *state = mem_alloc("test", generator->state_bytes);
    sim->scene = scene_new("/");
    char *assignment = mem_format("test", "start={%s}", keys);
    scene_set(sim->scene, assignment, &sim->problems);
    const struct param_target targets[] = {{generator->params, state}, {NULL, NULL}};
    param_read(sim->scene, "start", targets, &sim->units, &sim->problems);
    problems_report(&sim->problems);
    generator->make(sim, state, n);
    mem_free(state);
    mem_free(assignment);
    return sim;
}

static inline void generator_case_free(struct sim *sim)
{
    for (int s = 0; s < N_SPECIES; s++) species_free(&sim->species[s]);
    scene_free(sim->scene);
    mem_free(sim);
}
#endif
