/* SPDX-License-Identifier: GPL-3.0-or-later
 * Where the time goes: seconds, calls and rows of every entry of the step. Reported, never used in
 * a decision. */
#ifndef TEPHRA_PROFILE_H
#define TEPHRA_PROFILE_H
#include <stdint.h>

struct sim;
struct profile;

struct profile *profile_new(int calls);
void profile_free(struct profile *profile);
void profile_start(struct profile *profile, int64_t bytes);
/* bytes: that have gone to a device and back since the start of the run. */
void profile_stop(struct profile *profile, int call, int64_t rows, int64_t bytes);
/* CPU seconds that an entry of the step took so far. */
double profile_spent(const struct profile *profile, int call);
/* What the run costs each rank, so far. CPU seconds but for those spent in waiting: construction (keys, sort, domains, tree),
 * calculation, record (energies and files); seconds by the clock: communication, wait. */
struct rank_cost {
    double construction, calculation, record, communication, wait;
    double bytes, rows, updates, ghost_rows, ghost_cells, rounds, memory;   /* bytes sent; memory: the highest since the start */
    double ghost_bytes, top_bytes;      /* of these bytes: for others' cells and rows; for the topmost cells */
};
/* ranks.csv: a line a rank. All ranks. */
void profile_write_ranks(const struct sim *sim, const char *path);
/* Reads such a file: its ranks, for mem_free; their number. NULL if it cannot be read (errno) or is another file (errno 0). */
struct rank_cost *profile_read_ranks(const char *path, int *ranks);
/* profile.csv: hook,module,wall [s],cpu [s],calls,rows,copied [bytes]; with a device also a line for each kernel and for copies. */
void profile_write(const struct sim *sim, const char *path);
/* Seconds by the clock (only differences mean something), and user and system time of all threads. */
double profile_wall(void);
double profile_cpu(void);
#endif
