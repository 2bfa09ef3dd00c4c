/* SPDX-License-Identifier: GPL-3.0-or-later
 * Which source cells a target cell accepts: many sources at a time, in lanes. Compiled once an
 * instruction set (see simd_v4.h). The rules are explained in walk.c. */
#include "judge.h"
#include "kernels.h"
#include <stdbool.h>
#include <stddef.h>
#include <string.h>

enum { CHUNK = 64 };
/* Words of a record: a position, then the cell from `reach` to its end. */
enum { X, Y, Z, CELL, REACH, SCALE, MASS, POWER, N_CHILDREN = 13, SUPPORT, LEAST, RECORD };
enum { FIRST = offsetof(struct gravity_cell, reach), BYTES = offsetof(struct gravity_cell, group) + 2 - FIRST };
_Static_assert(FIRST + (POWER - REACH) * 4 == offsetof(struct gravity_cell, power), "record as the cell");
_Static_assert(FIRST + (N_CHILDREN - REACH) * 4 == offsetof(struct gravity_cell, n_children), "record as the cell");

typedef double four_doubles __attribute__((vector_size(32)));
typedef double four_in_memory __attribute__((vector_size(32), may_alias, aligned(8)));
typedef float four_floats __attribute__((vector_size(16), may_alias));

/* A cell's record with its position relative to the target, all as floats (or their bits). What
 * follows the position in the cell fills the fourth lane and means nothing there. */
HD void judge_stage(float record[RECORD], const struct gravity_view *v, const struct gravity_cell *cell)
{
    const double inverse = 1 / v->unit;
    const four_doubles centre = { v->centre[0], v->centre[1], v->centre[2], 0 }, factor = { inverse, inverse, inverse, 0 };
    const four_doubles pos = (four_doubles)*(const four_in_memory *)cell->pos;
    *(four_floats *)record = __builtin_convertvector((pos - centre) * factor, four_floats);
    memcpy(record + REACH, (const char *)cell + FIRST, BYTES);
}

/* A batch of sources: fields in lanes. */
struct batch { real field[RECORD]; };

HD struct batch judge_load(const float (*record)[RECORD])
{
    struct batch b;
    for (int column = 0; column < RECORD; column += LANES) {
        real block[LANES];
        for (int i = 0; i < LANES; i++) block[i] = simd_load(record[i] + column);
        simd_transpose(block);
        for (int i = 0; i < LANES; i++) b.field[column + i] = block[i];
    }
    return b;
}

HD simd_int judge_leaf(struct batch b)
{ return ((simd_int)b.field[N_CHILDREN] & 0xffff) == 0; }

/* With the lengths of the cell in the target's unit. */
HD struct judge_source judge_source(const struct batch *b, real unit1)
{ return (struct judge_source){ b->field[MASS], b->field[REACH] * unit1, b->field[SCALE] * unit1, b->field + POWER }; }

/* Squared distance of the cell's centre from the target's box. */
HD real judge_box(struct batch b, const struct gravity_view *v)
{ return judge_box2(b.field[X], b.field[Y], b.field[Z], v->half); }

/* Two cells that may act on each other, and the target's tolerance over d^2. */
struct side { real mass, reach, scale, power[5], tolerance; };

HD struct side judge_side(simd_int mask, struct side a, struct side b)
{
    struct side s = { real_if(mask, a.mass, b.mass), real_if(mask, a.reach, b.reach), real_if(mask, a.scale, b.scale),
                      { { 0 } }, real_if(mask, a.tolerance, b.tolerance) };
    for (int k = 0; k < 5; k++) s.power[k] = real_if(mask, a.power[k], b.power[k]);
    return s;
}

/* Does what a makes of b stay within b's tolerance? Eq. 16 as above. y: 1/d. */
HD simd_int judge_side_error(struct side a, struct side b, real y, real d2, int order)
{
    real t = b.reach * y, u = a.scale * y, power = u * u, error = a.mass * t * t + a.power[0] * power;
    for (int k = 3; k <= order; k++) {
        power *= u;
        error = error * t + a.power[k - 2] * power;
    }
    return error < b.tolerance * d2;
}

