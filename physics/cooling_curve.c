/* SPDX-License-Identifier: GPL-3.0-or-later
 * Makes cooling curves and integrates along them (doc/manual/cooling.md, sections 4 and 5). */
#include "cooling_curve.h"
#include "constants.h"
#include "cooling_balance.h"
#include "mem.h"
#include <math.h>
#include <string.h>

/* --- making --- */

/* Specific energy and rate of a sample. */
static struct cooling_node make_node(const struct cooling_sample *sample, const struct cooling_gas *gas)
{
    double particle = isnan(gas->mu) ? sample->particle : gas->mu * CONST_M_PROTON;
    double hydrogen = isnan(gas->hydrogen) ? sample->hydrogen : CONST_M_PROTON / gas->hydrogen;
    return (struct cooling_node){.u = CONST_K_B * sample->t / ((gas->gamma - 1) * particle),
                                 .rate = sample->loss / (hydrogen * hydrogen)};
}

/* The samples above the floor, and one at it; beyond the ends of the samples their last law. */
static void make_nodes(struct cooling_curve *curve, const struct cooling_samples *samples,
                       const struct cooling_gas *gas)
{
    const struct cooling_sample *at = samples->at;
    int k = 0;
    while (k < samples->n - 2 && at[k + 1].t <= gas->floor) k++;
    const struct cooling_node a = make_node(&at[k], gas), b = make_node(&at[k + 1], gas);
    double part = log(gas->floor / at[k].t) / log(at[k + 1].t / at[k].t);
    curve->node[0].u = a.u * pow(b.u / a.u, part);
    curve->node[0].rate = a.rate * pow(b.rate / a.rate, part);
    curve->t[0] = gas->floor;
    curve->n = 1;
    for (k = 0; k < samples->n; k++) {
        if (at[k].t <= gas->floor * (1 + 1e-9)) continue;
        curve->t[curve->n] = at[k].t;
        curve->node[curve->n++] = make_node(&at[k], gas);
    }
}

/* In how many pieces a segment is cut so that Q changes by at most 1.3 in each: where the equilibrium of
 * heated gas lies in a piece, the net rate is taken to be linear there. */
static int pieces(const struct cooling_node *node)
{
    const double most = log(1.3);
    return (int)fmax(1, ceil(fabs(log(node[1].rate / node[0].rate)) / most));
}

static void refine(struct cooling_curve *curve)
{
    int n = 1, at = 0;
    for (int k = 0; k < curve->n - 1; k++) n += pieces(&curve->node[k]);
    struct cooling_node *node = mem_array("cooling", struct cooling_node, n);
    double *t = mem_array("cooling", double, n);
    for (int k = 0; k < curve->n - 1; k++) {
        const struct cooling_node *a = &curve->node[k], *b = a + 1;
        int cuts = pieces(a);
        for (int c = 0; c < cuts; c++, at++) {
            double part = (double)c / cuts;
            node[at].u = a->u * pow(b->u / a->u, part);
            node[at].rate = a->rate * pow(b->rate / a->rate, part);
            t[at] = curve->t[k] * pow(curve->t[k + 1] / curve->t[k], part);
        }
    }
    node[at] = curve->node[curve->n - 1];
    t[at] = curve->t[curve->n - 1];
    mem_free(curve->node);
    mem_free(curve->t);
    curve->node = node;
    curve->t = t;
    curve->n = n;
}

static void integrate(struct cooling_curve *curve)
{
    struct cooling_node *node = curve->node;
    for (int k = curve->n - 2; k >= 0; k--) {
        node[k].power = 1 - log(node[k + 1].rate / node[k].rate) / log(node[k + 1].u / node[k].u);
        node[k].column = node[k + 1].column + cooling_column_below(&node[k], node[k + 1].u);
        if (k == curve->n - 2) node[k + 1].power = node[k].power;
    }
}

static void make_hints(struct cooling_curve *curve)
{
    curve->first_hint = cooling_leading_bits(curve->node[0].u);
    curve->n_hint = (int)(cooling_leading_bits(curve->node[curve->n - 1].u) - curve->first_hint) + 1;
    curve->hint = mem_array("cooling", uint16_t, curve->n_hint);
    for (int h = 0, k = 0; h < curve->n_hint; h++) {
        while (k < curve->n - 1 && cooling_leading_bits(curve->node[k + 1].u) < curve->first_hint + h) k++;
        curve->hint[h] = (uint16_t)k;
    }
}

struct cooling_curve *cooling_curve_new(const struct cooling_samples *samples, const struct cooling_gas *gas)
{
    check(samples->n >= 2);
    struct cooling_curve *curve = mem_alloc("cooling", sizeof *curve);
    curve->node = mem_array("cooling", struct cooling_node, samples->n + 1);
    curve->t = mem_array("cooling", double, samples->n + 1);
    double hydrogen = isnan(gas->hydrogen) ? samples->at[0].hydrogen : CONST_M_PROTON / gas->hydrogen;
    curve->heating = gas->heating / hydrogen;
    make_nodes(curve, samples, gas);
    check(curve->n >= 2);
    if (curve->heating > 0) refine(curve);
    integrate(curve);
    make_hints(curve);
    if (curve->heating > 0) curve->balance = cooling_balance_new(curve);
    return curve;
}

void cooling_curve_free(struct cooling_curve *curve)
{
    if (!curve) return;
    mem_free(curve->node);
    mem_free(curve->t);
    mem_free(curve->hint);
    cooling_balance_free(curve->balance);
    mem_free(curve);
}

/* --- looking up --- */

/* dlnu/dlnT of a segment; T and u are powers of each other within it and beyond the ends. */
static double u_power(const struct cooling_curve *curve, int k)
{
    return log(curve->node[k + 1].u / curve->node[k].u) / log(curve->t[k + 1] / curve->t[k]);
}

double cooling_curve_u(const struct cooling_curve *curve, double t)
{
    int k = 0;
    while (k < curve->n - 2 && curve->t[k + 1] < t) k++;
    return curve->node[k].u * pow(t / curve->t[k], u_power(curve, k));
}

double cooling_curve_temperature(const struct cooling_curve *curve, double u)
{
    int k = u > curve->node[0].u ? cooling_find_segment(curve, u) : 0;
    if (k == curve->n - 1) k--;
    return curve->t[k] * pow(u / curve->node[k].u, 1 / u_power(curve, k));
}

static double loss(const struct cooling_node *node, double u)
{
    return node->rate * pow(u / node->u, 1 - node->power);
}

double cooling_curve_rate(const struct cooling_curve *curve, double u, double rho)
{
    return curve->heating - rho * loss(&curve->node[u > curve->node[0].u ? cooling_find_segment(curve, u) : 0], u);
}

double cooling_curve_advance(const struct cooling_curve *curve, double u, double rho, double dt)
{
    return cooling_advance(curve, u, rho, dt);
}
