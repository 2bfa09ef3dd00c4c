/* SPDX-License-Identifier: GPL-3.0-or-later
 * Spheres of dark matter, stars and gas about one centre, each in equilibrium in the potential of all: rows
 * without pressure by Eddington's inversion, gas at rest in hydrostatic equilibrium. */
#include "equilibrium.h"
#include "mem.h"
#include "module.h"
#include "random.h"
#include <math.h>

enum { PARTS = 3 };
struct sphere { int form; double mass, radius, cut, share; };
struct spheres { struct sphere part[PARTS]; };

#define SPHERE(k, name, rows) \
    {name "_profile", PARAM_CHOICE, "", "hernquist", 0, 0, "hernquist|nfw|plummer", "density of the " rows, false, \
     offsetof(struct spheres, part[k].form)}, \
    {name "_mass", PARAM_REAL, "mass", "none", 1e-30, 1e30, NULL, \
     "mass of the " rows ": within the cut for nfw, else out to infinity without a cut; default: there are none", false, \
     offsetof(struct spheres, part[k].mass)}, \
    {name "_radius", PARAM_REAL, "length", "1", 1e-30, 1e30, NULL, "scale radius of the profile", false, \
     offsetof(struct spheres, part[k].radius)}, \
    {name "_cut", PARAM_REAL, "length", "none", 1e-30, 1e30, NULL, \
     "from this radius on the density falls exponentially; nfw must have one", false, offsetof(struct spheres, part[k].cut)}, \
    {name "_share", PARAM_REAL, "", "none", 1e-9, 1e9, NULL, \
     "part of the rows, relative to the other shares; default: in proportion to the masses", false, \
     offsetof(struct spheres, part[k].share)},

static const struct param params[] = {
    SPHERE(0, "dark", "dark matter") SPHERE(1, "star", "stars") SPHERE(2, "gas", "gas")
    {0}
};

static const enum species_kind kinds[PARTS] = {DARK, STAR, GAS};
static const char *const names[PARTS] = {"dark", "star", "gas"};

/* The parts that there are, in order; -1 and a problem if they cannot be made. */
static int choose(struct sim *sim, const struct spheres *spheres, struct radial *profile, int *which)
{
    int n = 0, shared = 0;
    bool fine = true;
    for (int k = 0; k < PARTS; k++) {
        const struct sphere *s = &spheres->part[k];
        if (isnan(s->mass)) continue;
        if (s->form == RADIAL_NFW && isnan(s->cut)) {
            problems_add(&sim->problems, "start.%s_cut: an nfw profile without one has no end to its mass", names[k]);
            fine = false;
        }
        shared += !isnan(s->share);
        profile[n] = (struct radial){.form = (enum radial_form)s->form, .mass = s->mass, .radius = s->radius, .cut = s->cut};
        which[n++] = k;
    }
    if (n == 0) problems_add(&sim->problems, "start: give one of dark_mass, star_mass and gas_mass, or several");
    else if (shared > 0 && shared < n) problems_add(&sim->problems, "start: give every part a share of the rows, or none");
    else if (fine) return n;
    return -1;
}

static void make_part(struct sim *sim, const struct equilibrium *all, int p, int k, int64_t n)
{
    struct equilibrium_part *part = mem_alloc("generator", sizeof *part);
    if (kinds[k] == GAS) {
        equilibrium_temperatures(all, p, part);
        equilibrium_fill_gas(part, rows_add(sim, GAS, n, part->total), sim_real(sim, "gamma", 5.0 / 3));
    } else if (equilibrium_velocities(all, p, part)) {
        equilibrium_fill(part, rows_add(sim, kinds[k], n, part->total), sim->seed, random_stream(names[k]));
    } else {
        problems_add(&sim->problems, "start.%s_profile: in this potential no velocities without a preferred direction keep the %s "
                     "rows in equilibrium (a core within a cusp): take a steeper profile or another radius", names[k], names[k]);
    }
    mem_free(part);
}

static void spheres_make(struct sim *sim, const void *state, int64_t n)
{
    const struct spheres *spheres = state;
    struct radial profile[PARTS];
    int which[PARTS], parts = choose(sim, spheres, profile, which);
    if (parts < 0) return;
    struct equilibrium *all = equilibrium_new(sim->units.G, profile, parts);
    double share[PARTS];
    int64_t count[PARTS];
    for (int p = 0; p < parts; p++) {
        double given = spheres->part[which[p]].share;
        share[p] = isnan(given) ? radial_at(&all->part[p], radial_end(&all->part[p])).mass : given;
    }
    rows_share(n, parts, share, count);
    for (int p = 0; p < parts; p++) {
        if (count[p] > 0) make_part(sim, all, p, which[p], count[p]);
        else problems_add(&sim->problems, "start.n: too few rows for the %s to have one", names[which[p]]);
    }
    mem_free(all);
}

const struct generator spheres_generator = {
    .name = "spheres", .doc = "spheres of dark matter, stars and gas in equilibrium in their common potential",
    .params = params, .state_bytes = sizeof(struct spheres), .make = spheres_make,
};
