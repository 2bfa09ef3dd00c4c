/* SPDX-License-Identifier: GPL-3.0-or-later
 * The block `start`. */
#include "start.h"
#include "file/start_file.h"
#include "log.h"
#include "mem.h"
#include "module.h"
#include "ranks.h"
#include <stdio.h>
#include <string.h>

const struct param start_params[] = {
    {"generator", PARAM_TEXT, "", "none", 0, 0, NULL, "initial conditions made by the program: see `tephra ics`",
     false, offsetof(struct start, generator)},
    {"file", PARAM_PATH, "", "none", 0, 0, NULL, "initial conditions read from a file: HDF5, GADGET-2 binary or text",
     false, offsetof(struct start, file)},
    {"n", PARAM_COUNT, "", "none", 1, 1e12, NULL, "total number of particles that the generator makes, exactly",
     false, offsetof(struct start, n)},
    {"strip_h", PARAM_FLAG, "", "off", 0, 0, NULL,
     "takes files of cosmological runs, their powers of h and of the scale factor multiplied out",
     false, offsetof(struct start, strip_h)},
    {"seed", PARAM_COUNT, "", "1", 0, 9e15, NULL, "seed of all random numbers of the run",
     false, offsetof(struct start, seed)},
    {0}
};

const struct generator *start_find_generator(const char *name)
{
    for (const struct generator *const *g = generator_list; *g; g++)
        if (strcmp((*g)->name, name) == 0) return *g;
    return NULL;
}

static void unknown_generator(struct sim *sim, const char *name)
{
    const char *names[64];
    int count = 0;
    for (const struct generator *const *g = generator_list; *g && count < 64; g++) names[count++] = (*g)->name;
    const char *near = fail_nearest(name, names, count);
    problems_add(&sim->problems, "%s: start.generator: there is no \"%s\"%s%s%s; `tephra ics` lists them",
                 scene_place(sim->scene, "start", "generator"), name, near ? " (did you mean \"" : "", near ? near : "",
                 near ? "\"?)" : "");
}

void start_targets(const struct start *start, struct param_target targets[3])
{
    targets[0] = (struct param_target){start_params, (void *)start};
    targets[1] = (struct param_target){start->maker ? start->maker->params : NULL, start->maker_state};
    targets[2] = (struct param_target){NULL, NULL};
}

void start_read(struct sim *sim)
{
    struct start *start = sim->start = mem_alloc("frame", sizeof *start);
    const char *name = scene_value(sim->scene, "start", "generator");
    if (name && strcmp(name, "none") != 0) {    /* used.yml says none where there is a file */
        start->maker = start_find_generator(name);
        if (!start->maker) {
            unknown_generator(sim, name);
            return;
        }
        start->maker_state = mem_alloc("frame", start->maker->state_bytes);
    }
    struct param_target targets[3];
    start_targets(start, targets);
    param_read(sim->scene, "start", targets, &sim->units, &sim->problems);
    if (!start->generator == !start->file)
        problems_add(&sim->problems, "%s: start: give either a generator or a file", scene_place(sim->scene, "start", NULL));
    const bool own_n = start->file || (start->maker && start->maker->own_n);
    if (start->maker && start->n < 0 && !own_n)
        problems_add(&sim->problems, "%s: start.n: say how many particles the generator shall make",
                     scene_place(sim->scene, "start", NULL));
    if (own_n && start->n >= 0)
        problems_add(&sim->problems, "%s: start.n: has no meaning with %s", scene_place(sim->scene, "start", "n"),
                     start->file ? "start.file" : start->generator);
    sim->seed = (uint64_t)start->seed;
    if (start->maker && start->maker->advise && sim->problems.count == 0)
        start->maker->advise(sim, start->maker_state, start->n);
}

void start_advise(struct sim *sim, const char *block, const char *key, double value)
{
    char text[32];
    snprintf(text, sizeof text, "%.17g", value);
    if (scene_default(sim->scene, block, key, text, "start.generator"))
        log_line("%s.%s = %g for %lld rows: advice of the generator %s", block, key, value, (long long)sim->start->n,
                 sim->start->generator);
}

void start_load(struct sim *sim)
{
    const struct start *start = sim->start;
    const bool spread = sim->spread;
    if (!start->maker) {
        start_file_read(sim, start->file);
        return;
    }
    sim->spread = false;        /* generators make all rows on every rank */
    start->maker->make(sim, start->maker_state, start->n);
    if (spread && sim->problems.count == 0) ranks_spread(sim);
}

void start_free(struct start *start)
{
    if (!start) return;
    struct param_target targets[3];
    start_targets(start, targets);
    param_free(targets);
    mem_free(start->maker_state);
    mem_free(start);
}
