/* SPDX-License-Identifier: GPL-3.0-or-later
 * The profile of a run. */
#include "profile.h"
#include "comm.h"
#include "mem.h"
#include "module.h"
#include "text_file.h"
#include <errno.h>
#include <string.h>
#include <time.h>

struct entry { double wall, cpu; int64_t calls, rows; };
struct profile {
    double wall, cpu;           /* at profile_start */
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

void profile_start(struct profile *profile)
{
    profile->wall = profile_wall();
    profile->cpu = profile_cpu();
}

void profile_stop(struct profile *profile, int call, int64_t rows)
{
    struct entry *entry = &profile->entry[call];
    entry->wall += profile_wall() - profile->wall;
    entry->cpu += profile_cpu() - profile->cpu;
    entry->calls++;
    entry->rows += rows;
}

double profile_spent(const struct profile *profile, int call) { return profile->entry[call].cpu; }

void profile_write(const struct sim *sim, const char *path)
{
    if (comm_rank() != 0) return;
    struct text_file file = text_file_open(path);
    FILE *stream = file.stream;
    if (!stream) fail(STATUS_ENVIRONMENT, "%s: cannot be written: %s", path, strerror(errno));
    fprintf(stream, "hook,module,wall [s],cpu [s],calls,rows\n");
    for (int c = 0; c < sim->n_call; c++) {
        const struct entry *entry = &sim->profile->entry[c];
        fprintf(stream, "%s,%s,%.6f,%.6f,%lld,%lld\n", hook_names[sim->call[c].hook],
                sim->use[sim->call[c].use].module->name, entry->wall, entry->cpu,
                (long long)entry->calls, (long long)entry->rows);
    }
    if (!text_file_close(&file)) fail(STATUS_ENVIRONMENT, "%s: cannot be written: %s", path, strerror(errno));
}
