/* SPDX-License-Identifier: GPL-3.0-or-later
 * The vectorised loops of SPH: the lanes are rows of one cluster, the loop runs over tile entries,
 * so that nothing is gathered and no sum is taken across lanes. Formulas: pair.h, search.h. Compiled with
 * -ffast-math: nothing here tests for NaN. */
#include "lanes.h"
#include "search.h"
#include <math.h>
#include <string.h>

#define for_lanes(l) _Pragma("omp simd") for (int l = 0; l < SPH_LANES; l++)

/* An empty statement that the compiler cannot move: with -O3 gcc 12 would fuse several turns of the
 * loop around it (unroll and jam) and leave most of the lanes' loop scalar, 2.8 times slower. */
#define STAY_APART() __asm__ volatile("")

static inline float larger(float a, float b) { return a > b ? a : b; }
static inline float smaller(float a, float b) { return a < b ? a : b; }

HD real outside(real x, float centre, float half)
{
    real away = real_max(x - centre, centre - x) - half;
    return real_max(away, real_splat(0));
}

/* A pair must not be lost by rounding: what a row finds would depend on the others in its cluster. */
static const float rounding = 1.00001f;

/* Squared distance of places from a box; both may have an extent. */
HD real gap2(const struct sph_box *box, real x, real y, real z, const real half[3])
{
    real dx = outside(x, box->centre[0], box->half[0]) - half[0];
    real dy = outside(y, box->centre[1], box->half[1]) - half[1];
    real dz = outside(z, box->centre[2], box->half[2]) - half[2];
    dx = real_max(dx, real_splat(0));
    dy = real_max(dy, real_splat(0));
    dz = real_max(dz, real_splat(0));
    return dx * dx + dy * dy + dz * dz;
}

/* Lists the entries [from, to) near the box, many at a time, behind n others. */
HD int take(struct sph_tile *tile, const struct sph_box *box, float rows, float least, int from, int to, int n)
{
    for (int j = from; j < to; j += LANES) {
        real x = outside(simd_load(tile->x + j), box->centre[0], box->half[0]);
        real y = outside(simd_load(tile->y + j), box->centre[1], box->half[1]);
        real z = outside(simd_load(tile->z + j), box->centre[2], box->half[2]);
        real r = real_max(simd_load(tile->reach + j), real_splat(least)) + rows;
        n += simd_pack(tile->list + n, x * x + y * y + z * z <= r * r, j);
    }
    return n;
}

/* Blocks near the box. */
static int near_blocks(const struct sph_tile *tile, const struct sph_box *box, float rows, float least, uint16_t *near)
{
    int n = 0;
    for (int b = 0; b < tile->blocks; b += LANES) {
        const real half[3] = {simd_load(tile->block_half[0] + b), simd_load(tile->block_half[1] + b),
                              simd_load(tile->block_half[2] + b)};
        real r2 = gap2(box, simd_load(tile->block_centre[0] + b), simd_load(tile->block_centre[1] + b),
                       simd_load(tile->block_centre[2] + b), half);
        real r = real_max(simd_load(tile->block_reach + b), real_splat(least)) + rows;
        n += simd_pack(near + n, r2 <= rounding * r * r, b);
    }
    while (n > 0 && near[n - 1] >= tile->blocks) n--;
    return n;
}

/* Entries beyond tile->n are staged before (see lanes.h) and not taken. */
static int filter(struct sph_tile *tile, struct sph_box box, float rows, float least)
{
    int n = 0;
    if (tile->blocks > 0) {
        uint16_t near[SPH_BLOCKS + 16];
        const int blocks = near_blocks(tile, &box, rows, least, near);
        for (int k = 0; k < blocks; k++) n = take(tile, &box, rows, least, near[k] * SPH_BLOCK, (near[k] + 1) * SPH_BLOCK, n);
    } else {
        n = take(tile, &box, rows, least, 0, tile->n, 0);
    }
    while (n > 0 && tile->list[n - 1] >= tile->n) n--;
    return n;
}

