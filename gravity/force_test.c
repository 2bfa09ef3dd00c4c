/* SPDX-License-Identifier: GPL-3.0-or-later
 * `tephra force-test`: accelerations of the rows of a file, their cost, and their relative errors
 * against direct sums in double on a sample. A first force, not counted, gives the fmm the
 * accelerations that its opening compares with, and holds the self-check. */
#include "comm.h"
#include "command/cmd.h"
#include "file/h5.h"
#include "file/start_file.h"
#include "gravity.h"
#include "log.h"
#include "mem.h"
#include "module.h"
#include "profile.h"
#include "ranks.h"
#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char usage[] =
    "force-test FILE.hdf5 [--set gravity.*|units.*=...] [--threads N] [--sample K] [--repeat M] "
    "[--out F.hdf5] [--device auto|cpu|cuda] [--isa v2|v3|v4]";

/* Rows whose errors are measured, unless --sample says otherwise. */
enum { SAMPLE = 1000 };

static struct sim *rows_of_file(const struct cmd_options *options)
{
    struct problems problems = {0};
    struct scene *scene = scene_new(".");
    scene_set(scene, "units={}", &problems);
    scene_set(scene, "gravity={}", &problems);
    for (int i = 0; i < options->n_set; i++) scene_set(scene, options->set[i], &problems);
    for (int b = 0; b < scene->n; b++)
        if (strcmp(scene->block[b].name, "units") != 0 && strcmp(scene->block[b].name, "gravity") != 0)
            problems_add(&problems, "--set %s: force-test takes keys of gravity and units only", scene->block[b].name);
    problems_report(&problems);
    struct sim *sim = sim_new(scene, SIM_FORCES);
    problems_report(&sim->problems);
    if (!sim_state(sim, "gravity")) fail(STATUS_INPUT, "--set gravity=off: then there are no forces to test");
    start_file_read(sim, options->argument[0]);
    problems_report(&sim->problems);
    return sim;
}

static void print_row(const struct sim *sim, const struct gravity *g, struct gravity_cost cost, struct gravity_errors e)
{
    const char *const solver[] = {"auto", "direct", "tree", "fmm"};
    const struct gravity_opening *o = &g->opening;
    char *setting = o->solver == SOLVER_DIRECT ? mem_format("gravity", "%s", g->precision == PRECISION_DOUBLE ? "double" : "float")
        : o->solver == SOLVER_TREE ? mem_format("gravity", "order=%d theta=%.3g group=%d leaf=%d", o->order,
                                                o->theta * g->scale, o->group_size, o->leaf_size)
        : mem_format("gravity", "order=%d tolerance=%.3g group=%d leaf=%d", o->order, o->alpha * g->scale,
                     o->group_size, o->leaf_size);
    double threads = omp_get_max_threads();
    comm_sum(&threads, 1);
    if (comm_rank() == 0)
        printf("%s,%s,%lld,%.0f,%.6g,%.6g,%.4e,%.4e,%.4e,%.4e\n", solver[o->solver], setting, (long long)gravity_count_rows(sim),
               threads, cost.build, cost.walk, e.rms, e.median, e.p99, e.max);
    mem_free(setting);
}

/* All rows of all species, one after the other, in the order of memory. */
static void write_results(struct sim *sim, const char *path)
{
    for (int u = 0; u < sim->n_use; u++)
        if (sim->use[u].module->potential) sim->use[u].module->potential(sim, sim->use[u].state);
    ranks_share(sim, (uint64_t)1 << COLUMN_acc | (uint64_t)1 << COLUMN_pot);
    if (comm_rank() != 0) return;
    int64_t rows = gravity_count_rows(sim), n = 0;
    uint64_t *id = mem_array("gravity", uint64_t, rows);
    double (*acc)[3] = mem_alloc("gravity", (size_t)rows * sizeof *acc), *pot = mem_array("gravity", double, rows);
    for_species(sim, s)
        for (int64_t i = 0; i < s->n; i++, n++) {
            id[n] = s->id[i];
            pot[n] = (double)s->pot[i];
            for (int k = 0; k < 3; k++) acc[n][k] = (double)s->acc[i][k];
        }
    struct h5 *file = h5_create(path);
    h5_write(file, "ParticleIDs", 'u', rows, 1, id);
    h5_write(file, "Acceleration", 'd', rows, 3, acc);
    h5_write(file, "Potential", 'd', rows, 1, pot);
    h5_close(file);
    mem_free(id);
    mem_free(acc);
    mem_free(pot);
}

static int force_test_run(int argc, char **argv)
{
    struct cmd_options options;
    if (!cmd_parse(&options, argc, argv, "set threads sample repeat out device isa", usage)) return STATUS_DONE;
    if (options.n_arguments != 1) fail(STATUS_INPUT, "usage: tephra %s", usage);
    cmd_set_threads(&options);
    struct sim *sim = rows_of_file(&options);
    const struct gravity *g = sim_state(sim, "gravity");
    cmd_open_device(&options, sim);
    sim_begin(sim);
    problems_report(&sim->problems);
    if (g->opening.solver != SOLVER_DIRECT) gravity_force(sim);
    if (comm_rank() == 0) printf("solver,setting,n,threads,build_cpu_s,walk_cpu_s,rms,median,p99,max\n");
    int64_t repeats = options.repeat > 0 ? options.repeat : 1;
    struct gravity_reference reference = {0};
    for (int64_t i = 0; i < repeats; i++) {
        struct gravity_cost cost = gravity_force(sim);
        if (i == 0) reference = gravity_reference_make(sim, g, options.sample > 0 ? options.sample : SAMPLE);
        print_row(sim, g, cost, gravity_reference_compare(sim, &reference));
    }
    gravity_reference_free(&reference);
    if (options.out) write_results(sim, options.out);
    sim_free(sim);
    return STATUS_DONE;
}

const struct command force_test_command = {
    "force-test", usage, "forces of a file: cost and error", force_test_run};
