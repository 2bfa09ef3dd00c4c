/* SPDX-License-Identifier: GPL-3.0-or-later
 * Files of series.h. */
#include "series.h"
#include "comm.h"
#include "layout.h"
#include "mem.h"
#include <dirent.h>
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char first_name[] = "t [";

static _Noreturn void not_written(const char *path)
{
    fail(STATUS_ENVIRONMENT, "%s: cannot be written: %s", path, strerror(errno));
}

static char *path_of(const struct sim *sim, const char *name) { return mem_format("files", "%s/%s", sim->folder, name); }

FILE *series_open(const struct sim *sim, const char *name, void (*header)(FILE *file, const void *context), const void *context)
{
    char *path = path_of(sim, name), unit[64];
    FILE *file = fopen(path, "a");
    if (!file) not_written(path);
    fseek(file, 0, SEEK_END);
    if (ftell(file) == 0) {
        layout_unit_text(sim->units.physical, "L V^-1", unit, sizeof unit);
        fprintf(file, "%s%s]", first_name, unit);
        header(file, context);
        fprintf(file, "\n");
    }
    mem_free(path);
    return file;
}

void series_time(const struct sim *sim, FILE *file)
{
    fprintf(file, "%.10g", layout_factor(&sim->units, "L V^-1") * timeline_now(&sim->time));
}

void series_close(const struct sim *sim, const char *name, FILE *file)
{
    char *path = path_of(sim, name);
    const bool written = !ferror(file);
    if (fclose(file) != 0 || !written) not_written(path);
    mem_free(path);
}

bool series_is(const char *path)
{
    const size_t length = strlen(path), ending = strlen(".csv");
    char first[sizeof first_name] = "";
    if (length < ending || strcmp(path + length - ending, ".csv") != 0) return false;
    FILE *file = fopen(path, "r");
    const bool series = file && fgets(first, sizeof first, file) && strcmp(first, first_name) == 0;
    if (file) fclose(file);
    return series;
}

static void trim(const struct sim *sim, const char *path)
{
    FILE *file = fopen(path, "r");
    if (!file) not_written(path);
    const double now = layout_factor(&sim->units, "L V^-1") * timeline_now(&sim->time);
    char *line = NULL;
    size_t size = 0;
    long keep = 0;
    bool whole = getline(&line, &size, file) > 0;
    while (whole && line[strlen(line) - 1] == '\n') {      /* else it was cut short while it was written */
        keep = ftell(file);
        if (getline(&line, &size, file) <= 0 || strtod(line, NULL) > now + 1e-9 * fabs(now)) break;
    }
    free(line);
    fclose(file);
    if (truncate(path, keep) != 0) not_written(path);
}

void series_trim(const struct sim *sim)
{
    if (comm_rank() != 0) return;
    DIR *folder = opendir(sim->folder);
    if (!folder) fail(STATUS_ENVIRONMENT, "%s: cannot be read: %s", sim->folder, strerror(errno));
    for (struct dirent *entry = readdir(folder); entry; entry = readdir(folder)) {
        char *path = path_of(sim, entry->d_name);
        if (series_is(path)) trim(sim, path);
        mem_free(path);
    }
    closedir(folder);
}
