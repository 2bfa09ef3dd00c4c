/* SPDX-License-Identifier: GPL-3.0-or-later
 * What other modules may ask of the module `clouds`. */
#ifndef TEPHRA_CLOUDS_H
#define TEPHRA_CLOUDS_H
#include "sim.h"

/* Radius of a cloud of that mass, in code units. The scene has the block `clouds`. */
double clouds_radius(const struct sim *sim, double mass);
#endif
