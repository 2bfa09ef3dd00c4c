/* SPDX-License-Identifier: GPL-3.0-or-later
 * Smoothing lengths. exact: 2h is the distance of the n-th neighbour, the row itself not counted.
 * smooth: h = eta (m/rho)^(1/3) with eta^3 = 3n/(32 pi), so that a uniform medium has n neighbours on
 * average (Springel & Hernquist 2002), rho being the sum of m W(r, h).
 *
 * A row looks as far as its last h suggests. Where that does not hold enough rows it looks further,
 * where it holds more than a tile it looks less far, between bounds that close: no row can make the
 * search fail. In a set of too few rows 2h is the distance of the farthest, scaled to what n rows
 * would need; a row whose neighbours all lie at its own place takes the nearest of the others; a row with
 * none at all keeps its h (or takes h_min, or 1). */
#include "comm.h"
#include "log.h"
#include "mem.h"
#include "sph.h"
#include <math.h>
#include <omp.h>
#include <string.h>

/* One row's search: it looks within `reach`; low held too few rows, high more than a tile. */
struct wish { int32_t row; float reach, low, high; };

struct seeker {
    struct sim *sim;
    struct sph *sph;
    struct sph_work *work;
    struct sph_batch *batch;
    float target, most;     /* rows to find, the row itself among them; no reach is larger */
};

/* The last neighbour may be farther than expected by this factor before the search must be repeated;
 * the cost of the search grows with it. */
static const float first_reach = 1.05f;

/* Where nothing is known: the radius that would hold the target if the smallest cell around that has
 * as many rows were uniform. */
static float guess_reach(const struct seeker *s)
{
    const struct tree *tree = &s->sim->tree;
    int32_t n = s->batch->node;
    while (tree->node[n].parent >= 0 && (float)tree->node[n].count[GAS] < s->target) n = tree->node[n].parent;
    const struct node *node = &tree->node[n];
    float extent = 0;
    for (int k = 0; k < 3; k++) extent = fmaxf(extent, node->high[k] - node->low[k]);
    return sph_guess_reach(extent, s->target, (float)node->count[GAS]);
}

/* Rows to find, the row itself among them. */
static float target_of(const struct sph *sph, const struct species *gas)
{
    return (float)(sph->neighbours < gas->n - 1 ? sph->neighbours : gas->n - 1) + 1;
}

/* In a set of too few rows, of the distance of the farthest: what n rows would need. */
static double scale_of(const struct sph *sph, float target)
{ return target < (float)(sph->neighbours + 1) ? cbrt((double)sph->neighbours / ((double)target - 1)) : 1; }

static void set_h(const struct seeker *s, int32_t i, float r2)
{
    s->sim->species[GAS].h[i] = sph_row_length(sph_law_of(s->sph), r2, scale_of(s->sph, s->target));
}

/* Looked everywhere and found nothing to measure by. */
static float lone_h(const struct sph *sph) { return sph->h_min > 0 ? (float)sph->h_min : 1.0f; }
static void keep_h(const struct seeker *s, int32_t i)
{
    float *h = &s->sim->species[GAS].h[i];
    if (!(*h > 0)) *h = lone_h(s->sph);
}

/* Some row's h is not bounded by what it looked through: the kernels' own walks must find the rows. */
static void give_up_lists(struct sph *sph)
{
#pragma omp atomic write
    sph->unforeseen = true;
}

/* Next reach of a row that found too little; false if there is no point in looking on. */
static bool look_further(const struct seeker *s, struct wish *w)
{
    w->low = w->reach;
    if (w->high < INFINITY) w->reach = sqrtf(w->low * w->high);
    else w->reach *= 1.3f;
    if (w->low < s->most && w->reach > w->low && w->reach < w->high) return true;
    if (w->high < INFINITY) set_h(s, w->row, w->high * w->high);
    else keep_h(s, w->row);
    give_up_lists(s->sph);
    return false;
}

