/* SPDX-License-Identifier: GPL-3.0-or-later
 * A disc galaxy (galaxy.h): halo and bulge by Eddington's inversion in the potential of all, the discs' mass spread
 * over spheres for that; the discs by moments in the potential of all. */
#include "galaxy.h"
#include "barotrope.h"
#include "constants.h"
#include "log.h"
#include "mem.h"
#include "random.h"
#include "start.h"
#include <math.h>
#include <string.h>

const char *const galaxy_names[GALAXY_PARTS] = {"dark", "bulge", "disc", "gas"};
static const enum species_kind kinds[GALAXY_PARTS] = {DARK, STAR, STAR, GAS};

static bool is_fixed(const struct galaxy *galaxy, int part)
{
    return (part == GALAXY_DARK && galaxy->fixed) || (part == GALAXY_BULGE && galaxy->bulge_fixed);
}

/* The part of the rows that each part has, relative to the others; how many parts there are, and how many say it. */
struct shares { double share[GALAXY_PARTS]; int parts, given; };

static struct shares shares_of(const struct galaxy *galaxy)
{
    struct shares s = {{0}, 0, 0};
    for (int k = 0; k < GALAXY_PARTS; k++) {
        bool there = galaxy->mass[k] > 0 && !is_fixed(galaxy, k);
        s.parts += there;
        s.given += there && !isnan(galaxy->share[k]);
        s.share[k] = !there ? 0 : isnan(galaxy->share[k]) ? galaxy->mass[k] : galaxy->share[k];
    }
    return s;
}

/* How many rows each part has. */
static bool share_rows(struct sim *sim, const struct galaxy *galaxy, int64_t n, int64_t count[GALAXY_PARTS])
{
    const struct shares s = shares_of(galaxy);
    if (s.given > 0 && s.given < s.parts) {
        problems_add(&sim->problems, "start: give every part of the galaxy a share of the rows, or none");
        return false;
    }
    if (s.parts == 0) {
        problems_add(&sim->problems, "start.dark_fixed: there is nothing but fixed parts: give a disc, gas or a bulge a mass");
        return false;
    }
    rows_share(n, GALAXY_PARTS, s.share, count);
    for (int k = 0; k < GALAXY_PARTS; k++)
        if (s.share[k] > 0 && count[k] == 0) {
            problems_add(&sim->problems, "start.n: too few rows for the %s to have one", galaxy_names[k]);
            return false;
        }
    return true;
}

/* Spheres first; then the discs' masses as spheres. */
static struct equilibrium *potential(const struct sim *sim, const struct galaxy *galaxy, int *spheres)
{
    struct radial part[GALAXY_PARTS];
    const double bulge_cut = galaxy->bulge_fixed ? NAN : 15 * galaxy->radius[GALAXY_BULGE];
    int n = 0;
    for (int k = 0; k < GALAXY_PARTS; k++) {
        if (!(galaxy->mass[k] > 0)) continue;
        const enum radial_form forms[GALAXY_PARTS] = {(enum radial_form)galaxy->form, RADIAL_HERNQUIST, RADIAL_DISC, RADIAL_DISC};
        double cut = k == GALAXY_DARK ? galaxy->cut : k == GALAXY_BULGE ? bulge_cut : NAN;
        part[n++] = (struct radial){.form = forms[k], .mass = galaxy->mass[k], .radius = galaxy->radius[k], .cut = cut};
        if (k <= GALAXY_BULGE) *spheres = n;
    }
    return equilibrium_new(sim->units.G, part, n);
}

static bool fill_sphere(struct sim *sim, const struct equilibrium *all, int part, struct rows *rows, uint64_t stream)
{
    struct equilibrium_part *sphere = mem_alloc("generator", sizeof *sphere);
    bool fine = equilibrium_velocities(all, part, sphere);
    if (fine) {
        for (int64_t i = rows->first; i < rows->first + rows->n; i++) rows->table->mass[i] = sphere->total / (double)rows->n;
        equilibrium_fill(sphere, *rows, sim->seed, stream);
    } else {
        problems_add(&sim->problems, "start: in the potential of this galaxy no velocities without a preferred direction keep its "
                     "%s in equilibrium: take a smaller or a more extended disc", part == 0 ? "halo" : "bulge");
    }
    mem_free(sphere);
    return fine;
}

static double sound_speed(const struct sim *sim, const struct galaxy *galaxy)
{
    return sqrt(CONST_K_B * galaxy->temperature / (galaxy->mu * CONST_M_PROTON)) / sim->units.velocity;
}

/* Of the discs' rows, by the block gravity. */
static double softening_of(const struct sim *sim)
{
    double stars = barotrope_said(sim, "gravity", "softening_star", "length");
    double all = barotrope_said(sim, "gravity", "softening", "length");
    return !isnan(stars) ? stars : isnan(all) ? 0 : all;
}

