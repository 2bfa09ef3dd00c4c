/* SPDX-License-Identifier: GPL-3.0-or-later
 * DENSITY and FORCE: batches in parallel, chunks of a batch's neighbours if they are too many for a
 * tile, clusters of a batch's rows. A row's sums run over its neighbours in row order, so they do not
 * depend on the number of threads. The candidates found for the density are kept for the force where
 * the arena has room; elsewhere the walk is done again and finds the same. */
#include "sph.h"
#include <math.h>
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

static void keep_list(struct sph *sph, const struct sph_work *work, struct sph_batch *batch)
{
    int64_t at, n = work->tile.n;
#pragma omp atomic capture
    { at = sph->arena_used; sph->arena_used += n; }
    if (at + n > sph->arena_size) return;
    memcpy(sph->arena + at, work->row, (size_t)n * sizeof *sph->arena);
    batch->list = at;
    batch->n_list = (int32_t)n;
}

static struct sph_region cluster_of(struct sph_region rows, int from)
{
    return (struct sph_region){rows.row + from, rows.n - from < SPH_LANES ? rows.n - from : SPH_LANES};
}

static void density_chunk(const struct visit *v, struct sph_density_sums *sums)
{
    for (int c = 0; c * SPH_LANES < v->rows.n; c++) {
        struct sph_region cluster = cluster_of(v->rows, c * SPH_LANES);
        struct sph_lanes lanes;
        struct sph_box box = sph_lanes_fill(&lanes, v->work, v->sim, cluster);
        int n = v->sph->loops->filter(&v->work->tile, box, sph_largest_h(v->sim, cluster));
        v->sph->loops->density(&lanes, &v->work->tile, n, &sums[c]);
    }
}

/* Density and derivatives of the velocity; the switch of Balsara 1995 (eps_B: Steinmetz 1996). */
static void finish_density(const struct visit *v, const struct sph_density_sums *sums)
{
    const struct species *gas = &v->sim->species[GAS];
    for (int r = 0; r < v->rows.n; r++) {
        const struct sph_density_sums *s = &sums[r / SPH_LANES];
        int l = r % SPH_LANES;
        int32_t i = v->rows.row[r];
        float rho = s->rho[l], x = s->curl[0][l], y = s->curl[1][l], z = s->curl[2][l];
        float scale = rho > 0 ? 1 / rho : 0, div = s->div[l] * scale, curl = sqrtf(x * x + y * y + z * z) * scale;
        gas->rho[i] = rho;
        gas->div_v[i] = div;
        gas->curl_v[i] = curl;
        if (!v->sph->balsara) continue;
        float floor = (float)v->sph->balsara_epsilon * sph_sound_speed(v->sph, gas->u ? gas->u[i] : 0) / gas->h[i];
        float sum = fabsf(div) + curl + floor;
        gas->balsara[i] = sum > 0 ? fabsf(div) / sum : 1;
    }
}

static void density_batch(struct visit *v)
{
    struct sph_density_sums sums[SPH_BATCH / SPH_LANES];
    memset(sums, 0, sizeof sums);
    sph_centre(v->work, v->sim, v->batch->node, v->rows);
    float reach = sph_largest_h(v->sim, v->rows);
    for (int64_t skip = 0; skip == 0 || v->work->more; skip += SPH_TILE) {
        sph_gather(v->work, v->sim, reach, true, skip);
        if (skip == 0 && !v->work->more && sph_nearest(v->work, v->sim)) keep_list(v->sph, v->work, v->batch);
        density_chunk(v, sums);
    }
    finish_density(v, sums);
}

static void force_chunk(const struct visit *v, struct sph_force_sums *sums)
{
    const struct sph *sph = v->sph;
    const struct sph_viscosity visc = {(float)sph->alpha, (float)sph->beta, (float)sph->epsilon};
    sph_stage_state(v->work, v->sim, sph);
    for (int c = 0; c * SPH_LANES < v->rows.n; c++) {
        struct sph_region cluster = cluster_of(v->rows, c * SPH_LANES);
        struct sph_lanes lanes;
        struct sph_box box = sph_lanes_fill(&lanes, v->work, v->sim, cluster);
        sph_lanes_state(&lanes, v->sim, sph, cluster);
        int n = sph->loops->filter(&v->work->tile, box, sph_largest_h(v->sim, cluster));
        sph->loops->force(&lanes, &v->work->tile, n, visc, &sums[c]);
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

static void force_batch(struct visit *v)
{
    struct sph_force_sums sums[SPH_BATCH / SPH_LANES];
    memset(sums, 0, sizeof sums);
    sph_centre(v->work, v->sim, v->batch->node, v->rows);
    if (v->batch->list >= 0) {
        sph_stage(v->work, v->sim, v->sph->arena + v->batch->list, v->batch->n_list);
        force_chunk(v, sums);
    } else {
        float reach = sph_largest_h(v->sim, v->rows);
        for (int64_t skip = 0; skip == 0 || v->work->more; skip += SPH_TILE) {
            sph_gather(v->work, v->sim, reach, true, skip);
            force_chunk(v, sums);
        }
    }
    finish_force(v, sums);
}

static void for_batches(struct sim *sim, struct sph *sph, void (*work)(struct visit *))
{
#pragma omp parallel for schedule(dynamic, 1)
    for (int32_t b = 0; b < sph->n_batches; b++) {
        struct visit v = {sim, sph, sph->work[omp_get_thread_num()], &sph->batch[b], sph_batch_rows(sim, &sph->batch[b])};
        work(&v);
    }
}

void sph_density(struct sim *sim, void *state)
{
    struct sph *sph = state;
    sph_fit_h_max(sim, sph);
    sph->arena_used = 0;
    for_batches(sim, sph, density_batch);
}

void sph_force(struct sim *sim, void *state)
{
    for_batches(sim, state, force_batch);
}
