/* SPDX-License-Identifier: GPL-3.0-or-later
 * The vectorised loops of SPH: the lanes are rows of one cluster, the loop runs over tile entries,
 * so that nothing is gathered and no sum is taken across lanes. Formulas: pair.h. The search for the
 * smoothing length brackets the distance of the n-th neighbour by values that occur, so that it ends
 * whatever the distances are. Compiled with -ffast-math: nothing here tests for NaN. */
#include "lanes.h"
#include <math.h>
#include <string.h>

#define for_lanes(l) _Pragma("omp simd") for (int l = 0; l < SPH_LANES; l++)

/* An empty statement that the compiler cannot move: with -O3 gcc 12 would fuse several turns of the
 * loop around it (unroll and jam) and leave most of the lanes' loop scalar, 2.8 times slower. */
#define STAY_APART() __asm__ volatile("")

static inline float larger(float a, float b) { return a > b ? a : b; }
static inline float smaller(float a, float b) { return a < b ? a : b; }

static int filter(struct sph_tile *tile, struct sph_box box, float reach)
{
    uint8_t *restrict near = tile->near;
    for (int j = 0; j < tile->n; j++) {
        float x = larger(fabsf(tile->x[j] - box.centre[0]) - box.half[0], 0.0f);
        float y = larger(fabsf(tile->y[j] - box.centre[1]) - box.half[1], 0.0f);
        float z = larger(fabsf(tile->z[j] - box.centre[2]) - box.half[2], 0.0f);
        float r = reach + tile->reach[j];
        near[j] = x * x + y * y + z * z <= r * r;
    }
    int n = 0, blocks = (tile->n + 7) / 8;
    memset(near + tile->n, 0, (size_t)(8 * blocks - tile->n));
    for (int b = 0; b < blocks; b++) {
        uint64_t any;
        memcpy(&any, near + 8 * b, sizeof any);
        if (any == 0) continue;
        for (int j = 8 * b; j < 8 * b + 8; j++) {
            tile->list[n] = (uint16_t)j;
            n += near[j];
        }
    }
    return n;
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
                     struct sph_density_sums *restrict sums, enum sph_kernel kind)
{
    struct sph_density_sums s = *sums;
    for (int k = 0; k < n; k++) {
        const struct sph_place j = tile->place[tile->list[k]];
        STAY_APART();
        for_lanes(l) {
            struct sph_density d = sph_density_pair(lane_place(i, l), j, kind);
            s.rho[l] += d.rho;
            s.div[l] += d.div;
            s.curl[0][l] += d.curl_x;
            s.curl[1][l] += d.curl_y;
            s.curl[2][l] += d.curl_z;
        }
    }
    *sums = s;
}

HD void force_rows(const struct sph_lanes *restrict i, const struct sph_tile *restrict tile, int n,
                   struct sph_viscosity visc, struct sph_force_sums *restrict sums, enum sph_kernel kind)
{
    struct sph_force_sums s = *sums;
    for (int k = 0; k < n; k++) {
        const struct sph_place j = tile->place[tile->list[k]];
        const struct sph_state sj = tile->state[tile->list[k]];
        for_lanes(l) {
            struct sph_force f = sph_force_pair(lane_place(i, l), lane_state(i, l), j, sj, visc, kind);
            s.acc[0][l] += f.ax;
            s.acc[1][l] += f.ay;
            s.acc[2][l] += f.az;
            s.du[l] += f.du;
            s.signal[l] = larger(s.signal[l], f.signal);
        }
    }
    *sums = s;
}

static void density(const struct sph_lanes *i, const struct sph_tile *tile, int n, struct sph_density_sums *sums)
{
    density_rows(i, tile, n, sums, SPH_CUBIC);
}

static void force(const struct sph_lanes *i, const struct sph_tile *tile, int n, struct sph_viscosity visc,
                  struct sph_force_sums *sums)
{
    force_rows(i, tile, n, visc, sums, SPH_CUBIC);
}

/* Fills tile->r2 for the listed entries; nearest: the smallest that is not 0. */
static void measure(const struct sph_lanes *restrict i, struct sph_tile *restrict tile, int n,
                    float nearest[restrict SPH_LANES])
{
    float least[SPH_LANES];
    for_lanes(l) least[l] = SPH_FAR;
    for (int k = 0; k < n; k++) {
        const struct sph_place j = tile->place[tile->list[k]];
        for_lanes(l) {
            float x = j.x - i->x[l], y = j.y - i->y[l], z = j.z - i->z[l], r2 = x * x + y * y + z * z;
            tile->r2[k][l] = r2;
            least[l] = smaller(least[l], r2 > 0.0f ? r2 : SPH_FAR);
        }
    }
    memcpy(nearest, least, sizeof least);
}

/* How many lie below t, the largest of those, and the smallest of the others. */
struct split { float count[SPH_LANES], below[SPH_LANES], above[SPH_LANES]; };

