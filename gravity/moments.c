/* SPDX-License-Identifier: GPL-3.0-or-later
 * Cells as a walk sees them: multipole moments about the centre of mass, the sphere that holds all
 * rows, the powers that bound the error of an interaction (Dehnen 2014, eq. 16, with the norms of
 * the moments), and the least acceleration of the rows within. Moments are made with the tree and
 * kept until the next; between, centres drift and spheres grow. */
#include "cell.h"
#include "comm.h"
#include "ghosts.h"
#include "gravity.h"
#include "mem.h"
#include <math.h>
#include <string.h>

int gravity_moments_width(const struct gravity_opening *opening)
{
    /* A multiple of the longest vector, so that a row of moments is read whole. */
    const int width[] = {0, 0, 16, 16, 16, 32, 64};
    return width[opening->order];
}

/* Order of the moment kernels: quadrupoles are those of order 3. */
static int moment_order(const struct gravity *g) { return g->opening.order > 2 ? g->opening.order : 3; }

/* The farthest corner of the cell's box from its centre. Comparisons of floats as they are: one instruction each, no branch. */
static double corner_distance(const struct node *node)
{
    double r2 = 0;
    for (int k = 0; k < 3; k++) {
        const float low = fabsf(node->low[k]), high = fabsf(node->high[k]), far = low > high ? low : high;
        r2 += (double)far * (double)far;
    }
    return sqrt(r2);
}

/* Rounding up what is a bound. */
static float bound(double x) { return (float)(x * (1 + 1e-6)); }

/* The unit of a cell's moments. Rows at one place have none: any small number does. */
static float unit_above(double x)
{
    int exponent;
    frexp(x, &exponent);
    return x > 0 ? (float)ldexp(1, exponent) : 1e-30f;
}

/* binomial(order, k) |M_k|, with |M_k| the Frobenius norm of sum m x^k: a stored term with exponents
 * a, b, c stands for k!/(a! b! c!) equal ones, and holds them over a! b! c!. */
static void measure_powers(struct gravity_cell *cell, const float *moment, int order)
{
    static const double factorial[] = {1, 1, 2, 6, 24, 120, 720};
    const double reach = (double)(cell->reach / cell->scale);
    double norm = 0, before = 0, last;
    for (int k = 2; k <= order; k++) {
        last = before;
        before = norm;
        double binomial = factorial[order] / (factorial[k] * factorial[order - k]);
        norm = 0;
        for (int a = k; a >= 0 && k < order; a--)
            for (int b = k - a; b >= 0; b--) {
                double m = (double)moment[CELL_MOMENT(a, b, k - a - b)];
                norm += m * m * factorial[a] * factorial[b] * factorial[k - a - b] * factorial[k];
            }
        /* The highest is not kept: bounded by those below, of which two or three rows may have no odd ones. */
        norm = k < order ? sqrt(norm) : fmax(before * reach, last * reach * reach);
        cell->power[k - 2] = (float)(binomial * norm);
    }
}

static void leaf_moments(const struct sim *sim, const struct gravity *g, int32_t n)
{
    struct gravity_cell *cell = &g->cell[n];
    cell->scale = unit_above(corner_distance(&sim->tree.node[n]));
    const struct gravity_leaf *leaf = gravity_rows_leaf(sim, g, n);
    const struct gravity_source *row = g->row + leaf->first;
    float r2 = 0;
    for (int i = 0; i < leaf->n; i++) {
        float x2 = row[i].x * row[i].x + row[i].y * row[i].y + row[i].z * row[i].z;
        r2 = x2 > r2 ? x2 : r2;
    }
    cell->reach = bound(sqrt((double)r2) * g->unit);
    int width = sim->tree.width[NODE_moment];
    if (width == 0) return;
    float *moment = sim->tree.moment + (int64_t)width * n;
    const float unit = (float)(g->unit / (double)cell->scale);
    g->kernels->far->of_rows[moment_order(g) - GRAVITY_ORDER_MIN](moment, row, leaf->n, unit);
    measure_powers(cell, moment, moment_order(g));
}

