/* SPDX-License-Identifier: GPL-3.0-or-later
 * Spherical density profiles in closed form: density with two derivatives, mass within r, and the part of the
 * potential that is due to what lies outside r. */
#ifndef TEPHRA_RADIAL_H
#define TEPHRA_RADIAL_H
#include <stdbool.h>

enum radial_form {
    RADIAL_HERNQUIST,  /* rho ~ r^-1 (r + a)^-3 (Hernquist 1990, ApJ 356, 359); mass: out to infinity */
    RADIAL_NFW,        /* rho ~ r^-1 (r + a)^-2 (Navarro, Frenk & White 1997, ApJ 490, 493); mass: within the cut */
    RADIAL_PLUMMER,    /* rho ~ (r^2 + a^2)^(-5/2) (Plummer 1911); mass: out to infinity */
    RADIAL_DISC        /* mass within r of a thin disc with surface density ~ exp(-r/a), spread over spheres */
};

/* From `cut` on the density falls as r^e exp(-r/d) with d = cut/5 and e such that the slope has no jump (Springel &
 * White 1999, MNRAS 307, 162, appendix): a sharp edge would have no distribution function. */
struct radial {
    enum radial_form form;
    double mass, radius, cut;   /* of the model; cut NAN: none */
    double scale;               /* 4 pi times the coefficient of rho; set by radial_prepare */
    double edge, power, decay;  /* of the tail: 4 pi rho(cut), e, d */
    double inside, around;      /* mass within the cut; 4 pi times the integral of rho r beyond it */
};

struct radial_point {
    double rho;                 /* density */
    double slope, bend;         /* d ln rho/dr, and its own derivative by r */
    double mass, outer;         /* within r; integral of 4 pi rho r dr from r outwards */
};

/* Sets the coefficients from form, mass, radius and cut. */
void radial_prepare(struct radial *profile);
struct radial_point radial_at(const struct radial *profile, double r);
/* Radius beyond which there is nothing that counts. */
double radial_end(const struct radial *profile);
#endif
