/* SPDX-License-Identifier: GPL-3.0-or-later
 * Ranks in a build without MPI: there is one. */
#include "comm.h"
#include <omp.h>
#include <stdlib.h>
#include <string.h>

void comm_begin(int *argc, char ***argv) { (void)argc; (void)argv; }
void comm_end(void) {}
void comm_abort(int status) { exit(status); }
int comm_rank(void) { return 0; }
int comm_size(void) { return 1; }
int comm_processors(void) { return omp_get_num_procs(); }
void comm_barrier(void) {}
void comm_sum(double *values, int count) { (void)values; (void)count; }
void comm_sum_int(int64_t *values, int count) { (void)values; (void)count; }
void comm_sum_floats(float *values, int count) { (void)values; (void)count; }
void comm_min(double *values, int count) { (void)values; (void)count; }
void comm_max(double *values, int count) { (void)values; (void)count; }
void comm_min_bytes(uint8_t *values, int64_t count) { (void)values; (void)count; }
void comm_broadcast(void *data, size_t bytes, int root) { (void)data; (void)bytes; (void)root; }
void comm_gather_all(void *all, const int64_t *bytes) { (void)all; (void)bytes; }
void comm_gather_counts(int64_t own, int64_t *counts) { counts[0] = own; }
void comm_exchange_counts(const int64_t *out, int64_t *in, int counts) { memcpy(in, out, (size_t)counts * sizeof *in); }
void comm_exchange(const void *out, const int64_t *out_bytes, void *in, const int64_t *in_bytes)
{ if (in_bytes[0] > 0) memcpy(in, out, (size_t)out_bytes[0]); }
void comm_send(const void *data, int64_t bytes, int to) { (void)data; (void)bytes; (void)to; }
void comm_receive(void *data, int64_t bytes, int from) { (void)data; (void)bytes; (void)from; }
struct comm_cost comm_cost(void) { return (struct comm_cost){0, 0, 0, 0}; }
