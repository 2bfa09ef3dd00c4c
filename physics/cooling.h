/* SPDX-License-Identifier: GPL-3.0-or-later
 * What other modules may ask of the module `cooling`. */
#ifndef TEPHRA_COOLING_H
#define TEPHRA_COOLING_H
#include "sim.h"

/* u/|du/dt| of a gas row by radiation at its present state, in code units; INFINITY where it does not
 * cool or the scene has no cooling. */
double cooling_time(const struct sim *sim, int64_t row);
/* Mass fraction of hydrogen by which n_H is told: cooling.hydrogen, or CONST_HYDROGEN. */
double cooling_hydrogen(const struct sim *sim);
#endif
