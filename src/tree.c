/* SPDX-License-Identifier: GPL-3.0-or-later
 * The octree's life between two builds: build, refit, follow, groups. Which cells there are is
 * decided in tree_cells.c, by the keys alone. */
#include "tree_cells.h"
#include "comm.h"
#include "ghosts.h"
#include "mem.h"
#include "sim.h"
#include <math.h>
#include <string.h>

/* Cells below which a loop is not worth waking threads for. */
enum { MANY = 8192 };

void tree_need(struct tree *tree, enum node_column column, int width)
{
    check(width > 0);
    tree->width[column] = width;
}

void tree_need_leaf(struct tree *tree, int rows)
{
    check(rows > 0);
    if (tree->leaf_size == 0 || rows < tree->leaf_size) tree->leaf_size = rows;
}

static void **slot(const struct tree *tree, enum node_column column)
{
    static const size_t offset[N_NODE_COLUMNS] = {
#define NODE(name, ...) offsetof(struct tree, name),
        NODE_COLUMNS(NODE)
#undef NODE
    };
    return (void **)((char *)tree + offset[column]);
}

void *tree_column(const struct tree *tree, enum node_column column) { return tree->width[column] ? *slot(tree, column) : NULL; }

size_t tree_node_bytes(const struct tree *tree, enum node_column column)
{
    return (size_t)tree->width[column] * (size_t)node_column_table[column].element_bytes;
}

/* Node columns follow the number of cells. */
static void reserve_columns(struct tree *tree)
{
    for (int c = 0; c < N_NODE_COLUMNS; c++) {
        if (tree->width[c] == 0) continue;
        mem_free(*slot(tree, c));
        *slot(tree, c) = mem_alloc("tree", (size_t)tree->n_nodes * tree_node_bytes(tree, c));
    }
    mem_free(tree->active_count);
    tree->active_count = mem_array("tree", int32_t, tree->n_nodes);
    tree->column_room = tree->n_nodes;
}

/* A longer block whose new part is zero. */
static void *lengthen(void *block, int32_t before, int32_t after, size_t bytes)
{
    block = mem_resize("tree", block, (size_t)after * bytes);
    memset((char *)block + (size_t)before * bytes, 0, (size_t)(after - before) * bytes);
    return block;
}

void tree_reserve(struct tree *tree, int32_t nodes)
{
    if (nodes > tree->capacity) {
        tree->capacity = nodes + nodes / 4;
        tree->node = mem_resize("tree", tree->node, (size_t)tree->capacity * sizeof *tree->node);
    }
    if (nodes <= tree->column_room) return;
    for (int c = 0; c < N_NODE_COLUMNS; c++)
        if (tree->width[c] > 0)
            *slot(tree, c) = lengthen(*slot(tree, c), tree->column_room, tree->capacity, tree_node_bytes(tree, c));
    tree->active_count = lengthen(tree->active_count, tree->column_room, tree->capacity, sizeof *tree->active_count);
    tree->column_room = tree->capacity;
}

void tree_free(struct tree *tree)
{
#define NODE(name, ...) mem_free(tree->name); tree->name = NULL;
    NODE_COLUMNS(NODE)
#undef NODE
    mem_free(tree->active_count);
    mem_free(tree->node);
    tree->active_count = NULL;
    tree->node = NULL;
    tree->n_nodes = tree->capacity = 0;
}

/* Plain comparisons become one instruction each; fmin and fmax are calls. */
static inline double smaller(double a, double b) { return a < b ? a : b; }
static inline double larger(double a, double b) { return a > b ? a : b; }

/* A bound in float that certainly holds x. */
static float below(double x) { return (float)x - 1.2e-7f * fabsf((float)x); }
static float above(double x) { return (float)x + 1.2e-7f * fabsf((float)x); }

