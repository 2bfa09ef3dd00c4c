/* SPDX-License-Identifier: GPL-3.0-or-later
 * Staging: the walk over the tree's boxes that finds the rows in reach of a batch, and the rows'
 * state now in floats about the batch's centre. See sph.h. */
#include "ghosts.h"
#include "integrate.h"
#include "sph.h"
#include <float.h>
#include <math.h>

struct sph_region sph_batch_rows(const struct sim *sim, const struct sph_batch *batch)
{
    return (struct sph_region){sim->species[GAS].active + batch->first, batch->count};
}

float sph_largest_h(const struct sim *sim, struct sph_region rows)
{
    float largest = 0;
    for (int r = 0; r < rows.n; r++) largest = fmaxf(largest, sph_h_now(sim, rows.row[r]));
    return largest;
}

void sph_centre(struct sph_work *work, const struct sim *sim, int32_t node, struct sph_region region)
{
    const struct node *cell = &sim->tree.node[node];
    for (int k = 0; k < 3; k++) {
        work->centre[k] = work->origin[k] = cell->pos[k];
        work->vel[k] = (double)cell->vel[k];
        work->low[k] = INFINITY;
        work->high[k] = -INFINITY;
    }
    for (int r = 0; r < region.n; r++) {
        double pos[3];
        sim_predict(&sim->time, &sim->species[GAS], region.row[r], pos);
        for (int k = 0; k < 3; k++) {
            float x = (float)(pos[k] - work->centre[k]);
            work->low[k] = x < work->low[k] ? x : work->low[k];
            work->high[k] = x > work->high[k] ? x : work->high[k];
        }
    }
}

/* Without it gcc -O2 keeps the loops over three axes, at twice the cost of the walk. */
#define for_axes(k) _Pragma("GCC unroll 3") for (int k = 0; k < 3; k++)

/* Time from the row's state to now. */
static inline double row_lag(const struct sim *sim, int32_t i)
{
    return timeline_lag(&sim->time, sim->species[GAS].rung[i], sim->species[GAS].rung0[i]);
}

static inline void row_position(const double origin[3], const struct sim *sim, int32_t i, double t, float x[3])
{
    const struct species *gas = &sim->species[GAS];
    for_axes(k)
        x[k] = (float)(integrate_position(gas->pos[i][k], gas->vel[i][k], (double)gas->acc[i][k], t) - origin[k]);
}

static inline struct sph_place place_row(const struct sph_work *work, const struct sim *sim, int32_t i)
{
    return sph_row_place(work->origin, work->vel, &sim->time, &sim->species[GAS], i);
}

struct sph_place sph_place_row(const struct sph_work *work, const struct sim *sim, int32_t i)
{
    return place_row(work, sim, i);
}

/* The larger of x and 0, without a call (fmax must see NaN) and without a branch that nobody foresees. */
static inline double positive(double x) { return 0.5 * (x + fabs(x)); }
static inline float positive_float(float x) { return 0.5f * (x + fabsf(x)); }

/* Squared distance of a box given by its ends, about the work's centre, from the region's box. */
static inline double box_gap2(const struct sph_work *work, const double low[3], const double high[3])
{
    double sum = 0;
    for_axes(k) {
        double gap = positive(low[k] - (double)work->high[k]) + positive((double)work->low[k] - high[k]);
        sum += gap * gap;
    }
    return sum;
}

/* The same of a row. */
static inline float row_gap2(const struct sph_work *work, const float x[3])
{
    float sum = 0;
    for_axes(k) {
        float gap = positive_float(x[k] - work->high[k]) + positive_float(work->low[k] - x[k]);
        sum += gap * gap;
    }
    return sum;
}

struct walk { struct sph_reach reach; int64_t skip; };

/* What the float arithmetic of the tile may lose against the boxes in double. */
static const double margin = 1 + 1e-5;

static inline float reach_of(const struct sph_reach *reach, float h)
{
    return reach->rows + reach->least + positive_float(reach->factor * h - reach->least);
}

static bool node_near(const struct sph_work *work, const struct tree *tree, int32_t n, const struct sph_reach *reach)
{
    const struct node *node = &tree->node[n];
    double low[3], high[3], r = (double)reach_of(reach, reach->factor > 0 ? tree->h_max[n] : 0);
    if (node->count[GAS] == 0) return false;
    for_axes(k) {
        double x = node->pos[k] - work->origin[k];
        low[k] = x + (double)node->low[k];
        high[k] = x + (double)node->high[k];
    }
    return box_gap2(work, low, high) <= margin * r * r;
}