/* Of the set's size: more rows than a tile holds that are closer are at one place, and need an h_min. */
static const float one_place = 1e-12f;

/* Next reach of a row that has more rows in reach than a tile holds. */
static bool look_closer(const struct seeker *s, struct wish *w)
{
    float least = fmaxf(one_place * s->most, 2 * (float)s->sph->h_min);
    w->high = w->reach;
    w->reach = w->low > 0 ? sqrtf(w->low * w->high) : fmaxf(0.5f * w->high, least);
    if (w->high > least && w->reach > w->low && w->reach < w->high) return true;
    w->high = fmaxf(w->high, least);
    set_h(s, w->row, w->high * w->high);
    give_up_lists(s->sph);
    return false;
}

/* Whether `target` rows are to be found; else the sum of their kernels. */
static bool counts_rows(const struct seeker *s)
{ return s->sph->count == SPH_EXACT || s->target <= (float)s->sph->neighbours; }

static float wanted_sum(const struct sph *sph) { return (float)sph->neighbours * 3.0f / 32.0f + sph->excess * SPH_PI; }

/* Searches for up to SPH_LANES rows; those that must look on are moved to kept[]. Returns how many. */
static int search_cluster(const struct seeker *s, const struct wish *wish, int n, struct wish *kept)
{
    const struct sph *sph = s->sph;
    int32_t row[SPH_LANES];
    struct sph_search search = {.target = s->target};
    struct sph_lanes lanes;
    struct wish mine[SPH_LANES];
    float reach = 0;
    int count = 0;
    for (int l = 0; l < SPH_LANES; l++) {
        mine[l] = wish[l < n ? l : n - 1];
        row[l] = mine[l].row;
        search.limit[l] = mine[l].reach * mine[l].reach;
        search.guess[l] = search.limit[l] / (first_reach * first_reach);
        reach = fmaxf(reach, mine[l].reach);
    }
    struct sph_box box = sph_lanes_fill(&lanes, s->work, s->sim, (struct sph_region){row, n});
    int entries = sph->loops->filter(&s->work->tile, box, reach, 0);
    if (counts_rows(s)) {
        sph->loops->search_exact(&lanes, &s->work->tile, entries, &search);
    } else {
        search.target = wanted_sum(sph);
        sph->loops->search_smooth[sph->kernel](&lanes, &s->work->tile, entries, &search);
    }
    for (int l = 0; l < n; l++) {
        if (search.found[l]) set_h(s, row[l], search.guess[l]);
        else if (look_further(s, &mine[l])) kept[count++] = mine[l];
    }
    return count;
}

/* A row that finds its h farther away than expected may come within reach of rows whose lists were
 * made without it: those that lie within its new 2h, where the search has just been. (A row with an h
 * larger than that has it in its list in any case.) */
static void mark_stale(const struct seeker *s)
{
    const struct species *gas = &s->sim->species[GAS];
    struct sph_batch *batch = NULL;
    for (int e = 0, first = 0, last = -1; e < s->work->tile.n; e++) {
        const int32_t row = s->work->row[e];
        if (row < first || row > last) {    /* in a closed box they come image by image */
            const int32_t b = sph_batch_at(s->sim, s->sph, row);
            if (b == s->sph->n_batches) continue;
            batch = &s->sph->batch[b];
            first = gas->active[batch->first];
            last = gas->active[batch->first + batch->count - 1];
        }
        if (row < first) continue;
#pragma omp atomic write
        batch->stale = true;
    }
}