/* How fast a row is now, and by how much its velocity may change until its step ends. */
static inline double row_velocity(const struct sim *sim, const struct species *s, int64_t i, double vel[3])
{
    const struct timeline *time = &sim->time;
    double lag = timeline_lag(time, s->rung[i], s->rung0[i]), change = 0;
    for (int k = 0; k < 3; k++) {
        double acc = s->acc[i][k];
        vel[k] = integrate_velocity(s->vel[i][k], acc, lag);
        change = larger(change, fabs(acc));
    }
    return change * timeline_seconds(time, (int64_t)1 << s->rung[i]);
}

/* A box and a speed that hold nothing yet. */
static void open_box(struct node *node)
{
    for (int k = 0; k < 3; k++) {
        node->low[k] = INFINITY;
        node->high[k] = -INFINITY;
    }
    node->speed = node->slack = 0;
}

static void widen(struct node *node, int k, double low, double high)
{
    node->low[k] = (float)smaller(node->low[k], below(low));
    node->high[k] = (float)larger(node->high[k], above(high));
}

static void widen_for_row(const struct sim *sim, struct node *node, const struct species *s, int64_t i)
{
    double pos[3], vel[3], change = row_velocity(sim, s, i, vel);
    sim_predict(&sim->time, s, i, pos);
    for (int k = 0; k < 3; k++) {
        double x = pos[k] - node->pos[k];
        widen(node, k, x, x);
        node->speed = (float)larger(node->speed, above(fabs(vel[k] - (double)node->vel[k]) + change));
    }
}

static void widen_for_child(struct node *node, const struct node *child)
{
    for (int k = 0; k < 3; k++) {
        double x = child->pos[k] - node->pos[k], v = fabs((double)child->vel[k] - (double)node->vel[k]);
        widen(node, k, x + (double)child->low[k], x + (double)child->high[k]);
        node->speed = (float)larger(node->speed, above(v + (double)child->speed));
    }
}

/* Sums for the mean position and velocity. */
struct centre { double weight, pos[3], vel[3]; };

static void centre_set(struct node *node, const struct centre *c, double mass)
{
    node->mass = (float)mass;
    for (int k = 0; k < 3; k++) {
        node->pos[k] = c->pos[k] / c->weight;
        node->vel[k] = (float)(c->vel[k] / c->weight);
    }
    open_box(node);
}

struct extremes { double low[3], high[3]; };

static const struct extremes nowhere = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};

static inline void extremes_add(struct extremes *e, const double x[3])
{
    for (int k = 0; k < 3; k++) {
        e->low[k] = smaller(e->low[k], x[k]);
        e->high[k] = larger(e->high[k], x[k]);
    }
}

/* Of a leaf's rows; weights are the masses, or 1 if `equal`. Positions and velocities go one after the other,
 * since the sums and extremes of both do not fit into the registers. Returns the least distance of rows that
 * follow each other, beyond the blur; that of rows at one place does not count. */
static double measure_positions(const struct sim *sim, const struct node *node, bool equal, struct centre *c, struct extremes *all)
{
    double last[3] = {INFINITY, INFINITY, INFINITY}, least2 = INFINITY, sum[3] = {0}, weight = 0;
    struct extremes e = nowhere;
    for (const struct species *s = sim->species; s < sim->species + N_SPECIES; s++)
        for (int64_t i = node->first[s->kind], end = i + node->count[s->kind]; i < end; i++) {
            double pos[3], m = equal ? 1 : s->mass[i], d2 = 0;
            sim_predict(&sim->time, s, i, pos);
            weight += m;
            for (int k = 0; k < 3; k++) {
                sum[k] += m * pos[k];
                d2 += (pos[k] - last[k]) * (pos[k] - last[k]);
                last[k] = pos[k];
            }
            least2 = d2 > 0 ? smaller(d2, least2) : least2;
            extremes_add(&e, pos);
        }
    *all = e;
    c->weight = weight;
    memcpy(c->pos, sum, sizeof sum);
    return larger(sqrt(least2), sim->tree.blur);
}

