/* SPDX-License-Identifier: GPL-3.0-or-later
 * Ranks. comm_mpi.c is the one file that includes mpi.h; comm_none.c is built without MPI. A start
 * without mpirun is one rank and does not initialise MPI at all. */
#ifndef TEPHRA_COMM_H
#define TEPHRA_COMM_H
#include <stddef.h>
#include <stdint.h>

void comm_begin(int *argc, char ***argv);
void comm_end(void);
_Noreturn void comm_abort(int status);
int comm_rank(void);
int comm_size(void);
/* Processors that this rank may run on, each shared out evenly among the ranks that may run on it: at least 1. */
int comm_processors(void);
void comm_barrier(void);
/* Sums in rank order, so that the result is the same on every rank and in every run. */
void comm_sum(double *values, int count);
void comm_sum_int(int64_t *values, int count);
/* Sums in no fixed order, for pictures: equal on every rank, to rounding the same in every run. */
void comm_sum_floats(float *values, int count);
void comm_min(double *values, int count);
void comm_max(double *values, int count);
/* Smallest of each byte over the ranks. */
void comm_min_bytes(uint8_t *values, int64_t count);
void comm_broadcast(void *data, size_t bytes, int root);
/* Rank r contributes bytes[r] bytes at offset sum(bytes[0..r-1]) of `all`, in place. */
void comm_gather_all(void *all, const int64_t *bytes);
/* bytes of every rank (comm_size entries) from this rank's own. */
void comm_gather_counts(int64_t own, int64_t *counts);
/* To every rank r `counts` numbers out[r counts], from every rank as many: in[r counts]. */
void comm_exchange_counts(const int64_t *out, int64_t *in, int counts);
/* To every rank r the next out_bytes[r] bytes of `out`, from every rank the next in_bytes[r] bytes of `in`. */
void comm_exchange(const void *out, const int64_t *out_bytes, void *in, const int64_t *in_bytes);
/* One message from this rank to another, which must take it. */
void comm_send(const void *data, int64_t bytes, int to);
void comm_receive(void *data, int64_t bytes, int from);
/* What all this has cost this rank so far: bytes sent to other ranks; seconds by the clock in the short calls that all ranks
 * must reach (wait) and in those that carry data (talk); CPU seconds in both. Reported, never used in a decision. */
struct comm_cost { int64_t bytes; double wait, talk, cpu; };
struct comm_cost comm_cost(void);
#endif
