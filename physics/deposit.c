/* SPDX-License-Identifier: GPL-3.0-or-later
 * What gas rows become when they are given something (deposit.h). */
#include "deposit.h"
#include "gravity/contact.h"
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

void deposit_shares(const struct sim *sim, const struct nearest *nearest, double share[NEAREST_MOST])
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

static double potential_of(const struct sim *sim, enum species_kind kind, int64_t row)
{
    struct gravity_piece piece = {.kind = kind, .mass = 1};
    sim_predict(&sim->time, &sim->species[kind], row, piece.pos);
    return gravity_field(sim, &piece, 1, kind, (const int64_t[2]){row, -1});
}

/* A mass of less than this part of a gas row is looked at with a probability, and counts for as much more. In a dwarf of 1 Gyr
 * 1e9 Msun pass between clouds, stars and gas: in pieces of 3e4 Msun, each with a Phi(x) - Phi(gas) of (50 km/s)^2 either way, an
 * error of 4e-4 of the kinetic energy, the root of their number times one. Walks for every piece took half of all time. */
static const double piece = 0.03;

double deposit_rise(const struct sim *sim, const struct nearest *nearest, enum species_kind kind, int64_t row, double mass,
                    const struct random *key)
{
    enum { PROBES = 2 };
    double share[NEAREST_MOST], there = 0, around = 0;
    if (!sim_state(sim, "gravity") || mass == 0) return 0;
    for (int k = 0; k < nearest->n; k++) around += sim->species[GAS].mass[nearest->row[k]] / nearest->n;
    const double chance = fmin(fabs(mass) / (piece * around), 1);
    if (random_uniform(key, (uint64_t)(NEAREST_MOST + 1 + PROBES)) > chance) return 0;
    deposit_shares(sim, nearest, share);
    for (int p = 0; p < PROBES; p++) {
        double left = random_uniform(key, (uint64_t)(NEAREST_MOST + 1 + p));
        int k = 0;
        for (; k < nearest->n - 1 && left > share[k]; k++) left -= share[k];
        there += potential_of(sim, GAS, nearest->row[k]) / PROBES;
    }
    return mass / chance * (there - potential_of(sim, kind, row));
}

void deposit_velocity(const struct sim *sim, int32_t j, double vel[3])
{
    const struct species *gas = &sim->species[GAS];
    double lag = timeline_lag(&sim->time, gas->rung[j], gas->rung0[j]);
    for (int k = 0; k < 3; k++) vel[k] = integrate_velocity(gas->vel[j][k], (double)gas->acc[j][k], lag);
}

/* A sleeping row's place now stays where it is. */
static void kick(struct sim *sim, int32_t j, int axis, double change)
{
    struct species *gas = &sim->species[GAS];
    gas->vel[j][axis] += change;
    gas->pos[j][axis] -= timeline_lag(&sim->time, gas->rung[j], gas->rung0[j]) * change;
}

/* Velocity by momentum. Returns the heat of mixing. */
static double mix(struct sim *sim, int32_t j, double mass, const double vel[3])
{
    const double old = sim->species[GAS].mass[j], whole = old + mass;
    double now[3], square = 0;
    deposit_velocity(sim, j, now);
    for (int k = 0; k < 3; k++) {
        double apart = vel[k] - now[k];
        kick(sim, j, k, mass / whole * apart);
        square += apart * apart;
    }
    return 0.5 * old * mass / whole * square;
}

/* Mass, elements and the heat of mixing. */
static void add_mass(struct sim *sim, const struct deposit *deposit, int32_t j, double share)
{
    struct species *gas = &sim->species[GAS];
    double mass = share * deposit->mass, whole = gas->mass[j] + mass;
    double heat = mix(sim, j, mass, deposit->vel);
    gas->u[j] = (float)((gas->mass[j] * (double)gas->u[j] + heat) / whole);
    gas->mass[j] = whole;
    for (int c = FIRST_ELEMENT; c < END_ELEMENTS; c++) {
        double *element = species_column(gas, (enum column)c);
        if (element) element[j] += share * deposit->element[c - FIRST_ELEMENT];
    }
}

/* Stochastic heating (Dalla Vecchia & Schaye 2012): gas that is heated at all becomes so hot that it expands before
 * it cools. Where there is more energy than heats all rows so, each has its part of it. */
static double heat_at_random(struct sim *sim, const struct deposit *deposit, const struct nearest *nearest)
{
    struct species *gas = &sim->species[GAS];
    double mass = 0, given = 0;
    for (int k = 0; k < nearest->n; k++) mass += gas->mass[nearest->row[k]];
    double chance = deposit->energy / (deposit->rise * mass), rise = deposit->rise * fmax(chance, 1);
    for (int k = 0; k < nearest->n; k++) {
        int32_t j = nearest->row[k];
        if (random_uniform(&deposit->key, (uint64_t)k) > chance) continue;
        gas->u[j] += (float)rise;
        given += gas->mass[j] * rise;
    }
    return given;
}

