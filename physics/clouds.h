/* SPDX-License-Identifier: GPL-3.0-or-later
 * What other modules may ask of the module `clouds`. */
#ifndef TEPHRA_CLOUDS_H
#define TEPHRA_CLOUDS_H
#include "sim.h"

/* Radius of a cloud of that mass, in code units. The scene has the block `clouds`. */
double clouds_radius(const struct sim *sim, double mass);
/* What else is to be done when a cloud takes another one in: called before their masses become one. */
typedef void clouds_joined(struct sim *sim, int32_t kept, int32_t taken);
void clouds_when_joined(struct sim *sim, clouds_joined *joined);
#endif
