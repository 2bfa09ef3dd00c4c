/* SPDX-License-Identifier: GPL-3.0-or-later
 * Conserved quantities and the ledger of what left them: energy.csv, one row a recorded full
 * synchronisation. Columns: t,dt,active,kinetic,thermal,potential, then a reservoir for each cause
 * that a module books, total (the sum of these energies), error ((total - first)/|first|), momentum,
 * angular momentum, masses by species. Scenes with physical units are written in the units of
 * their snapshots. */
#ifndef TEPHRA_ENERGY_H
#define TEPHRA_ENERGY_H
#include "sim.h"

enum { ENERGY_COLUMNS = 32, ENERGY_NAME = 32 };

struct energy {
    int n;                                      /* energies: kinetic, thermal, potential, reservoirs */
    char name[ENERGY_COLUMNS][ENERGY_NAME];
    double value[ENERGY_COLUMNS];
    double total, first, error, worst;          /* worst: largest |error| so far */
    double momentum[3], angular_momentum[3], mass[N_SPECIES];
    double all, all_first;                      /* mass of all species; at the start */
    bool started;                               /* first and all_first are set */
};

/* Sums over all rows of all ranks. Potentials must be fresh. */
void energy_measure(struct sim *sim, struct energy *energy);
/* Of this rank's own rows, the sum of mass times a column that is per unit of mass: u, pot. */
double energy_of_rows(const struct species *table, const float *specific);
/* Appends a row to that series (series.h), on rank 0. */
void energy_write(const struct sim *sim, const struct energy *energy, const char *name);
#endif