/* Unit vectors away from the deposit, less their weighted mean, times the shares: they sum to zero. */
static void find_directions(const struct sim *sim, const struct deposit *deposit, const struct nearest *nearest,
                            const double share[NEAREST_MOST], double away[NEAREST_MOST][3])
{
    double mean[3] = {0};
    for (int k = 0; k < nearest->n; k++) {
        double r2 = 0;
        sim_predict(&sim->time, &sim->species[GAS], nearest->row[k], away[k]);
        for (int x = 0; x < 3; x++) {
            away[k][x] -= deposit->pos[x];
            away[k][x] += box_shift(&sim->box, x, away[k][x]);
            r2 += away[k][x] * away[k][x];
        }
        for (int x = 0; x < 3; x++) mean[x] += share[k] * (away[k][x] *= r2 > 0 ? 1 / sqrt(r2) : 0);
    }
    for (int k = 0; k < nearest->n; k++)
        for (int x = 0; x < 3; x++) away[k][x] = share[k] * (away[k][x] - mean[x]);
}

/* Kinetic energy of the pushes p: A s^2 + B s at the scale s, which is 1 or, where that is more than there is, less. */
static double push(struct sim *sim, const struct deposit *deposit, const struct nearest *nearest,
                   const double share[NEAREST_MOST])
{
    double away[NEAREST_MOST][3], vel[3], a = 0, b = 0, scale = 1;
    const double *mass = sim->species[GAS].mass;
    find_directions(sim, deposit, nearest, share, away);
    for (int k = 0; k < nearest->n; k++) {
        deposit_velocity(sim, nearest->row[k], vel);
        for (int x = 0; x < 3; x++) {
            double p = deposit->momentum * away[k][x];
            a += 0.5 * p * p / mass[nearest->row[k]];
            b += p * (vel[x] - deposit->vel[x]);
        }
    }
    if (a + b > deposit->energy) scale = 2 * deposit->energy / (b + sqrt(b * b + 4 * a * deposit->energy));
    for (int k = 0; k < nearest->n; k++)
        for (int x = 0; x < 3; x++)
            kick(sim, nearest->row[k], x, scale * deposit->momentum * away[k][x] / mass[nearest->row[k]]);
    return scale * (scale * a + b);
}

/* A row that is suddenly much hotter pushes its neighbours at once, but pays only for the velocities that they will have had:
 * what they gain in its first step comes from nowhere, and falls as the square of that step. */
static const float much_hotter = 2, first_step = 4;

/* A row as it was before the deposit. */
struct before { double vel[3]; float u; };

static struct before before_of(const struct sim *sim, int32_t j)
{
    struct before before = {.u = sim->species[GAS].u[j]};
    deposit_velocity(sim, j, before.vel);
    return before;
}

/* The signal velocity that the row will have: twice its sound speed and how fast it leaves its place; for its first step
 * that of a shorter one. */
static double signal_of(const struct sim *sim, const struct sph *sph, int32_t j, const struct before *before)
{
    const struct species *gas = &sim->species[GAS];
    double now[3], apart = 0, sound = 2 * (double)sph_sound_speed(sph, gas->u[j], gas->rho[j]);
    deposit_velocity(sim, j, now);
    for (int k = 0; k < 3; k++) apart += (now[k] - before->vel[k]) * (now[k] - before->vel[k]);
    return (gas->u[j] > much_hotter * before->u ? (double)first_step : 1) * sound + sqrt(apart);
}

/* Rows whose step ends now obey the signal velocity themselves, in sph's LIMIT, and so do their neighbours. */
static void shorten(const struct sim *sim, const struct sph *sph, int32_t j, const struct before *before,
                    struct deposit_wishes *wishes)
{
    const struct species *gas = &sim->species[GAS];
    double signal = signal_of(sim, sph, j, before);
    if (timeline_active(&sim->time, gas->rung[j])) {
        gas->signal[j] = fmaxf(gas->signal[j], (float)signal);
        return;
    }
    int rung = timeline_rung(&sim->time, sph->courant * (double)gas->h[j] / signal);
    if (rung < 0 || rung >= gas->rung[j]) return;
    if (wishes->n == wishes->capacity) {
        wishes->capacity = 2 * wishes->capacity + 64;
        wishes->list = mem_resize("feedback", wishes->list, (size_t)wishes->capacity * sizeof *wishes->list);
    }
    wishes->list[wishes->n++] = (struct deposit_wish){j, (uint8_t)rung};
}

static int ascending(const void *a, const void *b)
{
    int32_t x = *(const int32_t *)a, y = *(const int32_t *)b;
    return (x > y) - (x < y);
}

