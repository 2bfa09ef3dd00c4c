/* SPDX-License-Identifier: GPL-3.0-or-later
 * budget.csv: what modules count beside energies, such as rates of star formation and masses of elements;
 * one row a recorded full synchronisation, like energy.csv. Its time is in the units of energy.csv, all other
 * columns in those that their names tell. Scenes whose modules count nothing have no such file. */
#ifndef TEPHRA_BUDGET_H
#define TEPHRA_BUDGET_H
#include "sim.h"

/* Sums what the modules tell over all ranks and appends a row to that series. */
void budget_write(struct sim *sim, const char *name);
#endif