void galaxy_advise(struct sim *sim, const struct galaxy *galaxy, int64_t n)
{
    const struct shares s = shares_of(galaxy);
    double all = 0, neighbours;
    const char *eos = scene_value(sim->scene, "sph", "eos");
    if (galaxy->mass[GALAXY_GAS] > 0 && sim->units.physical && eos && strcmp(eos, "adiabatic") != 0)
        start_advise(sim, "sph", "sound_speed", sound_speed(sim, galaxy));
    for (int k = 0; k < GALAXY_PARTS; k++) all += s.share[k];
    if (s.share[GALAXY_GAS] > 0)
        barotrope_advise(sim, galaxy->mass[GALAXY_GAS] / ((double)n * s.share[GALAXY_GAS] / all), 0, &neighbours);
    if (galaxy->bulge_fixed) {
        start_advise(sim, "external", "hernquist_mass", galaxy->mass[GALAXY_BULGE]);
        start_advise(sim, "external", "hernquist_radius", galaxy->radius[GALAXY_BULGE]);
    }
    if (!galaxy->fixed) return;
    bool nfw = galaxy->form == RADIAL_NFW;
    start_advise(sim, "external", nfw ? "nfw_mass" : "hernquist_mass", galaxy->mass[GALAXY_DARK]);
    start_advise(sim, "external", nfw ? "nfw_radius" : "hernquist_radius", galaxy->radius[GALAXY_DARK]);
    if (nfw) start_advise(sim, "external", "nfw_within", galaxy->cut);
}

/* Their mass is not in the potential that the others move in: a small part of the bulge's. */
static void add_holes(struct sim *sim, const struct galaxy *galaxy, const struct equilibrium *all, struct galaxy_rows *made)
{
    double inside = 0;
    for (int p = 0; p < all->n && galaxy->holes.n > 1; p++) inside += radial_at(&all->part[p], galaxy->holes.distance).mass;
    made->part[GALAXY_HOLES] = (struct rows){&sim->species[STAR], sim->species[STAR].n, galaxy->holes.n};
    holes_make(sim, &galaxy->holes, inside);
    made->mass += galaxy->holes.n > 0 ? (double)galaxy->holes.n * galaxy->holes.mass : 0;
}

bool galaxy_add(struct sim *sim, const struct galaxy *galaxy, int64_t n, int copy, struct galaxy_rows *made)
{
    int64_t count[GALAXY_PARTS];
    bool gas = galaxy->mass[GALAXY_GAS] > 0;
    if (gas && !sim->units.physical)
        problems_add(&sim->problems, "start.gas_temperature: a galaxy with gas needs physical units");
    for (int k = GALAXY_DARK; k <= GALAXY_BULGE; k++)
        if (is_fixed(galaxy, k) && !scene_find(sim->scene, "external"))
            problems_add(&sim->problems, "start.%s_fixed: a %s without rows needs a block external (--set external={})",
                         galaxy_names[k], k == GALAXY_DARK ? "halo" : "bulge");
    if (galaxy->fixed && galaxy->bulge_fixed && galaxy->form == RADIAL_HERNQUIST)
        problems_add(&sim->problems, "start.bulge_fixed: the block external has one Hernquist sphere, which is the halo's: "
                     "dark_profile: nfw, or a bulge of rows");
    const int64_t others = holes_reserve(sim, &galaxy->holes, n);
    if (sim->problems.count > 0 || !share_rows(sim, galaxy, others, count)) return false;
    if (count[GALAXY_DISC] > 0 && galaxy->q < 1 && copy == 1)
        log_warning("start.disc_q = %g: below 1 a disc of stars breaks up into rings and clumps within a turn (Toomre 1964, "
                    "ApJ 139, 1217)", galaxy->q);
    int spheres = 0;
    struct equilibrium *all = potential(sim, galaxy, &spheres);
    double sound = gas ? sound_speed(sim, galaxy) : 0;
    double height = isnan(galaxy->height) ? 0.1 * galaxy->radius[GALAXY_DISC] : galaxy->height;
    const struct disc stars = {galaxy->mass[GALAXY_DISC], galaxy->radius[GALAXY_DISC], height, galaxy->q, 0, NAN},
                      layer = {galaxy->mass[GALAXY_GAS], galaxy->radius[GALAXY_GAS], 0, 0, sound,
                               barotrope_said(sim, "sph", "stiff_density", "density")};
    struct disc_field *field = mem_alloc("generator", sizeof *field);
    *field = (struct disc_field){.all = all, .spheres = spheres, .disc = {&stars, &layer}, .softening = softening_of(sim)};
    disc_prepare(field);
    bool fine = true;
    made->mass = 0;
    for (int k = 0; k < GALAXY_PARTS; k++) {
        made->part[k] = (struct rows){&sim->species[kinds[k]], 0, 0};
        if (count[k] == 0) continue;
        char name[32];
        snprintf(name, sizeof name, "%s %d", galaxy_names[k], copy);
        made->part[k] = rows_add(sim, kinds[k], count[k], galaxy->mass[k]);
        if (k <= GALAXY_BULGE) fine &= fill_sphere(sim, all, k, &made->part[k], random_stream(name));
        else if (k == GALAXY_DISC) disc_fill_stars(field, made->part[k], sim->seed, random_stream(name));
        else disc_fill_gas(field, made->part[k], sim_real(sim, "gamma", 5.0 / 3), sim->seed, random_stream(name));
        made->mass += made->part[k].table->mass[made->part[k].first] * (double)count[k];
    }
    add_holes(sim, galaxy, all, made);
    mem_free(field);
    mem_free(all);
    return fine;
}

struct one { struct galaxy galaxy; };

static const struct param params[] = {GALAXY_PARAMS(one) {0}};

static void advise(struct sim *sim, const void *state, int64_t n)
{
    galaxy_advise(sim, &((const struct one *)state)->galaxy, n);
}

static void galaxy_make(struct sim *sim, const void *state, int64_t n)
{
    struct galaxy_rows made;
    galaxy_add(sim, &((const struct one *)state)->galaxy, n, 1, &made);
}

const struct generator galaxy_generator = {
    .name = "galaxy", .doc = "disc galaxy of dark halo, bulge, exponential discs of stars and gas",
    .params = params, .state_bytes = sizeof(struct one), .advise = advise, .make = galaxy_make,
};