static inline void put_place(struct sph_tile *tile, int slot, struct sph_place place, float other)
{
    tile->place[slot] = place;
    tile->x[slot] = place.x;
    tile->y[slot] = place.y;
    tile->z[slot] = place.z;
    tile->reach[slot] = other * 2.0f * place.half_h;
}

/* A search for h stages what it needs, positions and masses. Whether a row is in reach is as good as
 * random, so all are written and those out of reach are written over. */
static void take_positions(struct sph_work *work, const struct sim *sim, const struct node *node, struct sph_reach reach)
{
    struct sph_tile *tile = &work->tile;
    const struct species *gas = &sim->species[GAS];
    int n = tile->n;
    for (int32_t i = node->first[GAS]; i < node->first[GAS] + node->count[GAS]; i++) {
        if (n == SPH_TILE) {
            work->more = true;
            break;
        }
        float x[3];
        double t = row_lag(sim, i);
        row_position(work->origin, sim, i, t, x);
        /* Its search may be over, or not: both the h of now and the expected one count. */
        float r = reach_of(&reach, reach.factor > 0 ? fmaxf(t > 0 ? 0 : gas->h[i], sph_h_expected(sim, i, (float)t)) : 0);
        tile->x[n] = x[0];
        tile->y[n] = x[1];
        tile->z[n] = x[2];
        tile->mass[n] = (float)gas->mass[i];
        tile->reach[n] = 0;
        work->row[n] = i;
        n += row_gap2(work, x) <= (float)margin * r * r;
    }
    tile->n = n;
}

static void take_places(struct sph_work *work, const struct sim *sim, const struct node *node, struct walk *walk)
{
    struct sph_tile *tile = &work->tile;
    for (int32_t i = node->first[GAS]; i < node->first[GAS] + node->count[GAS]; i++) {
        if (walk->reach.beyond && !sph_is_beyond(walk->reach.beyond, i)) continue;
        struct sph_place p = place_row(work, sim, i);
        float r = reach_of(&walk->reach, 2.0f * p.half_h);
        if (row_gap2(work, (const float[3]){p.x, p.y, p.z}) > (float)margin * r * r || walk->skip-- > 0) continue;
        if (tile->n == SPH_TILE) {
            work->more = true;
            return;
        }
        put_place(tile, tile->n, p, work->meet.other);
        work->row[tile->n++] = i;
    }
}

/* Asks for what is in reach of the region. */
static void want(struct sph_work *work, const struct sim *sim, int32_t n, const struct sph_reach *reach)
{
    struct ghost_want want = {.angle = INFINITY, .rows = GHOST_ALL};
    const double r = (double)reach_of(reach, reach->factor > 0 ? sim->tree.h_max[n] : 0);
    for (int k = 0; k < 3; k++) {
        want.low[k] = work->origin[k] + (double)work->low[k] - r;
        want.high[k] = work->origin[k] + (double)work->high[k] + r;
    }
    ghosts_want(sim, n, sim->tree.node[n].n_children == 0, &want);
    work->missing = true;
}

/* Depth first in the order of the children, so that entries come in row order. */
static void visit(struct sph_work *work, const struct sim *sim, int32_t n, struct walk *walk)
{
    const struct node *node = &sim->tree.node[n];
    if (work->more || !node_near(work, &sim->tree, n, &walk->reach)) return;
    if (node_is_closed(node) || (node->n_children == 0 && !ghosts_have_rows(sim, n, GHOST_ALL))) {
        want(work, sim, n, &walk->reach);
        return;
    }
    if (node->n_children == 0) {
        if (walk->reach.search) take_positions(work, sim, node, walk->reach);
        else take_places(work, sim, node, walk);
    }
    for (int32_t k = 0; k < node->n_children; k++) visit(work, sim, node->child + k, walk);
}

/* Once for each image of the box whose rows may be in reach; seen from image s the origin lies at -s. */
static void visit_images(struct sph_work *work, const struct sim *sim, struct walk *walk)
{
    const struct node *root = &sim->tree.node[0];
    double reach = margin * (double)reach_of(&walk->reach, walk->reach.factor > 0 ? sim->tree.h_max[0] : 0);
    double all[2][3], near[2][3];
    for (int k = 0; k < 3; k++) {
        all[0][k] = root->pos[k] + (double)root->low[k];
        all[1][k] = root->pos[k] + (double)root->high[k];
        near[0][k] = work->centre[k] + (double)work->low[k] - reach;
        near[1][k] = work->centre[k] + (double)work->high[k] + reach;
    }
    struct box_images images = box_images(&sim->box, all, near);
    int s[3];
    for (s[0] = images.first[0]; s[0] <= images.last[0]; s[0]++)
        for (s[1] = images.first[1]; s[1] <= images.last[1]; s[1]++)
            for (s[2] = images.first[2]; s[2] <= images.last[2]; s[2]++) {
                for (int k = 0; k < 3; k++) work->origin[k] = work->centre[k] - s[k] * sim->box.side[k];
                visit(work, sim, 0, walk);
            }
    for (int k = 0; k < 3; k++) work->origin[k] = work->centre[k];
}

