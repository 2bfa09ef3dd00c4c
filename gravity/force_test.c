/* SPDX-License-Identifier: GPL-3.0-or-later
 * `tephra force-test`: accelerations of the rows of a file, their cost, and their relative errors
 * against direct sums in double on a sample. A first force, not counted, gives the fmm the
 * accelerations that its opening compares with, and holds the self-check. */
#include "cmd.h"
#include "comm.h"
#include "gravity.h"
#include "h5.h"
#include "log.h"
#include "mem.h"
#include "module.h"
#include "profile.h"
#include "random.h"
#include "ranks.h"
#include "start_file.h"
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

struct cost { double build, walk; };    /* CPU seconds of all ranks */

static struct sim *rows_of_file(const struct cmd_options *options)
{
    struct problems problems = {0};
    struct scene *scene = scene_new(".");
    scene_set(scene, "units={}", &problems);
    scene_set(scene, "gravity={}", &problems);
    for (int i = 0; i < options->n_set; i++) scene_set(scene, options->set[i], &problems);
    problems_report(&problems);
    struct sim *sim = sim_new(scene, SIM_FORCES);
    problems_report(&sim->problems);
    if (!sim_state(sim, "gravity")) fail(STATUS_INPUT, "--set gravity=off: then there are no forces to test");
    start_file_read(sim, options->argument[0]);
    problems_report(&sim->problems);
    return sim;
}

static int64_t count_rows(const struct sim *sim)
{
    int64_t rows = 0;
    for_species(sim, s) rows += s->n;
    return rows;
}

/* One force of all rows, with a tree of its own. */
static struct cost compute(struct sim *sim)
{
    double cpu[3] = {profile_cpu()};
    for_species(sim, s) memset(s->acc, 0, (size_t)s->n * sizeof *s->acc);
    sim_find_active(sim);
    sim->rebuild_next = true;
    sim_run_hook(sim, HOOK_ARRANGE);
    cpu[1] = profile_cpu();
    sim_run_hook(sim, HOOK_FORCE);
    cpu[2] = profile_cpu();
    if (ranks_failed(sim)) fail(STATUS_NUMBERS, "%s", sim->failure.text);
    comm_sum(cpu, 3);
    return (struct cost){cpu[1] - cpu[0], cpu[2] - cpu[1]};
}

static double row_draw(const struct sim *sim, const struct species *s, int64_t i)
{
    struct random key = {sim->seed, s->id[i], 0, random_stream("force_test")};
    return random_uniform(&key, 0);
}

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Rows whose draw is below this are `sample` of them. */
static double draw_limit(const struct sim *sim, int64_t sample)
{
    int64_t n = 0, rows = count_rows(sim);
    if (sample >= rows) return 1;
    double *draw = mem_array("gravity", double, rows);
    for_species(sim, s)
        for (int64_t i = 0; i < s->n; i++) draw[n++] = row_draw(sim, s, i);
    qsort(draw, (size_t)n, sizeof *draw, compare_doubles);
    double limit = draw[sample];
    mem_free(draw);
    return limit;
}

/* Relative error of one acceleration; that of a row without any counts absolutely. */
static double relative_error(const float acc[3], const double exact[4])
{
    double d2 = 0, a2 = 0;
    for (int k = 0; k < 3; k++) {
        d2 += ((double)acc[k] - exact[k]) * ((double)acc[k] - exact[k]);
        a2 += exact[k] * exact[k];
    }
    return sqrt(a2 > 0 ? d2 / a2 : d2);
}

/* The own rows of the sample: a reference and what the sums in double give. */
struct reference { int32_t *row[N_SPECIES]; int64_t n[N_SPECIES]; double (*exact[N_SPECIES])[4]; };

static struct reference reference_make(const struct sim *sim, const struct gravity *g, int64_t sample)
{
    struct reference r = {0};
    double limit = draw_limit(sim, sample);
    for_species(sim, s) {
        int k = (int)s->kind;
        r.row[k] = mem_array("gravity", int32_t, s->n_own);
        for (int64_t i = s->own; i < s->own + s->n_own; i++)
            if (row_draw(sim, s, i) < limit) r.row[k][r.n[k]++] = (int32_t)i;
        r.exact[k] = mem_alloc("gravity", (size_t)r.n[k] * sizeof *r.exact[k]);
        gravity_direct_rows(sim, g, s, r.row[k], r.n[k], r.exact[k]);
    }
    return r;
}

static struct gravity_errors reference_compare(const struct sim *sim, const struct reference *r)
{
    int64_t n = 0, i = 0;
    for (int k = 0; k < N_SPECIES; k++) n += r->n[k];
    double *error = mem_array("gravity", double, n);
    for_species(sim, s)
        for (int64_t j = 0; j < r->n[s->kind]; j++)
            error[i++] = relative_error(s->acc[r->row[s->kind][j]], r->exact[s->kind][j]);
    struct gravity_errors e = gravity_errors_shared(error, n);
    mem_free(error);
    return e;
}

static void reference_free(struct reference *r)
{
    for (int k = 0; k < N_SPECIES; k++) {
        mem_free(r->row[k]);
        mem_free(r->exact[k]);
    }
}

static void print_row(const struct sim *sim, const struct gravity *g, struct cost cost, struct gravity_errors e)
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
        printf("%s,%s,%lld,%.0f,%.6g,%.6g,%.4e,%.4e,%.4e,%.4e\n", solver[o->solver], setting, (long long)count_rows(sim),
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
    int64_t rows = count_rows(sim), n = 0;
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
    cmd_parse(&options, argc, argv, "set threads sample repeat out device isa", usage);
    if (options.n_arguments != 1) fail(STATUS_INPUT, "usage: tephra %s", usage);
    cmd_set_threads(&options);
    struct sim *sim = rows_of_file(&options);
    const struct gravity *g = sim_state(sim, "gravity");
    cmd_open_device(&options, sim);
    sim_begin(sim);
    problems_report(&sim->problems);
    if (g->opening.solver != SOLVER_DIRECT) compute(sim);
    if (comm_rank() == 0) printf("solver,setting,n,threads,build_cpu_s,walk_cpu_s,rms,median,p99,max\n");
    int64_t repeats = options.repeat > 0 ? options.repeat : 1;
    struct reference reference = {0};
    for (int64_t i = 0; i < repeats; i++) {
        struct cost cost = compute(sim);
        if (i == 0) reference = reference_make(sim, g, options.sample > 0 ? options.sample : SAMPLE);
        print_row(sim, g, cost, reference_compare(sim, &reference));
    }
    reference_free(&reference);
    if (options.out) write_results(sim, options.out);
    sim_free(sim);
    return STATUS_DONE;
}

const struct command force_test_command = {
    "force-test", "force-test FILE.hdf5 [--set ...] [--out F.hdf5]", "forces of a file: cost and error", force_test_run};
