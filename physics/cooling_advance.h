/* SPDX-License-Identifier: GPL-3.0-or-later
 * Gas along a cooling curve, on the CPU and on a device: cooling_curve.h tells what it does, and cooling_balance.h how gas walks
 * that is heated meanwhile. On a device the pointers of a curve are addresses there. */
#ifndef TEPHRA_COOLING_ADVANCE_H
#define TEPHRA_COOLING_ADVANCE_H
#include "hd.h"
#include "species.h"
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

/* At a sample. `power` is 1 - dlnQ/dlnu of the segment from here up, `column` the integral of du/Q
 * from here to the last sample: rho times the time in which gas cools through it. */
struct cooling_node { double u, rate, power, column; };

struct cooling_curve {
    int n;
    struct cooling_node *node;  /* ascending in u; the first is the floor; above the last the law goes on */
    double *t;                  /* temperature of the nodes [K] */
    struct cooling_balance *balance;    /* NULL without heating */
    double heating;             /* erg g^-1 s^-1, the same at any density */
    uint16_t *hint;             /* a segment not above the one that holds u, by the leading bits of u */
    int64_t first_hint;
    int n_hint;
};

enum { COOLING_POINTS = 4 };

/* sum weight/(1 - g at) over 1/Q, or sum weight/(g - at) over Q; allowed where the pole is farther than `reach`
 * from `middle`. */
struct cooling_rule { float at[COOLING_POINTS], weight[COOLING_POINTS], middle, reach; };

enum cooling_direction { COOLING_DOWN, COOLING_UP, COOLING_WAYS };
/* Blocks of 2^bits segments: block b holds segments b 2^bits to (b + 1) 2^bits - 1. */
struct cooling_level { int bits; unsigned n; struct cooling_rule *rule[COOLING_WAYS]; };

/* Each level's blocks are eight of the level below: fewer sizes are cheaper than fewer blocks. */
enum { COOLING_STRIDE = 3, COOLING_LEVELS = 6 };  /* cooling_curve.h counts nodes in 16 bits */
struct cooling_balance { int n_levels; struct cooling_level level[COOLING_LEVELS]; };

/* The exponent of a positive double and the first four bits of its mantissa: rises with its log. */
HD int64_t cooling_leading_bits(double u)
{
    int64_t bits;
    memcpy(&bits, &u, sizeof bits);
    return bits >> 48;
}

/* The integral of du/Q from the lower end of a segment to u. A slope of 1 within 1e-7 is taken to be
 * 1: the difference is below 1e-7 relative, the rounding of the power would be more. */
HD double cooling_column_below(const struct cooling_node *node, double u)
{
    double x = u / node->u, p = node->power;
    return node->u / node->rate * (fabs(p) < 1e-7 ? log(x) : (pow(x, p) - 1) / p);
}

/* The inverse: u whose column above the lower end is the given one. */
HD double cooling_u_above(const struct cooling_node *node, double column)
{
    double y = column * node->rate / node->u, p = node->power;
    return node->u * (fabs(p) < 1e-7 ? exp(y) : pow(1 + p * y, 1 / p));
}

/* The segment that holds u, which is not below the floor. */
HD int cooling_find_segment(const struct cooling_curve *curve, double u)
{
    int64_t h = cooling_leading_bits(u) - curve->first_hint;
    int k = curve->hint[h < curve->n_hint ? h : curve->n_hint - 1];
    while (k < curve->n - 1 && curve->node[k + 1].u <= u) k++;
    return k;
}

/* The segment in which this column is left to the last sample: the highest node with more than it. */
HD int cooling_find_column(const struct cooling_curve *curve, int end, double column)
{
    int k = 0;
    for (int length = end; length > 1;) {
        int half = length / 2;
        k = curve->node[k + half].column > column ? k + half : k;
        length -= half;
    }
    return k;
}

/* x^p to 1e-7; by series within a segment, where both x and x^p are near 1. */
HD double cooling_power(double x, double p)
{
    double z = (x - 1) / (x + 1), z2 = z * z, y = 2 * p * z * (1 + z2 * (1.0 / 3 + z2 * (1.0 / 5)));
    if (z2 > 0.01 || fabs(y) > 0.3) return pow(x, p);
    return 1 + y * (1 + y * (1.0 / 2 + y * (1.0 / 6 + y * (1.0 / 24 + y * (1.0 / 120 + y * (1.0 / 720))))));
}

