/* SPDX-License-Identifier: GPL-3.0-or-later
 * Pair sums: targets in lanes, up to four vectors at a time, sources broadcast; float sums are
 * promoted to double every CHUNK sources. Compiled once an instruction set (see simd_v4.h). */
#include "kernels.h"
#include "pair.h"

enum { CHUNK = 64 };

struct sums { real x, y, z, depth; };
struct target { real x, y, z, soft; simd_int own; };

HD struct target pairs_load(const struct gravity_targets *t, int i)
{
    return (struct target){ simd_load(t->x + i), simd_load(t->y + i), simd_load(t->z + i),
                            simd_load(t->soft + i), simd_load_int(t->own + i) };
}

HD void pairs_add(struct sums *sum, struct target t, struct gravity_source s, float soft, int index,
                  enum softening_form form, bool potential, bool own)
{
    real dx = s.x - t.x, dy = s.y - t.y, dz = s.z - t.z;
    real r2 = dx * dx + dy * dy + dz * dz;
    struct pair p = pair_any(form, r2, real_splat(s.mass), form == SOFT_COMMON ? real_splat(soft) : soft + t.soft);
    sum->x += p.pull * dx;
    sum->y += p.pull * dy;
    sum->z += p.pull * dz;
    if (own) p.depth = real_if(t.own == index, real_splat(0), p.depth);
    if (potential) sum->depth += p.depth;
}

HD void pairs_promote(struct gravity_targets *t, int i, struct sums sum, bool potential)
{
    simd_promote(t->ax + i, PAIR_PULL * sum.x);
    simd_promote(t->ay + i, PAIR_PULL * sum.y);
    simd_promote(t->az + i, PAIR_PULL * sum.z);
    if (potential) simd_promote(t->depth + i, PAIR_DEPTH * sum.depth);
}

/* `vectors` (1 to 4), form, potential and own are literals where this is called. */
HD void pairs_block(struct gravity_targets *t, int i, const struct gravity_sources *s, int vectors,
                    enum softening_form form, bool potential, bool own)
{
    struct target a = pairs_load(t, i), b = a, c = a, d = a;
    if (vectors > 1) b = pairs_load(t, i + LANES);
    if (vectors > 2) c = pairs_load(t, i + 2 * LANES);
    if (vectors > 3) d = pairs_load(t, i + 3 * LANES);
    for (int from = 0; from < s->n; from += CHUNK) {
        int to = s->n < from + CHUNK ? s->n : from + CHUNK;
        struct sums sa = { 0 }, sb = { 0 }, sc = { 0 }, sd = { 0 };
        for (int j = from; j < to; j++) {
            struct gravity_source row = s->row[j];
            float soft = form == SOFT_COMMON ? 2 * s->soft[0] : s->soft[j];
            pairs_add(&sa, a, row, soft, j, form, potential, own);
            if (vectors > 1) pairs_add(&sb, b, row, soft, j, form, potential, own);
            if (vectors > 2) pairs_add(&sc, c, row, soft, j, form, potential, own);
            if (vectors > 3) pairs_add(&sd, d, row, soft, j, form, potential, own);
        }
        pairs_promote(t, i, sa, potential);
        if (vectors > 1) pairs_promote(t, i + LANES, sb, potential);
        if (vectors > 2) pairs_promote(t, i + 2 * LANES, sc, potential);
        if (vectors > 3) pairs_promote(t, i + 3 * LANES, sd, potential);
    }
}

HD void pairs_all(struct gravity_targets *t, const struct gravity_sources *s, enum softening_form form,
                  bool potential, bool own)
{
    int vectors = (t->n + LANES - 1) / LANES, v = 0;
    for (; v + 4 <= vectors; v += 4) pairs_block(t, v * LANES, s, 4, form, potential, own);
    switch (vectors - v) {
    case 3: pairs_block(t, v * LANES, s, 3, form, potential, own); break;
    case 2: pairs_block(t, v * LANES, s, 2, form, potential, own); break;
    case 1: pairs_block(t, v * LANES, s, 1, form, potential, own); break;
    default: break;
    }
}

/* Two doubles at a time, x and y, then z and the mass: every instruction set has that. */
typedef double two __attribute__((vector_size(16)));
typedef float two_float __attribute__((vector_size(8), may_alias, aligned(4)));

static void stage_rows(struct gravity_source *out, const struct gravity_frame *frame, const double (*pos)[3],
                       const double *mass, int64_t n)
{
    const double *centre = frame->centre;
    const two centre_xy = { centre[0], centre[1] }, centre_z = { centre[2], 0 };
    const two factor_xy = { frame->inverse, frame->inverse }, factor_zm = { frame->inverse, frame->G };
    for (int64_t i = 0; i < n; i++) {
        two xy = { pos[i][0], pos[i][1] }, zm = { pos[i][2], mass[i] };
        *(two_float *)&out[i].x = __builtin_convertvector((xy - centre_xy) * factor_xy, two_float);
        *(two_float *)&out[i].z = __builtin_convertvector((zm - centre_z) * factor_zm, two_float);
    }
}

#define PAIRS(name, form, potential, own) \
    static void name(struct gravity_targets *t, const struct gravity_sources *s) { pairs_all(t, s, form, potential, own); }
PAIRS(common_acc, SOFT_COMMON, false, false)
PAIRS(common_pot, SOFT_COMMON, true, false)
PAIRS(common_own, SOFT_COMMON, true, true)
PAIRS(plummer_acc, SOFT_PLUMMER, false, false)
PAIRS(plummer_pot, SOFT_PLUMMER, true, false)
PAIRS(plummer_own, SOFT_PLUMMER, true, true)
PAIRS(spline_acc, SOFT_SPLINE, false, false)
PAIRS(spline_pot, SOFT_SPLINE, true, false)
PAIRS(spline_own, SOFT_SPLINE, true, true)

const struct gravity_pair_table SIMD_NAME(gravity_pair_table) = {
    .acc = { common_acc, plummer_acc, spline_acc },
    .pot = { common_pot, plummer_pot, spline_pot },
    .stage = stage_rows,
    .own = { common_own, plummer_own, spline_own },
};
