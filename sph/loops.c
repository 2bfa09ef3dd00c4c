/* SPDX-License-Identifier: GPL-3.0-or-later
 * DENSITY and FORCE: batches in parallel, chunks of a batch's neighbours if they are too many for a
 * tile, clusters of a batch's rows. A row's sums run over its neighbours in row order, so they do not
 * depend on the number of threads. The rows that a batch may meet were listed by the search for h; where
 * the arena had no room, or a row outside grew beyond what the list allows for, the walk is done again. */
#include "sph.h"
#include <omp.h>
#include <string.h>

/* One batch on its way: what the tile holds at the moment and how many chunks came before. */
struct visit {
    struct sim *sim;
    struct sph *sph;
    struct sph_work *work;
    struct sph_batch *batch;
    struct sph_region rows;
};

static struct sph_region cluster_of(struct sph_region rows, int from)
{
    return (struct sph_region){rows.row + from, rows.n - from < SPH_LANES ? rows.n - from : SPH_LANES};
}

/* Rows of a cluster into lanes, what they meet into the tile's list; the length of that. */
static int meet_cluster(const struct visit *v, struct sph_region cluster, struct sph_lanes *lanes, const struct sph_met *met)
{
    const struct sph_meet meet = v->sph->meet;
    struct sph_box box = sph_lanes_fill(lanes, v->work, v->sim, cluster);
    if (met && met->n >= 0) {
        memcpy(v->work->tile.list, v->sph->met + met->at, (size_t)met->n * sizeof *v->sph->met);
        return met->n;
    }
    float h = sph_largest_h(v->sim, cluster);
    int n = v->sph->loops->filter(&v->work->tile, box, meet.own * h, meet.least * h);
    return v->sph->loops->prune(lanes, &v->work->tile, n, meet);
}

static void density_chunk(const struct visit *v, void *all)
{
    struct sph_density_sums *sums = all;
    const struct sph_met none = {0, -1};
    sph_enclose(v->sph, v->work, v->rows.n);
    for (int c = 0; c * SPH_LANES < v->rows.n; c++) {
        struct sph_lanes lanes;
        int n = meet_cluster(v, cluster_of(v->rows, c * SPH_LANES), &lanes, NULL);
        v->sph->cluster[v->batch->cluster + c] = v->batch->list >= 0 ? sph_keep_met(v->sph, &v->work->tile, n) : none;
        v->sph->loops->density[v->sph->kernel][v->sph->grad_h](&lanes, &v->work->tile, n, &sums[c]);
    }
}

static void finish_density(const struct visit *v, const struct sph_density_sums *sums)
{
    const struct sph_law law = sph_law_of(v->sph);
    for (int r = 0; r < v->rows.n; r++) {
        const struct sph_density_sums *s = &sums[r / SPH_LANES];
        int l = r % SPH_LANES;
        struct sph_density sum = {s->rho[l], s->div[l], s->curl[0][l], s->curl[1][l], s->curl[2][l], s->swell[l]};
        const int32_t i = v->rows.row[r];
        const float t = (float)timeline_step(&v->sim->time, v->sim->species[GAS].rung0[i]);
        sph_row_density(law, &v->sim->species[GAS], i, t, sum);
    }
}

/* Stages the rows that the batch may meet, from its list or by a walk; each tile full goes to `chunk`. False if rows of other
 * ranks are missing. */
static bool for_chunks(struct visit *v, void (*chunk)(const struct visit *, void *), void *sums)
{
    struct sph_batch *batch = v->batch;
    sph_centre(v->work, v->sim, batch->node, v->rows);
    if (batch->list >= 0) {
        sph_stage(v->work, v->sim, sph_list_rows(v->work, v->sph, batch, NULL));
        chunk(v, sums);
        return true;
    }
    struct sph_reach reach = sph_mutual(v->sph, sph_largest_h(v->sim, v->rows));
    for (int64_t skip = 0; skip == 0 || v->work->more; skip += SPH_TILE) {
        sph_gather(v->work, v->sim, reach, skip);
        if (v->work->missing) return false;
        if (skip == 0 && !v->work->more) sph_keep_list(v->sph, v->work, v->sim, batch);
        chunk(v, sums);
    }
    return true;
}

static struct visit visit_of(struct sim *sim, struct sph *sph, struct sph_batch *batch)
{
    return (struct visit){sim, sph, sph->work[omp_get_thread_num()], batch, sph_batch_rows(sim, batch)};
}

static bool density_batch(struct sim *sim, struct sph *sph, struct sph_batch *batch)
{
    struct visit visit = visit_of(sim, sph, batch), *v = &visit;
    struct sph_density_sums sums[SPH_BATCH / SPH_LANES];
    memset(sums, 0, sizeof sums);
    if (v->batch->stale || v->sph->unforeseen) v->batch->list = -1;
    if (!for_chunks(v, density_chunk, sums)) return false;
    finish_density(v, sums);
    return true;
}

static void force_chunk(const struct visit *v, void *all)
{
    struct sph_force_sums *sums = all;
    const struct sph *sph = v->sph;
    const struct sph_viscosity visc = sph_viscosity_of(sph);
    sph_force_loop *force = sph->loops->force[sph->kernel][sph->grad_h][sph->viscosity][sph->conduction > 0];
    const bool kept = sph->cluster[v->batch->cluster + (v->rows.n - 1) / SPH_LANES].n >= 0;
    sph_stage_state(v->work, v->sim, sph);
    sph_enclose(sph, v->work, kept ? 0 : v->rows.n);
    for (int c = 0; c * SPH_LANES < v->rows.n; c++) {
        struct sph_region cluster = cluster_of(v->rows, c * SPH_LANES);
        struct sph_lanes lanes;
        int n = meet_cluster(v, cluster, &lanes, &sph->cluster[v->batch->cluster + c]);
        sph_lanes_state(&lanes, v->sim, sph, cluster);
        force(&lanes, &v->work->tile, n, visc, &sums[c]);
    }
}

static void finish_force(const struct visit *v, const struct sph_force_sums *sums)
{
    const struct species *gas = &v->sim->species[GAS];
    for (int r = 0; r < v->rows.n; r++) {
        const struct sph_force_sums *s = &sums[r / SPH_LANES];
        int l = r % SPH_LANES;
        int32_t i = v->rows.row[r];
        for (int k = 0; k < 3; k++) gas->acc[i][k] += s->acc[k][l];
        if (gas->du) gas->du[i] += s->du[l];
        if (gas->signal) gas->signal[i] = s->signal[l];
    }
}

static bool force_batch(struct sim *sim, struct sph *sph, struct sph_batch *batch)
{
    struct visit visit = visit_of(sim, sph, batch), *v = &visit;
    struct sph_force_sums sums[SPH_BATCH / SPH_LANES];
    memset(sums, 0, sizeof sums);
    if (!for_chunks(v, force_chunk, sums)) return false;
    finish_force(v, sums);
    return true;
}

void sph_density(struct sim *sim, void *state)
{
    struct sph *sph = state;
    sph->met_used = 0;
    if (sph_uses_device(sim) && sph_device_density(sim, sph)) return;
    rows_here(sim, GAS_BIT, COL_ALL, COL_ALL);
    sph_fit_h_max(sim);
    sph_for_batches(sim, sph, density_batch);
}

void sph_force(struct sim *sim, void *state)
{
    struct sph *sph = state;
    if (sph_uses_device(sim) && sph_device_force(sim, sph)) return;
    rows_here(sim, GAS_BIT, COL_ALL, COL_ALL);
    sph_for_batches(sim, sph, force_batch);
}
