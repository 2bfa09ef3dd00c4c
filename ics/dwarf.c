/* SPDX-License-Identifier: GPL-3.0-or-later
 * A dwarf galaxy before its collapse: dark halo, gas and cold clouds about one centre (the model of Berczik et al. 2002 in its
 * main traits). Halo and clouds have velocities by Eddington's inversion in the potential of all, the clouds less of them and
 * turning; the gas has the pressure that its weight asks for, turns as well, and will cool. */
#include "equilibrium.h"
#include "mem.h"
#include "module.h"
#include "random.h"
#include <math.h>

enum part { DWARF_DARK, DWARF_GAS, DWARF_CLOUD, PARTS };
struct dwarf { double mass[PARTS], radius[PARTS], share[PARTS], cut, virial, spin; struct rows_spectrum spectrum; };

#define KEY(name, unit, fallback, low, high, field, text) \
    {name, PARAM_REAL, unit, fallback, low, high, NULL, text, false, offsetof(struct dwarf, field)},

static const struct param params[] = {
    KEY("dark_mass", "mass", "2e10 Msun", 1e-300, 1e300, mass[DWARF_DARK], "mass of the halo, a Hernquist sphere")
    KEY("dark_radius", "length", "6 kpc", 1e-300, 1e300, radius[DWARF_DARK], "its scale radius")
    KEY("gas_mass", "mass", "1e9 Msun", 1e-300, 1e300, mass[DWARF_GAS], "mass of the gas, a Plummer sphere")
    KEY("gas_radius", "length", "3 kpc", 1e-300, 1e300, radius[DWARF_GAS], "its scale radius")
    KEY("cloud_mass", "mass", "1e9 Msun", 1e-300, 1e300, mass[DWARF_CLOUD], "mass of the clouds, a Hernquist sphere")
    KEY("cloud_radius", "length", "2 kpc", 1e-300, 1e300, radius[DWARF_CLOUD], "its scale radius")
    KEY("cut", "length", "40 kpc", 1e-300, 1e300, cut, "from this radius on the density of all falls exponentially")
    KEY("lightest", "mass", "1e4 Msun", 1e-300, 1e300, spectrum.least, "of the clouds, where their number gives their mass with it")
    KEY("heaviest", "mass", "1e6 Msun", 1e-300, 1e300, spectrum.most, "of the clouds; all masses are scaled to sum to cloud_mass")
    KEY("slope", "", "-1.5", -10, 10, spectrum.slope, "the number of clouds in an interval of mass is ~ mass^slope")
    KEY("virial", "", "0.5", 0, 1, virial, "kinetic energy of the clouds over that in equilibrium")
    KEY("spin", "", "0.5", 0, 1, spin, "speed of rotation over that of a circle of the gas, over the largest one of the clouds")
    KEY("dark_share", "", "2", 1e-9, 1e9, share[DWARF_DARK], "part of the rows, relative to the other shares")
    KEY("gas_share", "", "1", 1e-9, 1e9, share[DWARF_GAS], "the same of the gas")
    KEY("cloud_share", "", "1", 1e-9, 1e9, share[DWARF_CLOUD], "the same of the clouds")
    {0}
};

/* A cloud in the cusp of the halo needs one as well, or no velocities keep it there. */
static const enum radial_form forms[PARTS] = {RADIAL_HERNQUIST, RADIAL_PLUMMER, RADIAL_HERNQUIST};
static const enum species_kind kinds[PARTS] = {DARK, GAS, CLOUD};
static const char *const names[PARTS] = {"dwarf halo", "dwarf gas", "dwarf clouds"};

/* By mass; rows of equal masses are centred already. */
static void subtract_mean(struct rows rows, double (*x)[3])
{
    const double *mass = rows.table->mass;
    double mean[3] = {0}, sum = 0;
    for (int64_t i = rows.first; i < rows.first + rows.n; i++) {
        sum += mass[i];
        for (int k = 0; k < 3; k++) mean[k] += mass[i] * x[i][k];
    }
    for (int64_t i = rows.first; i < rows.first + rows.n; i++)
        for (int k = 0; k < 3; k++) x[i][k] -= mean[k] / sum;
}

