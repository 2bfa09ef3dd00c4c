/* SPDX-License-Identifier: GPL-3.0-or-later
 * Checkpoints: everything that a run needs to go on, in one HDF5 file in code units and row order. */
#ifndef TEPHRA_CHECKPOINT_H
#define TEPHRA_CHECKPOINT_H
#include "sim.h"

/* Writes all KEEP columns in use, the time, counters and what each module says it must save. The
 * file that was there becomes *.previous.hdf5; at any moment one of the two is whole. All ranks call it; the first one
 * writes, spread rows come to it rank after rank. */
void checkpoint_write(const struct sim *sim, const char *path);

/* Fills a simulation that was made from the same scene, between sim_new and sim_begin: the rows,
 * module states, counters, seed, and time.{start,dt_max,tick}; the cadences keep their lengths if
 * the longest step differs. A file of another format, of other modules or columns, or a damaged one
 * goes to sim->problems, and the simulation is then unusable. Every rank reads, of spread rows (sim->spread) its part. */
void checkpoint_read(struct sim *sim, const char *path);
#endif