static void split(const struct sph_tile *restrict tile, int n, const float t[restrict SPH_LANES],
                  struct split *restrict out)
{
    struct split s;
    for_lanes(l) {
        s.count[l] = s.below[l] = 0.0f;
        s.above[l] = SPH_FAR;
    }
    for (int k = 0; k < n; k++)
        for_lanes(l) {
            float r2 = tile->r2[k][l];
            s.count[l] += r2 < t[l] ? 1.0f : 0.0f;
            s.below[l] = larger(s.below[l], r2 < t[l] ? r2 : 0.0f);
            s.above[l] = smaller(s.above[l], r2 < t[l] ? SPH_FAR : r2);
        }
    *out = s;
}

/* Where to look next between low (not enough) and high (enough, or the limit): where Newton's step
 * leads, or the middle, which is taken every third time so that the bracket shrinks in any case. */
static float next_try(float newton, float low, float high, int round)
{
    float middle = low + 0.5f * (high - low);
    if (newton > low && newton < high && round % 3 > 0) return newton;
    return middle > low ? middle : high;
}

static void search_exact(const struct sph_lanes *i, struct sph_tile *tile, int n, struct sph_search *search)
{
    float nearest[SPH_LANES], low[SPH_LANES], high[SPH_LANES], t[SPH_LANES], target = search->target;
    bool open[SPH_LANES];
    measure(i, tile, n, nearest);
    for (int l = 0; l < SPH_LANES; l++) {
        low[l] = 0.0f;
        high[l] = search->limit[l];
        t[l] = smaller(search->guess[l], high[l]);
        open[l] = true;
    }
    for (int round = 1, left = SPH_LANES; left > 0; round++) {
        struct split s;
        split(tile, n, t, &s);
        left = 0;
        for (int l = 0; l < SPH_LANES; l++) {
            if (!open[l]) continue;
            bool enough = s.count[l] >= target, last = s.count[l] == (enough ? target : target - 1.0f);
            if (enough) high[l] = s.below[l];
            else low[l] = s.above[l];
            open[l] = !last && low[l] < high[l];
            left += open[l];
            if (open[l])
                t[l] = next_try(t[l] + t[l] * (target - 0.5f - s.count[l]) / (1.5f * larger(s.count[l], 1.0f)),
                                low[l], high[l], round);
            else
                search->guess[l] = larger(nearest[l], enough ? high[l] : low[l]);
        }
    }
    for (int l = 0; l < SPH_LANES; l++) search->found[l] = search->guess[l] < search->limit[l];
}

/* Sum over the entries of m_j w pi, and h times its derivative. */
struct weight { float sum[SPH_LANES], slope[SPH_LANES]; };

HD void weigh(const struct sph_tile *restrict tile, int n, const float h[restrict SPH_LANES],
              struct weight *restrict out, enum sph_kernel kind)
{
    struct weight s = {{0}, {0}};
    for (int k = 0; k < n; k++) {
        float mass = tile->place[tile->list[k]].mass * SPH_PI;
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
    const float enough = 1e-6f; /* relative: the rounding of the sum */
    float nearest[SPH_LANES], low[SPH_LANES], high[SPH_LANES], h[SPH_LANES];
    bool open[SPH_LANES];
    measure(i, tile, n, nearest);
    for (int l = 0; l < SPH_LANES; l++) {
        low[l] = 0.0f;
        high[l] = 0.5f * sqrtf(search->limit[l]);
        h[l] = smaller(0.5f * sqrtf(search->guess[l]), high[l]);
        open[l] = true;
        search->found[l] = false;
    }
    for (int round = 1, left = SPH_LANES; left > 0; round++) {
        struct weight s;
        weigh(tile, n, h, &s, kind);
        left = 0;
        for (int l = 0; l < SPH_LANES; l++) {
            if (!open[l]) continue;
            float excess = s.sum[l] - search->target * i->mass[l];
            bool beyond = excess < 0.0f && h[l] >= high[l];
            if (excess < 0.0f) low[l] = h[l];
            else high[l] = h[l];
            search->found[l] |= excess >= 0.0f;
            open[l] = !beyond && fabsf(excess) > enough * s.sum[l] && high[l] - low[l] > enough * high[l];
            left += open[l];
            search->guess[l] = beyond ? SPH_FAR : larger(nearest[l], 4.0f * h[l] * h[l]);
            float newton = h[l] - h[l] * excess / larger(s.slope[l], 1e-30f);
            h[l] = newton >= high[l] && !search->found[l] ? high[l] : next_try(newton, low[l], high[l], round);
        }
    }
    for (int l = 0; l < SPH_LANES; l++) search->found[l] = search->guess[l] < search->limit[l];
}

static void search_smooth(const struct sph_lanes *i, struct sph_tile *tile, int n, struct sph_search *search)
{
    smooth_rows(i, tile, n, search, SPH_CUBIC);
}

const struct sph_loops SIMD_NAME(sph_loops) = {
    .filter = filter, .density = density, .force = force,
    .search_exact = search_exact, .search_smooth = search_smooth,
};
