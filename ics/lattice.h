/* SPDX-License-Identifier: GPL-3.0-or-later
 * Places of even density for any number of rows, without the noise of random places. */
#ifndef TEPHRA_LATTICE_H
#define TEPHRA_LATTICE_H
#include <stdint.h>

/* The n points of a face-centred cubic lattice that are nearest to a centre of no symmetry, in units in which
 * n points fill a ball of radius 1. To be freed with mem_free. */
double (*lattice_ball(int64_t n))[3];
/* The same of a glass, which prefers no axis; its density is less even than a lattice's. */
double (*lattice_glass_ball(int64_t n))[3];
/* A glass (glass.c) in a box that repeats itself: as many points as its side is long, to the third power; to be freed. */
double (*glass_box(int *side))[3];
/* n points of a lattice that repeats itself with the box [0, side), so that every point has the same
 * surroundings: of very many such lattices one whose points keep well apart. 8n points are the same lattice,
 * twice as fine (from some hundreds on). */
void lattice_box(int64_t n, const double side[3], double (*pos)[3]);
#endif
