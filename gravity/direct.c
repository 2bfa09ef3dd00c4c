/* SPDX-License-Identifier: GPL-3.0-or-later
 * Direct sums: in float relative to each group's centre with promoted sums (solver direct), and in
 * double, for references and for `precision: double`. */
#include "comm.h"
#include "sum.h"
#include "walk.h"
#include <math.h>
#include <string.h>

/* Everything before, between and after the group's own rows, in the order of memory. */
static void add_others(struct walk *w, const struct node *node)
{
    for (int k = 0; k < N_SPECIES; k++) {
        const struct species *s = &w->sim->species[k];
        walk_add_range(w, s, 0, node->first[k]);
        walk_add_range(w, s, node->first[k] + node->count[k], s->n);
    }
}

static void direct_group(struct walk *w, int32_t n)
{
    const struct node *node = &w->sim->tree.node[n];
    double centre[3];
    for (int k = 0; k < 3; k++) centre[k] = node->pos[k] + 0.5 * ((double)node->high[k] + (double)node->low[k]);
    walk_begin_group(w, centre, w->g->unit, node);
    add_others(w, node);
    walk_end_group(w);
}

static void direct_float(struct sim *sim, struct gravity *g, enum gravity_output output)
{
    int32_t *group, n = tree_groups(&sim->tree, ALL_SPECIES, g->opening.group_size, "gravity", &group);
    int64_t pairs = 0;
#pragma omp parallel reduction(+ : pairs)
    {
        struct walk w = {0};
        walk_open(&w, sim, g, output);
#pragma omp for schedule(dynamic, 1)
        for (int32_t i = 0; i < n; i++)
            if (sim->tree.active_count[group[i]] > 0) direct_group(&w, group[i]);
        pairs += w.pairs;
        walk_close(&w);
    }
    g->pairs = pairs;
    g->cells = 0;
    mem_free(group);
}

/* Rows of a species from `from` on, as many as a tile holds. */
static void stage_exact(const struct sim *sim, const struct gravity *g, const struct species *s, int64_t from,
                        struct gravity_exact *tile)
{
    tile->n = 0;
    for (int64_t i = from; i < species_to(s) && tile->n < GRAVITY_EXACT; i++) {
        double pos[3];
        sim_predict(&sim->time, s, i, pos);
        tile->x[tile->n] = pos[0];
        tile->y[tile->n] = pos[1];
        tile->z[tile->n] = pos[2];
        tile->mass[tile->n] = g->G * s->mass[i];
        tile->soft[tile->n++] = gravity_half_soft2(g, s, i);
    }
}

enum { BLOCK = 64 };

/* A row on which all rows that are here act: x, y, z, softening. */
struct exact_target { double at[4]; int64_t row; };

/* The rows of species s. */
static void exact_block(const struct sim *sim, const struct gravity *g, const struct species *s, const struct exact_target *target,
                        int n, double (*sum)[4])
{
    struct gravity_exact tile;
    memset(sum, 0, (size_t)n * sizeof *sum);
    for (const struct species *from = sim->species; from < sim->species + N_SPECIES; from++)
        for (int64_t first = species_from(from); first < species_to(from); first += GRAVITY_EXACT) {
            stage_exact(sim, g, from, first, &tile);
            for (int i = 0; i < n; i++) {
                int64_t own = from == s ? target[i].row - first : -1;
                bool here = own >= 0 && own < tile.n;
                double mass = here ? tile.mass[own] : 0;
                if (here) tile.mass[own] = 0;
                g->kernels->exact->sum[g->form](sum[i], target[i].at, &tile);
                if (here) tile.mass[own] = mass;
            }
        }
    for (int i = 0; i < n; i++) sum[i][3] = -sum[i][3];
}

static void exact_rows(const struct sim *sim, const struct gravity *g, const struct species *s, const struct exact_target *target,
                       int64_t n, double (*acc)[4])
{
#pragma omp parallel for schedule(dynamic, 1)
    for (int64_t i = 0; i < n; i += BLOCK)
        exact_block(sim, g, s, target + i, (int)(n - i < BLOCK ? n - i : BLOCK), acc + i);
}

/* Of spread rows each rank sums over its own, on the targets of all ranks. */
static void exact_shared(const struct sim *sim, const struct gravity *g, const struct species *s, const struct exact_target *own,
                         int64_t n, double (*acc)[4])
{
    int64_t *bytes = mem_array("gravity", int64_t, comm_size()), before = 0, total = 0;
    comm_gather_counts(n * (int64_t)sizeof *own, bytes);
    for (int r = 0; r < comm_size(); r++) {
        if (r < comm_rank()) before += bytes[r] / (int64_t)sizeof *own;
        total += bytes[r] / (int64_t)sizeof *own;
    }
    struct exact_target *all = mem_alloc("gravity", (size_t)total * sizeof *all);
    double (*sum)[4] = mem_alloc("gravity", (size_t)total * sizeof *sum);
    if (n > 0) memcpy(all + before, own, (size_t)n * sizeof *own);
    comm_gather_all(all, bytes);
    exact_rows(sim, g, s, all, total, sum);
    check(total < INT32_MAX / 4);
    if (total > 0) comm_sum(sum[0], (int)(4 * total));
    if (n > 0) memcpy(acc, sum + before, (size_t)n * sizeof *sum);
    mem_free(all);
    mem_free(sum);
    mem_free(bytes);
}

void gravity_direct_rows(const struct sim *sim, const struct gravity *g, const struct species *s,
                         const int32_t *list, int64_t n, double (*acc)[4])
{
    struct exact_target *target = mem_alloc("gravity", (size_t)n * sizeof *target);
    for (int64_t i = 0; i < n; i++) {
        target[i].row = list[i];
        sim_predict(&sim->time, s, list[i], target[i].at);
        target[i].at[3] = gravity_half_soft2(g, s, list[i]);
    }
    if (sim->spread) exact_shared(sim, g, s, target, n, acc);
    else exact_rows(sim, g, s, target, n, acc);
    mem_free(target);
}

static void direct_double(struct sim *sim, struct gravity *g, enum gravity_output output)
{
    struct sum bound = {0, 0};
    g->pairs = g->cells = 0;
    for_species(sim, s) {
        double (*sum)[4] = mem_alloc("gravity", (size_t)s->n_active * sizeof *sum);
        gravity_direct_rows(sim, g, s, s->active, s->n_active, sum);
        for (int64_t a = 0; a < s->n_active; a++) {
            int64_t i = s->active[a];
            for (int k = 0; k < 3 && output == OUTPUT_FORCE; k++) s->acc[i][k] += (float)sum[a][k];
            if (sim->want_potential || output == OUTPUT_POTENTIAL) s->pot[i] = (float)sum[a][3];
            sum_add(&bound, s->mass[i] * sum[a][3]);
        }
        for_species(sim, other) g->pairs += s->n_active * other->n;
        mem_free(sum);
    }
    g->bound = sum_value(&bound);   /* of all own rows, where all are active: when energies are recorded */
}

void gravity_direct(struct sim *sim, struct gravity *g, enum gravity_output output)
{
    if (g->precision == PRECISION_DOUBLE) direct_double(sim, g, output);
    else if (g->adaptive || !sim_device(sim) || !gravity_direct_device(sim, g, output)) direct_float(sim, g, output);
}
