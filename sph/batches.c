/* SPDX-License-Identifier: GPL-3.0-or-later
 * Groups, batches and the largest smoothing length of each cell: see sph.h. */
#include "ghosts.h"
#include "mem.h"
#include "sph.h"
#include <math.h>
#include <omp.h>
#include <string.h>

/* What there is room for, of a gas row: runs of candidates, of which all rows together have 0.9 at a group size of 512,
 * and entries that its cluster meets, of which they have 17 with 50 neighbours; of an active row that is alone in its
 * group, as many neighbours. */
enum { ROW_RUNS = 1, ROW_MET = 16, LONE_RUNS = 2, LONE_MET = 4 };

static int64_t room(const struct sph *sph, const struct species *gas, int row, int lone)
{
    int64_t whole = gas->n_own * row, alone = gas->n_active * lone * sph->neighbours;
    return alone < whole ? alone : whole;
}

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
    int64_t runs = room(sph, gas, ROW_RUNS, LONE_RUNS), met = room(sph, gas, ROW_MET, LONE_MET);
    if (runs > sph->arena_size || met > sph->met_size) {
        sph_drop_lists(sph);
        sph->arena = mem_array("sph", struct sph_run, runs);
        sph->met = mem_array("sph", uint16_t, met);
        sph->arena_size = runs;
        sph->met_size = met;
    }
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
    int32_t clusters = 0;
    for (int32_t b = 0; b < sph->n_batches; b++) {
        sph->batch[b].cluster = clusters;
        clusters += (sph->batch[b].count + SPH_LANES - 1) / SPH_LANES;
    }
    sph->cluster = mem_resize("sph", sph->cluster, (size_t)clusters * sizeof *sph->cluster);
    for (int32_t c = 0; c < clusters; c++) sph->cluster[c] = (struct sph_met){0, -1};
}

/* Runs of rows that follow each other. */
static int64_t count_runs(const int32_t *row, int n)
{
    int64_t runs = n > 0;
    for (int k = 1; k < n; k++) runs += row[k] != row[k - 1] + 1;
    return runs;
}

void sph_keep_list(struct sph *sph, const struct sph_work *work, const struct sim *sim, struct sph_batch *batch)
{
    if (!sph_nearest(work, sim)) return;
    int64_t at, n = count_runs(work->row, work->tile.n);
#pragma omp atomic capture
    { at = sph->arena_used; sph->arena_used += n; }
    if (at + n > sph->arena_size) return;
    struct sph_run *run = sph->arena + at - 1;
    for (int k = 0; k < work->tile.n; k++) {
        if (k == 0 || work->row[k] != work->row[k - 1] + 1) *++run = (struct sph_run){work->row[k], 0};
        run->n++;
    }
    batch->list = at;
    batch->n_list = (int32_t)n;
}

int sph_list_rows(struct sph_work *work, const struct sph *sph, const struct sph_batch *batch, const struct sph_rungs *beyond)
{
    int n = 0;
    for (const struct sph_run *run = sph->arena + batch->list; run < sph->arena + batch->list + batch->n_list; run++)
        for (int32_t i = run->first; i < run->first + run->n; i++)
            if (!beyond || sph_is_beyond(beyond, i)) work->row[n++] = i;
    return n;
}

struct sph_met sph_keep_met(struct sph *sph, const struct sph_tile *tile, int n)
{
    int64_t at;
#pragma omp atomic capture
    { at = sph->met_used; sph->met_used += n; }
    if (at + n > sph->met_size) return (struct sph_met){0, -1};
    memcpy(sph->met + at, tile->list, (size_t)n * sizeof *sph->met);
    return (struct sph_met){at, n};
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
    void *const lists[] = {sph->arena, sph->met, sph->cluster, sph->batch};
    for (size_t l = 0; l < sizeof lists / sizeof *lists; l++) mem_free(lists[l]);
    sph->arena = NULL;
    sph->met = NULL;
    sph->cluster = NULL;
    sph->batch = NULL;
    sph->arena_size = sph->met_size = 0;
    sph->n_batches = 0;
}

void sph_free_batches(struct sph *sph)
{
    sph_drop_lists(sph);
    for (int t = 0; t < sph->n_work; t++) mem_free(sph->work[t]);
    sph_engine_free(sph->engine);
    mem_free(sph->work);
    mem_free(sph->group);
}

void sph_for_batches(struct sim *sim, struct sph *sph, bool (*work)(struct sim *, struct sph *, struct sph_batch *))
{
    for (int32_t b = 0; b < sph->n_batches; b++) sph->batch[b].waiting = true;
    do {
#pragma omp parallel for schedule(dynamic, 1)
        for (int32_t b = 0; b < sph->n_batches; b++)
            if (sph->batch[b].waiting) sph->batch[b].waiting = !work(sim, sph, &sph->batch[b]);
    } while (ghosts_open(sim));
}

static void measure_node(const struct sim *sim, const void *unused, int32_t n)
{
    const struct tree *tree = &sim->tree;
    const struct node *node = &tree->node[n];
    const float *h = sim->species[GAS].h;
    float largest = 0;
    (void)unused;
    for (int32_t k = 0; k < node->n_children; k++)
        if (tree->h_max[node->child + k] > largest) largest = tree->h_max[node->child + k];
    if (node->n_children == 0)
        for (int32_t i = node->first[GAS]; i < node->first[GAS] + node->count[GAS]; i++)
            largest = h[i] > largest ? h[i] : largest;
    if (node->n_children == 0) largest *= expf(SPH_GROWTH);
    tree->h_max[n] = largest;
}

void sph_fit_h_max(struct sim *sim)
{
    const struct tree *tree = &sim->tree;
    const struct species *gas = &sim->species[GAS];
    if (tree->n_nodes == 0) return;
    bool all = tree->built == sim->time.tick || gas->all_ending > gas->n / 4;
    tree_sweep(sim, GAS, all ? NULL : gas->ending, gas->n_ending, measure_node, NULL);
    if (tree->n_top > 0) ghosts_share_top_column(sim, NODE_h_max);
    for (int32_t n = tree->n_top - 1; n >= 0; n--)
        if (tree->node[n].place == NODE_TOP) measure_node(sim, NULL, n);
    ghosts_share_node_column(sim, NODE_h_max);
}
