/* SPDX-License-Identifier: GPL-3.0-or-later
 * What other modules may ask of the module `gravity`. */
#ifndef TEPHRA_GRAVITY_CONTACT_H
#define TEPHRA_GRAVITY_CONTACT_H
#include "sim.h"

/* Potential energy of two rows of unit mass at one place, -G/eps with the softening of the pair, in code units;
 * 0 without gravity or softening. */
double gravity_contact(const struct sim *sim, enum species_kind a, enum species_kind b);
#endif
