/* SPDX-License-Identifier: GPL-3.0-or-later
 * What made a file: the group /Provenance of snapshots and checkpoints. */
#ifndef TEPHRA_PROVENANCE_H
#define TEPHRA_PROVENANCE_H

struct h5;
struct sim;

/* Program and commit, compiler, host, ranks and threads, seed, work done, G, and the scene as
 * used.yml has it. No date: equal runs make equal files. */
void provenance_write(struct h5 *file, const struct sim *sim);
#endif
