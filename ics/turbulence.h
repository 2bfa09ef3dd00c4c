/* SPDX-License-Identifier: GPL-3.0-or-later
 * Gaussian random velocity fields with a power law as spectrum, in a box that repeats itself. */
#ifndef TEPHRA_TURBULENCE_H
#define TEPHRA_TURBULENCE_H
#include <stdint.h>

struct turbulence {
    double slope;           /* E(k) ~ k^-slope: 2 for shocks (Burgers), 5/3 for eddies (Kolmogorov) */
    double solenoidal;      /* part of the energy in modes without divergence: 2/3 when nothing is preferred */
    int64_t waves;          /* largest wave number, in waves along the side of the box; the smallest is 1 */
    uint64_t seed, stream;  /* random_stream of a name */
};

/* Velocities at n places of the box [-side/2, side/2) into vel, with unit mean square on the mesh that they are
 * taken from (four points a shortest wave, linear between them). A mode depends on seed, stream and its wave
 * numbers alone. */
void turbulence_fill(const struct turbulence *field, double side, int64_t n, double (*pos)[3], double (*vel)[3]);
#endif
