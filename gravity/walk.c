/* SPDX-License-Identifier: GPL-3.0-or-later
 * The walk of `tree` and `fmm`: top down over target cells, each with a list of source cells that it
 * inherits. A source is accepted for the target cell as a whole, or opened, or handed down to the
 * target's children. A target that is a group (Makino 1991) settles what is left: cells acting on
 * its rows one by one, and rows.
 *   tree: accepted cells act on the rows of every group below; opening by an angle.
 *   fmm:  accepted cells go into the target's local expansion, which is passed down; opening by the
 *         error it makes against the least acceleration in the target (Dehnen 2014, section 3). A
 *         cell refused that way may still act on the rows of a group: summed over the many cells of
 *         a dense region, the local expansions of a large sparse group err with one sign. Opening such
 *         a source would only let each of its pieces pass with the same error of the target's size in
 *         all: what is within it acts on the rows.
 * A task is a cell with its path from the root walked anew, so that every group sees the same lists
 * in the same order whatever the number of threads and ranks. A target with few active rows serves each of them on its own
 * (walk_row.c). A target that needs what another rank has not sent yet becomes a task of the next round. */
#include "walk.h"
#include "cell.h"
#include "ghosts.h"
#include "mem.h"
#include <math.h>
#include <omp.h>
#include <string.h>

/* Sides and angles of the openings of fmm: measured, see doc/manual/gravity.md. */
static const float theta_local = 0.9f;      /* (reach + radius) / distance */
static const float theta_target = 0.6f;     /* radius / distance */
static const float theta_cell = 0.95f;      /* reach / distance from the box, cell on rows */
static const float theta_first = 0.7f;      /* both, as long as no acceleration is known */
static const float open_ratio = 1.5f;       /* a source this much larger than the target is opened */

/* Powers of two near the radius, but not so small that powers of distances overflow. */
static double unit_of(double radius, double parent_unit)
{
    int exponent;
    frexp(fmax(radius, parent_unit / 1024), &exponent);
    return radius > 0 || parent_unit > 0 ? ldexp(1, exponent) : 1;
}

/* The target as a source is: a sphere about its centre of mass. What is decided of two cells is then the same from both
 * sides, bit for bit, and so are, but for their rounding, their forces: an expansion of order P about a centre of mass
 * holds M_m of the target times D_(m+k+1) times M_k of the source for all m + k < P (Dehnen 2002). */
static void make_mutual(const struct walk *w, struct gravity_view *v, double parent_unit)
{
    const struct gravity *g = w->g;
    const struct gravity_cell *cell = &g->cell[v->cell];
    const double before = v->unit;
    memcpy(v->centre, w->sim->tree.node[v->cell].pos, sizeof v->centre);
    v->unit = unit_of((double)cell->reach, parent_unit);
    const float factor = (float)(before / v->unit);
    v->radius = (float)((double)cell->reach / v->unit);
    v->support *= factor;
    v->near2 *= factor * factor;
    v->self = cell;
    v->parent = w->sim->tree.node[v->cell].parent;
    v->least = g->known ? g->least : NULL;
    v->alpha = g->known ? (float)(w->alpha * v->unit * v->unit) : INFINITY;
}

struct gravity_view walk_view(const struct walk *w, int32_t n, double parent_unit)
{
    const struct gravity *g = w->g;
    const struct node *node = &w->sim->tree.node[n];
    struct gravity_view v = {.cell = n, .group = gravity_is_group(g, node), .quadrupole = w->quadrupole};
    double half[3], r2 = 0;
    for (int k = 0; k < 3; k++) {
        v.centre[k] = node->pos[k] + 0.5 * ((double)node->high[k] + (double)node->low[k]);
        half[k] = 0.5 * ((double)node->high[k] - (double)node->low[k]);
        r2 += half[k] * half[k];
    }
    v.unit = unit_of(sqrt(r2), parent_unit);
    double unit1 = 1 / v.unit;
    for (int k = 0; k < 3; k++) v.half[k] = (float)(half[k] * unit1);
    v.radius = (float)(sqrt(r2) * unit1);
    v.h_max = g->adaptive ? w->sim->tree.h_max : NULL;
    v.support = (float)(fmax(g->support, g->adaptive ? 2 * (double)v.h_max[n] : 0) * unit1);
    v.near2 = (float)(g->near2 * unit1 * unit1);
    v.open_ratio = open_ratio;
    v.tolerance = g->known && g->least ? (float)(w->alpha * (double)g->least[n] * v.unit * v.unit) : INFINITY;
    if (g->opening.solver == SOLVER_FMM) {
        v.theta2 = g->known ? theta_local * theta_local : theta_first * theta_first;
        v.theta2_cell = g->known ? theta_cell * theta_cell : theta_first * theta_first;
        v.theta2_target = theta_target * theta_target;
    } else {
        v.theta2 = (float)(w->theta * w->theta);
    }
    if (g->mutual && g->opening.solver == SOLVER_FMM) make_mutual(w, &v, parent_unit);
    return v;
}

