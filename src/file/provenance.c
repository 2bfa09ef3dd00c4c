/* SPDX-License-Identifier: GPL-3.0-or-later
 * Writes the group /Provenance (provenance.h). */
#include "provenance.h"
#include "comm.h"
#include "commit.h"
#include "config.h"
#include "h5.h"
#include "sim.h"
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
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