/* Returns by how much a velocity may change until its row's step ends. */
static double measure_velocities(const struct sim *sim, const struct node *node, bool equal, struct centre *c, struct extremes *all)
{
    double change = 0, sum[3] = {0};
    struct extremes e = nowhere;
    for (const struct species *s = sim->species; s < sim->species + N_SPECIES; s++)
        for (int64_t i = node->first[s->kind], end = i + node->count[s->kind]; i < end; i++) {
            double vel[3], m = equal ? 1 : s->mass[i];
            change = larger(change, row_velocity(sim, s, i, vel));
            for (int k = 0; k < 3; k++) sum[k] += m * vel[k];
            extremes_add(&e, vel);
        }
    *all = e;
    memcpy(c->vel, sum, sizeof sum);
    return change;
}

/* Centre of mass (of the rows, if all masses are 0) and the box about it. Returns the least distance of rows. */
static double measure_leaf(const struct sim *sim, struct node *node)
{
    struct centre c;
    struct extremes pos, vel;
    double closest = measure_positions(sim, node, false, &c, &pos), mass = c.weight;
    const bool equal = !(mass > 0);
    if (equal) measure_positions(sim, node, equal, &c, &pos);
    double change = measure_velocities(sim, node, equal, &c, &vel);
    centre_set(node, &c, mass);
    for (int k = 0; k < 3; k++) {
        double v = node->vel[k];
        widen(node, k, pos.low[k] - node->pos[k], pos.high[k] - node->pos[k]);
        node->speed = (float)larger(node->speed, above(larger(vel.high[k] - v, v - vel.low[k]) + change));
    }
    return closest;
}

static void measure_inner(struct tree *tree, struct node *node)
{
    struct centre c = {0};
    double mass = 0;
    for (int32_t k = 0; k < node->n_children; k++) mass += (double)tree->node[node->child + k].mass;
    for (int32_t k = 0; k < node->n_children; k++) {
        const struct node *child = &tree->node[node->child + k];
        const double weight = mass > 0 ? (double)child->mass : (double)node_rows(child, ALL_SPECIES);
        c.weight += weight;
        for (int d = 0; d < 3; d++) {
            c.pos[d] += weight * child->pos[d];
            c.vel[d] += weight * (double)child->vel[d];
        }
    }
    centre_set(node, &c, mass);
    for (int32_t k = 0; k < node->n_children; k++) widen_for_child(node, &tree->node[node->child + k]);
}

/* Modules hold the rows of a leaf or a group as floats about its centre, with errors of up to 2^-24 of its
 * extent: 1.5e-5 of the distance of the closest rows at this ratio. One escaper at 1e7 radii, or two clumps
 * that far apart, go beyond; of cells of 128 random rows 0.2 % do. */
static bool is_stretched(const struct node *node, double closest)
{
    const double ratio = 256;
    double extent = 0;
    for (int k = 0; k < 3; k++) extent = larger(extent, (double)node->high[k] - (double)node->low[k]);
    return extent > ratio * closest;
}

static bool is_own_leaf(const struct node *node) { return node->n_children == 0 && node->place == NODE_OWN; }

/* Measures leaves and splits those that are stretched, until none is. closest: one a node. */
static float *settle_leaves(struct sim *sim, struct cells *cells)
{
    struct tree *tree = &sim->tree;
    float *closest = NULL;
    for (int32_t from = 0, to = tree->n_nodes; from < to; from = to, to = tree->n_nodes) {
        closest = mem_resize("tree", closest, (size_t)to * sizeof *closest);
#pragma omp parallel for schedule(dynamic, 256)
        for (int32_t n = from; n < to; n++)
            closest[n] = is_own_leaf(&tree->node[n]) ? (float)measure_leaf(sim, &tree->node[n]) : INFINITY;
        for (int32_t n = from; n < to; n++)
            if (is_own_leaf(&tree->node[n]) && is_stretched(&tree->node[n], (double)closest[n])) tree_cells_split(cells, n);
    }
    return closest;
}