/* A group must meet itself whole in its list. */
static bool is_inside(const struct walk *w, int32_t s, int32_t target)
{
    const struct gravity_leaf *a = &w->g->leaf[s], *b = &w->g->leaf[target];
    return a->first >= b->first && a->first + a->n <= b->first + b->n;
}

/* How far a reply is likely to be needed: a cell acts as a whole beyond about this part of its distance. */
static const float likely_angle = 0.9f;

/* Asks for a cell's children, or its rows, on behalf of a target. */
static void want(struct walk *w, int32_t target, int32_t source, bool rows)
{
    const struct node *node = &w->sim->tree.node[target];
    const bool large = node->place != NODE_OWN;
    struct ghost_want want = {.angle = likely_angle, .leaf = w->g->opening.leaf_size, .domain = large && w->domain,
                              .rows = gravity_ghost_rows(w->g)};
    for (int k = 0; k < 3; k++) {
        want.low[k] = large ? w->low[k] : node->pos[k] + (double)node->low[k];
        want.high[k] = large ? w->high[k] : node->pos[k] + (double)node->high[k];
    }
    ghosts_want(w->sim, source, rows, &want);
    w->missing = true;
}

/* The children of these cells are judged next; but a group waits whole for itself. */
static void open_parents(struct walk *w, const struct gravity_view *v, const struct list *parents, struct list *opened)
{
    for (int64_t i = 0; i < parents->n; i++) {
        const int32_t s = parents->item[i];
        const struct gravity_cell *cell = &w->g->cell[s];
        if (cell->group && is_inside(w, s, v->cell)) {
            if (s != v->cell) list_add(&w->waiting, s);
            continue;
        }
        if (cell->child < 0) {
            want(w, v->cell, s, false);
            continue;
        }
        list_reserve(opened, opened->n + cell->n_children);
        for (int c = 0; c < cell->n_children; c++) opened->item[opened->n++] = cell->child + c;
    }
}

/* Judges source[0, n), which lies in `list` from `from` on, and sorts it by verdict: without a branch,
 * since verdicts cannot be foretold. */
static void judge(struct walk *w, const struct gravity_view *v, const struct list *list, int64_t from, int64_t n)
{
    struct list *const out[GRAVITY_VERDICTS] = {&w->local, &w->far, &w->near, &w->waiting, &w->parents, &w->parents_far};
    const struct gravity_judge_table *table = w->g->kernels->judge;
    int32_t *item[GRAVITY_VERDICTS];
    int64_t count[GRAVITY_VERDICTS];
    w->parents.n = w->parents_far.n = 0;
    list_reserve(&w->verdict, n + GRAVITY_LANES_MAX);
    for (int k = 0; k < GRAVITY_VERDICTS; k++) {
        list_reserve(out[k], out[k]->n + n);
        item[k] = out[k]->item;
        count[k] = out[k]->n;
    }
    const int32_t *source = list->item + from, *verdict = w->verdict.item;
    const int order = w->g->opening.order - GRAVITY_ORDER_MIN;
    gravity_judge *const rule = w->g->opening.solver == SOLVER_TREE ? table->tree[w->g->adaptive]
        : (v->self ? table->mutual : table->fmm)[w->g->adaptive][order];
    rule(w->verdict.item, v, w->g->cell, source, n);
    for (int64_t i = 0; i < n; i++) item[verdict[i]][count[verdict[i]]++] = source[i];
    for (int k = 0; k < GRAVITY_VERDICTS; k++) out[k]->n = count[k];
    open_parents(w, v, &w->parents, &w->opened);
    open_parents(w, v, &w->parents_far, &w->opened_far);
}

/* Judges a list that grows meanwhile. */
static void judge_opened(struct walk *w, const struct gravity_view *v, const struct list *opened)
{
    for (int64_t done = 0; done < opened->n;) {
        int64_t n = opened->n - done;
        judge(w, v, opened, done, n);
        done += n;
    }
}

void walk_judge(struct walk *w, const struct gravity_view *v, int64_t from, int64_t to)
{
    w->local.n = w->near.n = w->opened.n = w->opened_far.n = 0;
    w->waiting.n = to;
    judge(w, v, &w->waiting, from, to - from);
    judge_opened(w, v, &w->opened);
    struct gravity_view far = *v;
    far.no_local = 1;
    judge_opened(w, &far, &w->opened_far);
}

struct gravity_far walk_far(const struct walk *w, const struct gravity_view *v, const struct list *list)
{
    return (struct gravity_far){
        .cell = w->g->cell, .moment = w->sim->tree.moment, .width = w->sim->tree.width[NODE_moment],
        .list = list->item, .n = (int)list->n, .centre = {v->centre[0], v->centre[1], v->centre[2]}, .scale = v->unit,
        .soft2 = (float)(w->g->far_soft2 / (v->unit * v->unit))};
}