/* The last block is filled up with its last entry. */
static void enclose(struct sph_tile *tile)
{
    float *const x[3] = {tile->x, tile->y, tile->z};
    tile->blocks = (tile->n + SPH_BLOCK - 1) / SPH_BLOCK;
    for (int j = tile->n; j < tile->blocks * SPH_BLOCK; j++) {
        for (int k = 0; k < 3; k++) x[k][j] = x[k][tile->n - 1];
        tile->reach[j] = tile->reach[tile->n - 1];
    }
    for (int b = 0; b < tile->blocks; b++) {
        const float *reach = tile->reach + b * SPH_BLOCK;
        float most = 0;
        for (int j = 0; j < SPH_BLOCK; j++) most = larger(most, reach[j]);
        tile->block_reach[b] = most;
        for (int k = 0; k < 3; k++) {
            const float *at = x[k] + b * SPH_BLOCK;
            float low = at[0], high = at[0];
            for (int j = 0; j < SPH_BLOCK; j++) {
                low = smaller(low, at[j]);
                high = larger(high, at[j]);
            }
            tile->block_centre[k][b] = 0.5f * (low + high);
            tile->block_half[k][b] = 0.5f * (high - low) + 2.4e-7f * larger(fabsf(low), fabsf(high));
        }
    }
}

/* The lanes in SPANS vectors. */
enum { SPANS = SPH_LANES / SPAN };

struct spot { span x[SPANS], y[SPANS], z[SPANS]; };

HD struct spot lanes_spot(const struct sph_lanes *i)
{
    struct spot spot;
    for (int s = 0; s < SPANS; s++) {
        spot.x[s] = span_load(i->x + SPAN * s);
        spot.y[s] = span_load(i->y + SPAN * s);
        spot.z[s] = span_load(i->z + SPAN * s);
    }
    return spot;
}

/* Squared distances of an entry of the tile from a vector of lanes. */
HD span distances(const struct sph_tile *tile, int j, const struct spot *i, int s)
{
    span x = tile->x[j] - i->x[s], y = tile->y[j] - i->y[s], z = tile->z[j] - i->z[s];
    return x * x + y * y + z * z;
}

/* Of the listed entries, those that meet at least one of the lanes; their number. */
static int prune(const struct sph_lanes *restrict i, struct sph_tile *restrict tile, int n, struct sph_meet meet)
{
    struct spot spot = lanes_spot(i);
    int met = 0;
    for (int k = 0; k < n; k++) {
        int j = tile->list[k], any = 0;
        for (int s = 0; s < SPANS; s++) {
            span h = 2.0f * span_load(i->half_h + SPAN * s);
            span r = meet.own * h + span_max(meet.least * h, span_splat(tile->reach[j]));
            any |= span_bits(distances(tile, j, &spot, s) < rounding * r * r);
        }
        tile->list[met] = (uint16_t)j;
        met += any != 0;
    }
    return met;
}

static inline struct sph_place lane_place(const struct sph_lanes *i, int l)
{
    return (struct sph_place){i->x[l], i->y[l], i->z[l], i->half_h[l], i->vx[l], i->vy[l], i->vz[l], i->mass[l]};
}

static inline struct sph_state lane_state(const struct sph_lanes *i, int l)
{
    return (struct sph_state){i->p[l], i->rho[l], i->half_c[l], i->balsara[l]};
}

HD void density_rows(const struct sph_lanes *restrict i, const struct sph_tile *restrict tile, int n,
                     struct sph_density_sums *restrict sums, enum sph_kernel kind, bool grad_h)
{
    struct sph_density_sums s = *sums;
    for (int k = 0; k < n; k++) {
        const struct sph_place j = tile->place[tile->list[k]];
        STAY_APART();
        for_lanes(l) {
            struct sph_density d = sph_density_pair(lane_place(i, l), j, kind, grad_h);
            s.rho[l] += d.rho;
            s.div[l] += d.div;
            s.curl[0][l] += d.curl_x;
            s.curl[1][l] += d.curl_y;
            s.curl[2][l] += d.curl_z;
            if (grad_h) s.swell[l] += d.swell;
        }
    }
    *sums = s;
}