/* The same of rows whose lists other ranks hold. */
static void touch_others(const struct seeker *s)
{
    const struct species *gas = &s->sim->species[GAS];
    struct sph *sph = s->sph;
    if (gas->n_own == gas->n) return;
#pragma omp critical(sph_touched)
    for (int e = 0; e < s->work->tile.n; e++) {
        const int32_t row = s->work->row[e];
        if (row >= gas->own && row < gas->own + gas->n_own) continue;
        struct sph_run *last = sph->n_touched > 0 ? &sph->touched[sph->n_touched - 1] : NULL;
        if (last && row == last->first + last->n) {
            last->n++;
            continue;
        }
        if (sph->n_touched == sph->touched_room) {
            sph->touched_room = 2 * sph->touched_room + 64;
            sph->touched = mem_resize("sph", sph->touched, (size_t)sph->touched_room * sizeof *sph->touched);
        }
        sph->touched[sph->n_touched++] = (struct sph_run){row, 1};
    }
}

/* The rows' box becomes the work's; returns how far they look. */
static float widest_reach(const struct seeker *s, const struct wish *wish, int n)
{
    int32_t row[SPH_BATCH];
    float reach = 0;
    for (int w = 0; w < n; w++) {
        row[w] = wish[w].row;
        reach = fmaxf(reach, wish[w].reach);
    }
    sph_centre(s->work, s->sim, s->batch->node, (struct sph_region){row, n});
    return reach;
}

/* The first round takes along what the kernels may meet if every h is as expected, for the list. False if rows of other
 * ranks are missing. */
static bool search_rows(const struct seeker *s, struct wish *wish, int n, bool first)
{
    for (; n > 0; first = false) {
        const struct sph_meet *meet = &s->work->meet;
        float half = 0.5f * widest_reach(s, wish, n), other = first ? first_reach * meet->other : 0;
        sph_gather(s->work, s->sim, (struct sph_reach){meet->own * half, (2 - meet->own) * half, other, true, NULL}, 0);
        if (s->work->more && n > 1)
            return search_rows(s, wish, n / 2, false) && search_rows(s, wish + n / 2, n - n / 2, false);
        if (s->work->more) {
            if (!look_closer(s, wish)) return true;
            continue;
        }
        if (s->work->missing) return false;
        if (first) sph_keep_list(s->sph, s->work, s->sim, s->batch);
        else {
            mark_stale(s);
            touch_others(s);
        }
        int kept = 0;
        sph_enclose(s->sph, s->work, n);
        for (int w = 0; w < n; w += SPH_LANES)
            kept += search_cluster(s, wish + w, n - w < SPH_LANES ? n - w : SPH_LANES, wish + kept);
        n = kept;
#pragma omp atomic
        s->sph->retries += n;
    }
    return true;
}

/* Where a row looks first. */
static float begin_reach(const struct seeker *s, int32_t i)
{
    if (!(s->sim->species[GAS].h[i] > 0)) return guess_reach(s);
    return 2 * first_reach * fmaxf(sph_h_expected(s->sim, i, 0), (float)s->sph->h_min);
}

/* Where it has to wait, it begins anew: with the h that it began with. */
static bool search_batch(struct sim *sim, struct sph *sph, struct sph_batch *batch)
{
    const struct species *gas = &sim->species[GAS];
    const struct seeker seeker = {sim, sph, sph->work[omp_get_thread_num()], batch, target_of(sph, gas), 4 * (float)sim->tree.side};
    const struct seeker *s = &seeker;
    struct wish wish[SPH_BATCH];
    float before[SPH_BATCH];
    for (int r = 0; r < s->batch->count; r++) {
        before[r] = gas->h[gas->active[batch->first + r]];
        int32_t i = gas->active[s->batch->first + r];
        float h = fmaxf(sph_h_expected(s->sim, i, 0), (float)s->sph->h_min);
        wish[r] = (struct wish){i, begin_reach(s, i), 0, INFINITY};
        if (h > first_reach * sph_h_expected(s->sim, i, 0)) give_up_lists(s->sph);
        if (!(gas->h[i] > 0)) give_up_lists(s->sph);
    }
    if (search_rows(s, wish, s->batch->count, true)) return true;
    for (int r = 0; r < batch->count; r++) gas->h[gas->active[batch->first + r]] = before[r];
    return false;
}