/* One child's moments about the parent's centre, added. */
static void add_child(const struct sim *sim, const struct gravity *g, const struct node *parent, int32_t n,
                      double scale, double *sum)
{
    const struct node *child = &sim->tree.node[n];
    const float *moment = sim->tree.moment + (int64_t)sim->tree.width[NODE_moment] * n;
    const int order = moment_order(g);
    double t[CELL_TERMS(GRAVITY_ORDER_MAX)] = {g->G * (double)child->mass}, unit = (double)g->cell[n].scale / scale;
    double factor = unit;
    for (int k = 2; k < order; k++) {
        factor *= unit;
        for (int i = CELL_TERMS(k); i < CELL_TERMS(k + 1); i++) t[i] = factor * (double)moment[i - CELL_TERMS(2)];
    }
    struct cell_vector e = {(parent->pos[0] - child->pos[0]) / scale, (parent->pos[1] - child->pos[1]) / scale,
                            (parent->pos[2] - child->pos[2]) / scale};
    switch (order) {
    case 3: cell_shift_moments(t, e, 3); break;
    case 4: cell_shift_moments(t, e, 4); break;
    case 5: cell_shift_moments(t, e, 5); break;
    default: cell_shift_moments(t, e, 6); break;
    }
    for (int i = 0; i < CELL_TERMS(order) - CELL_TERMS(2); i++) sum[i] += t[i + CELL_TERMS(2)];
}

static void inner_moments(const struct sim *sim, const struct gravity *g, int32_t n)
{
    const struct node *node = &sim->tree.node[n];
    struct gravity_cell *cell = &g->cell[n];
    double corner = corner_distance(node), reach = 0, sum[CELL_TERMS(GRAVITY_ORDER_MAX)] = {0};
    cell->scale = unit_above(corner);
    for (int32_t c = node->child; c < node->child + node->n_children; c++) {
        const double *a = node->pos, *b = sim->tree.node[c].pos;
        double d2 = 0;
        for (int k = 0; k < 3; k++) d2 += (a[k] - b[k]) * (a[k] - b[k]);
        reach = fmax(reach, sqrt(d2) + (double)g->cell[c].reach);
        if (sim->tree.width[NODE_moment]) add_child(sim, g, node, c, (double)cell->scale, sum);
    }
    cell->reach = bound(fmin(reach, corner));
    int width = sim->tree.width[NODE_moment];
    if (width == 0) return;
    float *moment = sim->tree.moment + (int64_t)width * n;
    for (int i = 0; i < CELL_TERMS(moment_order(g)) - CELL_TERMS(2); i++) moment[i] = (float)sum[i];
    measure_powers(cell, moment, moment_order(g));
}

/* A cell below a leaf of gravity's: never visited. */
static bool is_below(const struct gravity *g, const struct tree *tree, int32_t n)
{ return tree->node[n].parent >= 0 && gravity_is_leaf(g, &tree->node[tree->node[n].parent]); }

static void place_cell(const struct gravity *g, const struct node *node, struct gravity_cell *cell)
{
    memcpy(cell->pos, node->pos, sizeof cell->pos);
    cell->mass = (float)(g->G * (double)node->mass);
    cell->child = node->child;      /* -1: closed */
    cell->n_children = (int16_t)(gravity_is_leaf(g, node) ? 0 : node->n_children);
    cell->group = gravity_is_group(g, node);
}

/* Cells of several ranks, from the topmost of each. */
static void top_moments(struct sim *sim, struct gravity *g)
{
    const struct tree *tree = &sim->tree;
    if (tree->width[NODE_moment]) ghosts_share_top_column(sim, NODE_moment);
    ghosts_share_top_column(sim, NODE_cell);
    for (int32_t n = tree->n_top - 1; n >= 0; n--) {
        g->cell[n].child = tree->node[n].child;
        if (tree->node[n].place == NODE_TOP) inner_moments(sim, g, n);
    }
}

void gravity_moments_build(struct sim *sim, struct gravity *g)
{
    const struct tree *tree = &sim->tree;
    g->n_cells = tree->n_fixed;
    g->cell = tree_column(tree, NODE_cell);
    g->least = tree_column(tree, NODE_least);
    gravity_rows_build(sim, g);
#pragma omp parallel for schedule(dynamic, 64)
    for (int32_t n = 0; n < g->n_cells; n++) {
        g->cell[n] = (struct gravity_cell){0};
        if (is_below(g, tree, n)) continue;
        place_cell(g, &tree->node[n], &g->cell[n]);
        gravity_rows_place(g, n, &tree->node[n]);
        if (g->cell[n].n_children == 0 && tree->node[n].place == NODE_OWN) leaf_moments(sim, g, n);
    }
    for (int32_t n = g->n_cells - 1; n >= 0; n--)
        if (g->cell[n].n_children > 0 && tree->node[n].place == NODE_OWN) inner_moments(sim, g, n);
    g->n_placed = g->n_cells;
    if (tree->n_top > 0) top_moments(sim, g);
    g->built = g->fitted = tree->fitted;
    gravity_moments_least(sim, g);
}