void walk_inherit(float *local, const float *parent, const struct gravity_view *from,
                  const struct gravity_view *to, int order)
{
    double t[CELL_TERMS_MAX], factor = to->unit / from->unit, scale = 1;
    for (int i = 0; i < CELL_TERMS(order + 1); i++) t[i] = (double)parent[i];
    struct cell_vector e = {(to->centre[0] - from->centre[0]) / from->unit, (to->centre[1] - from->centre[1]) / from->unit,
                            (to->centre[2] - from->centre[2]) / from->unit};
    switch (order) {
    case 3: cell_shift_local(t, e, 3); break;
    case 4: cell_shift_local(t, e, 4); break;
    case 5: cell_shift_local(t, e, 5); break;
    default: cell_shift_local(t, e, 6); break;
    }
    for (int n = 0; n <= order; n++) {
        scale *= factor;
        for (int i = CELL_TERMS(n); i < CELL_TERMS(n + 1); i++) local[i] = (float)(scale * t[i]);
    }
}

void walk_want_rows(struct walk *w, int32_t target)
{
    for (int64_t i = 0; i < w->near.n; i++)
        if (!ghosts_have_rows(w->sim, w->near.item[i], gravity_ghost_rows(w->g))) want(w, target, w->near.item[i], true);
}

static void settle_group(struct walk *w, const struct gravity_view *v, const float *local)
{
    const struct node *node = &w->sim->tree.node[v->cell];
    walk_begin_group(w, v->centre, v->unit, node);
    struct gravity_far far = walk_far(w, v, &w->far);
    const struct gravity_far_table *table = w->g->kernels->far;
    if (local) walk_add_local(w, local);
    if (far.n > 0) (w->g->opening.order > 1 ? table->quadrupoles : table->monopoles)[w->potential](&w->targets, &far);
    walk_add_leaves(w, &w->near, v->cell);
    w->cells += (far.n) * (int64_t)w->targets.n;
    walk_end_group(w);
}

/* The child on the way down to w->task, or -1 at or below it. */
static int32_t next_on_path(const struct walk *w, int32_t n)
{
    for (int64_t i = w->path.n - 1; i > 0; i--)
        if (w->path.item[i] == n) return w->path.item[i - 1];
    return -1;
}

static void descend(struct walk *w, int32_t n, int64_t from, int64_t to, const struct gravity_view *parent,
                    const float *above)
{
    if (w->sim->tree.active_count[n] == 0) return;
    const bool fmm = w->g->opening.solver == SOLVER_FMM;
    if (fmm && w->g->known && walk_has_few(w, n)) {     /* above the task, those of the task alone */
        walk_rows(w, next_on_path(w, n) >= 0 ? w->path.item[0] : n, &(struct walk_inherited){from, to, parent, above});
        return;
    }
    struct gravity_view v = walk_view(w, n, parent ? parent->unit : 0);
    float local[CELL_TERMS_MAX] = {0};
    int64_t far_before = w->far.n;
    walk_judge(w, &v, from, to);
    if (v.group && w->sim->spread) walk_want_rows(w, n);
    if (w->missing) {   /* above the task other tasks are there for what is beside it */
        list_add(&w->again, next_on_path(w, n) >= 0 ? w->path.item[0] : n);
        w->missing = false;
        w->far.n = far_before;
        return;
    }
    if (fmm) {
        int order = w->g->opening.order;
        if (parent) walk_inherit(local, above, parent, &v, order);
        struct gravity_far list = walk_far(w, &v, &w->local);
        if (list.n > 0) w->g->kernels->far->to_local[order - GRAVITY_ORDER_MIN](local, &list);
        w->cells += list.n;
    }
    if (v.group) {
        settle_group(w, &v, fmm ? local : NULL);
    } else {
        const struct node *node = &w->sim->tree.node[n];
        int32_t only = next_on_path(w, n);
        int64_t end = w->waiting.n;
        for (int32_t c = node->child; c < node->child + node->n_children; c++)
            if (only < 0 || c == only) descend(w, c, to, end, &v, local);
    }
    w->far.n = far_before;
}

/* Everything below one cell, from the root down. */
static void walk_task(struct walk *w, int32_t task)
{
    w->path.n = 0;
    for (int32_t n = task; n >= 0; n = w->sim->tree.node[n].parent) list_add(&w->path, n);
    w->waiting.n = w->far.n = 0;
    list_add(&w->waiting, 0);
    descend(w, 0, 0, 1, NULL, NULL);
}

