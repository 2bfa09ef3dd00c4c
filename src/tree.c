/* SPDX-License-Identifier: GPL-3.0-or-later
 * The octree: memory, build, groups. Which cells there are is decided in tree_cells.c, by the keys alone; what becomes of
 * them until the next build in tree_refit.c. */
#include "tree_box.h"
#include "tree_engine.h"
#include "tree_cells.h"
#include "comm.h"
#include "ghosts.h"
#include "mem.h"
#include "sim.h"
#include <math.h>
#include <string.h>

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
    tree_engine_free(tree->engine);
    tree->engine = NULL;
    tree->active_count = NULL;
    tree->node = NULL;
    tree->n_nodes = tree->capacity = 0;
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
    if (node->n_children > 0) measure_inner(tree->node, node);
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

static bool build_cells(struct sim *sim)
{
    struct cells *cells = tree_cells_begin(sim);
    if (!cells) return false;
    float *closest = settle_leaves(sim, cells);
    tree_cells_end(cells);
    sim->tree.n_fixed = sim->tree.n_nodes;
    finish_nodes(sim, closest);
    mem_free(closest);
    return true;
}

bool tree_build(struct sim *sim)
{
    struct tree *tree = &sim->tree;
    check(tree->leaf_size > 0);
    ghosts_forget(sim);
    for_species(sim, s) species_drop(s);
    const bool device = sim_device(sim) && !sim->spread && tree_cells_device(sim);
    if (sim->failure.set || (!device && !build_cells(sim))) return false;
    tree->n_fixed = tree->n_nodes;
    reserve_columns(tree);
    tree->built = tree->fitted = sim->time.tick;
    return true;
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
