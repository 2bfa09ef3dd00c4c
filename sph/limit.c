/* SPDX-License-Identifier: GPL-3.0-or-later
 * Time steps. signal: dt = min(C h / v_sig, eta sqrt(2h/|a|)), v_sig the largest signal velocity
 * towards a neighbour (Monaghan 1997); it does not change under a boost. classic: dt = 0.1
 * min(sqrt(2h/|a|), h/|v|, h/c, u/|du/dt|) (Berczik 1999).
 *
 * Then the steps of neighbours are brought within step_ratio (4) of each other (Saitoh & Makino 2009):
 * the longer one is shortened, and a sleeping row whose step would be too long is woken. Wishes are
 * minima, applied round by round until none is left, so their order does not matter. */
#include "comm.h"
#include "ghosts.h"
#include "mem.h"
#include "module.h"
#include "ranks.h"
#include "sph.h"
#include <math.h>
#include <omp.h>
#include <stdlib.h>
#include <string.h>

static const double classic_factor = 0.1;

static void lessen(struct step_reason *step, double dt, const char *text)
{
    if (dt < step->dt) *step = (struct step_reason){dt, text};
}

static double norm(double x, double y, double z) { return sqrt(x * x + y * y + z * z); }

static void lessen_classic(struct step_reason *step, const struct species *gas, int64_t i, double c, double a)
{
    const double h = (double)gas->h[i], f = classic_factor;
    lessen(step, f * sqrt(2 * h / a), "sqrt(2h/|a|)");
    lessen(step, f * h / norm(gas->vel[i][0], gas->vel[i][1], gas->vel[i][2]), "h/|v|");
    lessen(step, f * h / c, "h/c");
    if (gas->u && gas->du[i] != 0) lessen(step, f * (double)(gas->u[i] / fabsf(gas->du[i])), "u/|du/dt|");
}

void sph_reason(const struct sim *sim, const void *state, const struct species *gas, int64_t i, struct step_reason *step)
{
    const struct sph *sph = state;
    if (gas->kind != GAS) return;
    double h = (double)gas->h[i], c = (double)sph_sound_speed(sph, gas->u ? gas->u[i] : 0, gas->rho[i]);
    double a = norm((double)gas->acc[i][0], (double)gas->acc[i][1], (double)gas->acc[i][2]);
    if (sim->time.classic) {
        lessen_classic(step, gas, i, c, a);
        return;
    }
    lessen(step, sph->courant * h / fmax(2 * c, (double)gas->signal[i]), "sph.courant");
    lessen(step, sph->acceleration * sqrt(2 * h / a), "sph.acceleration");
}

/* Lists of (row, rung): a row is asked to go no higher than that rung. */
struct wish { int32_t row; uint8_t rung; };
struct wishes { struct wish *list; int64_t n, capacity; };

static void add_wish(struct wishes *w, int32_t row, int rung)
{
    if (w->n == w->capacity) {
        w->capacity = 2 * w->capacity + 64;
        w->list = mem_resize("sph", w->list, (size_t)w->capacity * sizeof *w->list);
    }
    w->list[w->n++] = (struct wish){row, (uint8_t)rung};
}

/* Rows to compare with their neighbours: rows, ascending, in batches. */
struct company { const int32_t *row; struct sph_batch *batch; int32_t n; };

/* The rungs that rows are about to have, and by how much those of neighbours may differ. */
struct terms { const uint8_t *rung; int levels; };
static struct terms terms_of(const struct sim *sim, const struct sph *sph)
{ return (struct terms){sim->species[GAS].next_rung, sph->levels}; }

/* Rungs beyond these are uneven with that of some of the rows. */
static struct sph_rungs even_with(struct sph_region rows, struct terms terms)
{
    struct sph_rungs even = {terms.rung, 0, UINT8_MAX};
    for (int r = 0; r < rows.n; r++) {
        int own = terms.rung[rows.row[r]];
        even.low = own - terms.levels > even.low ? own - terms.levels : even.low;
        even.high = own + terms.levels < even.high ? own + terms.levels : even.high;
    }
    return even;
}

/* A row with the entries of the tile that are listed. */
static void compare_row(const struct sph_work *work, struct terms terms, int32_t i, struct sph_place own, int n,
                        struct wishes *wishes)
{
    const float h = 2 * own.half_h;
    const uint8_t *rung = terms.rung;
    const int levels = terms.levels;
    for (int e = 0; e < n; e++) {
        int k = work->tile.list[e];
        int32_t j = work->row[k];
        if (rung[j] <= rung[i] + levels && rung[i] <= rung[j] + levels) continue;
        float reach = work->meet.own * h + fmaxf(work->meet.least * h, work->tile.reach[k]);
        if (sph_gap(own, work->tile.place[k]).r2 > reach * reach) continue;
        if (rung[j] > rung[i]) add_wish(wishes, j, rung[i] + levels);
        else add_wish(wishes, i, rung[j] + levels);
    }
}