void deposit_wake(struct sim *sim, struct deposit_wishes *wishes)
{
    uint8_t *rung = sim->species[GAS].rung;
    int64_t moved = 0;
    if (wishes->n_moved > 0) qsort(wishes->moved, (size_t)wishes->n_moved, sizeof *wishes->moved, ascending);
    for (int64_t m = 0; m < wishes->n_moved; m++)
        if (moved == 0 || wishes->moved[m] != wishes->moved[moved - 1]) wishes->moved[moved++] = wishes->moved[m];
    tree_follow_rows(sim, GAS, wishes->moved, moved);
    for (int64_t w = 0; w < wishes->n; w++) {
        const struct deposit_wish *wished = &wishes->list[w];
        if (wished->rung < rung[wished->row]) rung[wished->row] = wished->rung;
    }
    wishes->n = wishes->n_moved = 0;
}

void deposit_free(struct deposit_wishes *wishes)
{
    mem_free(wishes->list);
    mem_free(wishes->moved);
}

static double add_energy(struct sim *sim, const struct deposit *deposit, const struct nearest *nearest,
                         const double share[NEAREST_MOST])
{
    struct species *gas = &sim->species[GAS];
    if (deposit->form == DEPOSIT_JUMPS) return heat_at_random(sim, deposit, nearest);
    if (deposit->form == DEPOSIT_PUSH) return push(sim, deposit, nearest, share);
    for (int k = 0; k < nearest->n; k++)
        gas->u[nearest->row[k]] += (float)(share[k] * deposit->energy / gas->mass[nearest->row[k]]);
    return deposit->energy;
}

/* Rows in the midst of their step whose velocity has changed: the tree is to follow, and those that are fast are to wake. */
static void follow(const struct sim *sim, const struct nearest *nearest, const struct before *before,
                   struct deposit_wishes *wishes)
{
    const struct sph *sph = sim_state(sim, "sph");
    if (wishes->n_moved + nearest->n > wishes->room) {
        wishes->room = 2 * wishes->room + NEAREST_MOST;
        wishes->moved = mem_resize("feedback", wishes->moved, (size_t)wishes->room * sizeof *wishes->moved);
    }
    for (int k = 0; k < nearest->n; k++) {
        int32_t j = nearest->row[k];
        shorten(sim, sph, j, &before[k], wishes);
        if (!timeline_active(&sim->time, sim->species[GAS].rung[j])) wishes->moved[wishes->n_moved++] = j;
    }
}

void deposit_push(struct sim *sim, const struct nearest *nearest, const double impulse[3], double heat,
                  struct deposit_wishes *wishes)
{
    struct species *gas = &sim->species[GAS];
    double share[NEAREST_MOST];
    struct before before[NEAREST_MOST];
    deposit_shares(sim, nearest, share);
    for (int k = 0; k < nearest->n; k++) {
        int32_t j = nearest->row[k];
        before[k] = before_of(sim, j);
        for (int x = 0; x < 3; x++) kick(sim, j, x, share[k] * impulse[x] / gas->mass[j]);
        gas->u[j] += (float)(share[k] * heat / gas->mass[j]);
    }
    follow(sim, nearest, before, wishes);
}

void deposit_withdraw(struct sim *sim, const struct nearest *nearest, double mass, struct deposit *drawn)
{
    struct species *gas = &sim->species[GAS];
    double share[NEAREST_MOST], vel[3], momentum[3] = {0};
    deposit_shares(sim, nearest, share);
    *drawn = (struct deposit){.mass = mass};
    for (int k = 0; k < nearest->n; k++) {
        int32_t j = nearest->row[k];
        double part = share[k] * mass, rest = 1 - part / gas->mass[j];
        deposit_velocity(sim, j, vel);
        for (int x = 0; x < 3; x++) {
            momentum[x] += part * vel[x];
            drawn->energy += 0.5 * part * vel[x] * vel[x];
        }
        drawn->energy += part * (double)gas->u[j];
        for (int c = FIRST_ELEMENT; c < END_ELEMENTS; c++) {
            double *element = species_column(gas, (enum column)c);
            if (element) drawn->element[c - FIRST_ELEMENT] += (1 - rest) * element[j];
            if (element) element[j] *= rest;
        }
        gas->mass[j] -= part;
    }
    for (int x = 0; x < 3; x++) drawn->vel[x] = momentum[x] / mass;
}

double deposit_to_gas(struct sim *sim, const struct deposit *deposit, const struct nearest *nearest,
                      struct deposit_wishes *wishes)
{
    double share[NEAREST_MOST];
    struct before before[NEAREST_MOST];
    deposit_shares(sim, nearest, share);
    for (int k = 0; k < nearest->n; k++) {
        before[k] = before_of(sim, nearest->row[k]);
        add_mass(sim, deposit, nearest->row[k], share[k]);
    }
    double given = deposit->energy > 0 ? add_energy(sim, deposit, nearest, share) : 0;
    follow(sim, nearest, before, wishes);
    return given;
}
