/* SPDX-License-Identifier: GPL-3.0-or-later
 * Ranks over MPI: the one file that includes mpi.h. A start without mpirun leaves MPI alone. */
#define _GNU_SOURCE     /* sched_getaffinity */
#include "comm.h"
#include "fail.h"
#include "mem.h"
#include "profile.h"
#include <limits.h>
#include <mpi.h>
#include <omp.h>
#include <sched.h>
#include <stdlib.h>
#include <string.h>

static struct comm_cost cost;    /* of this process */

struct comm_cost comm_cost(void) { return cost; }

struct started { double wall, cpu; };
static struct started start_call(void) { return (struct started){profile_wall(), profile_cpu()}; }
static void end_call(struct started started, double *sum)
{
    *sum += profile_wall() - started.wall;
    cost.cpu += profile_cpu() - started.cpu;
}

/* Set by the launchers of Open MPI, of PMIx and PMI-2 ones such as Slurm's, and of MPICH. */
static bool launched(void)
{
    const char *const marks[] = {"OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "PMI_RANK"};
    for (size_t i = 0; i < sizeof marks / sizeof *marks; i++)
        if (getenv(marks[i])) return true;
    return false;
}

static bool running(void)
{
    int begun, ended;
    MPI_Initialized(&begun);
    MPI_Finalized(&ended);
    return begun && !ended;
}

void comm_begin(int *argc, char ***argv)
{
    int level;
    if (launched()) MPI_Init_thread(argc, argv, MPI_THREAD_FUNNELED, &level);
}

void comm_end(void)
{
    if (running()) MPI_Finalize();
}

void comm_abort(int status)
{
    if (running() && comm_size() > 1) MPI_Abort(MPI_COMM_WORLD, status);
    comm_end();
    exit(status);
}

int comm_rank(void)
{
    int rank = 0;
    if (running()) MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    return rank;
}

int comm_size(void)
{
    int size = 1;
    if (running()) MPI_Comm_size(MPI_COMM_WORLD, &size);
    return size;
}

int comm_processors(void)
{
    if (comm_size() == 1) return omp_get_num_procs();
    MPI_Comm machine;
    int ranks;
    cpu_set_t own;
    MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &machine);
    MPI_Comm_size(machine, &ranks);
    if (sched_getaffinity(0, sizeof own, &own) != 0) CPU_ZERO(&own);
    cpu_set_t *all = mem_array("ranks", cpu_set_t, ranks);
    MPI_Allgather(&own, sizeof own, MPI_BYTE, all, sizeof own, MPI_BYTE, machine);
    MPI_Comm_free(&machine);
    double share = 0;
    for (int cpu = 0; cpu < CPU_SETSIZE; cpu++) {
        int among = 0;
        for (int r = 0; r < ranks && CPU_ISSET(cpu, &own); r++) among += CPU_ISSET(cpu, &all[r]) != 0;
        if (among > 0) share += 1.0 / among;
    }
    mem_free(all);
    return share < 1 ? 1 : (int)(share + 1e-6);
}

void comm_barrier(void)
{
    if (running()) MPI_Barrier(MPI_COMM_WORLD);
}

void comm_sum(double *values, int count)
{
    int size = comm_size();
    if (size == 1) return;
    const struct started started = start_call();
    double *all = mem_array("ranks", double, (int64_t)size * count);
    MPI_Allgather(values, count, MPI_DOUBLE, all, count, MPI_DOUBLE, MPI_COMM_WORLD);
    end_call(started, &cost.wait);
    for (int i = 0; i < count; i++) {
        values[i] = 0;
        for (int r = 0; r < size; r++) values[i] += all[(int64_t)r * count + i];
    }
    mem_free(all);
}

static void reduce(void *values, int count, MPI_Datatype type, MPI_Op operation)
{
    if (comm_size() == 1) return;
    const struct started started = start_call();
    MPI_Allreduce(MPI_IN_PLACE, values, count, type, operation, MPI_COMM_WORLD);
    end_call(started, &cost.wait);
}

void comm_sum_int(int64_t *values, int count) { reduce(values, count, MPI_INT64_T, MPI_SUM); }
void comm_sum_floats(float *values, int count) { reduce(values, count, MPI_FLOAT, MPI_SUM); }
void comm_min(double *values, int count) { reduce(values, count, MPI_DOUBLE, MPI_MIN); }
void comm_max(double *values, int count) { reduce(values, count, MPI_DOUBLE, MPI_MAX); }

void comm_min_bytes(uint8_t *values, int64_t count)
{
    check(count <= INT_MAX);
    reduce(values, (int)count, MPI_UINT8_T, MPI_MIN);
}

