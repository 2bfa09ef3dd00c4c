/* SPDX-License-Identifier: GPL-3.0-or-later
 * What gas rows become when they are given something (deposit.h). */
#include "deposit.h"
#include "mem.h"
#include "sph/kernel.h"
#include "sph/sph.h"
#include <math.h>
#include <stdlib.h>

bool deposit_reaches(const struct sim *sim, const struct nearest *nearest)
{
    const struct species *gas = &sim->species[GAS];
    for (int k = 0; k < nearest->n; k++) {
        double reach = 2 * (double)gas->h[nearest->row[k]];
        if (nearest->r2[k] < reach * reach) return true;
    }
    return false;
}

/* Shares that sum to 1; equal ones if the kernel reaches nobody. */
static void find_shares(const struct sim *sim, const struct nearest *nearest, double share[NEAREST_MOST])
{
    const struct species *gas = &sim->species[GAS];
    double h = 0.5 * sqrt(nearest->r2[nearest->n - 1]), sum = 0;
    for (int k = 0; k < nearest->n; k++) {
        double weight = h > 0 ? (double)sph_kernel((float)(sqrt(nearest->r2[k]) / h), SPH_CUBIC) : 0;
        share[k] = gas->mass[nearest->row[k]] * weight;
        sum += share[k];
    }
    for (int k = 0; k < nearest->n; k++) share[k] = sum > 0 ? share[k] / sum : 1.0 / nearest->n;
}

/* Velocity by momentum; a sleeping row's place now stays where it is. Returns the heat of mixing. */
static double mix(struct sim *sim, int32_t j, double mass, const double vel[3])
{
    struct species *gas = &sim->species[GAS];
    double lag = timeline_lag(&sim->time, gas->rung[j], gas->rung0[j]), whole = gas->mass[j] + mass, square = 0;
    for (int k = 0; k < 3; k++) {
        double apart = vel[k] - integrate_velocity(gas->vel[j][k], (double)gas->acc[j][k], lag);
        double kick = mass / whole * apart;
        gas->vel[j][k] += kick;
        gas->pos[j][k] -= lag * kick;
        square += apart * apart;
    }
    return 0.5 * gas->mass[j] * mass / whole * square;
}

static void wish(const struct sim *sim, const struct sph *sph, int32_t j, struct deposit_wishes *wishes)
{
    const struct species *gas = &sim->species[GAS];
    double step = sph->courant * (double)gas->h[j] / (2 * (double)sph_sound_speed(sph, gas->u[j], gas->rho[j]));
    int rung = timeline_rung(&sim->time, step);
    if (rung < 0 || rung >= gas->rung[j]) return;
    if (wishes->n == wishes->capacity) {
        wishes->capacity = 2 * wishes->capacity + 64;
        wishes->list = mem_resize("feedback", wishes->list, (size_t)wishes->capacity * sizeof *wishes->list);
    }
    wishes->list[wishes->n++] = (struct deposit_wish){j, (uint8_t)rung};
}

void deposit_wake(struct sim *sim, struct deposit_wishes *wishes)
{
    uint8_t *rung = sim->species[GAS].rung;
    for (int64_t w = 0; w < wishes->n; w++) {
        const struct deposit_wish *wished = &wishes->list[w];
        if (wished->rung < rung[wished->row]) rung[wished->row] = wished->rung;
    }
    wishes->n = 0;
}

static int ascending(const void *a, const void *b)
{
    int32_t x = *(const int32_t *)a, y = *(const int32_t *)b;
    return (x > y) - (x < y);
}

void deposit_to_gas(struct sim *sim, const struct deposit *deposit, const struct nearest *nearest,
                    struct deposit_wishes *wishes)
{
    struct species *gas = &sim->species[GAS];
    const struct sph *sph = sim_state(sim, "sph");
    double share[NEAREST_MOST];
    int32_t sleeping[NEAREST_MOST], n = 0;
    find_shares(sim, nearest, share);
    for (int k = 0; k < nearest->n; k++) {
        int32_t j = nearest->row[k];
        double mass = share[k] * deposit->mass, whole = gas->mass[j] + mass;
        double heat = share[k] * deposit->energy + mix(sim, j, mass, deposit->vel);
        gas->u[j] = (float)((gas->mass[j] * (double)gas->u[j] + heat) / whole);
        gas->mass[j] = whole;
        for (int c = FIRST_ELEMENT; c < END_ELEMENTS; c++) {
            double *element = species_column(gas, (enum column)c);
            if (element) element[j] += share[k] * deposit->element[c - FIRST_ELEMENT];
        }
        if (timeline_active(&sim->time, gas->rung[j])) continue;
        wish(sim, sph, j, wishes);
        sleeping[n++] = j;
    }
    qsort(sleeping, (size_t)n, sizeof *sleeping, ascending);
    tree_follow_rows(sim, GAS, sleeping, n);
}