void sph_gather(struct sph_work *work, const struct sim *sim, struct sph_reach reach, int64_t skip)
{
    struct walk walk = {reach, skip};
    work->tile.n = 0;
    work->more = work->missing = false;
    visit_images(work, sim, &walk);
}

bool sph_nearest(const struct sph_work *work, const struct sim *sim)
{
    const struct sph_tile *tile = &work->tile;
    const float *const x[3] = {tile->x, tile->y, tile->z};
    bool nearest = true;
    for (int k = 0; k < 3; k++) {
        double side = sim->box.side[k];
        float most = side > 0 ? (float)(0.499 * side) : INFINITY;
        for (int e = 0; e < tile->n; e++) nearest &= fabsf(x[k][e]) < most;
    }
    return nearest;
}

/* Lets the row's image nearest to the centre be staged. */
static void choose_image(struct sph_work *work, const struct sim *sim, int32_t i)
{
    double pos[3];
    sim_predict(&sim->time, &sim->species[GAS], i, pos);
    for (int k = 0; k < 3; k++)
        work->origin[k] = work->centre[k] - box_shift(&sim->box, k, pos[k] - work->centre[k]);
}

void sph_stage(struct sph_work *work, const struct sim *sim, int n)
{
    bool closed = box_closed(&sim->box);
    for (int k = 0; k < n; k++) {
        if (closed) choose_image(work, sim, work->row[k]);
        put_place(&work->tile, k, place_row(work, sim, work->row[k]), work->meet.other);
    }
    for (int k = 0; k < 3; k++) work->origin[k] = work->centre[k];
    work->tile.n = n;
    work->more = false;
}

void sph_stage_state(struct sph_work *work, const struct sim *sim, const struct sph *sph)
{
    const struct sph_law law = sph_law_of(sph);
    for (int k = 0; k < work->tile.n; k++)
        work->tile.state[k] = sph_row_state(law, &sim->time, &sim->species[GAS], work->row[k]);
}

struct sph_box sph_lanes_fill(struct sph_lanes *lanes, const struct sph_work *work, const struct sim *sim,
                              struct sph_region cluster)
{
    float low[3] = {FLT_MAX, FLT_MAX, FLT_MAX}, high[3] = {-FLT_MAX, -FLT_MAX, -FLT_MAX};
    for (int l = 0; l < SPH_LANES; l++) {
        struct sph_place p = sph_place_row(work, sim, cluster.row[l < cluster.n ? l : cluster.n - 1]);
        const float x[3] = {p.x, p.y, p.z};
        for (int k = 0; k < 3; k++) {
            low[k] = x[k] < low[k] ? x[k] : low[k];
            high[k] = x[k] > high[k] ? x[k] : high[k];
        }
        lanes->x[l] = p.x;
        lanes->y[l] = p.y;
        lanes->z[l] = p.z;
        lanes->half_h[l] = p.half_h;
        lanes->vx[l] = p.vx;
        lanes->vy[l] = p.vy;
        lanes->vz[l] = p.vz;
        lanes->mass[l] = p.mass;
    }
    struct sph_box box;
    for (int k = 0; k < 3; k++) {
        box.centre[k] = 0.5f * (low[k] + high[k]);
        box.half[k] = 0.5f * (high[k] - low[k]) + 2 * FLT_EPSILON * fmaxf(fabsf(low[k]), fabsf(high[k]));
    }
    return box;
}

void sph_lanes_state(struct sph_lanes *lanes, const struct sim *sim, const struct sph *sph,
                     struct sph_region cluster)
{
    const struct sph_law law = sph_law_of(sph);
    for (int l = 0; l < SPH_LANES; l++) {
        struct sph_state s = sph_row_state(law, &sim->time, &sim->species[GAS], cluster.row[l < cluster.n ? l : cluster.n - 1]);
        lanes->p[l] = s.p;
        lanes->rho[l] = s.rho;
        lanes->half_c[l] = s.half_c;
        lanes->balsara[l] = s.balsara;
    }
}
