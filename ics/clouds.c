/* SPDX-License-Identifier: GPL-3.0-or-later
 * Two equal molecular clouds on a collision course (Vinogradov & Berczik 2006; Marinho & Lepine 2000, A&AS 142,
 * 165): rho = M / (2 pi R^2 r) within R, one temperature, at rest within themselves or turbulent, or in solid
 * rotation. Rows lie on stretched lattices that are turned against each other, or at random. */
#include "barotrope.h"
#include "constants.h"
#include "lattice.h"
#include "mem.h"
#include "module.h"
#include "random.h"
#include "rows.h"
#include "start.h"
#include "turbulence.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

struct clouds {
    double mass, radius, temperature, velocity, impact, separation;
    double turbulence, slope, solenoidal, rotation;
    int64_t waves;
    int places;
};
enum { LATTICE, RANDOM };

static const struct param params[] = {
    {"mass", PARAM_REAL, "mass", "1", 1e-30, 1e30, NULL, "mass of each cloud", false, offsetof(struct clouds, mass)},
    {"radius", PARAM_REAL, "length", "1", 1e-30, 1e30, NULL, "radius of each cloud", false, offsetof(struct clouds, radius)},
    {"temperature", PARAM_REAL, "temperature", "none", 1e-3, 1e9, NULL,
     "gives the speed of sound sqrt(k T/(mu m_p)), or u with sph.eos: adiabatic; mu is sph.mu, here 2; "
     "default: from sph.sound_speed", false,
     offsetof(struct clouds, temperature)},
    {"velocity", PARAM_REAL, "velocity", "0", 0, 1e30, NULL, "speed with which one cloud approaches the other", false,
     offsetof(struct clouds, velocity)},
    {"impact", PARAM_REAL, "", "0", 0, 100, NULL, "impact parameter in radii: the offset of the paths", false,
     offsetof(struct clouds, impact)},
    {"separation", PARAM_REAL, "length", "none", 0, 1e30, NULL,
     "distance of the centres along the paths; default: two radii", false, offsetof(struct clouds, separation)},
    {"turbulence", PARAM_REAL, "velocity", "0", 0, 1e30, NULL, "root mean square of random velocities, in three dimensions", false,
     offsetof(struct clouds, turbulence)},
    {"turbulence_slope", PARAM_REAL, "", "2", -5, 10, NULL, "their energy spectrum is E(k) ~ k^-slope", false,
     offsetof(struct clouds, slope)},
    {"turbulence_solenoidal", PARAM_REAL, "", "0.6666666666666667", 0, 1, NULL, "part of that energy without divergence", false,
     offsetof(struct clouds, solenoidal)},
    {"turbulence_waves", PARAM_COUNT, "", "16", 1, 64, NULL, "shortest wave: this often in a cloud's diameter", false,
     offsetof(struct clouds, waves)},
    {"rotation", PARAM_REAL, "", "0", 0, 10, NULL, "energy of solid rotation about z over that of a cloud's own gravity", false,
     offsetof(struct clouds, rotation)},
    {"places", PARAM_CHOICE, "", "lattice", 0, 0, "lattice|random", "of the rows: random places carry noise of sqrt(N)", false,
     offsetof(struct clouds, places)},
    {0}
};

/* Of H2, unless the scene says another mean molecular weight. */
static double sound_speed(struct sim *sim, const struct clouds *clouds)
{
    start_advise(sim, "sph", "mu", 2);
    return sqrt(CONST_K_B * clouds->temperature / (barotrope_said(sim, "sph", "mu", "") * CONST_M_PROTON)) / sim->units.velocity;
}

/* Isothermal gas becomes a sink where it is as dense as the rows resolve its Jeans mass. A ball of that density is as tightly bound
 * as a sink must be, 2 E_th = |E_gr| = 3/5 G M^2/r, with the radius c sqrt(15/(4 pi G rho)). */
static double advise_sinks(struct sim *sim, double row, double least)
{
    const char *eos = scene_value(sim->scene, "sph", "eos");
    double neighbours, rho = barotrope_density(sim, row, least, &neighbours);
    const double c = barotrope_said(sim, "sph", "sound_speed", "velocity");
    if (!scene_find(sim->scene, "sinks") || isnan(rho) || !eos || strcmp(eos, "isothermal") != 0) return NAN;
    start_advise(sim, "sinks", "density", rho);
    start_advise(sim, "sinks", "radius", c * sqrt(15 / (4 * acos(-1) * sim->units.G * rho)));
    return barotrope_said(sim, "sinks", "density", "density");
}

/* The gas resists from the density on at which its Jeans mass is no longer resolved (barotrope.h), but not below ten times the
 * clouds' mean, or becomes sinks; the softening is the smoothing length there. h itself has no floor: what collapses beyond
 * would have all its rows as neighbours. */
