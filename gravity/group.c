/* SPDX-License-Identifier: GPL-3.0-or-later
 * A group of target rows: staged with the sources that act on them, summed, written back. */
#include "cell.h"
#include "walk.h"
#include <math.h>
#include <string.h>

enum { TILE = 1024 };

void walk_open(struct walk *w, struct sim *sim, const struct gravity *g, enum gravity_output output)
{
    static const double binomial[] = {1, 1, 3, 3, 6, 10, 15};   /* (order over 2); tree keeps order 3 */
    w->sim = sim;
    w->g = g;
    w->output = output;
    w->potential = output == OUTPUT_POTENTIAL || (output == OUTPUT_FORCE && sim->want_potential);
    w->theta = g->opening.theta * g->scale;
    w->alpha = g->opening.alpha * g->scale;
    w->quadrupole = (float)(1 / binomial[g->opening.order]);
    w->pairs = w->cells = w->again.n = 0;
    if (w->sources.row) return;
    w->sources.capacity = TILE;
    w->sources.row = mem_array("gravity", struct gravity_source, TILE);
    w->sources.soft = mem_array("gravity", float, TILE);
}

void walk_close(struct walk *w)
{
    void *block[] = {w->waiting.item, w->parents.item, w->parents_far.item, w->opened.item, w->opened_far.item,
                     w->local.item, w->near.item, w->far.item, w->verdict.item, w->path.item, w->again.item, w->row,
                     w->own.row, w->own.soft, w->sources.row, w->sources.soft,
                     w->targets.x, w->targets.y, w->targets.z, w->targets.soft, w->targets.own,
                     w->targets.ax, w->targets.ay, w->targets.az, w->targets.depth};
    for (size_t i = 0; i < sizeof block / sizeof *block; i++) mem_free(block[i]);
}

static void reserve_targets(struct walk *w, int n)
{
    struct gravity_targets *t = &w->targets;
    n = (n + GRAVITY_LANES_MAX - 1) / GRAVITY_LANES_MAX * GRAVITY_LANES_MAX;
    if (n <= t->capacity) return;
    t->capacity = n;
    float **const floats[] = {&t->x, &t->y, &t->z, &t->soft};
    double **const doubles[] = {&t->ax, &t->ay, &t->az, &t->depth};
    for (int k = 0; k < 4; k++) {
        *floats[k] = mem_resize("gravity", *floats[k], (size_t)n * sizeof(float));
        *doubles[k] = mem_resize("gravity", *doubles[k], (size_t)n * sizeof(double));
    }
    t->own = mem_resize("gravity", t->own, (size_t)n * sizeof *t->own);
    w->row = mem_resize("gravity", w->row, (size_t)n * sizeof *w->row);
}

static void reserve_own(struct gravity_sources *own, int64_t n)
{
    own->n = 0;
    if (n <= own->capacity) return;
    own->capacity = (int)n;
    own->row = mem_resize("gravity", own->row, (size_t)n * sizeof *own->row);
    own->soft = mem_resize("gravity", own->soft, (size_t)n * sizeof *own->soft);
}

static void add_target(struct walk *w, int s, int64_t i, int own)
{
    struct gravity_targets *t = &w->targets;
    int n = t->n++;
    const struct gravity_source row = w->own.row[own];
    t->x[n] = row.x;
    t->y[n] = row.y;
    t->z[n] = row.z;
    t->soft[n] = w->own.soft[own];
    t->own[n] = own;
    w->row[n] = (struct row){s, (int32_t)i};
}

/* Idle lanes repeat the first target, so that nothing in them can overflow. */
static void fill_lanes(struct gravity_targets *t)
{
    int end = (t->n + GRAVITY_LANES_MAX - 1) / GRAVITY_LANES_MAX * GRAVITY_LANES_MAX;
    for (int i = t->n; i < end; i++) {
        t->x[i] = t->x[0];
        t->y[i] = t->y[0];
        t->z[i] = t->z[0];
        t->soft[i] = t->soft[0];
        t->own[i] = t->own[0];
    }
    double *const sums[] = {t->ax, t->ay, t->az, t->depth};
    for (int k = 0; k < 4; k++) memset(sums[k], 0, (size_t)end * sizeof(double));
}

/* Sources act on the targets; with potentials wanted, the group's own rows by a kernel of their own. */
static void sum_rows(struct walk *w, const struct gravity_sources *s, bool own)
{
    const struct gravity *g = w->g;
    const struct gravity_pair_table *table = g->kernels->pair;
    /* Over the few pairs of a lone row errors do not average out. */
    const enum gravity_refinement refinement = w->lone ? GRAVITY_REFINED : gravity_refinement(g);
    gravity_pair_sum *const *forms = (w->potential ? own ? table->own : table->pot : table->acc)[refinement];
    forms[g->pair_form](&w->targets, s);
    w->pairs += (int64_t)w->targets.n * s->n;
}

static void evaluate(struct walk *w)
{
    if (w->sources.n > 0) sum_rows(w, &w->sources, false);
    w->sources.n = 0;
}

