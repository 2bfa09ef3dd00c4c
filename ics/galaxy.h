/* SPDX-License-Identifier: GPL-3.0-or-later
 * A disc galaxy of dark halo, bulge, stellar and gas disc: its parameters and its rows. */
#ifndef TEPHRA_GALAXY_H
#define TEPHRA_GALAXY_H
#include "disc.h"
#include "holes.h"
#include "module.h"

enum galaxy_part { GALAXY_DARK, GALAXY_BULGE, GALAXY_DISC, GALAXY_GAS, GALAXY_PARTS };
extern const char *const galaxy_names[GALAXY_PARTS];

struct galaxy {
    int form;
    double mass[GALAXY_PARTS], radius[GALAXY_PARTS], share[GALAXY_PARTS];
    double cut, height, q, temperature, mu;
    struct holes holes;
    bool fixed, bulge_fixed;    /* the halo, the bulge is a potential of the block external, not rows */
};

/* The rows of the parameter table of `struct OWNER`, which holds a struct galaxy named galaxy. */
#define GALAXYKEY(owner, name, unit, fallback, low, field, text) \
    {name, PARAM_REAL, unit, fallback, low, 1e30, NULL, text, false, offsetof(struct owner, galaxy.field)},
#define GALAXY_PARAMS(owner) \
    {"dark_profile", PARAM_CHOICE, "", "nfw", 0, 0, "hernquist|nfw", "density of the halo", false, offsetof(struct owner, galaxy.form)}, \
    GALAXYKEY(owner, "dark_mass", "mass", NULL, 1e-30, mass[GALAXY_DARK], "mass of the halo: within the cut for nfw") \
    GALAXYKEY(owner, "dark_radius", "length", NULL, 1e-30, radius[GALAXY_DARK], "its scale radius") \
    GALAXYKEY(owner, "dark_cut", "length", NULL, 1e-30, cut, "from this radius on its density falls exponentially") \
    {"dark_fixed", PARAM_FLAG, "", "off", 0, 0, NULL, \
     "the halo is a fixed potential of the block external, whose keys follow, and has no rows", false, \
     offsetof(struct owner, galaxy.fixed)}, \
    {"bulge_fixed", PARAM_FLAG, "", "off", 0, 0, NULL, "the same of the bulge, which has no cut then", false, \
     offsetof(struct owner, galaxy.bulge_fixed)}, \
    GALAXYKEY(owner, "bulge_mass", "mass", "0", 0, mass[GALAXY_BULGE], "mass of the bulge, a Hernquist sphere of stars") \
    GALAXYKEY(owner, "bulge_radius", "length", "1", 1e-30, radius[GALAXY_BULGE], "its scale radius; with rows it is cut at 15 of them") \
    GALAXYKEY(owner, "disc_mass", "mass", "0", 0, mass[GALAXY_DISC], "mass of the disc of stars") \
    GALAXYKEY(owner, "disc_radius", "length", "1", 1e-30, radius[GALAXY_DISC], "surface density ~ exp(-R/this)") \
    GALAXYKEY(owner, "disc_height", "length", "none", 1e-30, height, "density ~ sech^2(z/this); default: a tenth of disc_radius") \
    GALAXYKEY(owner, "disc_q", "", "1.5", 0.01, q, "Toomre's Q of the stars at 2.2 radii") \
    GALAXYKEY(owner, "gas_mass", "mass", "0", 0, mass[GALAXY_GAS], "mass of the disc of gas") \
    GALAXYKEY(owner, "gas_radius", "length", "1", 1e-30, radius[GALAXY_GAS], "surface density ~ exp(-R/this)") \
    GALAXYKEY(owner, "gas_temperature", "temperature", "1e4 K", 1, temperature, "temperature of the gas") \
    GALAXYKEY(owner, "gas_mu", "", "0.6", 0.1, mu, "its mean molecular weight: 0.6 ionised, 1.3 neutral (as cooling to its floor leaves it)") \
    GALAXYKEY(owner, "dark_share", "", "none", 1e-9, share[GALAXY_DARK], "part of the rows; default: in proportion to the masses") \
    GALAXYKEY(owner, "bulge_share", "", "none", 1e-9, share[GALAXY_BULGE], "the same of the bulge") \
    GALAXYKEY(owner, "disc_share", "", "none", 1e-9, share[GALAXY_DISC], "the same of the disc of stars") \
    GALAXYKEY(owner, "gas_share", "", "none", 1e-9, share[GALAXY_GAS], "the same of the disc of gas") \
    HOLES_PARAMS(struct owner, galaxy.holes),

/* The rows of one galaxy, part by part, its black holes last. */
enum { GALAXY_HOLES = GALAXY_PARTS, GALAXY_PIECES };
struct galaxy_rows { struct rows part[GALAXY_PIECES]; double mass; };

/* Gas without an energy equation has the speed of sound of its temperature and resists where n rows of a galaxy no longer
 * resolve its Jeans mass (barotrope.h); the block external has the potential of a fixed halo; unless the scene gives others. */
void galaxy_advise(struct sim *sim, const struct galaxy *galaxy, int64_t n);
/* Adds n rows, at rest about the origin, discs in the plane z = 0 and turning towards +z. `copy` tells the random numbers of
 * several galaxies apart. False and problems if the parameters do not make one. */
bool galaxy_add(struct sim *sim, const struct galaxy *galaxy, int64_t n, int copy, struct galaxy_rows *made);
#endif