/* The search on the device; false if the CPU must do it. */
static bool search_on_device(struct sim *sim, struct sph *sph)
{
    const struct species *gas = &sim->species[GAS];
    const struct seeker s = {sim, sph, NULL, NULL, target_of(sph, gas), 4 * (float)sim->tree.side};
    const bool exact = counts_rows(&s);
    const struct sph_quest quest = {!exact, exact ? s.target : wanted_sum(sph), s.most, first_reach, s.target, lone_h(sph),
                                    scale_of(sph, s.target)};
    return sph_device_search(sim, sph, &quest);
}

/* Marks the batches of own rows that others have touched. */
static void mark_touched(const struct sim *sim, struct sph *sph, const struct sph_run *run, int64_t n)
{
    const struct species *gas = &sim->species[GAS];
    for (int64_t k = 0; k < n; k++)
        for (int32_t row = run[k].first, end = row + run[k].n; row < end && row < gas->own + gas->n_own; row++) {
            if (row < gas->own) continue;
            const int32_t b = sph_batch_at(sim, sph, row);
            if (b == sph->n_batches) break;
            const struct sph_batch *batch = &sph->batch[b];
            sph->batch[b].stale |= end > gas->active[batch->first];
            row = gas->active[batch->first + batch->count - 1];     /* the others of it need no look */
        }
}

static void share_surprise(const struct sim *sim, struct sph *sph)
{
    const int size = comm_size();
    if (size == 1) return;
    double unforeseen = sph->unforeseen;
    comm_max(&unforeseen, 1);
    sph->unforeseen = unforeseen > 0;
    int64_t *bytes = mem_array("sph", int64_t, size), total = 0, before = 0;
    comm_gather_counts(sph->n_touched * (int64_t)sizeof *sph->touched, bytes);
    for (int r = 0; r < size; r++) {
        before += r < comm_rank() ? bytes[r] : 0;
        total += bytes[r];
    }
    struct sph_run *all = mem_alloc("sph", (size_t)total);
    if (sph->n_touched > 0) memcpy((char *)all + before, sph->touched, (size_t)bytes[comm_rank()]);
    comm_gather_all(all, bytes);
    mark_touched(sim, sph, all, total / (int64_t)sizeof *all);
    mem_free(all);
    mem_free(bytes);
    mem_free(sph->touched);
    sph->touched = NULL;
    sph->n_touched = sph->touched_room = 0;
}

/* At the start: how many rows have more neighbours than asked, since h cannot be smaller. */
static void tell_floor(struct sim *sim, const struct sph *sph)
{
    const struct species *gas = &sim->species[GAS];
    double rows = 0;
    if (sim->time.tick > 0 || !(sph->h_min > 0)) return;
    rows_here(sim, GAS_BIT, COL(h), 0);
    for (int64_t a = 0; a < gas->n_active; a++) rows += !(gas->h[gas->active[a]] > (float)sph->h_min);
    comm_sum(&rows, 1);
    if (rows > 0)
        log_warning("sph.h_min = %g: %.0f of %lld rows stand there at the start, with more neighbours, and cost, than asked for",
                    sph->h_min, rows, (long long)gas->n);
}

void sph_smooth(struct sim *sim, void *state)
{
    struct sph *sph = state;
    const struct species *gas = &sim->species[GAS];
    sph_make_batches(sim, sph);
    sph->unforeseen = target_of(sph, gas) < (float)(sph->neighbours + 1);
    if (!sph_uses_device(sim) || !search_on_device(sim, sph)) {
        rows_here(sim, GAS_BIT, COL_ALL, COL_ALL);
        if (sph->grouped == sim->time.tick) sph_fit_h_max(sim);
        sph_for_batches(sim, sph, search_batch);
    }
    share_surprise(sim, sph);
    tell_floor(sim, sph);
}
