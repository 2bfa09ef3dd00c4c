/* SPDX-License-Identifier: GPL-3.0-or-later
 * What tests of SPH compare with: rows as they are now, in double precision; rows put to sleep; variants of the scheme. */
#ifndef TEPHRA_TESTS_SPH_BRUTE_H
#define TEPHRA_TESTS_SPH_BRUTE_H
#include "integrate.h"
#include "sph_case.h"

static inline void clustered(double pos[3], double vel[3], int64_t i, int64_t n, const struct random *key)
{
    case_random(pos, vel, i, n, key);
    double scale = i % 3 == 0 ? 1 : i % 3 == 1 ? 0.01 : 1e-5;
    for (int d = 0; d < 3; d++) pos[d] = (double)(i % 3) + scale * (pos[d] - 0.5);
}

static inline void lattice(double pos[3], double vel[3], int64_t i, int64_t n, const struct random *key)
{
    int64_t side = llround(cbrt((double)n));
    (void)key;
    pos[0] = (double)(i % side) / (double)side;
    pos[1] = (double)(i / side % side) / (double)side;
    pos[2] = (double)(i / side / side) / (double)side;
    vel[0] = vel[1] = vel[2] = 0;
}

#define GRAD_H "sph.count=smooth", "sph.grad_h=on"
static const char *const variants[][8] = {
    {NULL}, {GRAD_H, "sph.equation=entropy", "sph.kernel=wendland_c2", "sph.neighbours=100", "sph.strength=shocks", NULL},
    {GRAD_H, "sph.conduction=0.3", NULL}, {GRAD_H, "sph.viscosity=signal", "sph.kernel=wendland_c4", "sph.balsara=off", NULL},
    {"sph.preset=modern", NULL}, {"sph.conduction=1", NULL},
    {"sph.viscosity=signal", "sph.kernel=wendland_c4", "sph.neighbours=200", "sph.strength=shocks", "sph.balsara=off", NULL},
};
enum { VARIANTS = sizeof variants / sizeof *variants };

struct now { double pos[3], vel[3], u, h, rho; };

static inline struct now row_now(const struct sim *sim, int64_t i)
{
    const struct species *gas = &sim->species[GAS];
    struct now now = {.u = gas->u ? (double)gas->u[i] : 0, .h = (double)sph_h_now(sim, i), .rho = (double)sph_rho_now(sim, i)};
    double t = timeline_lag(&sim->time, gas->rung[i], gas->rung0[i]);
    for (int d = 0; d < 3; d++) {
        now.pos[d] = integrate_position(gas->pos[i][d], gas->vel[i][d], (double)gas->acc[i][d], t);
        now.vel[d] = integrate_velocity(gas->vel[i][d], (double)gas->acc[i][d], t);
    }
    if (gas->u) now.u = (double)integrate_energy(gas->u[i], gas->du[i], (float)t);
    if (t > 0 && case_sph(sim)->equation == SPH_ENTROPY) now.u *= exp(-(case_sph(sim)->gamma - 1) * (double)gas->div_v[i] * t);
    return now;
}

static inline double distance2(const struct now *a, const struct now *b)
{
    double sum = 0;
    for (int d = 0; d < 3; d++) sum += (a->pos[d] - b->pos[d]) * (a->pos[d] - b->pos[d]);
    return sum;
}

static inline struct now *all_now(const struct sim *sim)
{
    int64_t n = sim->species[GAS].n;
    struct now *now = mem_array("test", struct now, n);
    for (int64_t i = 0; i < n; i++) now[i] = row_now(sim, i);
    return now;
}

/* Puts rows to sleep, on steps that began at different ticks, moves on to a tick where few are active. */
static inline void put_to_sleep(struct sim *sim)
{
    struct species *gas = case_gas(sim);
    sim->time.tick = ((int64_t)1 << RUNG_TOP) - ((int64_t)1 << (RUNG_TOP - 4));
    for (int64_t i = 0; i < gas->n; i++) {
        gas->rung0[i] = gas->rung[i] = (uint8_t)(RUNG_TOP - gas->id[i] % 6);
        gas->du[i] = -gas->u[i];
    }
    tree_build(sim);
    sim_find_active(sim);
    tree_mark_active(sim);
}
#endif
