/* SPDX-License-Identifier: GPL-3.0-or-later
 * Cells: multipoles as symmetric Cartesian tensors with their traces kept, so that Plummer softening
 * is exact in the far field too (Dehnen 2002 and 2014 give the scheme).
 *
 * With moments M_abc = (-1)^(a+b+c) / (a! b! c!) sum m x^a y^b z^c about the centre of mass (no
 * dipole) and D_abc the derivatives of 1/sqrt(R^2 + eps^2) at R = target - source centre:
 *   local expansion      L_abc = sum over ijk of M_ijk D_(a+i)(b+j)(c+k)
 *   minus the potential  depth(x) = sum over abc of L_abc x^a y^b z^c / (a! b! c!)
 *   acceleration         its gradient; all without G.
 * A tensor is stored order by order, in each order as (n,0,0) (n-1,1,0) (n-1,0,1) (n-2,2,0) ...
 * Arithmetic in `real` (see real.h). */
#ifndef TEPHRA_GRAVITY_CELL_H
#define TEPHRA_GRAVITY_CELL_H
#include "real.h"

enum { CELL_TERMS_MAX = 84 };   /* of orders 0 to 6 */
/* Terms of all orders below n. */
#define CELL_TERMS(n) ((n) * ((n) + 1) * ((n) + 2) / 6)
#define CELL_INDEX(a, b, c) (CELL_TERMS((a) + (b) + (c)) + ((b) + (c)) * ((b) + (c) + 1) / 2 + (c))

/* X(a, b, c) for every term of one order. */
#define CELL_ORDER_0(X) X(0, 0, 0)
#define CELL_ORDER_1(X) X(1, 0, 0) X(0, 1, 0) X(0, 0, 1)
#define CELL_ORDER_2(X) X(2, 0, 0) X(1, 1, 0) X(1, 0, 1) X(0, 2, 0) X(0, 1, 1) X(0, 0, 2)
#define CELL_ORDER_3(X) X(3, 0, 0) X(2, 1, 0) X(2, 0, 1) X(1, 2, 0) X(1, 1, 1) X(1, 0, 2) \
    X(0, 3, 0) X(0, 2, 1) X(0, 1, 2) X(0, 0, 3)
#define CELL_ORDER_4(X) X(4, 0, 0) X(3, 1, 0) X(3, 0, 1) X(2, 2, 0) X(2, 1, 1) X(2, 0, 2) \
    X(1, 3, 0) X(1, 2, 1) X(1, 1, 2) X(1, 0, 3) X(0, 4, 0) X(0, 3, 1) X(0, 2, 2) X(0, 1, 3) X(0, 0, 4)
#define CELL_ORDER_5(X) X(5, 0, 0) X(4, 1, 0) X(4, 0, 1) X(3, 2, 0) X(3, 1, 1) X(3, 0, 2) \
    X(2, 3, 0) X(2, 2, 1) X(2, 1, 2) X(2, 0, 3) X(1, 4, 0) X(1, 3, 1) X(1, 2, 2) X(1, 1, 3) X(1, 0, 4) \
    X(0, 5, 0) X(0, 4, 1) X(0, 3, 2) X(0, 2, 3) X(0, 1, 4) X(0, 0, 5)
#define CELL_ORDER_6(X) X(6, 0, 0) X(5, 1, 0) X(5, 0, 1) X(4, 2, 0) X(4, 1, 1) X(4, 0, 2) \
    X(3, 3, 0) X(3, 2, 1) X(3, 1, 2) X(3, 0, 3) X(2, 4, 0) X(2, 3, 1) X(2, 2, 2) X(2, 1, 3) X(2, 0, 4) \
    X(1, 5, 0) X(1, 4, 1) X(1, 3, 2) X(1, 2, 3) X(1, 1, 4) X(1, 0, 5) \
    X(0, 6, 0) X(0, 5, 1) X(0, 4, 2) X(0, 3, 3) X(0, 2, 4) X(0, 1, 5) X(0, 0, 6)

struct cell_vector { real x, y, z; };