/* A walk along the curve: energy, its rate and the time that is left. */
struct cooling_walk { double u, rate, left; bool done; };

/* (b - a)/ln(b/a) with z = (b - a)/(b + a), ln(b/a) = 2 (z + z^3/3 + z^5/5 + ...). */
HD double cooling_log_mean(double a, double b)
{
    double z = (b - a) / (b + a), z2 = z * z;
    if (z2 > 0.02) return (b - a) / log(b / a);
    return 0.5 * (a + b) / (1 + z2 * (1.0 / 3 + z2 * (1.0 / 5 + z2 * (1.0 / 7))));
}

/* To the end of a segment, the net rate being linear in u; `rate` is the one there, of the same sign. */
HD void cooling_walk_to(struct cooling_walk *walk, double end, double rate)
{
    double change = rate - walk->rate, distance = end - walk->u, mean = cooling_log_mean(walk->rate, rate);
    if (distance / mean < walk->left) {
        *walk = (struct cooling_walk){end, rate, walk->left - distance / mean, false};
        return;
    }
    double growth = distance != 0 ? change / distance * walk->left : 0;
    walk->u += walk->rate * walk->left * (fabs(growth) < 1e-8 ? 1 : (double)expm1f((float)growth) / growth);
    walk->done = true;
}

/* To the equilibrium within a segment, the distance from it decaying; after 30 e-folds nothing is left of it. */
HD void cooling_walk_home(struct cooling_walk *walk, double home)
{
    double decay = walk->rate / (home - walk->u);   /* where rounding puts u beyond it, u is there */
    if (decay > 0 && decay * walk->left < 30) home += (walk->u - home) * (double)expf((float)(-decay * walk->left));
    walk->u = home;
    walk->done = true;
}

/* Through segment k, or the rest of it. */
HD void cooling_walk_segment(const struct cooling_curve *curve, int k, double g, bool up, struct cooling_walk *walk)
{
    const struct cooling_node *node = &curve->node[k], *end = up ? node + 1 : node;
    double rate = g - end->rate;
    if (rate * walk->rate > 0) cooling_walk_to(walk, end->u, rate);
    else cooling_walk_home(walk, node->u * cooling_power(g / node->rate, 1 / (1 - node->power)));
}

HD double cooling_falling_time(const struct cooling_rule *rule, float g)
{
    float part[COOLING_POINTS];
    for (int i = 0; i < COOLING_POINTS; i++) part[i] = rule->weight[i] / (1 - g * rule->at[i]);
    return (double)((part[0] + part[1]) + (part[2] + part[3]));
}

HD double cooling_rising_time(const struct cooling_rule *rule, float g)
{
    float part[COOLING_POINTS];
    for (int i = 0; i < COOLING_POINTS; i++) part[i] = rule->weight[i] / (g - rule->at[i]);
    return (double)((part[0] + part[1]) + (part[2] + part[3]));
}

/* From node to node over whole blocks, the largest that the time and the equilibrium allow. `up` is literal. */
HD int cooling_stride(const struct cooling_balance *balance, int node, float g, bool up, double *left)
{
    const float pole = up ? g : 1 / g;
    for (int l = 0; l >= 0;) {
        const struct cooling_level *level = &balance->level[l];
        const unsigned b = (unsigned)((node >> level->bits) - !up);
        const struct cooling_rule *rule = &level->rule[up ? COOLING_UP : COOLING_DOWN][b < level->n ? b : 0];
        double time = INFINITY;
        if (b < level->n && fabsf(pole - rule->middle) > rule->reach)
            time = up ? cooling_rising_time(rule, g) : cooling_falling_time(rule, g);
        if (!(time < *left)) {
            l--;
            continue;
        }
        *left -= time;
        node += up ? 1 << level->bits : -(1 << level->bits);
        if (l + 1 < balance->n_levels && (node & ((1 << level[1].bits) - 1)) == 0) l++;
    }
    return node;
}