HD void force_rows(const struct sph_lanes *restrict i, const struct sph_tile *restrict tile, int n,
                   struct sph_viscosity visc, struct sph_force_sums *restrict sums, enum sph_kernel kind, bool grad_h,
                   bool signal_velocity, bool conducting)
{
    struct sph_force_sums s = *sums;
    for (int k = 0; k < n; k++) {
        const struct sph_place j = tile->place[tile->list[k]];
        const struct sph_state sj = tile->state[tile->list[k]];
        for_lanes(l) {
            struct sph_force f = sph_force_pair(lane_place(i, l), lane_state(i, l), j, sj, visc, kind, grad_h, signal_velocity);
            if (conducting) f.du += sph_conduct_pair(lane_place(i, l), lane_state(i, l), j, sj, visc, kind, grad_h);
            s.acc[0][l] += f.ax;
            s.acc[1][l] += f.ay;
            s.acc[2][l] += f.az;
            s.du[l] += f.du;
            s.signal[l] = larger(s.signal[l], f.signal);
        }
    }
    *sums = s;
}

#define DENSITY(name, kind, grad_h) \
    static void name(const struct sph_lanes *i, const struct sph_tile *tile, int n, struct sph_density_sums *sums) \
    { density_rows(i, tile, n, sums, kind, grad_h); }
#define FORCE_LOOP(name, kind, grad_h, signal, conducting) \
    static void name(const struct sph_lanes *i, const struct sph_tile *tile, int n, struct sph_viscosity visc, \
                     struct sph_force_sums *sums) { force_rows(i, tile, n, visc, sums, kind, grad_h, signal, conducting); }