static void finish_node(struct tree *tree, int32_t n, float *closest)
{
    struct node *node = &tree->node[n];
    if (node->n_children > 0) measure_inner(tree, node);
    node->stretched = is_stretched(node, (double)closest[n]);
}

static void tell_parent(const struct tree *tree, int32_t n, float *closest)
{
    const int32_t parent = tree->node[n].parent;
    if (parent >= 0) closest[parent] = fminf(closest[parent], closest[n]);
}

/* Own cells, the topmost of them to all ranks, and then those that hold rows of several ranks. */
static void finish_nodes(struct sim *sim, float *closest)
{
    struct tree *tree = &sim->tree;
    for (int32_t n = tree->n_nodes - 1; n >= 0; n--) {
        if (tree->node[n].place != NODE_OWN) continue;
        finish_node(tree, n, closest);
        if (n >= tree->n_top) tell_parent(tree, n, closest);
    }
    if (tree->n_top == 0) return;
    ghosts_share_tops(sim, closest);
    for (int32_t n = tree->n_top - 1; n >= 0; n--) {
        if (tree->node[n].place == NODE_TOP) finish_node(tree, n, closest);
        tell_parent(tree, n, closest);
    }
}

bool tree_build(struct sim *sim)
{
    struct tree *tree = &sim->tree;
    check(tree->leaf_size > 0);
    ghosts_forget(sim);
    struct cells *cells = tree_cells_begin(sim);
    if (!cells) return false;
    float *closest = settle_leaves(sim, cells);
    tree_cells_end(cells);
    reserve_columns(tree);
    tree->n_fixed = tree->n_nodes;
    finish_nodes(sim, closest);
    mem_free(closest);
    tree->built = tree->fitted = sim->time.tick;
    return true;
}

static void drift(struct node *node, double dt)
{
    float growth = above((double)node->speed * dt);
    for (int k = 0; k < 3; k++) {
        node->pos[k] += dt * (double)node->vel[k];
        node->low[k] = below((double)(node->low[k] - growth));
        node->high[k] = above((double)(node->high[k] + growth));
    }
    node->slack += growth;
}

static void fit_leaf(const struct sim *sim, struct node *node)
{
    open_box(node);
    for (const struct species *s = sim->species; s < sim->species + N_SPECIES; s++)
        for (int64_t i = node->first[s->kind], end = i + node->count[s->kind]; i < end; i++) widen_for_row(sim, node, s, i);
}

static void fit_inner(const struct tree *tree, struct node *node)
{
    open_box(node);
    for (int32_t k = 0; k < node->n_children; k++) widen_for_child(node, &tree->node[node->child + k]);
}

/* A box is fitted anew when it has grown, on every side, by this part of its width. In Sedov's explosion with
 * steps of 1:1e4, where a few hot rows cross the gas while the rest sleeps, walks otherwise meet their boxes everywhere. */
static const float loose = 1.0f / 8;

static bool is_loose(const struct node *node)
{
    float width = 0;
    for (int k = 0; k < 3; k++) width = fmaxf(width, node->high[k] - node->low[k]);
    return node->slack > loose * width;
}

/* Cells above what was fitted, whose rows are of several ranks: the same on every rank. */
static void fit_tops(struct sim *sim)
{
    struct tree *tree = &sim->tree;
    ghosts_share_tops(sim, NULL);
    for (int32_t n = tree->n_top - 1; n >= 0; n--) {
        struct node *node = &tree->node[n];
        if (node->slack > 0) continue;
        if (node->place == NODE_TOP) fit_inner(tree, node);
        if (node->parent >= 0) tree->node[node->parent].slack = 0;
    }
}

