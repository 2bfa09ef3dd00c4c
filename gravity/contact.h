/* SPDX-License-Identifier: GPL-3.0-or-later
 * What other modules may ask of the module `gravity`. */
#ifndef TEPHRA_GRAVITY_CONTACT_H
#define TEPHRA_GRAVITY_CONTACT_H
#include "sim.h"

/* Whether every gas row has a softening of its own: what is told here of gas as a species is then wrong. */
bool gravity_gas_is_adaptive(const struct sim *sim);
/* Potential energy of two rows of unit mass at one place, -G/eps with the softening of the pair, in code units;
 * 0 without gravity or softening. */
double gravity_contact(const struct sim *sim, enum species_kind a, enum species_kind b);
/* The same at the distance r; 0 where rows at one place do not attract each other. */
double gravity_pair(const struct sim *sim, enum species_kind a, enum species_kind b, double r);
/* By how much the potential of all other rows at a row's place rises when the row becomes one of the species `to`, with the
 * softening of those; 0 where both have one softening. Cells are taken as wholes beyond three times their size and some
 * softening lengths (a few per cent of the result). Rows as they are now; any thread. */
double gravity_resoften(const struct sim *sim, enum species_kind kind, int64_t row, enum species_kind to);
/* A mass of one species at a place; below 0: what was there before and is no more. */
struct gravity_piece { enum species_kind kind; double mass, pos[3]; };
/* Potential energy of the pieces with all rows but two of one species (-1: none), not with each other: by how much it changes
 * where masses move, divide or become one. Rows and cells as above; 0 without gravity. Any thread. */
double gravity_field(const struct sim *sim, const struct gravity_piece *piece, int n, enum species_kind kind,
                     const int64_t without[2]);
/* Potential energy of n pieces among themselves. */
double gravity_among(const struct sim *sim, const struct gravity_piece *piece, int64_t n);
#endif
