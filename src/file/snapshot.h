/* SPDX-License-Identifier: GPL-3.0-or-later
 * Snapshots for people and their tools: one GADGET-4-style HDF5 file, ordered by id, that yt,
 * pynbody and SPLASH open (doc/manual/output.md). */
#ifndef TEPHRA_SNAPSHOT_H
#define TEPHRA_SNAPSHOT_H
#include "sim.h"

/* FLOAT: Coordinates, Velocities, Masses and mass fractions in half the bytes, as many other programs
 * write them; DOUBLE keeps a run's state to the last bit. */
enum snapshot_precision { SNAPSHOT_DOUBLE, SNAPSHOT_FLOAT };

/* Writes every column with a file name that the species has; positions and velocities are those of
 * the present tick for rows in the midst of a step too. Potential only where it is fresh.
 * All ranks call it. The first one writes; spread rows come to it in slices (slices.h). */
void snapshot_write(const struct sim *sim, const char *path, enum snapshot_precision precision);
#endif