/* The same operations on the same numbers from both sides: the cell that comes first is a, whichever is the target. */
HD simd_int judge_pair(struct side a, struct side b, const struct gravity_view *v, real d2, int order, real support)
{
    real sum = a.reach + b.reach, edge = sum + support, larger = real_max(a.reach, b.reach);
    real y = judge_root(real_max(d2, real_splat(REAL_FLOOR)));
    return (sum * sum < v->theta2 * d2) & (edge * edge < d2) & (d2 >= v->near2) & (larger * larger < v->theta2_target * d2)
         & judge_side_error(a, b, y, d2, order) & judge_side_error(b, a, y, d2, order);
}

HD simd_int judge_choose(simd_int mask, simd_int a, simd_int b) { return (a & mask) | (b & ~mask); }
HD simd_int judge_all(int32_t x) { return x - (simd_int){ 0 }; }

/* Beyond which a cell and the target act as wholes: no pair of theirs is softened over a longer distance. */
HD real judge_support(struct batch b, const struct gravity_view *v, real unit1, bool adaptive)
{ return adaptive ? real_max(real_splat(v->support), unit1 * b.field[SUPPORT]) : real_splat(v->support); }

HD simd_int judge_by_error(struct batch b, const struct gravity_view *v, int order, bool adaptive)
{
    real unit1 = real_splat((float)(1 / v->unit)), support = judge_support(b, v, unit1, adaptive);
    real d2 = b.field[X] * b.field[X] + b.field[Y] * b.field[Y] + b.field[Z] * b.field[Z];
    struct judge_source source = judge_source(&b, unit1);
    simd_int rest, too_large, local = judge_local(source, v, d2, order, support, &too_large);
    if (v->no_local) {
        local = judge_all(0);
        too_large = ~local;
    }
    if (v->group) {
        rest = judge_choose(too_large, judge_all(GRAVITY_OPEN_FAR), judge_all(GRAVITY_OPEN));
        rest = judge_choose(judge_leaf(b), judge_all(GRAVITY_NEAR), rest);
        rest = judge_choose(judge_cell(source, v, judge_box(b, v), support), judge_all(GRAVITY_FAR), rest);
    } else {
        simd_int open = (b.field[REACH] * unit1 > v->open_ratio * v->radius) & ~judge_leaf(b);
        rest = judge_choose(open, judge_all(GRAVITY_OPEN), judge_all(GRAVITY_WAIT));
    }
    return judge_choose(local, judge_all(GRAVITY_LOCAL), rest);
}

/* Of two cells that do not accept each other the larger is split, a leaf never; the target's parent is its pair with itself. */
HD simd_int judge_mutually(struct batch b, const struct gravity_view *v, int order, bool adaptive)
{
    real unit1 = real_splat((float)(1 / v->unit)), support = judge_support(b, v, unit1, adaptive);
    real d2 = b.field[X] * b.field[X] + b.field[Y] * b.field[Y] + b.field[Z] * b.field[Z];
    const struct gravity_cell *self = v->self;
    struct side source = { b.field[MASS], b.field[REACH] * unit1, b.field[SCALE] * unit1, { { 0 } }, v->alpha * b.field[LEAST] };
    struct side target = { real_splat(self->mass), real_splat(v->radius), real_splat(self->scale) * unit1, { { 0 } },
                           real_splat(v->alpha) * (v->least ? v->least[v->cell] : 1) };
    for (int k = 0; k < 5; k++) {
        source.power[k] = b.field[POWER + k];
        target.power[k] = real_splat(self->power[k]);
    }
    simd_int cell = (simd_int)b.field[CELL], first = cell < v->cell, leaf = judge_leaf(b);
    simd_int accept = judge_pair(judge_side(first, source, target), judge_side(first, target, source), v, d2, order, support);
    simd_int open = (source.reach > target.reach) | ((source.reach == target.reach) & first) | (cell == v->parent);
    if (v->group) open = judge_all(-1);
    simd_int rest = judge_choose(open & ~leaf, judge_all(GRAVITY_OPEN), judge_all(GRAVITY_WAIT));
    if (v->group) rest = judge_choose(leaf, judge_all(GRAVITY_NEAR), rest);
    return judge_choose(accept, judge_all(GRAVITY_LOCAL), rest);
}