/* Rows with the tile, a cluster at a time. */
static void compare_tile(struct sph_work *work, const struct sim *sim, const struct sph *sph, struct sph_region rows,
                         struct wishes *wishes)
{
    const struct terms terms = terms_of(sim, sph);
    const struct sph_meet meet = work->meet;
    sph_enclose(sph, work, work->tile.n > 0 ? rows.n : 0);
    for (int r = 0; work->tile.n > 0 && r < rows.n; r += SPH_LANES) {
        struct sph_region cluster = {rows.row + r, rows.n - r < SPH_LANES ? rows.n - r : SPH_LANES};
        struct sph_lanes lanes;
        float h = sph_largest_h(sim, cluster);
        struct sph_box box = sph_lanes_fill(&lanes, work, sim, cluster);
        int n = sph->loops->filter(&work->tile, box, meet.own * h, meet.least * h);
        for (int l = 0; n > 0 && l < cluster.n; l++) {
            struct sph_place own = {.x = lanes.x[l], .y = lanes.y[l], .z = lanes.z[l], .half_h = lanes.half_h[l]};
            compare_row(work, terms, cluster.row[l], own, n, wishes);
        }
    }
}

/* Compares the rows of a batch with those of their neighbours that are uneven with any of them: nearly always few. False if
 * rows of other ranks are missing. */
static bool compare_batch(struct sph_work *work, const struct sim *sim, const struct sph *sph, const int32_t *row,
                          const struct sph_batch *batch, struct wishes *wishes)
{
    const struct sph_region rows = {row + batch->first, batch->count};
    const struct sph_rungs even = even_with(rows, terms_of(sim, sph));
    if (batch->list >= 0) {
        int n = sph_list_rows(work, sph, batch, &even);
        if (n == 0) return true;
        sph_centre(work, sim, batch->node, rows);
        sph_stage(work, sim, n);
        compare_tile(work, sim, sph, rows, wishes);
        return true;
    }
    struct sph_reach reach = sph_mutual(sph, sph_largest_h(sim, rows));
    reach.beyond = &even;
    sph_centre(work, sim, batch->node, rows);
    for (int64_t skip = 0; skip == 0 || work->more; skip += SPH_TILE) {
        sph_gather(work, sim, reach, skip);
        if (work->missing) return false;
        compare_tile(work, sim, sph, rows, wishes);
    }
    return true;
}

/* Grants wishes for rows that are here, and appends the own ones that changed. */
static void grant(const struct species *gas, const struct wishes *wishes, struct wishes *granted)
{
    for (int64_t w = 0; w < wishes->n; w++) {
        struct wish wish = wishes->list[w];
        const bool own = wish.row >= gas->own && wish.row < gas->own + gas->n_own;
        if ((gas->spread && !own) || wish.rung >= gas->next_rung[wish.row]) continue;
        gas->next_rung[wish.row] = wish.rung;
        if (own) add_wish(granted, wish.row, wish.rung);
    }
}

/* Those that must wait for rows of other ranks once more. */
static void compare(struct sim *sim, struct sph *sph, struct company company, struct wishes *wishes)
{
    for (int32_t b = 0; b < company.n; b++) company.batch[b].waiting = true;
    do {
#pragma omp parallel if (company.n > 1)
        {
            struct wishes mine = {0};
#pragma omp for schedule(dynamic, 4) nowait
            for (int32_t b = 0; b < company.n; b++)
                if (company.batch[b].waiting)
                    company.batch[b].waiting = !compare_batch(sph->work[omp_get_thread_num()], sim, sph, company.row,
                                                              &company.batch[b], &mine);
#pragma omp critical(sph_wishes)
            for (int64_t w = 0; w < mine.n; w++) add_wish(wishes, mine.list[w].row, mine.list[w].rung);
            mem_free(mine.list);
        }
    } while (ghosts_open(sim));
}

static int by_number(const void *a, const void *b)
{
    const int32_t *x = a, *y = b;
    return (*x > *y) - (*x < *y);
}

/* Rows that have just been granted a wish may be uneven with others now. */
static void compare_granted(struct sim *sim, struct sph *sph, const struct wish *granted, int64_t n, struct wishes *wishes)
{
    int32_t *row = mem_array("sph", int32_t, n);
    int64_t rows = 0;
    for (int64_t w = 0; w < n; w++) row[w] = granted[w].row;
    if (n > 1) qsort(row, (size_t)n, sizeof *row, by_number);
    for (int64_t w = 0; w < n; w++)
        if (w == 0 || row[w] != row[w - 1]) row[rows++] = row[w];
    struct sph_batch *batch = mem_array("sph", struct sph_batch, sph_most_batches(sph, rows));
    compare(sim, sph, (struct company){row, batch, sph_divide(sim, sph, row, rows, batch)}, wishes);
    mem_free(batch);
    mem_free(row);
}