/* D_abc of one auxiliary rank from the rank above it (McMurchie & Davidson 1978):
 * D^(m)_(a+1)bc = x D^(m+1)_abc + a D^(m+1)_(a-1)bc. a, b, c are literals. */
HD real cell_raise(const real *d, struct cell_vector r, int a, int b, int c)
{
    real x = a > 0 ? r.x : b > 0 ? r.y : r.z;
    int n = a > 0 ? a : b > 0 ? b : c, i = a > 0, j = !i && b > 0, k = !i && !j;
    real first = d[CELL_INDEX(a - i, b - j, c - k)];
    if (n == 1) return x * first;
    return real_fma(x, first, (float)(n - 1) * d[CELL_INDEX(a - 2 * i, b - 2 * j, c - 2 * k)]);
}

/* Lifts orders 1 to `top` in place, the highest first, since each needs only lower ones. */
HD void cell_lift(real *d, struct cell_vector r, int top)
{
#define CELL_RAISE(a, b, c) d[CELL_INDEX(a, b, c)] = cell_raise(d, r, a, b, c);
    if (top >= 6) { CELL_ORDER_6(CELL_RAISE) }
    if (top >= 5) { CELL_ORDER_5(CELL_RAISE) }
    if (top >= 4) { CELL_ORDER_4(CELL_RAISE) }
    if (top >= 3) { CELL_ORDER_3(CELL_RAISE) }
    if (top >= 2) { CELL_ORDER_2(CELL_RAISE) }
    CELL_ORDER_1(CELL_RAISE)
#undef CELL_RAISE
}

/* All derivatives of 1/sqrt(r.r + eps2) to `order`, a literal. */
HD void cell_derivatives(real *d, struct cell_vector r, real eps2, int order)
{
    real r2 = r.x * r.x + r.y * r.y + r.z * r.z + eps2;
    real y = real_rsqrt_guess(r2);
    y *= 1.5f - 0.5f * r2 * y * y;
    real y2 = y * y, rank[7];
    rank[0] = y;
    for (int m = 1; m <= 6; m++) rank[m] = (float)(1 - 2 * m) * y2 * rank[m - 1];
    d[0] = rank[order];
    if (order >= 6) { cell_lift(d, r, 1); d[0] = rank[5]; }
    if (order >= 5) { cell_lift(d, r, order - 4); d[0] = rank[4]; }
    if (order >= 4) { cell_lift(d, r, order - 3); d[0] = rank[3]; }
    if (order >= 3) { cell_lift(d, r, order - 2); d[0] = rank[2]; }
    if (order >= 2) { cell_lift(d, r, order - 1); d[0] = rank[1]; }
    cell_lift(d, r, order);
    d[0] = rank[0];
}

/* sum + the moments of order k contracted with the derivatives raised by (a, b, c). Moments start
 * at order 2. */
#define CELL_MOMENT(i, j, k) (CELL_INDEX(i, j, k) - CELL_TERMS(2))
HD real cell_contract(real sum, const real *moment, const real *d, int k, int a, int b, int c)
{
#define CELL_TERM(i, j, l) sum = real_fma(moment[CELL_MOMENT(i, j, l)], d[CELL_INDEX(a + i, b + j, c + l)], sum);
    if (k == 2) { CELL_ORDER_2(CELL_TERM) }
    if (k == 3) { CELL_ORDER_3(CELL_TERM) }
    if (k == 4) { CELL_ORDER_4(CELL_TERM) }
    if (k == 5) { CELL_ORDER_5(CELL_TERM) }
#undef CELL_TERM
    return sum;
}

/* Adds one cell's part to a local expansion of `order`: all terms with n + k <= order (k < order),
 * one k after the other so that its moments stay in registers. */
HD void cell_to_local(real *local, real mass, const real *moment, const real *d, int order)
{
#define CELL_MASS(a, b, c) { real *l = &local[CELL_INDEX(a, b, c)]; *l = real_fma(mass, d[CELL_INDEX(a, b, c)], *l); \
    if (order > 2 && order >= a + b + c + 2) *l = cell_contract(*l, moment, d, 2, a, b, c); }
