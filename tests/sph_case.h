/* SPDX-License-Identifier: GPL-3.0-or-later
 * A simulation of gas alone for the tests and benchmarks of SPH: rows made by a function of the row
 * number, the module with its defaults and some keys set, hooks called by hand. */
#ifndef TEPHRA_TESTS_SPH_CASE_H
#define TEPHRA_TESTS_SPH_CASE_H
#include "mem.h"
#include "module.h"
#include "random.h"
#include "sph/sph.h"
#include <math.h>
#include <string.h>

extern const struct module sph_module;

/* Places row i of n and gives it a velocity; key: for random numbers of its own. */
typedef void case_maker(double pos[3], double vel[3], int64_t i, int64_t n, const struct random *key);

static inline struct sph *case_sph(const struct sim *sim) { return sim->use[0].state; }
static inline struct species *case_gas(struct sim *sim) { return &sim->species[GAS]; }

/* settings: "sph.key=value" words, NULL-ended. */
static struct sim *case_new(int64_t n, case_maker *make, const char *const *settings)
{
    struct sim *sim = mem_alloc("test", sizeof *sim);
    struct species *gas = case_gas(sim);
    sim->scene = scene_new(".");
    scene_set(sim->scene, "sph={}", &sim->problems);
    for (const char *const *s = settings; s && *s; s++) scene_set(sim->scene, *s, &sim->problems);
    sim->use = mem_alloc("test", sizeof *sim->use);
    sim->n_use = 1;
    sim->use[0] = (struct use){&sph_module, mem_alloc("test", sph_module.state_bytes)};
    struct param_target targets[] = {{sph_module.params, sim->use[0].state}, {NULL, NULL}};
    sim->units = (struct units){.G = 1, .length = 1, .mass = 1, .velocity = 1};
    param_read(sim->scene, "sph", targets, &sim->units, &sim->problems);
    for (int k = 0; k < N_SPECIES; k++) sim->species[k].kind = (enum species_kind)k;
    const enum column columns[] = {COLUMN_pos, COLUMN_vel, COLUMN_mass, COLUMN_id, COLUMN_acc, COLUMN_rung,
                                   COLUMN_rung0, COLUMN_dt};
    for (size_t c = 0; c < sizeof columns / sizeof *columns; c++) species_need(gas, columns[c]);
    sph_module.declare(sim, sim->use[0].state);
    problems_report(&sim->problems);
    species_reserve(gas, n);
    gas->n = gas->n_own = n;
    for (int64_t i = 0; i < n; i++) {
        struct random key = {7, (uint64_t)i + 1, 0, random_stream("test_sph")};
        make(gas->pos[i], gas->vel[i], i, n, &key);
        gas->id[i] = (uint64_t)i + 1;
        gas->mass[i] = 1.0 / (double)n;
        gas->rung[i] = gas->rung0[i] = RUNG_TOP;
        gas->h[i] = 0;
        if (gas->u) gas->u[i] = (float)(0.5 + random_uniform(&key, 20));
        if (gas->du) gas->du[i] = 0;
        for (int d = 0; d < 3; d++) gas->acc[i][d] = 0;
    }
    sim->time = (struct timeline){.dt_max = 1, .tick_end = INT64_MAX};
    sim->tree.built = -1;
    tree_need_leaf(&sim->tree, 32);
    return sim;
}

static inline void case_free(struct sim *sim)
{
    sph_module.end(sim, sim->use[0].state);
    for (int k = 0; k < N_SPECIES; k++) species_free(&sim->species[k]);
    tree_free(&sim->tree);
    scene_free(sim->scene);
    mem_free(sim->use[0].state);
    mem_free(sim->use);
    mem_free(sim);
}

/* Tree, active rows, then H and DENSITY, then FORCE on rows whose acc and du are cleared. */
static inline void case_arrange(struct sim *sim)
{
    tree_build(sim);
    sim_find_active(sim);
    tree_mark_active(sim);
}

static inline void case_density(struct sim *sim)
{
    sph_module.hook[HOOK_H](sim, sim->use[0].state);
    sph_module.hook[HOOK_DENSITY](sim, sim->use[0].state);
}

static inline void case_force(struct sim *sim)
{
    struct species *gas = case_gas(sim);
    rows_here(sim, GAS_BIT, 0, COL(acc) | COL(du));
    for (int64_t a = 0; a < gas->n_active; a++) {
        int32_t i = gas->active[a];
        for (int d = 0; d < 3; d++) gas->acc[i][d] = 0;
        if (gas->du) gas->du[i] = 0;
    }
    sph_module.hook[HOOK_FORCE](sim, sim->use[0].state);
}

static inline void case_random(double pos[3], double vel[3], int64_t i, int64_t n, const struct random *key)
{
    (void)i;
    (void)n;
    for (int d = 0; d < 3; d++) {
        pos[d] = random_uniform(key, (uint64_t)d);
        vel[d] = random_normal(key, (uint64_t)d + 3);
    }
}

/* A sphere of density 1/r. */
static inline void case_evrard(double pos[3], double vel[3], int64_t i, int64_t n, const struct random *key)
{
    (void)i;
    (void)n;
    double unit[3], r = sqrt(random_uniform(key, 10));
    random_direction(key, 0, unit);
    for (int d = 0; d < 3; d++) {
        pos[d] = r * unit[d];
        vel[d] = 0.1 * random_normal(key, (uint64_t)d + 3);
    }
}
#endif
