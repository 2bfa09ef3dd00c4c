/* SPDX-License-Identifier: GPL-3.0-or-later
 * Exponential discs of stars and gas in the field of spheres: rotation curve, velocity dispersions, heights. */
#ifndef TEPHRA_DISC_H
#define TEPHRA_DISC_H
#include "equilibrium.h"

/* Surface density mass/(2 pi a^2) exp(-R/a), vertical density ~ sech^2(z/z0). */
struct disc {
    double mass, radius, height;    /* gas: its height follows from its temperature */
    double q;                       /* Toomre's Q of the stars at 2.2 radii, where a disc's own pull is largest */
    double sound;                   /* gas: sqrt(P/rho) where it is thin */
    double stiff;                   /* gas: P/rho is sound^2 [1 + (rho/stiff)^(2/3)]; NAN: sound^2 */
};

enum { DISC_STARS, DISC_GAS, DISC_POINTS = 200 };

struct disc_field {
    const struct equilibrium *all;  /* spheres, and the discs' mass spread over spheres */
    int spheres;                    /* parts of `all` that are spheres */
    const struct disc *disc[2];     /* stars and gas; mass 0: there is none */
    double softening;               /* Plummer's, of the forces that will act */
    double sigma;                   /* radial dispersion of the stars at R = 0, before it is softened there */
    double first, step;             /* ln of the first radius of the tables, and of the ratio of the next */
    double speed2[2][DISC_POINTS];  /* squared circular speed of stars and of gas by the discs alone */
    double sheet[DISC_POINTS];      /* surface density of the stars that acts across their disc: see disc.c */
    double height[DISC_POINTS], heat[DISC_POINTS];  /* of the gas: its z0, and P/rho, a mean over its layer */
};

/* Fills the tables, and sets sigma from q of the stars. */
void disc_prepare(struct disc_field *field);
/* Squared circular speed, a mean over the layer of stars or of gas (DISC_STARS, DISC_GAS). */
double disc_speed2(const struct disc_field *field, int layer, double R);
/* Epicyclic frequency of the stars. */
double disc_kappa(const struct disc_field *field, double R);
void disc_fill_stars(const struct disc_field *field, struct rows rows, uint64_t seed, uint64_t stream);
/* Gas on circles; evenly sown (little of the noise of random places), z0 from its own weight, the stars' and the spheres'. */
void disc_fill_gas(const struct disc_field *field, struct rows rows, double gamma, uint64_t seed, uint64_t stream);
#endif
