/* SPDX-License-Identifier: GPL-3.0-or-later
 * Pair sums: targets in lanes, up to four vectors at a time, sources broadcast; float sums are
 * promoted to double every CHUNK sources. Compiled once an instruction set (see simd_v4.h). */
#include "kernels.h"
#include "pair.h"

enum { CHUNK = 64 };

struct sums { real x, y, z, depth; };
struct target { real x, y, z, soft; simd_int own; };
/* What is known where a kernel is compiled: literals all. */
struct variant { enum softening_form form; bool rough, potential, own; };

HD struct target pairs_load(const struct gravity_targets *t, int i)
{
    return (struct target){ simd_load(t->x + i), simd_load(t->y + i), simd_load(t->z + i),
                            simd_load(t->soft + i), simd_load_int(t->own + i) };
}

HD struct pair pairs_field(real r2, real mass, real soft2, struct variant v)
{
    if (!v.rough) return pair_any(v.form, r2, mass, soft2);
    real u2 = r2 + soft2, zero = real_splat(0);
    if (v.form == SOFT_COMMON) return pair_guess(u2, mass);
    return pair_guess(real_max(u2, real_splat(REAL_FLOOR)), real_if_less(zero, u2, mass, zero));
}

HD void pairs_add(struct sums *sum, struct target t, struct gravity_source s, float soft, int index, struct variant v)
{
    real dx = s.x - t.x, dy = s.y - t.y, dz = s.z - t.z;
    real r2 = dx * dx + dy * dy + dz * dz;
    struct pair p = pairs_field(r2, real_splat(s.mass), v.form == SOFT_COMMON ? real_splat(soft) : soft + t.soft, v);
    sum->x += p.pull * dx;
    sum->y += p.pull * dy;
    sum->z += p.pull * dz;
    if (v.own) p.depth = real_if(t.own == index, real_splat(0), p.depth);
    if (v.potential) sum->depth += p.depth;
}

HD void pairs_promote(struct gravity_targets *t, int i, struct sums sum, struct variant v)
{
    const float pull = v.rough ? 1 : PAIR_PULL, depth = v.rough ? 1 : PAIR_DEPTH;
    simd_promote(t->ax + i, pull * sum.x);
    simd_promote(t->ay + i, pull * sum.y);
    simd_promote(t->az + i, pull * sum.z);
    if (v.potential) simd_promote(t->depth + i, depth * sum.depth);
}

/* `vectors` (1 to 4) is a literal where this is called. */
HD void pairs_block(struct gravity_targets *t, int i, const struct gravity_sources *s, int vectors, struct variant v)
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
            float soft = v.form == SOFT_COMMON ? s->soft2 : s->soft[j];
            pairs_add(&sa, a, row, soft, j, v);
            if (vectors > 1) pairs_add(&sb, b, row, soft, j, v);
            if (vectors > 2) pairs_add(&sc, c, row, soft, j, v);
            if (vectors > 3) pairs_add(&sd, d, row, soft, j, v);
        }
        pairs_promote(t, i, sa, v);
        if (vectors > 1) pairs_promote(t, i + LANES, sb, v);
        if (vectors > 2) pairs_promote(t, i + 2 * LANES, sc, v);
        if (vectors > 3) pairs_promote(t, i + 3 * LANES, sd, v);
    }
}

HD void pairs_all(struct gravity_targets *t, const struct gravity_sources *s, struct variant v)
{
    int vectors = (t->n + LANES - 1) / LANES, done = 0;
    for (; done + 4 <= vectors; done += 4) pairs_block(t, done * LANES, s, 4, v);
    switch (vectors - done) {
    case 3: pairs_block(t, done * LANES, s, 3, v); break;
    case 2: pairs_block(t, done * LANES, s, 2, v); break;
    case 1: pairs_block(t, done * LANES, s, 1, v); break;
    default: break;
    }
}

/* A row is a vector of four floats. */
typedef float four __attribute__((vector_size(16), may_alias, aligned(4)));

static void shift_rows(struct gravity_source *out, const struct gravity_source *row, const float shift[3], int n)
{
    const four by = { shift[0], shift[1], shift[2], 0 };
    for (int i = 0; i < n; i++) *(four *)&out[i] = *(const four *)&row[i] + by;
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

#define PAIRS(name, form, rough) \
    static void name##_acc(struct gravity_targets *t, const struct gravity_sources *s) \
    { pairs_all(t, s, (struct variant){ form, rough, false, false }); } \
    static void name##_pot(struct gravity_targets *t, const struct gravity_sources *s) \
    { pairs_all(t, s, (struct variant){ form, rough, true, false }); } \
    static void name##_own(struct gravity_targets *t, const struct gravity_sources *s) \
    { pairs_all(t, s, (struct variant){ form, rough, true, true }); }
PAIRS(common, SOFT_COMMON, false)
PAIRS(plummer, SOFT_PLUMMER, false)
PAIRS(spline, SOFT_SPLINE, false)
PAIRS(rough_common, SOFT_COMMON, true)
PAIRS(rough_plummer, SOFT_PLUMMER, true)

/* The spline costs so much more that its root is always refined. */
const struct gravity_pair_table SIMD_NAME(gravity_pair_table) = {
    .acc = { { common_acc, plummer_acc, spline_acc }, { rough_common_acc, rough_plummer_acc, spline_acc } },
    .pot = { { common_pot, plummer_pot, spline_pot }, { rough_common_pot, rough_plummer_pot, spline_pot } },
    .own = { { common_own, plummer_own, spline_own }, { rough_common_own, rough_plummer_own, spline_own } },
    .stage = stage_rows,
    .shift = shift_rows,
    .guess_error = SIMD_GUESS_ERROR,
};