#define CELL_K(k, a, b, c) if (order > k && order >= a + b + c + k) \
    local[CELL_INDEX(a, b, c)] = cell_contract(local[CELL_INDEX(a, b, c)], moment, d, k, a, b, c);
#define CELL_3(a, b, c) CELL_K(3, a, b, c)
#define CELL_4(a, b, c) CELL_K(4, a, b, c)
#define CELL_5(a, b, c) CELL_K(5, a, b, c)
    CELL_ORDER_0(CELL_MASS) CELL_ORDER_1(CELL_MASS) CELL_ORDER_2(CELL_MASS) CELL_ORDER_3(CELL_MASS)
    if (order >= 4) { CELL_ORDER_4(CELL_MASS) }
    if (order >= 5) { CELL_ORDER_5(CELL_MASS) }
    if (order >= 6) { CELL_ORDER_6(CELL_MASS) }
    CELL_ORDER_0(CELL_3) CELL_ORDER_1(CELL_3) CELL_ORDER_2(CELL_3) CELL_ORDER_3(CELL_3)
    CELL_ORDER_0(CELL_4) CELL_ORDER_1(CELL_4) CELL_ORDER_2(CELL_4)
    CELL_ORDER_0(CELL_5) CELL_ORDER_1(CELL_5)
#undef CELL_MASS
#undef CELL_K
#undef CELL_3
#undef CELL_4
#undef CELL_5
}

/* The same of a cell whose moments and derivatives are in units of its own distance: a term of order n goes in times part[n]. One
 * term after the other, so that none needs room of its own. */
HD void cell_to_local_scaled(real *local, real mass, const real *moment, const real *d, const real *part, int order)
{
#define CELL_WHOLE(a, b, c) { real l = mass * d[CELL_INDEX(a, b, c)]; \
    if (order > 2 && order >= a + b + c + 2) l = cell_contract(l, moment, d, 2, a, b, c); \
    if (order > 3 && order >= a + b + c + 3) l = cell_contract(l, moment, d, 3, a, b, c); \
    if (order > 4 && order >= a + b + c + 4) l = cell_contract(l, moment, d, 4, a, b, c); \
    if (order > 5 && order >= a + b + c + 5) l = cell_contract(l, moment, d, 5, a, b, c); \
    local[CELL_INDEX(a, b, c)] = real_fma(part[a + b + c], l, local[CELL_INDEX(a, b, c)]); }
    CELL_ORDER_0(CELL_WHOLE) CELL_ORDER_1(CELL_WHOLE) CELL_ORDER_2(CELL_WHOLE) CELL_ORDER_3(CELL_WHOLE)
    if (order >= 4) { CELL_ORDER_4(CELL_WHOLE) }
    if (order >= 5) { CELL_ORDER_5(CELL_WHOLE) }
    if (order >= 6) { CELL_ORDER_6(CELL_WHOLE) }
#undef CELL_WHOLE
}

/* One cell's potential and force at a row: the terms n = 0 and 1 of the same, all k < order. */
HD void cell_to_row(real *local, real mass, const real *moment, const real *d, int order)
{
#define CELL_ROW(a, b, c) { real l = mass * d[CELL_INDEX(a, b, c)]; \
    l = cell_contract(l, moment, d, 2, a, b, c); \
    if (order > 3) l = cell_contract(l, moment, d, 3, a, b, c); \
    if (order > 4) l = cell_contract(l, moment, d, 4, a, b, c); \
    if (order > 5) l = cell_contract(l, moment, d, 5, a, b, c); \
    local[CELL_INDEX(a, b, c)] = l; }
    CELL_ORDER_0(CELL_ROW) CELL_ORDER_1(CELL_ROW)
#undef CELL_ROW
}

/* Powers e^j / j! of a shift. */
struct cell_powers { real of[7]; };
HD struct cell_powers cell_power(real e)
{
    struct cell_powers p;
    p.of[0] = real_splat(1);
    for (int j = 1; j <= 6; j++) p.of[j] = p.of[j - 1] * e * real_splat(1.0 / j);
    return p;
}

