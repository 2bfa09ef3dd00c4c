/* SPDX-License-Identifier: GPL-3.0-or-later
 * The walk of `tree` and `fmm`: top down over target cells, each with a list of source cells that it
 * inherits. A source is accepted for the target cell as a whole, or opened, or handed down to the
 * target's children. A target that is a group (Makino 1991) settles what is left: cells acting on
 * its rows one by one, and rows.
 *   tree: accepted cells act on the rows of every group below; opening by an angle.
 *   fmm:  accepted cells go into the target's local expansion, which is passed down; opening by the
 *         error it makes against the least acceleration in the target (Dehnen 2014, section 3). A
 *         cell refused that way may still act on the rows of a group: summed over the many cells of
 *         a dense region, the local expansions of a large sparse group err with one sign.
 * A task is a cell with its path from the root walked anew, so that every group sees the same lists
 * in the same order whatever the number of threads and ranks, and whichever rows are active. */
#include "walk.h"
#include "cell.h"
#include "mem.h"
#include <math.h>
#include <string.h>

/* Sides and angles of the openings of fmm: measured, see doc/manual/gravity.md. */
static const double theta_local = 0.9;      /* (reach + radius) / distance */
static const double theta_target = 0.6;     /* radius / distance */
static const double theta_cell = 0.8;       /* reach / distance from the box, cell on rows */
static const double theta_first = 0.7;      /* both, as long as no acceleration is known */
static const double open_ratio = 1.5;       /* a source this much larger than the target is opened */

/* A target cell: its box now, and bounds for accepting a source. */
struct view {
    int32_t cell;
    double centre[3], half[3], radius, unit;
    float tolerance;            /* alpha times the least acceleration */
    bool group;
};

enum verdict { ACCEPT, ROWS_FROM_CELL, ROWS_FROM_ROWS, OPEN, HAND_DOWN };

static struct view view_of(const struct walk *w, int32_t n, double parent_unit)
{
    const struct node *node = &w->sim->tree.node[n];
    struct view v = {.cell = n, .group = gravity_is_group(w->g, node)};
    double r2 = 0;
    for (int k = 0; k < 3; k++) {
        v.centre[k] = node->pos[k] + 0.5 * ((double)node->high[k] + (double)node->low[k]);
        v.half[k] = 0.5 * ((double)node->high[k] - (double)node->low[k]);
        r2 += v.half[k] * v.half[k];
    }
    v.radius = sqrt(r2);
    /* A power of two near the radius, but not so small that a neighbour would lie out of range. */
    int exponent;
    frexp(fmax(v.radius, parent_unit / 1024), &exponent);
    v.unit = r2 > 0 || parent_unit > 0 ? ldexp(1, exponent) : 1;
    v.tolerance = w->g->known ? (float)(w->alpha * (double)w->g->least[n]) : INFINITY;
    return v;
}

/* Error of the acceleration that source s makes through the local expansion, times d^2: Dehnen
 * (2014), eq. 16: sum over k of binomial(P, k) |M_k| r^(P-k) / d^P, with the dipole absent. */
static float local_error(const struct gravity_cell *s, int order, float t, float u)
{
    float error = s->mass * t * t, power = u;
    for (int k = 2; k <= order; k++) {
        power *= u;
        error = (k == 2 ? error : error * t) + s->power[k - 2] * power;
    }
    return error;
}

static bool local_accepts(const struct walk *w, const struct view *v, const struct gravity_cell *s, double d2)
{
    double sum = (double)s->reach + v->radius, edge = sum + w->g->support;
    double theta = w->g->known ? theta_local : theta_first;
    if (sum * sum >= theta * theta * d2 || edge * edge >= d2 || d2 < w->g->near2) return false;
    if (v->radius * v->radius >= theta_target * theta_target * d2) return false;
    float y = 1 / sqrtf((float)d2);
    return local_error(s, w->g->opening.order, (float)v->radius * y, s->scale * y) < v->tolerance * (float)d2;
}

/* Squared distances of the cell's centre from the nearest and farthest points of the box. */
static void box_distances(const struct view *v, const double d[3], double *least2, double *most2)
{
    *least2 = *most2 = 0;
    for (int k = 0; k < 3; k++) {
        double near = fmax(fabs(d[k]) - v->half[k], 0), far = fabs(d[k]) + v->half[k];
        *least2 += near * near;
        *most2 += far * far;
    }
}

