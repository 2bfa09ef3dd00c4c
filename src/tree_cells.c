/* SPDX-License-Identifier: GPL-3.0-or-later
 * Keys, sort and cells of the octree. A cell is made only where its rows part: chains of cells with
 * one child, which one distant escaper would cause, are skipped. */
#include "tree_cells.h"
#include "comm.h"
#include "mem.h"
#include "ranks.h"
#include "sim.h"
#include "sort.h"
#include <math.h>
#include <stdlib.h>

void tree_cells_cube(struct tree *tree, const double low[3], const double high[3])
{
    double extent = 0;
    for (int k = 0; k < 3; k++) extent = fmax(extent, high[k] - low[k]);
    if (extent == 0) extent = 1;
    tree->side = ldexp(1.0, ilogb(extent / 0.875) + 1);
    for (int k = 0; k < 3; k++) tree->corner[k] = floor(low[k] / (tree->side / 8)) * (tree->side / 8);
}

static bool choose_cube(struct sim *sim)
{
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for_species(sim, s)
        for (int64_t i = species_from(s); i < species_to(s); i++) {
            double pos[3];
            sim_predict(&sim->time, s, i, pos);
            if (!isfinite(pos[0] + pos[1] + pos[2])) {
                sim_fail(sim, s, i, "position is not finite");
                break;
            }
            for (int k = 0; k < 3; k++) {
                low[k] = pos[k] < low[k] ? pos[k] : low[k];
                high[k] = pos[k] > high[k] ? pos[k] : high[k];
            }
        }
    if (ranks_failed(sim)) return false;
    comm_min(low, 3);
    comm_max(high, 3);
    tree_cells_cube(&sim->tree, low, high);
    return true;
}

static inline void row_grid(const struct cells *b, const struct species *s, int64_t i, uint64_t x[3])
{
    double pos[3];
    sim_predict(&b->sim->time, s, i, pos);
    key_grid(pos, b->tree->corner, b->scale, x);
}

/* Of a row that is here whatever happens. */
static inline uint64_t high_of(const struct cells *b, int s, int64_t i) { return b->high[s][i - b->from[s]]; }

static struct key row_key(const struct cells *b, const struct species *s, int64_t i)
{
    uint64_t x[3];
    row_grid(b, s, i, x);
    return (struct key){key_interleave(x, KEY_HALF), key_interleave(x, 0)};
}

struct key tree_cells_key(const struct cells *b, int s, int64_t row) { return row_key(b, &b->sim->species[s], row); }

/* Rows whose upper half keys agree are put in order of the lower half, then of their ids. */
struct tie { uint64_t low, id; int32_t row; };

static int compare_ties(const void *a, const void *b)
{
    const struct tie *s = a, *t = b;
    if (s->low != t->low) return s->low < t->low ? -1 : 1;
    return (s->id > t->id) - (s->id < t->id);
}

static void settle_ties(const struct cells *b, const struct species *s, int32_t *order, int64_t n)
{
    const uint64_t *high = b->high[s->kind];
    const int64_t from = b->from[s->kind];
    struct tie *tie = NULL;
    for (int64_t i = 0, end; i < n; i = end) {
        for (end = i + 1; end < n && high[end] == high[i]; end++) {}
        if (end == i + 1) continue;
        tie = mem_resize("sort", tie, (size_t)(end - i) * sizeof *tie);
        for (int64_t k = i; k < end; k++)
            tie[k - i] = (struct tie){row_key(b, s, from + order[k]).low, s->id[from + order[k]], order[k]};
        qsort(tie, (size_t)(end - i), sizeof *tie, compare_ties);
        for (int64_t k = i; k < end; k++) order[k] = tie[k - i].row;
    }
    mem_free(tie);
}

static void sort_species(struct cells *b, struct species *s)
{
    const int64_t from = b->from[s->kind] = species_from(s), n = species_to(s) - from;
    uint64_t *high = b->high[s->kind] = mem_array("sort", uint64_t, n);
    int32_t *order = mem_array("sort", int32_t, n);
#pragma omp parallel for
    for (int64_t i = 0; i < n; i++) {
        uint64_t x[3];
        row_grid(b, s, from + i, x);
        order[i] = (int32_t)i;
        high[i] = key_interleave(x, KEY_HALF);
    }
    sort_keys(high, order, n);
    settle_ties(b, s, order, n);
    species_permute(s, order, n);
    mem_free(order);
}

static int octant(const struct cells *b, int s, int64_t i, int level)
{
    struct key key = {high_of(b, s, i), 0};
    if (level > KEY_HALF) key = row_key(b, &b->sim->species[s], i);
    return key_octant(key, level);
}

/* The same in the upper halves of the keys. Halving without a branch: outcomes cannot be foretold. */
static int32_t key_boundary(const uint64_t *high, int32_t from, int32_t to, int level, int wanted)
{
    const uint64_t *at = high + from;
    for (int32_t n = to - from; n > 0;) {
        const int32_t half = n / 2;
        const bool below = key_octant((struct key){at[half], 0}, level) < wanted;
        at = below ? at + half + 1 : at;
        n = below ? n - half - 1 : half;
    }
    return (int32_t)(at - high);
}

int32_t tree_cells_boundary(const struct cells *b, int s, int32_t from, int32_t to, int level, int wanted)
{
    const int32_t first = (int32_t)b->from[s];
    if (level <= KEY_HALF) return first + key_boundary(b->high[s], from - first, to - first, level, wanted);
    while (from < to) {
        int32_t middle = from + (to - from) / 2;
        if (octant(b, s, middle, level) < wanted) from = middle + 1;
        else to = middle;
    }
    return from;
}