static void clouds_advise(struct sim *sim, const void *state, int64_t n)
{
    const struct clouds *clouds = state;
    const double pi = 3.14159265358979323846, R = clouds->radius, least = 10;
    if (sim->units.physical && !isnan(clouds->temperature)) {
        const char *eos = scene_value(sim->scene, "sph", "eos");
        double speed = sound_speed(sim, clouds);
        if (eos && strcmp(eos, "adiabatic") != 0) start_advise(sim, "sph", "sound_speed", speed);
    }
    const double row = 2 * clouds->mass / (double)n, mean = clouds->mass / (4 * pi / 3 * R * R * R);
    double neighbours, stiff = barotrope_advise(sim, row, least * mean, &neighbours);
    if (isnan(stiff)) stiff = advise_sinks(sim, row, least * mean);
    if (!isnan(stiff)) start_advise(sim, "gravity", "softening", cbrt(3 * neighbours * row / (32 * pi * stiff)));
}

static double norm(const double x[3]) { return sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]); }

/* Places of one cloud about its centre. The second lattice is turned by angles of no symmetry. */
static void place(const struct clouds *clouds, struct rows rows, bool turn, uint64_t seed)
{
    double (*pos)[3] = rows.table->pos + rows.first;
    const uint64_t stream = random_stream(turn ? "second cloud" : "first cloud");
    double (*ball)[3] = clouds->places == LATTICE ? lattice_ball(rows.n) : NULL;
    const double a = 1.1, b = 0.7;
    const double turned[3][3] = {{cos(a), -sin(a), 0}, {sin(a) * cos(b), cos(a) * cos(b), -sin(b)},
                                 {sin(a) * sin(b), cos(a) * sin(b), cos(b)}};
    for (int64_t i = 0; i < rows.n; i++) {
        const struct random key = {seed, (uint64_t)i + 1, 0, stream};
        double x[3], r = 1;
        if (ball) memcpy(x, ball[i], sizeof x);
        else random_direction(&key, 1, x);
        if (ball) r = sqrt(norm(x));                    /* the ball's radius cubed is the mass within, r^2 in the cloud */
        else r = sqrt(random_uniform(&key, 0));
        for (int k = 0; k < 3; k++) {
            double turned_x = turned[k][0] * x[0] + turned[k][1] * x[1] + turned[k][2] * x[2];
            pos[i][k] = clouds->radius * r * (turn ? turned_x : x[k]);
        }
    }
    mem_free(ball);
    rows_centre(rows);
}

/* Random motion and rotation about the cloud's own centre of mass, which stays at rest. */
static void stir(const struct sim *sim, const struct clouds *clouds, struct rows rows, bool second)
{
    const double R = clouds->radius, omega = sqrt(4 * clouds->rotation * sim->units.G * clouds->mass / (R * R * R));
    double (*pos)[3] = rows.table->pos + rows.first, (*vel)[3] = rows.table->vel + rows.first;
    if (clouds->turbulence > 0) {
        const struct turbulence field = {clouds->slope, clouds->solenoidal, clouds->waves, sim->seed,
                                         random_stream(second ? "second turbulence" : "first turbulence")};
        turbulence_fill(&field, 2.1 * R, rows.n, pos, vel);     /* a little wider than the cloud: the box repeats */
        rows_rest(rows);
        double square = 0;
        for (int64_t i = 0; i < rows.n; i++) square += norm(vel[i]) * norm(vel[i]) / (double)rows.n;
        for (int64_t i = 0; i < rows.n; i++)
            for (int k = 0; k < 3; k++) vel[i][k] *= clouds->turbulence / sqrt(square);
    }
    for (int64_t i = 0; i < rows.n; i++) {      /* I = M R^2/3 and W = 2/3 G M^2/R of the density 1/r */
        vel[i][0] -= omega * pos[i][1];
        vel[i][1] += omega * pos[i][0];
    }
    rows_rest(rows);
}

static void clouds_make(struct sim *sim, const void *state, int64_t n)
{
    const struct clouds *clouds = state;
    if (!isnan(clouds->temperature) && !sim->units.physical)
        problems_add(&sim->problems, "start.temperature: a scene without units gives sph.sound_speed instead");
    if (n < 2) problems_add(&sim->problems, "start.n: two clouds need two rows at least");
    if (sim->problems.count > 0) return;
    const double apart = isnan(clouds->separation) ? 2 * clouds->radius : clouds->separation;
    const int64_t count[2] = {n - n / 2, n / 2};
    double mass = clouds->mass * (double)count[0] / ((double)n / 2);     /* rows of both clouds have one mass */
    for (int second = 0; second < 2; second++) {
        struct rows rows = rows_add(sim, GAS, count[second], second ? 2 * clouds->mass - mass : mass);
        place(clouds, rows, second, sim->seed);
        stir(sim, clouds, rows, second);
        const double side = second ? 0.5 : -0.5;
        for (int64_t i = rows.first; i < rows.first + rows.n; i++) {
            rows.table->pos[i][0] += side * apart;
            rows.table->pos[i][1] += side * clouds->impact * clouds->radius;
            rows.table->vel[i][0] -= side * clouds->velocity;
        }
    }
    struct species *gas = &sim->species[GAS];
    rows_centre(rows_all(gas));
    if (!isnan(clouds->temperature)) rows_set_temperature(sim, clouds->temperature);
}

const struct generator clouds_generator = {
    .name = "clouds", .doc = "two molecular clouds with rho ~ 1/r on a collision course",
    .params = params, .state_bytes = sizeof(struct clouds), .advise = clouds_advise, .make = clouds_make,
};