void comm_broadcast(void *data, size_t bytes, int root)
{
    check(bytes <= INT_MAX);
    if (comm_size() > 1) MPI_Bcast(data, (int)bytes, MPI_BYTE, root, MPI_COMM_WORLD);
}

enum { MOST = 1 << 30 };    /* MPI counts in int */

void comm_gather_all(void *all, const int64_t *bytes)
{
    int size = comm_size();
    int64_t total = 0;
    for (int r = 0; r < size; r++) total += bytes[r];
    if (size == 1) return;
    const struct started started = start_call();
    cost.bytes += bytes[comm_rank()] * (size - 1);
    if (total < MOST) {
        int *count = mem_array("ranks", int, 2 * size), *at = count + size;
        for (int r = 0; r < size; r++) count[r] = (int)bytes[r];
        for (int r = 1; r < size; r++) at[r] = at[r - 1] + count[r - 1];
        MPI_Allgatherv(MPI_IN_PLACE, 0, MPI_BYTE, all, count, at, MPI_BYTE, MPI_COMM_WORLD);
        mem_free(count);
    } else {
        char *part = all;
        for (int r = 0; r < size; part += bytes[r++])
            for (int64_t done = 0; done < bytes[r]; done += MOST)
                MPI_Bcast(part + done, (int)(bytes[r] - done < MOST ? bytes[r] - done : MOST), MPI_BYTE, r, MPI_COMM_WORLD);
    }
    end_call(started, &cost.talk);
}

void comm_gather_counts(int64_t own, int64_t *counts)
{
    counts[0] = own;
    if (comm_size() == 1) return;
    const struct started started = start_call();
    MPI_Allgather(&own, 1, MPI_INT64_T, counts, 1, MPI_INT64_T, MPI_COMM_WORLD);
    end_call(started, &cost.wait);
}

void comm_exchange_counts(const int64_t *out, int64_t *in, int counts)
{
    const struct started started = start_call();
    if (comm_size() == 1) memcpy(in, out, (size_t)counts * sizeof *in);
    else MPI_Alltoall(out, counts, MPI_INT64_T, in, counts, MPI_INT64_T, MPI_COMM_WORLD);
    end_call(started, &cost.wait);
}

/* Messages of one direction, part by part; `requests` grows. */
struct messages { MPI_Request *request; int n, capacity; };

static MPI_Request *next_request(struct messages *m)
{
    if (m->n == m->capacity) {
        m->capacity = 2 * m->capacity + 16;
        m->request = mem_resize("ranks", m->request, (size_t)m->capacity * sizeof *m->request);
    }
    return &m->request[m->n++];
}

void comm_exchange(const void *out, const int64_t *out_bytes, void *in, const int64_t *in_bytes)
{
    const int size = comm_size(), rank = comm_rank();
    const struct started started = start_call();
    struct messages m = {0};
    const char *from = out;
    char *to = in;
    for (int r = 0; r < size; to += in_bytes[r++])
        for (int64_t at = 0; at < in_bytes[r] && r != rank; at += MOST)
            MPI_Irecv(to + at, (int)(in_bytes[r] - at < MOST ? in_bytes[r] - at : MOST), MPI_BYTE, r, 0, MPI_COMM_WORLD,
                      next_request(&m));
    to = in;
    for (int r = 0; r < rank; r++) to += in_bytes[r];
    for (int r = 0; r < size; from += out_bytes[r++]) {
        if (r == rank && out_bytes[r] > 0) memcpy(to, from, (size_t)out_bytes[r]);
        for (int64_t at = 0; at < out_bytes[r] && r != rank; at += MOST)
            MPI_Isend(from + at, (int)(out_bytes[r] - at < MOST ? out_bytes[r] - at : MOST), MPI_BYTE, r, 0, MPI_COMM_WORLD,
                      next_request(&m));
        cost.bytes += r == rank ? 0 : out_bytes[r];
    }
    MPI_Waitall(m.n, m.request, MPI_STATUSES_IGNORE);
    mem_free(m.request);
    end_call(started, &cost.talk);
}

void comm_send(const void *data, int64_t bytes, int to)
{
    const struct started started = start_call();
    const char *from = data;
    for (int64_t at = 0; at < bytes; at += MOST)
        MPI_Send(from + at, (int)(bytes - at < MOST ? bytes - at : MOST), MPI_BYTE, to, 0, MPI_COMM_WORLD);
    cost.bytes += bytes;
    end_call(started, &cost.talk);
}

void comm_receive(void *data, int64_t bytes, int from)
{
    const struct started started = start_call();
    char *to = data;
    for (int64_t at = 0; at < bytes; at += MOST)
        MPI_Recv(to + at, (int)(bytes - at < MOST ? bytes - at : MOST), MPI_BYTE, from, 0, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    end_call(started, &cost.talk);
}