#define FORCE(name, kind, grad_h, signal) \
    FORCE_LOOP(name, kind, grad_h, signal, false) \
    FORCE_LOOP(name##_conducting, kind, grad_h, signal, true)
#define VARIANTS(name, kind) \
    DENSITY(density_##name, kind, false) \
    DENSITY(density_##name##_h, kind, true) \
    FORCE(force_##name, kind, false, false) \
    FORCE(force_##name##_signal, kind, false, true) \
    FORCE(force_##name##_h, kind, true, false) \
    FORCE(force_##name##_h_signal, kind, true, true)
VARIANTS(cubic, SPH_CUBIC)
VARIANTS(c2, SPH_WENDLAND_C2)
VARIANTS(c4, SPH_WENDLAND_C4)

/* Fills tile->r2 for those of the listed entries that lie within a lane's limit, which stay listed;
 * returns their number. nearest: the smallest that is not 0. */
static int measure(const struct sph_lanes *restrict i, struct sph_tile *restrict tile, int n,
                   const float limit[restrict SPH_LANES], float nearest[restrict SPH_LANES])
{
    struct spot spot = lanes_spot(i);
    const span far = span_splat(SPH_FAR);
    span least[SPANS];
    int near = 0;
    for (int s = 0; s < SPANS; s++) least[s] = far;
    for (int k = 0; k < n; k++) {
        int j = tile->list[k], any = 0;
        for (int s = 0; s < SPANS; s++) {
            span r2 = distances(tile, j, &spot, s);
            least[s] = span_min(least[s], span_if(r2 > 0.0f, r2, far));
            span_store(tile->r2[near] + SPAN * s, r2);
            any |= span_bits(r2 < span_load(limit + SPAN * s));
        }
        tile->list[near] = (uint16_t)j;
        near += any != 0;
    }
    for (int s = 0; s < SPANS; s++) span_store(nearest + SPAN * s, least[s]);
    return near;
}

/* How many lie below t, the largest of those, and the smallest of the others. */
struct split { float count[SPH_LANES], below[SPH_LANES], above[SPH_LANES]; };

HD void split_span(const struct sph_tile *restrict tile, int n, const float *at, struct split *restrict out, int first)
{
    const span far = span_splat(SPH_FAR), none = {0}, t = span_load(at + first);
    span below = none, above = far;
    span_int count = {0};
    for (int k = 0; k < n; k++) {
        span r2 = span_load(tile->r2[k] + first);
        span_int less = r2 < t;
        count -= less;
        below = span_max(below, span_if(less, r2, none));
        above = span_min(above, span_if(less, far, r2));
    }
    for (int l = 0; l < SPAN; l++) out->count[first + l] = (float)count[l];
    span_store(out->below + first, below);
    span_store(out->above + first, above);
}

static void split(const struct sph_tile *restrict tile, int n, const float at[restrict SPH_LANES],
                  struct split *restrict out)
{
    for (int s = 0; s < SPANS; s++) split_span(tile, n, at, out, SPAN * s);
}

static void search_exact(const struct sph_lanes *i, struct sph_tile *tile, int n, struct sph_search *search)
{
    float nearest[SPH_LANES], at[SPH_LANES];
    struct sph_bracket bracket[SPH_LANES];
    n = measure(i, tile, n, search->limit, nearest);
    for (int l = 0; l < SPH_LANES; l++) {
        bracket[l] = sph_exact_begin(search->guess[l], search->limit[l]);
        at[l] = bracket[l].at;
    }
    for (int round = 1, left = SPH_LANES; left > 0; round++) {
        struct split s;
        split(tile, n, at, &s);
        left = 0;
        for (int l = 0; l < SPH_LANES; l++) {
            if (!bracket[l].open) continue;
            sph_exact_turn(&bracket[l], (struct sph_split){s.count[l], s.below[l], s.above[l]}, search->target, nearest[l], round);
            at[l] = bracket[l].at;
            left += bracket[l].open;
        }
    }
    for (int l = 0; l < SPH_LANES; l++) {
        search->guess[l] = bracket[l].radius2;
        search->found[l] = search->guess[l] < search->limit[l];
    }
}

/* Sum over the entries of m_j w pi, and h times its derivative. */
struct weight { float sum[SPH_LANES], slope[SPH_LANES]; };

HD void weigh(const struct sph_tile *restrict tile, int n, const float h[restrict SPH_LANES],
              struct weight *restrict out, enum sph_kernel kind)
{
    struct weight s = {{0}, {0}};
    for (int k = 0; k < n; k++) {
        float mass = tile->mass[tile->list[k]] * SPH_PI;
        for_lanes(l) {
            float q = sqrtf(tile->r2[k][l]) / h[l];
            s.sum[l] += mass * sph_kernel(q, kind);
            s.slope[l] -= mass * q * sph_kernel_slope(q, kind);
        }
    }
    *out = s;
}

HD void smooth_rows(const struct sph_lanes *i, struct sph_tile *tile, int n, struct sph_search *search,
                    enum sph_kernel kind)
{
    float nearest[SPH_LANES], h[SPH_LANES];
    struct sph_bracket bracket[SPH_LANES];
    n = measure(i, tile, n, search->limit, nearest);
    for (int l = 0; l < SPH_LANES; l++) {
        bracket[l] = sph_smooth_begin(search->guess[l], search->limit[l]);
        h[l] = bracket[l].at;
    }
    for (int round = 1, left = SPH_LANES; left > 0; round++) {
        struct weight s;
        weigh(tile, n, h, &s, kind);
        left = 0;
        for (int l = 0; l < SPH_LANES; l++) {
            if (!bracket[l].open) continue;
            sph_smooth_turn(&bracket[l], s.sum[l], s.slope[l], search->target * i->mass[l], nearest[l], round);
            h[l] = bracket[l].at;
            left += bracket[l].open;
        }
    }
    for (int l = 0; l < SPH_LANES; l++) {
        search->guess[l] = bracket[l].radius2;
        search->found[l] = search->guess[l] < search->limit[l];
    }
}

#define SMOOTH(name, kind) \
    static void name(const struct sph_lanes *i, struct sph_tile *tile, int n, struct sph_search *search) \
    { smooth_rows(i, tile, n, search, kind); }
SMOOTH(smooth_cubic, SPH_CUBIC)
SMOOTH(smooth_c2, SPH_WENDLAND_C2)
SMOOTH(smooth_c4, SPH_WENDLAND_C4)

#define DENSITIES(name) {density_##name, density_##name##_h}
#define BOTH(name) {name, name##_conducting}
#define FORCES(name) {{BOTH(force_##name), BOTH(force_##name##_signal)}, {BOTH(force_##name##_h), BOTH(force_##name##_h_signal)}}

const struct sph_loops SIMD_NAME(sph_loops) = {
    .enclose = enclose, .filter = filter, .prune = prune, .search_exact = search_exact,
    .search_smooth = {smooth_cubic, smooth_c2, smooth_c4},
    .density = {DENSITIES(cubic), DENSITIES(c2), DENSITIES(c4)},
    .force = {FORCES(cubic), FORCES(c2), FORCES(c4)},
};
