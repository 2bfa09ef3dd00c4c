/* SPDX-License-Identifier: GPL-3.0-or-later
 * From which density on gas without an energy equation is made to resist, for a generator's advice: where the rows no longer
 * resolve its Jeans mass. */
#ifndef TEPHRA_BAROTROPE_H
#define TEPHRA_BAROTROPE_H
#include "sim.h"

/* What the scene says of a key, in code units; NAN if nothing that can be read. */
double barotrope_said(const struct sim *sim, const char *block, const char *key, const char *dimension);
/* The density at which two kernels full of rows of this mass are a Jeans mass (Bate & Burkert 1997, MNRAS 288, 1060),
 * (5 c^2/(2 G))^(3/2) (4 pi rho/3)^(-1/2), but `least` at least; NAN without sph.sound_speed. *neighbours: sph.neighbours. */
double barotrope_density(const struct sim *sim, double row_mass, double least, double *neighbours);
/* Where the scene has sph.eos: barotropic and a speed of sound, advises that as sph.stiff_density. Returns the density that
 * holds then, NAN where there is none. */
double barotrope_advise(struct sim *sim, double row_mass, double least, double *neighbours);
#endif