/* May the cell act on the rows of a group? Its sphere never touches the group's box. */
static bool cell_accepts(const struct walk *w, const struct view *v, const struct gravity_cell *s, const double d[3])
{
    double least2, most2;
    box_distances(v, d, &least2, &most2);
    double edge = (double)s->reach + w->g->support, theta = w->g->known ? theta_cell : theta_first;
    if ((double)(s->reach * s->reach) >= theta * theta * least2 || edge * edge >= least2 || least2 < w->g->near2) return false;
    float y = 1 / sqrtf((float)least2), u = s->scale * y;
    return w->quadrupole * s->power[0] * u * u * s->reach * y < v->tolerance * (float)least2;
}

static enum verdict judge_fmm(const struct walk *w, const struct view *v, const struct gravity_cell *s, bool self)
{
    double d[3] = {s->pos[0] - v->centre[0], s->pos[1] - v->centre[1], s->pos[2] - v->centre[2]};
    if (local_accepts(w, v, s, d[0] * d[0] + d[1] * d[1] + d[2] * d[2])) return ACCEPT;
    if (v->group) {
        if (self) return HAND_DOWN;
        if (cell_accepts(w, v, s, d)) return ROWS_FROM_CELL;
        return s->n_children == 0 ? ROWS_FROM_ROWS : OPEN;
    }
    return s->n_children > 0 && (double)s->reach > open_ratio * v->radius ? OPEN : HAND_DOWN;
}

/* The side of the cube within the cell's sphere over the distance, for every group in the target. */
static enum verdict judge_tree(const struct walk *w, const struct view *v, const struct gravity_cell *s, bool self)
{
    double d[3] = {s->pos[0] - v->centre[0], s->pos[1] - v->centre[1], s->pos[2] - v->centre[2]}, least2, most2;
    box_distances(v, d, &least2, &most2);
    double reach2 = (double)s->reach * (double)s->reach, side2 = 4.0 / 3.0 * reach2, theta2 = w->theta * w->theta;
    double edge = (double)s->reach + w->g->support, edge2 = edge * edge;
    if (side2 < theta2 * least2 && edge2 < least2 && least2 >= w->g->near2) return ROWS_FROM_CELL;
    if (v->group) return self ? HAND_DOWN : s->n_children == 0 ? ROWS_FROM_ROWS : OPEN;
    bool hopeless = side2 >= theta2 * most2 || edge2 >= most2 || most2 < w->g->near2;
    return s->n_children > 0 && hopeless ? OPEN : HAND_DOWN;
}

/* A group must meet itself whole in its list. */
static bool is_inside(const struct walk *w, int32_t s, int32_t target)
{
    const struct node *a = &w->sim->tree.node[s], *b = &w->sim->tree.node[target];
    for (int k = 0; k < N_SPECIES; k++)
        if (a->count[k] > 0 && (a->first[k] < b->first[k] || a->first[k] + a->count[k] > b->first[k] + b->count[k])) return false;
    return true;
}

static void judge(struct walk *w, const struct view *v, int32_t s)
{
    const struct gravity_cell *cell = &w->g->cell[s];
    bool fmm = w->g->opening.solver == SOLVER_FMM;
    enum verdict verdict = fmm ? judge_fmm(w, v, cell, s == v->cell) : judge_tree(w, v, cell, s == v->cell);
    if (verdict == OPEN && cell->group && is_inside(w, s, v->cell)) verdict = HAND_DOWN;
    switch (verdict) {
    case ACCEPT: list_add(&w->local, s); break;
    case ROWS_FROM_CELL: list_add(&w->far, s); break;
    case ROWS_FROM_ROWS: list_add(&w->near, s); break;
    case HAND_DOWN: list_add(&w->waiting, s); break;
    case OPEN:
        for (int32_t c = cell->child; c < cell->child + cell->n_children; c++) list_add(&w->opened, c);
        break;
    }
}