/* u, which lies in segment k, after dt at density rho. Never passes the equilibrium on its side. */
HD double cooling_balance_advance(const struct cooling_curve *curve, int k, double u, double rho, double dt)
{
    const double g = curve->heating / rho;
    const struct cooling_node *at = &curve->node[k];
    struct cooling_walk walk = {u, g - at->rate * cooling_power(u / at->u, 1 - at->power), rho * dt, false};
    const bool up = walk.rate > 0;
    while (!walk.done && walk.rate != 0) {
        if (up && k == curve->n - 1) return walk.u + walk.rate * walk.left;
        cooling_walk_segment(curve, k, g, up, &walk);
        if (walk.done) break;
        int node = up ? cooling_stride(curve->balance, k + 1, (float)g, true, &walk.left)
                      : cooling_stride(curve->balance, k, (float)g, false, &walk.left);
        if (!up && node == 0) return curve->node[0].u;
        walk.u = curve->node[node].u;
        walk.rate = g - curve->node[node].rate;
        k = up ? node : node - 1;
    }
    return walk.u;
}

HD double cooling_fall(const struct cooling_curve *curve, double u, double column)
{
    int k = cooling_find_segment(curve, u);
    const struct cooling_node *node = &curve->node[k];
    double below = cooling_column_below(node, u);
    if (column < below) return fmin(u, cooling_u_above(node, below - column));
    double left = node->column + (column - below);
    if (left >= curve->node[0].column) return curve->node[0].u;
    node = &curve->node[cooling_find_column(curve, k, left)];
    return cooling_u_above(node, node->column - left);
}

/* u after dt at density rho; at least the floor, to which colder gas is raised. */
HD double cooling_advance(const struct cooling_curve *curve, double u, double rho, double dt)
{
    double floor = curve->node[0].u;
    if (!(u > floor)) u = floor;
    if (curve->balance) return fmax(cooling_balance_advance(curve, cooling_find_segment(curve, u), u, rho, dt), floor);
    return u > floor ? cooling_fall(curve, u, rho * dt) : floor;
}
/* [Fe/H] of a metal mass fraction, log10(Z / 0.02) with Sutherland & Dopita's abundances, and -5 of gas without metals. */
HD double cooling_feh(double metallicity) { return metallicity > 0.02 * 1e-5 ? log10(metallicity / 0.02) : -5; }

/* The gas of a scene: curves by [Fe/H], from `first` upwards, `width` apart; one where all gas is the same. Code units in cgs. */
struct cooling_law { const struct cooling_curve *const *bin; int n_bins; double first, width, energy, density, time; };

HD const struct cooling_curve *cooling_curve_of(const struct cooling_law *law, const struct species *gas, int64_t i)
{
    if (law->n_bins == 1) return law->bin[0];
    const double place = (cooling_feh(gas->metals[i] / gas->mass[i]) - law->first) / law->width;
    return law->bin[(int)fmin(fmax(place + 0.5, 0.0), (double)(law->n_bins - 1))];
}

enum cooling_reservoir { RADIATED, HEATED_PHOTO, HEATED_FLOOR, N_RESERVOIRS };

/* What one row loses and gains over a step of length `step`, added to `booked` in code units. */
HD void cooling_row(const struct cooling_law *law, const struct species *gas, int64_t i, double step, double booked[N_RESERVOIRS])
{
    const struct cooling_curve *curve = cooling_curve_of(law, gas, i);
    const double dt = step * law->time;
    if (dt == 0) return;
    const double before = (double)gas->u[i], raised = fmax(before, curve->node[0].u / law->energy);
    const double rho = (double)gas->rho[i] * law->density;
    gas->u[i] = (float)(cooling_advance(curve, raised * law->energy, rho, dt) / law->energy);
    const double heated = curve->heating * dt / law->energy;
    booked[HEATED_FLOOR] -= gas->mass[i] * (raised - before);
    booked[HEATED_PHOTO] -= gas->mass[i] * heated;
    booked[RADIATED] += gas->mass[i] * (raised + heated - (double)gas->u[i]);
}
#endif