/* For every group in the target: what no row of it could accept is opened. */
HD simd_int judge_by_angle(struct batch b, const struct gravity_view *v, bool adaptive)
{
    real unit1 = real_splat((float)(1 / v->unit)), support = judge_support(b, v, unit1, adaptive), reach = b.field[REACH] * unit1;
    simd_int accept = judge_angle(reach, judge_box(b, v), v->theta2, support, v->near2), rest;
    if (v->group) {
        rest = judge_choose(judge_leaf(b), judge_all(GRAVITY_NEAR), judge_all(GRAVITY_OPEN));
    } else {
        real x = real_max(b.field[X], -b.field[X]) + v->half[0], y = real_max(b.field[Y], -b.field[Y]) + v->half[1],
             z = real_max(b.field[Z], -b.field[Z]) + v->half[2], most2 = x * x + y * y + z * z;
        simd_int hopeless = ~judge_angle(reach, most2, v->theta2, support, v->near2);
        rest = judge_choose(hopeless & ~judge_leaf(b), judge_all(GRAVITY_OPEN), judge_all(GRAVITY_WAIT));
    }
    return judge_choose(accept, judge_all(GRAVITY_FAR), rest);
}

/* `order`, `adaptive` and `rule` are literals. */
enum rule { BY_ANGLE, BY_ERROR, MUTUAL };

HD void judge_list(int32_t *verdict, const struct gravity_view *v, const struct gravity_cell *cell,
                   const int32_t *list, int64_t n, int order, bool adaptive, enum rule rule)
{
    float record[CHUNK][RECORD] __attribute__((aligned(64)));
    for (int64_t from = 0; from < n; from += CHUNK) {
        int count = n - from < CHUNK ? (int)(n - from) : CHUNK;
        for (int i = 0; i < count; i++) {
            judge_stage(record[i], v, &cell[list[from + i]]);
            if (rule == MUTUAL) memcpy(&record[i][CELL], &list[from + i], sizeof list[from + i]);
            if (rule == MUTUAL) record[i][LEAST] = v->least ? v->least[list[from + i]] : 1;
            if (adaptive) record[i][SUPPORT] = 2 * v->h_max[list[from + i]];
        }
        for (int i = count; i % LANES != 0; i++) memcpy(record[i], record[0], sizeof record[0]);
        for (int i = 0; i < count; i += LANES) {
            struct batch b = judge_load(&record[i]);
            simd_int decided = rule == MUTUAL ? judge_mutually(b, v, order, adaptive)
                : rule == BY_ERROR ? judge_by_error(b, v, order, adaptive) : judge_by_angle(b, v, adaptive);
            simd_store((float *)verdict + from + i, (real)decided);
        }
    }
}

#define JUDGE(name, order, adaptive, rule) \
    static void name(int32_t *verdict, const struct gravity_view *v, const struct gravity_cell *cell, \
                     const int32_t *list, int64_t n) { judge_list(verdict, v, cell, list, n, order, adaptive, rule); }
#define ORDER(order) \
    JUDGE(fmm_##order, order, false, BY_ERROR) \
    JUDGE(adaptive_##order, order, true, BY_ERROR) \
    JUDGE(mutual_##order, order, false, MUTUAL) \
    JUDGE(mutual_adaptive_##order, order, true, MUTUAL)
ORDER(3)
ORDER(4)
ORDER(5)
ORDER(6)
JUDGE(tree, 0, false, BY_ANGLE)
JUDGE(adaptive_tree, 0, true, BY_ANGLE)

#define ORDERS(name) { name##_3, name##_4, name##_5, name##_6 }
const struct gravity_judge_table SIMD_NAME(gravity_judge_table) = {
    .fmm = { ORDERS(fmm), ORDERS(adaptive) },
    .mutual = { ORDERS(mutual), ORDERS(mutual_adaptive) },
    .tree = { tree, adaptive_tree },
};