/* What is granted becomes the step of an active row, or wakes a sleeping one; if suddenly, for a step that counts from now.
 * A row may come twice: one that was just woken can look active, but its step is not used then. */
static void apply(const struct sim *sim, int32_t i)
{
    const struct species *gas = &sim->species[GAS];
    uint8_t rung = gas->next_rung[i];
    float step = nextafterf((float)timeline_seconds(&sim->time, (int64_t)1 << gas->next_rung[i]), INFINITY);
    if (timeline_active(&sim->time, gas->rung[i])) {
        gas->dt[i] = fminf(gas->dt[i], step);
        return;
    }
    while (timeline_sudden(rung, gas->rung0[i]) && !timeline_divides(sim->time.tick, rung)) rung--;
    gas->rung[i] = rung;
}

/* Every rank learns the wishes of all; their number. */
static int64_t share_wishes(struct wishes *wishes)
{
    int size = comm_size();
    if (size == 1) return wishes->n;
    int64_t *bytes = mem_array("sph", int64_t, size), total = 0, before = 0;
    comm_gather_counts(wishes->n * (int64_t)sizeof *wishes->list, bytes);
    for (int r = 0; r < size; r++) {
        if (r < comm_rank()) before += bytes[r];
        total += bytes[r];
    }
    struct wish *all = mem_alloc("sph", (size_t)total + 1);
    if (wishes->n > 0) memcpy((char *)all + before, wishes->list, (size_t)bytes[comm_rank()]);
    comm_gather_all(all, bytes);
    mem_free(wishes->list);
    mem_free(bytes);
    wishes->list = all;
    wishes->n = wishes->capacity = total / (int64_t)sizeof *all;
    return wishes->n;
}

/* Each rank compares its own rows, until no row of any rank is asked for anything. */
static void even_out(struct sim *sim, struct sph *sph)
{
    const struct species *gas = &sim->species[GAS];
    struct wishes wishes = {0}, granted = {0};
    compare(sim, sph, (struct company){gas->active, sph->batch, sph->n_batches}, &wishes);
    for (int64_t done = 0; share_wishes(&wishes) > 0;) {
        grant(gas, &wishes, &granted);
        ghosts_share(sim, (uint64_t)1 << COLUMN_next_rung);
        wishes.n = 0;
        const int64_t end = granted.n;
        compare_granted(sim, sph, granted.list + done, end - done, &wishes);
        done = end;
    }
    for (int64_t w = 0; w < granted.n; w++) apply(sim, granted.list[w].row);
    mem_free(wishes.list);
    mem_free(granted.list);
}

static void bring_near(struct sim *sim, struct sph *sph)
{
    const struct species *gas = &sim->species[GAS];
    if (!gas->spread) ranks_share(sim, (uint64_t)1 << COLUMN_dt);
    memcpy(gas->next_rung + species_from(gas), gas->rung + species_from(gas), (size_t)(species_to(gas) - species_from(gas)));
    for (int64_t e = 0; e < gas->n_ending; e++) {
        int32_t i = gas->ending[e];
        int rung = timeline_rung(&sim->time, (double)gas->dt[i]);
        gas->next_rung[i] = (uint8_t)(rung > 0 ? rung : 0);
    }
    ghosts_share(sim, (uint64_t)1 << COLUMN_next_rung | (uint64_t)1 << COLUMN_pos);
    even_out(sim, sph);
}

void sph_limit(struct sim *sim, void *state)
{
    struct sph *sph = state;
    const struct species *gas = &sim->species[GAS];
    uint64_t reads = COL(h) | COL(u) | COL(rho) | COL(acc) | COL(signal), writes = COL(dt);
    if (sim->time.classic) reads |= COL(vel) | COL(du);
    if (!sim->time.common) {
        reads |= COL_MOTION | COL(mass) | COL(div_v);
        writes |= COL(next_rung) | COL(rung);
    }
    rows_here(sim, GAS_BIT, reads, writes);
#pragma omp parallel for
    for (int64_t a = 0; a < gas->n_active; a++) {
        int32_t i = gas->active[a];
        struct step_reason step = {(double)gas->dt[i], NULL};
        sph_reason(sim, sph, gas, i, &step);
        gas->dt[i] = fminf(gas->dt[i], (float)step.dt);
    }
    if (!sim->time.common && gas->all_ending > 0) bring_near(sim, sph);
    if (timeline_synchronous(&sim->time)) sph_drop_lists(sph);
}
