/* SPDX-License-Identifier: GPL-3.0-or-later
 * `tephra ics`: initial conditions into a file. The keys are those of the block `start`, as a scene
 * would write them; units.* say what they are measured in. */
#include "cmd.h"
#include "comm.h"
#include "file/snapshot.h"
#include "log.h"
#include "mem.h"
#include "module.h"
#include "start.h"
#include <stdio.h>
#include <string.h>

static const char usage[] = "ics GENERATOR [key=value]... -o FILE.hdf5";

static void list_generators(void)
{
    printf("usage: tephra %s\n\n", usage);
    for (const struct generator *const *g = generator_list; *g; g++) {
        printf("%s: %s\n", (*g)->name, (*g)->doc);
        param_describe(stdout, "start", (*g)->params, false);
        putchar('\n');
    }
    printf("all of them:\n");
    param_describe(stdout, "start", start_params, false);
    printf("units.length, units.mass, units.velocity, units.G, box.x, box.y, box.z: as in a scene; without them\n"
           "G is 1 and space open\n");
    for (int m = 0; module_list[m]; m++)
        if (module_list[m]->kelvin)
            printf("%s.KEY: what gas it is; tephra params %s\n", module_list[m]->name, module_list[m]->name);
}

/* key=value as --set would have it: start.key=value, or as it is if it names a block. */
static void set_key(struct scene *scene, const char *argument, struct problems *problems)
{
    const char *equals = strchr(argument, '='), *dot = strchr(argument, '.');
    bool has_block = dot && equals && dot < equals;
    if (!equals) {
        problems_add(problems, "%s: expects key=value; usage: tephra %s", argument, usage);
        return;
    }
    if (strncmp(argument, "generator=", 10) == 0 || strncmp(argument, "start.generator=", 16) == 0)
        problems_add(problems, "%s: the generator is named once, by the word after ics: tephra %s", argument, usage);
    char *assignment = mem_format("scene", "%s%s", has_block ? "" : "start.", argument);
    scene_set(scene, assignment, problems);
    mem_free(assignment);
}

static void add_block(struct scene *scene, const char *name, struct problems *problems)
{
    char *assignment = mem_format("scene", "%s={}", name);
    scene_set(scene, assignment, problems);
    mem_free(assignment);
}

/* The command line as a scene of the blocks units, start, box and that of the gas; *out is the file's name. */
static struct scene *scene_of(int argc, char **argv, const char **out, struct problems *problems)
{
    struct scene *scene = scene_new(".");
    const char *generator = NULL;
    scene_set(scene, "units={}", problems);
    scene_set(scene, "start={}", problems);
    scene_set(scene, "box={}", problems);
    for (int m = 0; module_list[m]; m++)
        if (module_list[m]->kelvin) add_block(scene, module_list[m]->name, problems);
    for (int i = 1; i < argc; i++) {
        bool option = strcmp(argv[i], "-o") == 0 || strcmp(argv[i], "--out") == 0;
        if (option && i + 1 < argc) *out = argv[++i];
        else if (argv[i][0] == '-') problems_add(problems, "%s: not understood; usage: tephra %s", argv[i], usage);
        else if (generator) set_key(scene, argv[i], problems);
        else generator = argv[i];
    }
    if (!generator || strchr(generator, '='))
        problems_add(problems, "say which generator; tephra ics lists them");
    if (!*out) problems_add(problems, "say which file to write: -o FILE.hdf5");
    char *assignment = mem_format("scene", "start.generator=%s", generator ? generator : "none");
    scene_set(scene, assignment, problems);
    mem_free(assignment);
    return scene;
}

static int ics_run(int argc, char **argv)
{
    if (argc < 2 || strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0) {
        if (comm_rank() == 0) list_generators();
        return STATUS_DONE;
    }
    const char *out = NULL;
    struct problems problems = {0};
    struct scene *scene = scene_of(argc, argv, &out, &problems);
    problems_report(&problems);
    cmd_check_writable(out, "-o");
    struct sim *sim = sim_new(scene, SIM_START);
    problems_report(&sim->problems);
    box_read(sim);
    species_need(&sim->species[GAS], COLUMN_u);
    start_load(sim);
    problems_report(&sim->problems);
    snapshot_write(sim, out, SNAPSHOT_DOUBLE);
    for_species(sim, s)
        log_line("%s: %lld %s rows made by %s", out, (long long)s->n, species_names[s->kind], sim->start->generator);
    sim_free(sim);
    return STATUS_DONE;
}

const struct command ics_command = {"ics", usage, "initial conditions into a file", ics_run};