void tree_refit(struct sim *sim)
{
    struct tree *tree = &sim->tree;
    double dt = timeline_seconds(&sim->time, sim->time.tick - tree->fitted);
    int64_t fitted = 0;
    tree->fitted = sim->time.tick;
    ghosts_close(sim);
    if (!(dt > 0)) return;
#pragma omp parallel for reduction(+ : fitted) if (tree->n_nodes > MANY)
    for (int32_t n = 0; n < tree->n_nodes; n++) {
        struct node *node = &tree->node[n];
        drift(node, dt);
        if (!is_own_leaf(node) || !is_loose(node)) continue;
        fit_leaf(sim, node);
        fitted++;
    }
    if (tree->n_top > 0) comm_sum_int(&fitted, 1);
    for (int32_t n = tree->n_nodes - 1; n >= 0 && fitted > 0; n--) {
        struct node *node = &tree->node[n];
        if (node->slack > 0 || node->place != NODE_OWN) continue;
        if (node->n_children > 0) fit_inner(tree, node);
        if (node->parent >= 0 && tree->node[node->parent].place == NODE_OWN) tree->node[node->parent].slack = 0;
    }
    if (tree->n_top > 0 && fitted > 0) fit_tops(sim);
}

/* First entry of the ascending list[from..to-1] that is at least `row`. */
static int64_t lower_bound(const int32_t *list, int64_t from, int64_t to, int64_t row)
{
    while (from < to) {
        int64_t middle = (from + to) / 2;
        if (list[middle] < row) from = middle + 1;
        else to = middle;
    }
    return from;
}

/* A part of each species' list of rows. */
struct part { const int32_t *list[N_SPECIES]; int64_t from[N_SPECIES], to[N_SPECIES]; };

static struct part part_of(const struct part *parent, const struct node *node)
{
    struct part part = *parent;
    for (int s = 0; s < N_SPECIES; s++) {
        const int32_t *list = part.list[s];
        part.from[s] = lower_bound(list, part.from[s], part.to[s], node->first[s]);
        part.to[s] = lower_bound(list, part.from[s], part.to[s], (int64_t)node->first[s] + node->count[s]);
    }
    return part;
}

static int64_t part_rows(const struct part *part)
{
    int64_t rows = 0;
    for (int s = 0; s < N_SPECIES; s++) rows += part->to[s] - part->from[s];
    return rows;
}

static void mark(struct tree *tree, int32_t n, const struct part *part)
{
    const struct node *node = &tree->node[n];
    tree->active_count[n] = (int32_t)part_rows(part);
    if (tree->active_count[n] == 0) return;
    for (int32_t k = 0; k < node->n_children; k++) {
        struct part inside = part_of(part, &tree->node[node->child + k]);
        mark(tree, node->child + k, &inside);
    }
}

void tree_mark_active(struct sim *sim)
{
    struct tree *tree = &sim->tree;
    if (tree->n_nodes == 0) return;
    int64_t idle = 0;
    struct part part = {0};
    for (int s = 0; s < N_SPECIES; s++) {
        part.list[s] = sim->species[s].active;
        part.to[s] = sim->species[s].n_active;
        idle += sim->species[s].n - part.to[s];
    }
    if (idle > 0) {     /* rows of other ranks are none of the active ones */
        memset(tree->active_count, 0, (size_t)tree->n_nodes * sizeof *tree->active_count);
        mark(tree, 0, &part);
        return;
    }
    for (int32_t n = 0; n < tree->n_nodes; n++) tree->active_count[n] = (int32_t)node_rows(&tree->node[n], ALL_SPECIES);
}

static void follow(struct sim *sim, int32_t n, const struct part *part)
{
    struct node *node = &sim->tree.node[n];
    if (node_is_closed(node)) return;   /* another rank's alone */
    for (int32_t k = 0; k < node->n_children; k++) {
        struct node *child = &sim->tree.node[node->child + k];
        struct part inside = part_of(part, child);
        if (part_rows(&inside) == 0) continue;
        follow(sim, node->child + k, &inside);
        widen_for_child(node, child);
    }
    if (node->n_children > 0) return;
    for (int s = 0; s < N_SPECIES; s++)
        for (int64_t a = part->from[s]; a < part->to[s]; a++)
            widen_for_row(sim, node, &sim->species[s], part->list[s][a]);
}