/* All rows of the cell act; those that are targets: `only`, or, if it is NULL, the active own ones. */
static void begin(struct walk *w, const double centre[3], double unit, const struct node *node, const struct row *only)
{
    int64_t rows = node_rows(node, ALL_SPECIES);
    w->stage = stage_at(w->sim, w->g, centre, w->g->unit);
    reserve_own(&w->own, rows);
    reserve_targets(w, (int)rows);
    w->lone = only != NULL;
    w->targets.n = 0;
    w->targets.unit = (float)(w->g->unit / unit);
    w->own.soft2 = w->sources.soft2 = (float)(w->g->far_soft2 / (w->g->unit * w->g->unit));
    const struct timeline *time = &w->sim->time;
    for (int k = 0; k < N_SPECIES; k++) {
        const struct species *s = &w->sim->species[k];
        int64_t from = node->first[k], to = from + node->count[k];
        int before = w->own.n;
        stage_sources(&w->stage, &w->own, s, from, to);
        if (only && only->species == k) add_target(w, k, only->index, before + (int)(only->index - from));
        for (int64_t i = from; i < to && !only; i++)
            if (i >= s->own && i < s->own + s->n_own && timeline_active(time, s->rung[i]))
                add_target(w, k, i, before + (int)(i - from));
    }
    fill_lanes(&w->targets);
    sum_rows(w, &w->own, true);
}

void walk_begin_group(struct walk *w, const double centre[3], double unit, const struct node *node)
{ begin(w, centre, unit, node, NULL); }

void walk_begin_row(struct walk *w, const double centre[3], double unit, const struct node *node, struct row row)
{ begin(w, centre, unit, node, &row); }

void walk_add_field(struct walk *w, const double field[4])
{
    const struct gravity_targets *t = &w->targets;
    const double unit = (double)t->unit, area = unit * unit;
    t->depth[0] += unit * field[0];
    t->ax[0] += area * field[1];
    t->ay[0] += area * field[2];
    t->az[0] += area * field[3];
}

void walk_add_local(struct walk *w, const float *local)
{
    static const float factorial[] = {1, 1, 2, 6, 24, 120, 720};
    const int order = w->g->opening.order;
    float scaled[CELL_TERMS_MAX];
    for (int n = 0; n <= order; n++)
        for (int a = n; a >= 0; a--)
            for (int b = n - a; b >= 0; b--) {
                int i = CELL_INDEX(a, b, n - a - b);
                scaled[i] = local[i] / (factorial[a] * factorial[b] * factorial[n - a - b]);
            }
    w->g->kernels->far->at_targets[order - GRAVITY_ORDER_MIN](&w->targets, scaled);
}

void walk_add_range(struct walk *w, const struct species *s, int64_t from, int64_t to)
{
    while (from < to) {
        int64_t room = w->sources.capacity - w->sources.n, end = to - from < room ? to : from + room;
        stage_sources(&w->stage, &w->sources, s, from, end);
        if (w->sources.n == w->sources.capacity) evaluate(w);
        from = end;
    }
}

static void add_leaf(struct walk *w, int32_t n)
{
    const struct gravity *g = w->g;
    const struct gravity_leaf *leaf = gravity_rows_leaf(w->sim, g, n);
    struct gravity_sources *to = &w->sources;
    float shift[3];
    for (int k = 0; k < 3; k++) shift[k] = (float)((g->cell[n].pos[k] - w->stage.frame.centre[k]) * w->stage.frame.inverse);
    for (int from = 0; from < leaf->n;) {
        int room = to->capacity - to->n, rows = leaf->n - from < room ? leaf->n - from : room;
        g->kernels->pair->shift(to->row + to->n, g->row + leaf->first + from, shift, rows);
        if (g->pair_form != SOFT_COMMON) memcpy(to->soft + to->n, g->soft + leaf->first + from, (size_t)rows * sizeof *to->soft);
        to->n += rows;
        from += rows;
        if (to->n == to->capacity) evaluate(w);
    }
}

void walk_add_leaves(struct walk *w, const struct list *leaves, int32_t own)
{
    for (int64_t i = 0; i < leaves->n; i++)
        if (leaves->item[i] != own) add_leaf(w, leaves->item[i]);
}

void walk_end_group(struct walk *w)
{
    evaluate(w);
    const struct gravity_targets *t = &w->targets;
    const double per_length = w->stage.frame.inverse, per_area = per_length * per_length;
    for (int i = 0; i < t->n; i++) {
        const struct species *s = &w->sim->species[w->row[i].species];
        int32_t n = w->row[i].index;
        double a[3] = {per_area * t->ax[i], per_area * t->ay[i], per_area * t->az[i]};
        if (s->grav) s->grav[n] = (float)sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
        for (int k = 0; k < 3 && w->output == OUTPUT_FORCE; k++) s->acc[n][k] += (float)a[k];
        if (w->potential) s->pot[n] = (float)(-per_length * t->depth[i]);
    }
}
