/* SPDX-License-Identifier: GPL-3.0-or-later
 * The profile of a run. */
#include "profile.h"
#include "comm.h"
#include "device.h"
#include "file/text_file.h"
#include "ghosts.h"
#include "mem.h"
#include "module.h"
#include <errno.h>
#include <string.h>
#include <time.h>

/* waited: CPU seconds in calls that wait for other ranks */
struct entry { double wall, cpu, waited; int64_t calls, rows, bytes; };
struct profile {
    double wall, cpu, waited;   /* at profile_start */
    int64_t bytes;
    struct entry entry[];
};

static double clock_now(clockid_t clock)
{
    struct timespec now;
    clock_gettime(clock, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

double profile_wall(void) { return clock_now(CLOCK_MONOTONIC); }
double profile_cpu(void) { return clock_now(CLOCK_PROCESS_CPUTIME_ID); }

struct profile *profile_new(int calls)
{
    return mem_alloc("frame", sizeof(struct profile) + (size_t)calls * sizeof(struct entry));
}

void profile_free(struct profile *profile) { mem_free(profile); }

void profile_start(struct profile *profile, int64_t bytes)
{
    profile->bytes = bytes;
    profile->wall = profile_wall();
    profile->cpu = profile_cpu();
    profile->waited = comm_cost().cpu;
}

void profile_stop(struct profile *profile, int call, int64_t rows, int64_t bytes)
{
    struct entry *entry = &profile->entry[call];
    entry->wall += profile_wall() - profile->wall;
    entry->cpu += profile_cpu() - profile->cpu;
    entry->waited += comm_cost().cpu - profile->waited;
    entry->calls++;
    entry->rows += rows;
    entry->bytes += bytes - profile->bytes;
}

double profile_spent(const struct profile *profile, int call) { return profile->entry[call].cpu; }

/* Kernels and copies, of the whole step. */
static void write_device(struct device *device, FILE *stream)
{
    const struct device_cost *cost;
    for (int c = 0, n = device_costs(device, &cost); c < n; c++)
        fprintf(stream, "DEVICE,%s,%.6f,0,%lld,0,%lld\n", cost[c].name, cost[c].seconds, (long long)cost[c].calls,
                (long long)cost[c].bytes);
}

void profile_write(const struct sim *sim, const char *path)
{
    if (comm_rank() != 0) return;
    struct text_file file = text_file_open(path);
    FILE *stream = file.stream;
    if (!stream) fail(STATUS_ENVIRONMENT, "%s: cannot be written: %s", path, strerror(errno));
    fprintf(stream, "hook,module,wall [s],cpu [s],calls,rows,copied [bytes]\n");
    for (int c = 0; c < sim->n_call; c++) {
        const struct entry *entry = &sim->profile->entry[c];
        fprintf(stream, "%s,%s,%.6f,%.6f,%lld,%lld,%lld\n", hook_names[sim->call[c].hook],
                sim->use[sim->call[c].use].module->name, entry->wall, entry->cpu,
                (long long)entry->calls, (long long)entry->rows, (long long)entry->bytes);
    }
    if (sim->device) write_device(sim->device, stream);
    if (!text_file_close(&file)) fail(STATUS_ENVIRONMENT, "%s: cannot be written: %s", path, strerror(errno));
}

static struct rank_cost own_cost(const struct sim *sim)
{
    const struct comm_cost comm = comm_cost();
    const struct ghost_counts ghosts = ghosts_counts(sim);
    struct rank_cost cost = {.communication = comm.talk, .wait = comm.wait, .bytes = (double)comm.bytes,
                             .ghost_rows = (double)ghosts.rows, .ghost_cells = (double)ghosts.cells,
                             .rounds = (double)ghosts.rounds, .memory = (double)mem_peak(),
                             .ghost_bytes = (double)ghosts.bytes, .top_bytes = (double)ghosts.top_bytes};
    for (int c = 0; c < sim->n_call; c++) {
        const struct entry *entry = &sim->profile->entry[c];
        const int hook = sim->call[c].hook;
        *(hook == HOOK_ARRANGE ? &cost.construction : hook == HOOK_RECORD ? &cost.record : &cost.calculation)
            += entry->cpu - entry->waited;
        if (sim->call[c].hook == HOOK_LIMIT && strcmp(sim->use[sim->call[c].use].module->name, "steps") == 0)
            cost.updates = (double)entry->rows;
    }
    for_species(sim, s) cost.rows += (double)s->n_own;
    return cost;
}

static const char ranks_head[] = "rank,T_construction [s],T_calculation [s],T_record [s],T_communication [s],T_wait [s],bytes,"
                                 "imbalance,rows,updates,ghost_rows,ghost_cells,rounds,memory [bytes],ghost_bytes,top_bytes\n";

void profile_write_ranks(const struct sim *sim, const char *path)
{
    const int size = comm_size();
    struct rank_cost *cost = mem_array("frame", struct rank_cost, size);
    int64_t *bytes = mem_array("frame", int64_t, size);
    for (int r = 0; r < size; r++) bytes[r] = (int64_t)sizeof *cost;
    cost[comm_rank()] = own_cost(sim);
    comm_gather_all(cost, bytes);
    double most = 0, all = 0;
    for (int r = 0; r < size; r++) {
        most = cost[r].updates > most ? cost[r].updates : most;
        all += cost[r].updates;
    }
    if (comm_rank() == 0) {
        struct text_file file = text_file_open(path);
        if (!file.stream) fail(STATUS_ENVIRONMENT, "%s: cannot be written: %s", path, strerror(errno));
        fputs(ranks_head, file.stream);
        for (int r = 0; r < size; r++) {
            const struct rank_cost *c = &cost[r];
            fprintf(file.stream, "%d,%.6f,%.6f,%.6f,%.6f,%.6f,%.0f,%.4f,%.0f,%.0f,%.0f,%.0f,%.0f,%.0f,%.0f,%.0f\n", r,
                    c->construction, c->calculation, c->record, c->communication, c->wait, c->bytes,
                    all > 0 ? most * size / all : 1, c->rows, c->updates, c->ghost_rows, c->ghost_cells, c->rounds, c->memory,
                    c->ghost_bytes, c->top_bytes);
        }
        if (!text_file_close(&file)) fail(STATUS_ENVIRONMENT, "%s: cannot be written: %s", path, strerror(errno));
    }
    mem_free(cost);
    mem_free(bytes);
}

struct rank_cost *profile_read_ranks(const char *path, int *ranks)
{
    char line[512];
    struct rank_cost *cost = NULL;
    *ranks = 0;
    errno = 0;
    FILE *file = fopen(path, "r");
    if (!file) return NULL;
    bool good = fgets(line, sizeof line, file) && strcmp(line, ranks_head) == 0;
    while (good && fgets(line, sizeof line, file)) {
        cost = mem_resize("frame", cost, (size_t)(*ranks + 1) * sizeof *cost);
        struct rank_cost *c = &cost[(*ranks)++];
        good = sscanf(line, "%*d,%lf,%lf,%lf,%lf,%lf,%lf,%*f,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf", &c->construction, &c->calculation,
                      &c->record, &c->communication, &c->wait, &c->bytes, &c->rows, &c->updates, &c->ghost_rows, &c->ghost_cells,
                      &c->rounds, &c->memory, &c->ghost_bytes, &c->top_bytes) == 14;
    }
    fclose(file);
    if (!good) {
        mem_free(cost);
        cost = NULL;
        errno = 0;
    }
    return cost;
}