/* Judges waiting[from, to) and whatever is opened on the way; what is left waits behind `to`. */
static void judge_all(struct walk *w, const struct view *v, int64_t from, int64_t to)
{
    w->local.n = w->near.n = w->opened.n = 0;
    for (int64_t i = from; i < to; i++) judge(w, v, w->waiting.item[i]);
    for (int64_t i = 0; i < w->opened.n; i++) judge(w, v, w->opened.item[i]);
}

static struct gravity_far far_of(const struct walk *w, const struct view *v, const struct list *list)
{
    return (struct gravity_far){
        .cell = w->g->cell, .moment = w->sim->tree.moment, .width = w->sim->tree.width[NODE_moment],
        .list = list->item, .n = (int)list->n, .centre = {v->centre[0], v->centre[1], v->centre[2]}, .scale = v->unit,
        .soft2 = (float)(w->g->far_soft2 / (v->unit * v->unit))};
}

/* The parent's expansion about this target's centre, in its unit. */
static void inherit(float *local, const float *parent, const struct view *from, const struct view *to, int order)
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

static void settle_group(struct walk *w, const struct view *v, const float *local)
{
    const struct node *node = &w->sim->tree.node[v->cell];
    struct stage stage = stage_at(w->sim, w->g, v->centre, v->unit);
    walk_begin_group(w, &stage, node);
    struct gravity_far far = far_of(w, v, &w->far);
    const struct gravity_far_table *table = w->g->kernels->far;
    if (local) walk_add_local(w, local);
    if (far.n > 0) (w->g->opening.order > 1 ? table->quadrupoles : table->monopoles)[w->potential](&w->targets, &far);
    for (int64_t i = 0; i < w->near.n; i++) walk_add_rows(w, &stage, &w->sim->tree.node[w->near.item[i]]);
    w->cells += (far.n) * (int64_t)w->targets.n;
    walk_end_group(w, &stage);
}

/* The child on the way down to w->task, or -1 at or below it. */
static int32_t next_on_path(const struct walk *w, int32_t n)
{
    if (w->depth == 0) return -1;
    for (int i = w->depth - 1; i > 0; i--)
        if (w->path[i] == n) return w->path[i - 1];
    return -1;
}

static void descend(struct walk *w, int32_t n, int64_t from, int64_t to, const struct view *parent, const float *above)
{
    if (w->sim->tree.active_count[n] == 0) return;
    const bool fmm = w->g->opening.solver == SOLVER_FMM;
    struct view v = view_of(w, n, parent ? parent->unit : 0);
    float local[CELL_TERMS_MAX] = {0};
    int64_t far_before = w->far.n;
    w->waiting.n = to;
    judge_all(w, &v, from, to);
    if (fmm) {
        int order = w->g->opening.order;
        if (parent) inherit(local, above, parent, &v, order);
        struct gravity_far list = far_of(w, &v, &w->local);
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
    w->depth = 0;
    for (int32_t n = task; n >= 0; n = w->sim->tree.node[n].parent) {
        list_reserve((void **)&w->path, &w->path_capacity, w->depth + 1, sizeof *w->path);
        w->path[w->depth++] = n;
    }
    w->waiting.n = w->far.n = 0;
    list_add(&w->waiting, 0);
    descend(w, 0, 0, 1, NULL, NULL);
}

void gravity_walk(struct sim *sim, struct gravity *g, enum gravity_output output)
{
    int32_t *task, n_tasks, n_rows = 0;
    for_species(sim, s) n_rows += (int32_t)s->n;
    /* Many more tasks than threads, yet few enough that the paths walked again do not count. */
    int size = n_rows / 256 > g->opening.group_size ? n_rows / 256 : g->opening.group_size;
    n_tasks = tree_groups(&sim->tree, ALL_SPECIES, size, "gravity", &task);
    int64_t pairs = 0, cells = 0;
#pragma omp parallel reduction(+ : pairs, cells)
    {
        struct walk w;
        walk_open(&w, sim, g, output);
#pragma omp for schedule(dynamic, 1)
        for (int32_t i = 0; i < n_tasks; i++)
            if (sim->tree.active_count[task[i]] > 0) walk_task(&w, task[i]);
        pairs += w.pairs;
        cells += w.cells;
        walk_close(&w);
    }
    g->pairs = pairs;
    g->cells = cells;
    mem_free(task);
}