/* Adds one row's moments of orders 2 to order - 1; x, y, z: powers of minus its position. */
HD void cell_add_row(real *moment, real mass, const struct cell_powers *x, const struct cell_powers *y,
                     const struct cell_powers *z, int order)
{
#define CELL_ROW(a, b, c) moment[CELL_MOMENT(a, b, c)] += mass * x->of[a] * y->of[b] * z->of[c];
    CELL_ORDER_2(CELL_ROW)
    if (order > 3) { CELL_ORDER_3(CELL_ROW) }
    if (order > 4) { CELL_ORDER_4(CELL_ROW) }
    if (order > 5) { CELL_ORDER_5(CELL_ROW) }
#undef CELL_ROW
}

/* One term of a tensor moved along one axis: of n, the exponents below (step -1) or above (step 1)
 * that reach it. i, j, k: the axis. All literals. */
HD real cell_slide(const real *t, const struct cell_powers *p, int n, int a, int b, int c, int i, int j, int k)
{
    real sum = t[CELL_INDEX(a, b, c)];
    if (n >= 1) sum += p->of[1] * t[CELL_INDEX(a + i, b + j, c + k)];
    if (n >= 2) sum += p->of[2] * t[CELL_INDEX(a + 2 * i, b + 2 * j, c + 2 * k)];
    if (n >= 3) sum += p->of[3] * t[CELL_INDEX(a + 3 * i, b + 3 * j, c + 3 * k)];
    if (n >= 4) sum += p->of[4] * t[CELL_INDEX(a + 4 * i, b + 4 * j, c + 4 * k)];
    if (n >= 5) sum += p->of[5] * t[CELL_INDEX(a + 5 * i, b + 5 * j, c + 5 * k)];
    if (n >= 6) sum += p->of[6] * t[CELL_INDEX(a + 6 * i, b + 6 * j, c + 6 * k)];
    return sum;
}

#define CELL_UP(X) CELL_ORDER_0(X) CELL_ORDER_1(X) CELL_ORDER_2(X) CELL_ORDER_3(X) CELL_ORDER_4(X) CELL_ORDER_5(X)
#define CELL_DOWN(X) CELL_ORDER_5(X) CELL_ORDER_4(X) CELL_ORDER_3(X) CELL_ORDER_2(X) CELL_ORDER_1(X)

/* Moments M_abc of orders 0 to order - 1 (all of them, from order 0), about a centre that lies at -e
 * from the old one in place: axis by axis, the highest order first. */
HD void cell_shift_moments(real *t, struct cell_vector e, int order)
{
#define CELL_X(a, b, c) if (a + b + c < order) t[CELL_INDEX(a, b, c)] = cell_slide(t, &p, a, a, b, c, -1, 0, 0);
#define CELL_Y(a, b, c) if (a + b + c < order) t[CELL_INDEX(a, b, c)] = cell_slide(t, &p, b, a, b, c, 0, -1, 0);
#define CELL_Z(a, b, c) if (a + b + c < order) t[CELL_INDEX(a, b, c)] = cell_slide(t, &p, c, a, b, c, 0, 0, -1);
    struct cell_powers p = cell_power(e.x);
    CELL_DOWN(CELL_X)
    p = cell_power(e.y);
    CELL_DOWN(CELL_Y)
    p = cell_power(e.z);
    CELL_DOWN(CELL_Z)
#undef CELL_X
#undef CELL_Y
#undef CELL_Z
}

/* A local expansion L_abc of orders 0 to `order` about a centre at e from the old one, in place: the
 * lowest order first. */