/* Cells that have come are as their ranks have them, but for the place of their children. */
void gravity_moments_open(struct sim *sim, struct gravity *g)
{
    struct tree *tree = &sim->tree;
    if (tree->n_top == 0 || g->opening.solver == SOLVER_DIRECT) return;
    g->cell = tree_column(tree, NODE_cell);
    g->least = tree_column(tree, NODE_least);
    g->leaf = mem_resize("gravity", g->leaf, (size_t)tree->n_nodes * sizeof *g->leaf);
    for (int32_t n = 0; n < tree->n_nodes; n++) {
        if (n == tree->n_top) n = tree->n_fixed;
        if (n == tree->n_nodes) break;
        if (tree->node[n].place != NODE_AWAY) continue;
        g->cell[n].child = tree->node[n].child;
        if (n >= g->n_placed) gravity_rows_place(g, n, &tree->node[n]);
        if (ghosts_have_rows(sim, n, gravity_ghost_rows(g))) gravity_rows_use(g, n);
    }
    g->n_placed = tree->n_nodes;
}

void gravity_moments_refit(struct sim *sim, struct gravity *g)
{
    const struct tree *tree = &sim->tree;
    double dt = timeline_seconds(&sim->time, tree->fitted - g->fitted);
    gravity_moments_open(sim, g);   /* closed by the refit of the tree */
#pragma omp parallel for if (g->n_cells > 8192)
    for (int32_t n = 0; n < g->n_cells; n++) {
        struct gravity_cell *cell = &g->cell[n];
        const struct node *node = &tree->node[n];
        if (cell->scale <= 0) continue;
        memcpy(cell->pos, node->pos, sizeof cell->pos);
        const double corner = corner_distance(node), past = node->slack > 0 ? 0 : INFINITY;     /* of a box just fitted */
        const double reach = (double)cell->reach + sqrt(3) * (double)node->speed * dt + past;
        cell->reach = bound(reach < corner ? reach : corner);
    }
    g->fitted = tree->fitted;
    g->epoch++;
}

/* Mean square of the column grav, in blocks whose sums are added in order. It is used as a float: that its last bits
 * depend on where domains end has no effect. */
static double mean_square(const struct sim *sim)
{
    enum { BLOCK = 8192 };
    double sum = 0, rows = 0;
    for_species(sim, s) {
        const int64_t from = species_from(s), to = species_to(s), blocks = (to - from + BLOCK - 1) / BLOCK;
        double *part = mem_array("gravity", double, blocks);
#pragma omp parallel for
        for (int64_t b = 0; b < blocks; b++)
            for (int64_t i = from + b * BLOCK; i < from + (b + 1) * BLOCK && i < to; i++)
                part[b] += (double)s->grav[i] * (double)s->grav[i];
        for (int64_t b = 0; b < blocks; b++) sum += part[b];
        mem_free(part);
        rows += (double)s->n;
    }
    if (sim->spread) comm_sum(&sum, 1);
    return rows > 0 ? sum / rows : 0;
}

static void inner_least(const struct gravity *g, int32_t n)
{
    const struct gravity_cell *cell = &g->cell[n];
    if (cell->n_children == 0) return;
    g->least[n] = INFINITY;
    for (int32_t c = cell->child; c < cell->child + cell->n_children; c++) g->least[n] = fminf(g->least[n], g->least[c]);
}

void gravity_moments_least(struct sim *sim, struct gravity *g)
{
    if (g->opening.solver != SOLVER_FMM || !g->known) return;
    /* Accelerations below this part of the rms count as it: the floor of `accuracy`. */
    const float floor = (float)(GRAVITY_FLOOR * sqrt(mean_square(sim)));
#pragma omp parallel for schedule(dynamic, 256)
    for (int32_t n = 0; n < g->n_cells; n++) {
        const struct node *node = &sim->tree.node[n];
        if (g->cell[n].scale <= 0 || g->cell[n].n_children > 0 || node->place != NODE_OWN) continue;
        float least = INFINITY;
        for_species(sim, s)
            for (int64_t i = node->first[s->kind]; i < node->first[s->kind] + node->count[s->kind]; i++)
                least = fminf(least, s->grav[i]);
        g->least[n] = fmaxf(least, floor);
    }
    for (int32_t n = g->n_cells - 1; n >= 0; n--)
        if (sim->tree.node[n].place == NODE_OWN) inner_least(g, n);
    if (sim->tree.n_top > 0) ghosts_share_top_column(sim, NODE_least);
    for (int32_t n = sim->tree.n_top - 1; n >= 0; n--)
        if (sim->tree.node[n].place == NODE_TOP) inner_least(g, n);
    ghosts_share_node_column(sim, NODE_least);
}