/* The cells of several ranks follow from their topmost cells: of those that have followed rows. */
static void follow_tops(struct sim *sim, const struct part *part)
{
    struct tree *tree = &sim->tree;
    bool *moved = mem_array("tree", bool, tree->n_top);
    for (int32_t n = 0; n < tree->n_top; n++) {
        struct part inside = part_of(part, &tree->node[n]);
        moved[n] = part_rows(&inside) > 0;
    }
    ghosts_share_moved(sim, moved);
    for (int32_t n = tree->n_top - 1; n > 0; n--) {
        struct node *node = &tree->node[n];
        if (!moved[n]) continue;
        widen_for_child(&tree->node[node->parent], node);
        moved[node->parent] = true;
    }
    mem_free(moved);
}

void tree_follow(struct sim *sim)
{
    if (sim->tree.n_nodes == 0) return;
    struct part part = {0};
    for (int s = 0; s < N_SPECIES; s++) {
        part.list[s] = sim->species[s].ending;
        part.to[s] = sim->species[s].n_ending;
    }
    follow(sim, 0, &part);
    if (sim->tree.n_top > 0) follow_tops(sim, &part);
}

void tree_follow_rows(struct sim *sim, enum species_kind kind, const int32_t *row, int64_t n)
{
    struct part part = {0};
    part.list[kind] = row;
    part.to[kind] = n;
    if (sim->tree.n_nodes > 0) follow(sim, 0, &part);
}

struct sweep { const struct sim *sim; enum species_kind kind; tree_measure *measure; const void *data; };

static void sweep_paths(const struct sweep *sweep, int32_t n, const int32_t *row, int64_t rows)
{
    const struct node *node = &sweep->sim->tree.node[n];
    int64_t from = 0;
    if (node_is_closed(node)) return;   /* another rank's alone */
    for (int32_t k = 0; k < node->n_children; k++) {
        const struct node *child = &sweep->sim->tree.node[node->child + k];
        int64_t to = lower_bound(row, from, rows, (int64_t)child->first[sweep->kind] + child->count[sweep->kind]);
        if (to > from) sweep_paths(sweep, node->child + k, row + from, to - from);
        from = to;
    }
    sweep->measure(sweep->sim, sweep->data, n);
}

void tree_sweep(struct sim *sim, enum species_kind kind, const int32_t *row, int64_t rows, tree_measure *measure, const void *data)
{
    const struct tree *tree = &sim->tree;
    if (tree->n_nodes == 0) return;
    if (row) {
        sweep_paths(&(struct sweep){sim, kind, measure, data}, 0, row, rows);
        return;
    }
#pragma omp parallel for schedule(dynamic, 1024)
    for (int32_t n = 0; n < tree->n_fixed; n++)
        if (is_own_leaf(&tree->node[n])) measure(sim, data, n);
    for (int32_t n = tree->n_fixed - 1; n >= 0; n--)
        if (tree->node[n].n_children > 0 && tree->node[n].place == NODE_OWN) measure(sim, data, n);
}

static void collect(const struct tree *tree, int32_t n, unsigned mask, int size, int32_t *groups, int32_t *count)
{
    const struct node *node = &tree->node[n];
    int64_t rows = node_rows(node, mask);
    if (rows == 0 || node->place == NODE_AWAY) return;
    if ((rows <= size && !node->stretched) || node->n_children == 0) {
        groups[(*count)++] = n;
        return;
    }
    for (int32_t k = 0; k < node->n_children; k++) collect(tree, node->child + k, mask, size, groups, count);
}

int32_t tree_groups(const struct tree *tree, unsigned mask, int size, const char *owner, int32_t **groups)
{
    int32_t count = 0;
    *groups = mem_array(owner, int32_t, tree->n_nodes);
    if (tree->n_nodes > 0) collect(tree, 0, mask, size, *groups, &count);
    *groups = mem_resize(owner, *groups, (size_t)count * sizeof **groups);
    return count;
}
