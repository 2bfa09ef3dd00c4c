/* SPDX-License-Identifier: GPL-3.0-or-later
 * Groups, batches and the largest smoothing length of each cell: see sph.h. */
#include "mem.h"
#include "sph.h"
#include <math.h>
#include <omp.h>
#include <string.h>

/* Candidates that the arena has room for: of a gas row, twice what all rows together have at a group size of 512; of an
 * active row that is alone in its group, as many neighbours. */
enum { ROW_CANDIDATES = 6, LONE_CANDIDATES = 4 };

static void make_groups(const struct sim *sim, struct sph *sph)
{
    mem_free(sph->group);
    sph->n_groups = tree_groups(&sim->tree, GAS_BIT, (int)sph->group_size, "sph", &sph->group);
    sph->grouped = sim->tree.built;
}

static void reserve(const struct sim *sim, struct sph *sph)
{
    const struct species *gas = &sim->species[GAS];
    int threads = omp_get_max_threads();
    if (threads > sph->n_work) {
        sph->work = mem_resize("sph", sph->work, (size_t)threads * sizeof *sph->work);
        for (; sph->n_work < threads; sph->n_work++) {
            sph->work[sph->n_work] = mem_alloc("sph", sizeof(struct sph_work));
            sph->work[sph->n_work]->meet = sph->meet;
        }
    }
    int64_t whole = gas->n * ROW_CANDIDATES, lone = gas->n_active * LONE_CANDIDATES * sph->neighbours;
    sph_drop_lists(sph);
    sph->arena_size = lone < whole ? lone : whole;
    sph->arena = mem_array("sph", int32_t, sph->arena_size);
    sph->arena_used = 0;
    sph->batch = mem_resize("sph", sph->batch, (size_t)sph_most_batches(sph, gas->n_active) * sizeof *sph->batch);
}

/* Of each group, the last batch alone is not full. */
int64_t sph_most_batches(const struct sph *sph, int64_t n)
{
    int64_t most = sph->n_groups + n / SPH_BATCH;
    return most < n ? most : n;
}

int32_t sph_group_of(const struct sim *sim, const struct sph *sph, int32_t row)
{
    int32_t low = 0, high = sph->n_groups;
    while (high - low > 1) {
        int32_t middle = low + (high - low) / 2;
        if (sim->tree.node[sph->group[middle]].first[GAS] <= row) low = middle;
        else high = middle;
    }
    return sph->group[low];
}

int32_t sph_divide(const struct sim *sim, const struct sph *sph, const int32_t *row, int64_t n, struct sph_batch *batch)
{
    int32_t batches = 0, count;
    for (int32_t r = 0, group = -1; r < n; r += count) {
        const struct node *node = group < 0 ? NULL : &sim->tree.node[group];
        if (!node || row[r] >= node->first[GAS] + node->count[GAS]) {
            group = sph_group_of(sim, sph, row[r]);
            node = &sim->tree.node[group];
        }
        int32_t end = node->first[GAS] + node->count[GAS];
        for (count = 1; count < SPH_BATCH && r + count < n && row[r + count] < end;) count++;
        batch[batches++] = (struct sph_batch){.node = group, .first = r, .count = count, .list = -1};
    }
    return batches;
}

void sph_make_batches(struct sim *sim, struct sph *sph)
{
    const struct species *gas = &sim->species[GAS];
    if (sph->group == NULL || sph->grouped != sim->tree.built || sim->tree.built == sim->time.tick)
        make_groups(sim, sph);
    reserve(sim, sph);
    sph->n_batches = sph_divide(sim, sph, gas->active, gas->n_active, sph->batch);
}

void sph_keep_list(struct sph *sph, const struct sph_work *work, const struct sim *sim, struct sph_batch *batch)
{
    int64_t at, n = work->tile.n;
    if (!sph_nearest(work, sim)) return;
#pragma omp atomic capture
    { at = sph->arena_used; sph->arena_used += n; }
    if (at + n > sph->arena_size) return;
    memcpy(sph->arena + at, work->row, (size_t)n * sizeof *sph->arena);
    batch->list = at;
    batch->n_list = (int32_t)n;
}

int32_t sph_batch_at(const struct sim *sim, const struct sph *sph, int32_t row)
{
    int32_t low = 0, high = sph->n_batches;
    while (low < high) {
        int32_t middle = low + (high - low) / 2;
        const struct sph_batch *batch = &sph->batch[middle];
        if (sim->species[GAS].active[batch->first + batch->count - 1] < row) low = middle + 1;
        else high = middle;
    }
    return low;
}

void sph_drop_lists(struct sph *sph)
{
    mem_free(sph->arena);
    mem_free(sph->batch);
    sph->arena = NULL;
    sph->batch = NULL;
    sph->arena_size = 0;
    sph->n_batches = 0;
}

void sph_free_batches(struct sph *sph)
{
    sph_drop_lists(sph);
    for (int t = 0; t < sph->n_work; t++) mem_free(sph->work[t]);
    mem_free(sph->work);
    mem_free(sph->group);
    mem_free(sph->next_rung);
}

static void measure_node(struct tree *tree, const struct species *gas, int32_t n)
{
    const struct node *node = &tree->node[n];
    float largest = 0;
    for (int32_t k = 0; k < node->n_children; k++)
        if (tree->h_max[node->child + k] > largest) largest = tree->h_max[node->child + k];
    if (node->n_children == 0)
        for (int32_t i = node->first[GAS]; i < node->first[GAS] + node->count[GAS]; i++)
            largest = gas->h[i] > largest ? gas->h[i] : largest;
    if (node->n_children == 0) largest *= expf(sph_growth);
    tree->h_max[n] = largest;
}

/* Measures the nodes on the paths to the rows listed, in row order. */
static void measure_paths(struct tree *tree, const struct species *gas, int32_t n, const int32_t *row, int64_t rows)
{
    const struct node *node = &tree->node[n];
    int64_t from = 0;
    for (int32_t k = 0; k < node->n_children; k++) {
        const struct node *child = &tree->node[node->child + k];
        int64_t to = from;
        while (to < rows && row[to] < child->first[GAS] + child->count[GAS]) to++;
        if (to > from) measure_paths(tree, gas, node->child + k, row + from, to - from);
        from = to;
    }
    measure_node(tree, gas, n);
}

void sph_fit_h_max(struct sim *sim)
{
    struct tree *tree = &sim->tree;
    const struct species *gas = &sim->species[GAS];
    if (tree->n_nodes == 0) return;
    if (tree->built == sim->time.tick || gas->n_ending > gas->n / 4) {
#pragma omp parallel for schedule(dynamic, 1024)
        for (int32_t n = 0; n < tree->n_nodes; n++)
            if (tree->node[n].n_children == 0) measure_node(tree, gas, n);
        for (int32_t n = tree->n_nodes - 1; n >= 0; n--)
            if (tree->node[n].n_children > 0) measure_node(tree, gas, n);
    } else {
        measure_paths(tree, gas, 0, gas->ending, gas->n_ending);
    }
}
