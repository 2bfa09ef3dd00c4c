/* SPDX-License-Identifier: GPL-3.0-or-later
 * Places of even density for any number of rows: none of the noise of random places, no axis preferred. */
#ifndef TEPHRA_LATTICE_H
#define TEPHRA_LATTICE_H
#include <stdint.h>

/* The n points of a face-centred cubic lattice that are nearest to a centre of no symmetry, in units in which
 * n points fill a ball of radius 1. To be freed with mem_free. */
double (*lattice_ball(int64_t n))[3];
/* n points of a lattice that repeats itself with the box [0, side): every point has the same surroundings, and
 * each its own x (the first has side/(2n)). Of very many such lattices it is one whose points keep well apart. */
void lattice_box(int64_t n, const double side[3], double (*pos)[3]);
#endif