/* Rows of one species in a cell. */
struct range { int s; int32_t first, last; };

/* Where the keys of a cell's rows differ: the first and the last of each species tell. */
static struct key difference(const struct cells *b, const struct range *range, int n, bool lower)
{
    struct key differ = {0, 0}, start = {0, 0};
    for (int k = 0; k < n; k++) {
        const struct range *r = &range[k];
        const int32_t end[2] = {r->first, r->last};
        for (int e = 0; e < 2; e++) {
            struct key key = {high_of(b, r->s, end[e]), 0};
            if (lower) key = row_key(b, &b->sim->species[r->s], end[e]);
            if (k == 0 && e == 0) start = key;
            differ.high |= start.high ^ key.high;
            differ.low |= start.low ^ key.low;
        }
    }
    return differ;
}

static int level_of(struct key differ)
{
    if (differ.high) return KEY_HALF - (63 - __builtin_clzll(differ.high)) / 3;
    if (differ.low) return KEY_LEVELS - (63 - __builtin_clzll(differ.low)) / 3;
    return KEY_LEVELS + 1;
}

int tree_cells_level(struct key first, struct key last)
{
    return level_of((struct key){first.high ^ last.high, first.low ^ last.low});
}

/* Level at which the rows of a cell first lie in different octants; beyond KEY_LEVELS if never. The lower halves
 * of the keys, which are not kept, seldom decide. */
static int parting_level(const struct cells *b, const struct node *node)
{
    struct range range[N_SPECIES];
    int n = 0;
    for (int s = 0; s < N_SPECIES; s++)
        if (node->count[s] > 0) range[n++] = (struct range){s, node->first[s], node->first[s] + node->count[s] - 1};
    struct key differ = difference(b, range, n, false);
    return level_of(differ.high ? differ : difference(b, range, n, true));
}

int32_t tree_cells_add(struct tree *tree, int32_t count)
{
    int32_t first = tree->n_nodes;
    tree->n_nodes += count;
    if (tree->n_nodes > tree->capacity) {
        tree->capacity = tree->n_nodes + tree->n_nodes / 2 + 64;
        tree->node = mem_resize("tree", tree->node, (size_t)tree->capacity * sizeof *tree->node);
    }
    return first;
}

/* One level of splitting. */
static void part(struct cells *b, int32_t n)
{
    struct tree *tree = b->tree;
    struct node node = tree->node[n];
    int level = parting_level(b, &node);
    if (level > KEY_LEVELS) return;     /* all rows at one place: a leaf of any size */

    struct node child[8];
    int32_t from[N_SPECIES];
    int16_t n_children = 0;
    for (int s = 0; s < N_SPECIES; s++) from[s] = node.first[s];
    for (int o = 0; o < 8; o++) {
        struct node c = {.parent = n, .child = -1};
        for (int s = 0; s < N_SPECIES; s++) {
            c.first[s] = from[s];
            from[s] = tree_cells_boundary(b, s, from[s], node.first[s] + node.count[s], level, o + 1);
            c.count[s] = from[s] - c.first[s];
        }
        if (node_rows(&c, ALL_SPECIES) > 0) child[n_children++] = c;
    }
    int32_t first = tree_cells_add(tree, n_children);
    tree->node[n].child = first;
    tree->node[n].n_children = n_children;
    for (int32_t k = 0; k < n_children; k++) tree->node[first + k] = child[k];
}

static void split(struct cells *b, int32_t n)
{
    const struct tree *tree = b->tree;
    if (node_rows(&tree->node[n], ALL_SPECIES) <= tree->leaf_size) return;
    part(b, n);
    const int32_t first = tree->node[n].child, n_children = tree->node[n].n_children;
    for (int32_t k = 0; k < n_children; k++) split(b, first + k);
}

/* One rank, or every rank alike. */
static void split_all(struct cells *b)
{
    struct node root = {.parent = -1, .child = -1};
    for (int s = 0; s < N_SPECIES; s++) root.count[s] = (int32_t)b->sim->species[s].n;
    if (node_rows(&root, ALL_SPECIES) == 0) return;
    tree_cells_add(b->tree, 1);
    b->tree->node[0] = root;
    split(b, 0);
}

/* Rows go to the ranks of their domains and into order there. */
static void split_own(struct cells *b)
{
    domains_exchange(b);
    for_species(b->sim, s) {
        mem_free(b->high[s->kind]);
        sort_species(b, s);
    }
    domains_tops(b);
    b->tree->n_top = b->tree->n_nodes;
    for (int32_t n = 0; n < b->tree->n_top; n++)
        if (b->tree->node[n].place == NODE_OWN) split(b, n);
}

struct cells *tree_cells_begin(struct sim *sim)
{
    struct tree *tree = &sim->tree;
    if (!choose_cube(sim)) return NULL;
    struct cells *b = mem_alloc("sort", sizeof *b);
    *b = (struct cells){.sim = sim, .tree = tree, .scale = ldexp(1.0, KEY_LEVELS) / tree->side};
    for_species(sim, s) sort_species(b, s);
    tree->n_nodes = tree->n_top = 0;
    if (sim->spread) split_own(b);
    else split_all(b);
    return b;
}

void tree_cells_split(struct cells *cells, int32_t leaf) { part(cells, leaf); }

void tree_cells_end(struct cells *cells)
{
    struct tree *tree = cells->tree;
    for (int s = 0; s < N_SPECIES; s++) mem_free(cells->high[s]);
    tree->capacity = tree->n_nodes + tree->n_nodes / 32;    /* not what growing took too much; the next tree is similar */
    tree->node = mem_resize("tree", tree->node, (size_t)tree->capacity * sizeof *tree->node);
    mem_free(cells);
}
