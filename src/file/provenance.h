/* SPDX-License-Identifier: GPL-3.0-or-later
 * What made a file: the group /Provenance of snapshots and checkpoints. */
#ifndef TEPHRA_PROVENANCE_H
#define TEPHRA_PROVENANCE_H

struct h5;
struct sim;

/* Program and commit, compiler, host, ranks and threads, seed, work done, G, and the scene as
 * used.yml has it. No date: equal runs make equal files. */
void provenance_write(struct h5 *file, const struct sim *sim);
/* A run goes on as what it began as: adds to sim->problems every key of the scene that may not change at a restart and has
 * another value than in the file, `path`. A file that a run reads may have moved: that is told, no more. */
void provenance_check(struct h5 *file, struct sim *sim, const char *path);
#endif
