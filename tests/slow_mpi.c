/* SPDX-License-Identifier: GPL-3.0-or-later
 * A network on which messages are late: preloaded before MPI, it holds up every call by which tephra's ranks exchange, on each
 * rank by times of its own. */
#include <mpi.h>
#include <stdint.h>
#include <time.h>

static void wait_a_while(void)
{
    static uint64_t state;
    int rank;
    PMPI_Comm_rank(MPI_COMM_WORLD, &rank);
    state = (state + (uint64_t)rank + 1) * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    const long most = 2000000;      /* nanoseconds */
    nanosleep(&(struct timespec){0, (long)(state >> 33) % most}, NULL);
}

int MPI_Allreduce(const void *a, void *b, int n, MPI_Datatype type, MPI_Op operation, MPI_Comm all)
{
    wait_a_while();
    return PMPI_Allreduce(a, b, n, type, operation, all);
}

int MPI_Allgather(const void *a, int n, MPI_Datatype type, void *b, int m, MPI_Datatype other, MPI_Comm all)
{
    wait_a_while();
    return PMPI_Allgather(a, n, type, b, m, other, all);
}

int MPI_Alltoall(const void *a, int n, MPI_Datatype type, void *b, int m, MPI_Datatype other, MPI_Comm all)
{
    wait_a_while();
    return PMPI_Alltoall(a, n, type, b, m, other, all);
}

int MPI_Isend(const void *a, int n, MPI_Datatype type, int to, int tag, MPI_Comm all, MPI_Request *request)
{
    wait_a_while();
    return PMPI_Isend(a, n, type, to, tag, all, request);
}

int MPI_Send(const void *a, int n, MPI_Datatype type, int to, int tag, MPI_Comm all)
{
    wait_a_while();
    return PMPI_Send(a, n, type, to, tag, all);
}

int MPI_Waitall(int n, MPI_Request request[], MPI_Status status[])
{
    wait_a_while();
    return PMPI_Waitall(n, request, status);
}
