/* SPDX-License-Identifier: GPL-3.0-or-later
 * Writes and checks the group /Provenance (provenance.h). */
#include "provenance.h"
#include "comm.h"
#include "commit.h"
#include "config.h"
#include "h5.h"
#include "log.h"
#include "mem.h"
#include "module.h"
#include "start.h"
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* used.yml as a text for free(). */
static char *scene_text(const struct sim *sim)
{
    char *text = NULL;
    size_t size = 0;
    FILE *stream = open_memstream(&text, &size);
    if (!stream) fail(STATUS_ENVIRONMENT, "out of memory for the text of the scene");
    sim_write_used(sim, stream);
    fclose(stream);
    return text;
}

void provenance_write(struct h5 *file, const struct sim *sim)
{
    static const char group[] = "Provenance";
    char host[256] = "";
    gethostname(host, sizeof host - 1);
    h5_group(file, group);
    h5_attr_text(file, group, "program", PACKAGE_STRING);
    h5_attr_text(file, group, "commit", TEPHRA_COMMIT);
    h5_attr_text(file, group, "compiler", __VERSION__);
    h5_attr_text(file, group, "host", host);
    h5_attr_int(file, group, "ranks", comm_size());
    h5_attr_int(file, group, "threads", omp_get_max_threads());
    h5_attr_int(file, group, "seed", (int64_t)sim->seed);
    h5_attr_int(file, group, "steps", sim->steps);
    h5_attr_int(file, group, "updates", sim->updates);
    h5_attr_double(file, group, "G", sim->units.G);
    if (!sim->scene) return;
    char *text = scene_text(sim);
    h5_attr_text(file, group, "title", sim->scene->title ? sim->scene->title : "");
    h5_attr_text(file, group, "scene", text);
    free(text);
}

/* The value of a key in the text of a used.yml, for mem_free; NULL if it has none. */
static char *value_in(const char *scene, const char *block, const char *key)
{
    char *text = mem_text("files", scene), *value = NULL;
    bool inside = false;
    const size_t length = strlen(key);
    for (char *next = text, *line; !value && (line = strsep(&next, "\n"));) {
        if (*line != ' ') inside = strncmp(line, block, strlen(block)) == 0 && strcmp(line + strlen(block), ":") == 0;
        else if (inside && strncmp(line + 2, key, length) == 0 && strncmp(line + 2 + length, ": ", 2) == 0)
            value = mem_text("files", line + 2 + length + 2);
    }
    mem_free(text);
    return value;
}

static const struct param *param_in(const struct param *table, const char *key)
{
    for (; table && table->name; table++)
        if (strcmp(table->name, key) == 0) return table;
    return NULL;
}

/* NULL for the keys of units, which no table describes. */
static const struct param *find_param(const struct sim *sim, const char *block, const char *key)
{
    const struct param *found = NULL;
    struct param_target targets[3];
    start_targets(sim->start, targets);
    for (int t = 0; t < 2 && !found && strcmp(block, "start") == 0; t++) found = param_in(targets[t].table, key);
    for (int u = 0; u < sim->n_use && !found; u++)
        if (strcmp(sim->use[u].module->name, block) == 0) found = param_in(sim->use[u].module->params, key);
    return found;
}

static void check_key(struct sim *sim, const char *path, const char *stored, const char *place[2], const char *value)
{
    const struct param *param = find_param(sim, place[0], place[1]);
    char *before = param && param->at_restart ? NULL : value_in(stored, place[0], place[1]);
    if (before && strcmp(before, value) != 0) {
        if (param && param->type == PARAM_PATH)
            log_line("%s was written with %s.%s: %s; now it is %s", path, place[0], place[1], before, value);
        else
            problems_add(&sim->problems, "%s was written with %s.%s: %s, and %s says %s: it may not change when a run is continued "
                         "(write %s there, or begin a new run)", path, place[0], place[1], before,
                         scene_place(sim->scene, place[0], place[1]), value, before);
    }
    mem_free(before);
}

void provenance_check(struct h5 *file, struct sim *sim, const char *path)
{
    char *stored = h5_read_attr_text(file, "Provenance", "scene");
    char *own = stored && sim->scene && sim->start ? scene_text(sim) : NULL;
    const char *block = "";
    for (char *next = own, *line; next && (line = strsep(&next, "\n"));) {
        char *colon = strchr(line, ':');
        if (!colon) continue;
        *colon = '\0';
        if (*line != ' ') block = line;
        else check_key(sim, path, stored, (const char *[2]){block, line + 2}, colon + 2);
    }
    free(own);
    mem_free(stored);
}
