/* SPDX-License-Identifier: GPL-3.0-or-later
 * Ranks over MPI: the one file that includes mpi.h. A start without mpirun leaves MPI alone. */
#define _GNU_SOURCE     /* sched_getaffinity */
#include "comm.h"
#include "fail.h"
#include "mem.h"
#include <limits.h>
#include <mpi.h>
#include <omp.h>
#include <sched.h>
#include <stdlib.h>

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
    double *all = mem_array("ranks", double, (int64_t)size * count);
    MPI_Allgather(values, count, MPI_DOUBLE, all, count, MPI_DOUBLE, MPI_COMM_WORLD);
    for (int i = 0; i < count; i++) {
        values[i] = 0;
        for (int r = 0; r < size; r++) values[i] += all[(int64_t)r * count + i];
    }
    mem_free(all);
}

void comm_sum_int(int64_t *values, int count)
{
    if (comm_size() > 1) MPI_Allreduce(MPI_IN_PLACE, values, count, MPI_INT64_T, MPI_SUM, MPI_COMM_WORLD);
}

void comm_min(double *values, int count)
{
    if (comm_size() > 1) MPI_Allreduce(MPI_IN_PLACE, values, count, MPI_DOUBLE, MPI_MIN, MPI_COMM_WORLD);
}

void comm_max(double *values, int count)
{
    if (comm_size() > 1) MPI_Allreduce(MPI_IN_PLACE, values, count, MPI_DOUBLE, MPI_MAX, MPI_COMM_WORLD);
}

void comm_min_bytes(uint8_t *values, int64_t count)
{
    check(count <= INT_MAX);
    if (comm_size() > 1) MPI_Allreduce(MPI_IN_PLACE, values, (int)count, MPI_UINT8_T, MPI_MIN, MPI_COMM_WORLD);
}

void comm_broadcast(void *data, size_t bytes, int root)
{
    check(bytes <= INT_MAX);
    if (comm_size() > 1) MPI_Bcast(data, (int)bytes, MPI_BYTE, root, MPI_COMM_WORLD);
}

/* Part by part, since MPI counts in int. */
void comm_gather_all(void *all, const int64_t *bytes)
{
    const int64_t most = 1 << 30;
    char *part = all;
    for (int r = 0, size = comm_size(); r < size && size > 1; part += bytes[r++])
        for (int64_t at = 0; at < bytes[r]; at += most)
            MPI_Bcast(part + at, (int)(bytes[r] - at < most ? bytes[r] - at : most), MPI_BYTE, r, MPI_COMM_WORLD);
}

void comm_gather_counts(int64_t own, int64_t *counts)
{
    counts[0] = own;
    if (comm_size() > 1) MPI_Allgather(&own, 1, MPI_INT64_T, counts, 1, MPI_INT64_T, MPI_COMM_WORLD);
}