/* Of the active rows; and whether they are so many that most of what the domain needs will be needed. */
static bool frame_active(const struct sim *sim, double low[3], double high[3])
{
    enum { FEW = 8 };
    int64_t active = 0, own = 0;
    for (int k = 0; k < 3; k++) {
        low[k] = INFINITY;
        high[k] = -INFINITY;
    }
    for_species(sim, s) {
        active += s->n_active;
        own += s->n_own;
        for (int64_t a = 0; a < s->n_active; a++)
            for (int k = 0; k < 3; k++) {
                low[k] = fmin(low[k], s->pos[s->active[a]][k]);
                high[k] = fmax(high[k], s->pos[s->active[a]][k]);
            }
    }
    return FEW * active > own;
}

static void reserve_walks(struct gravity *g, int threads)
{
    if (threads <= g->n_walks) return;
    g->walk = mem_resize("gravity", g->walk, (size_t)threads * sizeof *g->walk);
    memset(g->walk + g->n_walks, 0, (size_t)(threads - g->n_walks) * sizeof *g->walk);
    g->n_walks = threads;
}

void gravity_walk_free(struct gravity *g)
{
    for (int k = 0; k < g->n_walks; k++) walk_close(&g->walk[k]);
    mem_free(g->walk);
}

/* Walks these tasks; those that must be walked again come into `again`. */
static void walk_tasks(struct sim *sim, struct gravity *g, enum gravity_output output, const struct list *task, struct list *again)
{
    int64_t pairs = 0, cells = 0;
    double low[3], high[3];
    const bool domain = sim->spread && frame_active(sim, low, high);
    int32_t n_everywhere;
    int64_t *everywhere = walk_count_active(sim, g->opening.solver == SOLVER_FMM && g->known, &n_everywhere);
    reserve_walks(g, omp_get_max_threads());
#pragma omp parallel reduction(+ : pairs, cells)
    {
        struct walk *const w = &g->walk[omp_get_thread_num()];
        walk_open(w, sim, g, output);
        w->domain = domain;
        w->everywhere = everywhere;
        w->n_everywhere = n_everywhere;
        for (int k = 0; k < 3 && sim->spread; k++) {
            w->low[k] = low[k];
            w->high[k] = high[k];
        }
#pragma omp for schedule(dynamic, 1)
        for (int64_t i = 0; i < task->n; i++) walk_task(w, task->item[i]);
#pragma omp critical(gravity_again)
        for (int64_t i = 0; i < w->again.n; i++) list_add(again, w->again.item[i]);
        pairs += w->pairs;
        cells += w->cells;
    }
    mem_free(everywhere);
    g->pairs += pairs;
    g->cells += cells;
}

/* Asks at once for what the targets above all tasks are likely to need. */
static void walk_ahead(struct sim *sim, struct gravity *g)
{
    struct ghost_want want = {.angle = likely_angle, .leaf = g->opening.leaf_size, .rows = gravity_ghost_rows(g)};
    want.domain = frame_active(sim, want.low, want.high);
    for (int32_t n = 0; n < sim->tree.n_top && want.low[0] <= want.high[0]; n++)
        if (sim->tree.node[n].place == NODE_AWAY && node_is_closed(&sim->tree.node[n])) ghosts_want(sim, n, false, &want);
    if (ghosts_open(sim)) gravity_moments_open(sim, g);
}

/* Cells with at most so many active rows, in the order of the keys. */
static void list_tasks(const struct sim *sim, const struct gravity *g, int32_t n, int64_t most, struct list *task)
{
    const struct node *node = &sim->tree.node[n];
    const int64_t active = sim->tree.active_count[n];
    if (active == 0) return;
    if (active <= most || gravity_is_group(g, node)) list_add(task, n);
    else
        for (int32_t c = node->child; c < node->child + node->n_children; c++) list_tasks(sim, g, c, most, task);
}

void gravity_walk(struct sim *sim, struct gravity *g, enum gravity_output output)
{
    struct list task = {0}, again = {0};
    /* Many more tasks than threads, yet few, since each walks its path again: with tasks of 16 active rows 1000 of them cost 70 %
     * more than as one (tests/bench_active). */
    const int64_t active = sim->tree.active_count[0], many = active / 256, share = active / (16 * omp_get_max_threads());
    const int64_t least = omp_get_max_threads() == 1 || share > 256 ? 256 : share > 16 ? share : 16;
    list_tasks(sim, g, 0, many > least ? many : least, &task);
    g->pairs = g->cells = 0;
    if (sim->spread) walk_ahead(sim, g);
    walk_tasks(sim, g, output, &task, &again);
    while (ghosts_open(sim)) {
        gravity_moments_open(sim, g);
        const struct list done = task;
        task = again;
        again = done;
        again.n = 0;
        walk_tasks(sim, g, output, &task, &again);
    }
    check(again.n == 0);
    mem_free(task.item);
    mem_free(again.item);
}