HD void cell_shift_local(real *t, struct cell_vector e, int order)
{
#define CELL_X(a, b, c) if (a + b + c < order) \
    t[CELL_INDEX(a, b, c)] = cell_slide(t, &p, order - (a + b + c), a, b, c, 1, 0, 0);
#define CELL_Y(a, b, c) if (a + b + c < order) \
    t[CELL_INDEX(a, b, c)] = cell_slide(t, &p, order - (a + b + c), a, b, c, 0, 1, 0);
#define CELL_Z(a, b, c) if (a + b + c < order) \
    t[CELL_INDEX(a, b, c)] = cell_slide(t, &p, order - (a + b + c), a, b, c, 0, 0, 1);
    struct cell_powers p = cell_power(e.x);
    CELL_UP(CELL_X)
    p = cell_power(e.y);
    CELL_UP(CELL_Y)
    p = cell_power(e.z);
    CELL_UP(CELL_Z)
#undef CELL_X
#undef CELL_Y
#undef CELL_Z
}

struct cell_field { real x, y, z, depth; };

/* A local expansion at `r` from its centre; local[] holds L_abc / (a! b! c!). Horner's rule along x,
 * then y, then z would save products; powers vectorise better. */
HD struct cell_field cell_at(const float *local, struct cell_vector r, int order)
{
    real px[7], py[7], pz[7];
    px[0] = py[0] = pz[0] = real_splat(1);
    for (int i = 1; i <= 6; i++) {
        px[i] = px[i - 1] * r.x;
        py[i] = py[i - 1] * r.y;
        pz[i] = pz[i - 1] * r.z;
    }
    struct cell_field f = { real_splat(0), real_splat(0), real_splat(0), real_splat(0) };
#define CELL_ADD(a, b, c) \
    f.depth += local[CELL_INDEX(a, b, c)] * px[a] * py[b] * pz[c]; \
    if (a > 0) f.x += (float)a * local[CELL_INDEX(a, b, c)] * px[a > 0 ? a - 1 : 0] * py[b] * pz[c]; \
    if (b > 0) f.y += (float)b * local[CELL_INDEX(a, b, c)] * px[a] * py[b > 0 ? b - 1 : 0] * pz[c]; \
    if (c > 0) f.z += (float)c * local[CELL_INDEX(a, b, c)] * px[a] * py[b] * pz[c > 0 ? c - 1 : 0];
    CELL_ORDER_0(CELL_ADD) CELL_ORDER_1(CELL_ADD) CELL_ORDER_2(CELL_ADD) CELL_ORDER_3(CELL_ADD)
    if (order >= 4) { CELL_ORDER_4(CELL_ADD) }
    if (order >= 5) { CELL_ORDER_5(CELL_ADD) }
    if (order >= 6) { CELL_ORDER_6(CELL_ADD) }
#undef CELL_ADD
    return f;
}

/* A cell as monopole and raw quadrupole q (xx xy xz yy yz zz, M_abc above), at r = target - centre. */
struct cell_quadrupole { real xx, xy, xz, yy, yz, zz; };
HD struct cell_field cell_field(struct cell_vector r, real mass, struct cell_quadrupole q, real eps2, int quadrupole)
{
    real r2 = r.x * r.x + r.y * r.y + r.z * r.z + eps2;
    real y = real_rsqrt_guess(r2);
    if (REAL_GUESS) y *= 1.5f - 0.5f * r2 * y * y;
    real y2 = y * y, my = mass * y;
    if (!quadrupole) {
        real pull = -my * y2;
        return (struct cell_field){ pull * r.x, pull * r.y, pull * r.z, my };
    }
    real y3 = y * y2, y5 = y3 * y2, trace = q.xx + q.yy + q.zz;
    real vx = 2.f * q.xx * r.x + q.xy * r.y + q.xz * r.z;
    real vy = q.xy * r.x + 2.f * q.yy * r.y + q.yz * r.z;
    real vz = q.xz * r.x + q.yz * r.y + 2.f * q.zz * r.z;
    real s = 1.5f * (vx * r.x + vy * r.y + vz * r.z), y5x3 = 3.f * y5;
    real pull = y5x3 * trace - mass * y3 - 5.f * s * y5 * y2;
    return (struct cell_field){ pull * r.x + y5x3 * vx, pull * r.y + y5x3 * vy, pull * r.z + y5x3 * vz,
                                my - trace * y3 + s * y5 };
}
#endif
