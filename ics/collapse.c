/* SPDX-License-Identifier: GPL-3.0-or-later
 * A protogalaxy: a triaxial, rotating cloud of gas in the fixed halo of a Plummer sphere (Berczik 1999, A&A 348, 371, in its
 * main traits). */
#include "lattice.h"
#include "mem.h"
#include "module.h"
#include "rows.h"
#include "start.h"
#include <math.h>

struct collapse { double mass, axis[3], temperature, spin, expansion, halo_mass, halo_radius; };

#define KEY(name, unit, fallback, low, high, field, text) \
    {name, PARAM_REAL, unit, fallback, low, high, NULL, text, false, offsetof(struct collapse, field)},

static const struct param params[] = {
    KEY("mass", "mass", "1e11 Msun", 1e-300, 1e300, mass, "mass of the gas")
    KEY("axis_a", "length", "100 kpc", 1e-300, 1e300, axis[0], "half the longest axis of its ellipsoid, along x")
    KEY("axis_b", "length", "75 kpc", 1e-300, 1e300, axis[1], "along y")
    KEY("axis_c", "length", "50 kpc", 1e-300, 1e300, axis[2], "along z, about which it turns")
    KEY("temperature", "temperature", "1e4 K", 1, 1e9, temperature, "of the gas")
    KEY("spin", "", "0.08", -10, 10, spin, "lambda = J |E|^(1/2)/(G M^(5/2)) of gas and halo, with the gas' share of J")
    KEY("expansion", "", "0", -1e3, 1e3, expansion, "speed outwards at a place over that of a circular orbit at axis_a, times r/axis_a")
    KEY("halo_mass", "mass", "1e12 Msun", 0, 1e300, halo_mass, "of the dark halo, a Plummer potential of the block external")
    KEY("halo_radius", "length", "25 kpc", 1e-300, 1e300, halo_radius, "its Plummer radius")
    {0}
};

static void collapse_advise(struct sim *sim, const void *state, int64_t n)
{
    const struct collapse *collapse = state;
    (void)n;
    start_advise(sim, "external", "plummer_mass", collapse->halo_mass);
    start_advise(sim, "external", "plummer_radius", collapse->halo_radius);
}

/* Places of rho ~ 1/s, s^2 = x^2/a^2 + y^2/b^2 + z^2/c^2 < 1: M(s) = M s^2, while a ball's is the cube of its radius. */
static void place(const struct collapse *collapse, struct species *gas)
{
    double (*ball)[3] = lattice_ball(gas->n);
    for (int64_t i = 0; i < gas->n; i++) {
        const double *x = ball[i], r = sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
        for (int k = 0; k < 3; k++) gas->pos[i][k] = collapse->axis[k] * sqrt(r) * x[k];
    }
    mem_free(ball);
    rows_centre(rows_all(gas));
}

/* Solid rotation: the gas has the angular momentum by mass that gas and halo of that lambda have. |E| is the energy of gravity: the
 * halo's own, 3 pi G M^2/(32 b), the gas' in the halo, and the gas' own as of a sphere of the same volume, 2/3 G M^2/R. */
static double turn_rate(const struct sim *sim, const struct collapse *collapse, const struct species *gas)
{
    const double pi = 3.14159265358979323846, G = sim->units.G, b = collapse->halo_radius;
    const double all = collapse->mass + collapse->halo_mass;
    double energy = 3 * pi / 32 * G * collapse->halo_mass * collapse->halo_mass / b, inertia = 0;
    energy += 2.0 / 3 * G * collapse->mass * collapse->mass / cbrt(collapse->axis[0] * collapse->axis[1] * collapse->axis[2]);
    for (int64_t i = 0; i < gas->n; i++) {
        const double *x = gas->pos[i], R2 = x[0] * x[0] + x[1] * x[1];
        energy += G * gas->mass[i] * collapse->halo_mass / sqrt(R2 + x[2] * x[2] + b * b);
        inertia += gas->mass[i] * R2;
    }
    return inertia > 0 ? collapse->spin * G * pow(all, 1.5) / sqrt(energy) * collapse->mass / inertia : 0;
}

static void collapse_make(struct sim *sim, const void *state, int64_t n)
{
    const struct collapse *collapse = state;
    if (!sim->units.physical) problems_add(&sim->problems, "start.temperature: a protogalaxy needs physical units");
    if (collapse->halo_mass > 0 && !scene_find(sim->scene, "external"))
        problems_add(&sim->problems, "start.halo_mass: the halo is a potential of the block external (--set external={})");
    if (sim->problems.count > 0) return;
    struct species *gas = rows_make(sim, GAS, n, collapse->mass);
    place(collapse, gas);
    const double a = collapse->axis[0], b = collapse->halo_radius, s2 = a * a + b * b;
    const double within = collapse->mass + collapse->halo_mass * a * a * a / (s2 * sqrt(s2));
    const double omega = turn_rate(sim, collapse, gas), out = collapse->expansion * sqrt(sim->units.G * within / a) / a;
    for (int64_t i = 0; i < n; i++) {
        const double *x = gas->pos[i];
        gas->vel[i][0] = out * x[0] - omega * x[1];
        gas->vel[i][1] = out * x[1] + omega * x[0];
        gas->vel[i][2] = out * x[2];
    }
    rows_rest(rows_all(gas));
    rows_set_temperature(sim, collapse->temperature);
}

const struct generator collapse_generator = {
    .name = "collapse", .doc = "triaxial, rotating cloud of gas in a fixed dark halo, from which a galaxy forms",
    .params = params, .state_bytes = sizeof(struct collapse), .advise = collapse_advise, .make = collapse_make,
};