/* Masses from the spectrum, scaled to the given sum; then less speed, and with a chance that grows with the spin rows that turn
 * backwards turn forwards, which leaves the density as it is (Lynden-Bell 1960). */
static void make_clouds(const struct dwarf *dwarf, struct rows rows, uint64_t seed)
{
    struct species *s = rows.table;
    double sum = 0;
    for (int64_t i = rows.first; i < rows.first + rows.n; i++) {
        const struct random key = {seed, s->id[i], 0, random_stream("dwarf masses")};
        s->mass[i] = rows_mass(&dwarf->spectrum, random_uniform(&key, 0));
        sum += s->mass[i];
        double turns = s->pos[i][0] * s->vel[i][1] - s->pos[i][1] * s->vel[i][0];
        if (turns < 0 && random_uniform(&key, 1) < dwarf->spin)
            for (int k = 0; k < 2; k++) s->vel[i][k] = -s->vel[i][k];
        for (int k = 0; k < 3; k++) s->vel[i][k] *= sqrt(dwarf->virial);
    }
    for (int64_t i = rows.first; i < rows.first + rows.n; i++) s->mass[i] *= dwarf->mass[DWARF_CLOUD] / sum;
    subtract_mean(rows, s->pos);
    subtract_mean(rows, s->vel);
}

/* At r, the part `spin` of the circular speed, about z. */
static void turn_gas(const struct equilibrium *all, double spin, struct rows rows)
{
    for (int64_t i = rows.first; i < rows.first + rows.n; i++) {
        const double *x = rows.table->pos[i], r = sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
        double mass = 0;
        for (int p = 0; p < all->n; p++) mass += radial_at(&all->part[p], r).mass;
        const double omega = r > 0 ? spin * sqrt(all->G * mass / r) / r : 0;
        rows.table->vel[i][0] -= omega * x[1];
        rows.table->vel[i][1] += omega * x[0];
    }
    rows_rest(rows);
}

static void make_part(struct sim *sim, const struct dwarf *dwarf, const struct equilibrium *all, int p, int64_t n)
{
    struct equilibrium_part *part = mem_alloc("generator", sizeof *part);
    struct rows rows = rows_add(sim, kinds[p], n, dwarf->mass[p]);
    if (p == DWARF_GAS) {
        equilibrium_temperatures(all, p, part);
        equilibrium_fill_gas(part, rows, sim_real(sim, "gamma", 5.0 / 3));
        turn_gas(all, dwarf->spin, rows);
    } else if (equilibrium_velocities(all, p, part)) {
        equilibrium_fill(part, rows, sim->seed, random_stream(names[p]));
        if (p == DWARF_CLOUD) make_clouds(dwarf, rows, sim->seed);
    } else {
        problems_add(&sim->problems, "start: no velocities without a preferred direction keep the %s in equilibrium: take "
                     "radii that differ less", names[p]);
    }
    mem_free(part);
}

static void dwarf_make(struct sim *sim, const void *state, int64_t n)
{
    const struct dwarf *dwarf = state;
    struct radial profile[PARTS];
    int64_t count[PARTS];
    rows_share(n, PARTS, dwarf->share, count);
    for (int p = 0; p < PARTS; p++) {
        if (count[p] < 2) problems_add(&sim->problems, "start.n: too few rows for the %s", names[p]);
        profile[p] = (struct radial){.form = forms[p], .mass = dwarf->mass[p], .radius = dwarf->radius[p], .cut = dwarf->cut};
    }
    if (sim->problems.count > 0) return;
    struct equilibrium *all = equilibrium_new(sim->units.G, profile, PARTS);
    for (int p = 0; p < PARTS; p++) make_part(sim, dwarf, all, p, count[p]);
    mem_free(all);
}

const struct generator dwarf_generator = {
    .name = "dwarf", .doc = "dwarf galaxy of dark halo, gas and cold clouds, before its collapse",
    .params = params, .state_bytes = sizeof(struct dwarf), .make = dwarf_make,
};
