/* SPDX-License-Identifier: GPL-3.0-or-later
 * Makes the rules of cooling_balance.h and walks over them. Times are times rho, rates over rho. */
#include "cooling_balance.h"
#include "cooling_curve.h"
#include "mem.h"
#include <gsl/gsl_eigen.h>
#include <math.h>

enum { POINTS = 4 };

/* sum weight/(1 - g at) over 1/Q, or sum weight/(g - at) over Q; allowed where the pole is farther than `reach`
 * from `middle`. */
struct rule { float at[POINTS], weight[POINTS], middle, reach; };

enum direction { COOL, WARM, N_DIRECTIONS };
/* Blocks of 2^bits segments: block b holds segments b 2^bits to (b + 1) 2^bits - 1. */
struct level { int bits; unsigned n; struct rule *rule[N_DIRECTIONS]; };

/* Each level's blocks are eight of the level below: fewer sizes are cheaper than fewer blocks. */
enum { STEP = 3, LEVELS = 6 };  /* cooling_curve.h counts nodes in 16 bits */
struct cooling_balance { int n_levels; struct level level[LEVELS]; };

/* How far the pole must be from the middle of a block, in half widths: with x of these Gauss' rule of 4 points is
 * good to (x + sqrt(x^2 - 1))^-8, 5e-4 of the time of such a block and 2e-6 where the pole is twice as far. */
static const double clearance = 1.5;

/* --- making --- */

/* Points of a measure; both rules of a child are two of these. */
struct measure { int n; double at[2 * POINTS], weight[2 * POINTS]; };

/* Gauss' rule of a measure of a few points: the recurrence of its orthogonal polynomials (Stieltjes), whose
 * tridiagonal matrix has the points as eigenvalues (Golub & Welsch 1969). */
static struct measure reduce(const struct measure *m)
{
    double a[POINTS] = {0}, b[POINTS] = {0}, before[2 * POINTS] = {0}, now[2 * POINTS], sum = 0, norm = 0;
    int n = 0;
    for (int i = 0; i < m->n; i++) sum += m->weight[i];
    for (int i = 0; i < m->n; i++) now[i] = 1 / sqrt(sum);
    while (n < POINTS) {
        for (int i = 0; i < m->n; i++) a[n] += m->weight[i] * m->at[i] * now[i] * now[i];
        for (int i = 0; i < m->n; i++) {
            double next = (m->at[i] - a[n]) * now[i] - norm * before[i];
            before[i] = now[i];
            now[i] = next;
        }
        norm = 0;
        for (int i = 0; i < m->n; i++) norm += m->weight[i] * now[i] * now[i];
        norm = b[n++] = sqrt(norm);
        if (norm < 1e-7 * fabs(a[0])) break;    /* no more points in it than rounding can tell apart */
        for (int i = 0; i < m->n; i++) now[i] /= norm;
    }
    double matrix[POINTS * POINTS] = {0}, value[POINTS], vector[POINTS * POINTS];
    for (int i = 0; i < n; i++) {
        matrix[i * n + i] = a[i];
        if (i + 1 < n) matrix[i * n + i + 1] = matrix[(i + 1) * n + i] = b[i];
    }
    gsl_matrix_view of = gsl_matrix_view_array(matrix, (size_t)n, (size_t)n);
    gsl_matrix_view vectors = gsl_matrix_view_array(vector, (size_t)n, (size_t)n);
    gsl_vector_view values = gsl_vector_view_array(value, (size_t)n);
    gsl_eigen_symmv_workspace *work = gsl_eigen_symmv_alloc((size_t)n);
    gsl_eigen_symmv(&of.matrix, &values.vector, &vectors.matrix, work);
    gsl_eigen_symmv_free(work);
    struct measure rule = {.n = n};
    for (int i = 0; i < n; i++) {
        rule.at[i] = value[i];
        rule.weight[i] = sum * vector[i] * vector[i];
    }
    return rule;
}

/* Q from low to high, in a block. */
struct range { double low, high; };

static struct rule make_rule(const struct measure *m, struct range range)
{
    struct rule rule = {.middle = (float)(0.5 * (range.low + range.high)),
                        .reach = (float)(clearance * 0.5 * (range.high - range.low))};
    for (int i = 0; i < POINTS; i++) {
        rule.at[i] = i < m->n ? (float)m->at[i] : rule.middle;
        rule.weight[i] = i < m->n ? (float)m->weight[i] : 0;
    }
    return rule;
}

/* What the blocks of one level know: measures of 1/Q and of Q, and the range of Q. */
struct draft { struct measure of[N_DIRECTIONS]; struct range q; };

/* A power law over a segment: points of Gauss-Legendre in ln u. */
static struct draft draft_segment(const struct cooling_node *node)
{
    static const double point[POINTS] = {-0.8611363115940526, -0.3399810435848563, 0.3399810435848563, 0.8611363115940526};
    static const double weight[POINTS] = {0.3478548451374538, 0.6521451548625461, 0.6521451548625461, 0.3478548451374538};
    double length = log(node[1].u / node[0].u);
    struct draft draft = {{{.n = POINTS}, {.n = POINTS}},
                          {fmin(node[0].rate, node[1].rate), fmax(node[0].rate, node[1].rate)}};
    struct measure *cool = &draft.of[COOL], *warm = &draft.of[WARM];
    for (int i = 0; i < POINTS; i++) {
        double x = 0.5 * length * (1 + point[i]), q = node->rate * exp((1 - node->power) * x);
        warm->at[i] = q;
        warm->weight[i] = 0.5 * length * weight[i] * node->u * exp(x);
        cool->at[i] = 1 / q;
        cool->weight[i] = warm->weight[i] / q;
    }
    return draft;
}

static struct draft join(const struct draft *a, const struct draft *b)
{
    struct draft both = {.q = {fmin(a->q.low, b->q.low), fmax(a->q.high, b->q.high)}};
    for (int d = 0; d < N_DIRECTIONS; d++) {
        struct measure sum = a->of[d];
        for (int i = 0; i < b->of[d].n; i++) {
            sum.at[sum.n] = b->of[d].at[i];
            sum.weight[sum.n++] = b->of[d].weight[i];
        }
        both.of[d] = reduce(&sum);
    }
    return both;
}

static void make_level(struct level *level, int bits, const struct draft *draft, int n)
{
    *level = (struct level){.bits = bits, .n = (unsigned)n};
    for (int d = 0; d < N_DIRECTIONS; d++) level->rule[d] = mem_array("cooling", struct rule, n);
    for (int b = 0; b < n; b++) {
        struct range q = draft[b].q, x = {1 / q.high, 1 / q.low};
        level->rule[COOL][b] = make_rule(&draft[b].of[COOL], x);
        level->rule[WARM][b] = make_rule(&draft[b].of[WARM], q);
    }
}

struct cooling_balance *cooling_balance_new(const struct cooling_curve *curve)
{
    struct cooling_balance *balance = mem_alloc("cooling", sizeof *balance);
    struct draft *draft = mem_array("cooling", struct draft, curve->n - 1);
    for (int k = 0; k < curve->n - 1; k++) draft[k] = draft_segment(&curve->node[k]);
    for (int bits = 0, n = curve->n - 1; n > 0; bits++, n /= 2) {
        if (bits % STEP == 0) make_level(&balance->level[balance->n_levels++], bits, draft, n);
        for (int b = 0; b < n / 2; b++) draft[b] = join(&draft[2 * b], &draft[2 * b + 1]);
    }
    mem_free(draft);
    return balance;
}

void cooling_balance_free(struct cooling_balance *balance)
{
    if (!balance) return;
    for (int l = 0; l < balance->n_levels; l++)
        for (int d = 0; d < N_DIRECTIONS; d++) mem_free(balance->level[l].rule[d]);
    mem_free(balance);
}

/* --- walking --- */

/* x^p to 1e-7; by series within a segment, where both x and x^p are near 1. */
static double power(double x, double p)
{
    double z = (x - 1) / (x + 1), z2 = z * z, y = 2 * p * z * (1 + z2 * (1.0 / 3 + z2 * (1.0 / 5)));
    if (z2 > 0.01 || fabs(y) > 0.3) return pow(x, p);
    return 1 + y * (1 + y * (1.0 / 2 + y * (1.0 / 6 + y * (1.0 / 24 + y * (1.0 / 120 + y * (1.0 / 720))))));
}

/* A walk along the curve: energy, its rate and the time that is left. */
struct walk { double u, rate, left; bool done; };

/* (b - a)/ln(b/a) with z = (b - a)/(b + a), ln(b/a) = 2 (z + z^3/3 + z^5/5 + ...). */
static double log_mean(double a, double b)
{
    double z = (b - a) / (b + a), z2 = z * z;
    if (z2 > 0.02) return (b - a) / log(b / a);
    return 0.5 * (a + b) / (1 + z2 * (1.0 / 3 + z2 * (1.0 / 5 + z2 * (1.0 / 7))));
}

/* To the end of a segment, the net rate being linear in u; `rate` is the one there, of the same sign. */
static void walk_to(struct walk *walk, double end, double rate)
{
    double change = rate - walk->rate, distance = end - walk->u, mean = log_mean(walk->rate, rate);
    if (distance / mean < walk->left) {
        *walk = (struct walk){end, rate, walk->left - distance / mean, false};
        return;
    }
    double growth = distance != 0 ? change / distance * walk->left : 0;
    walk->u += walk->rate * walk->left * (fabs(growth) < 1e-8 ? 1 : (double)expm1f((float)growth) / growth);
    walk->done = true;
}

/* To the equilibrium within a segment, the distance from it decaying; after 30 e-folds nothing is left of it. */
static void walk_home(struct walk *walk, double home)
{
    double decay = walk->rate / (home - walk->u);   /* where rounding puts u beyond it, u is there */
    if (decay > 0 && decay * walk->left < 30) home += (walk->u - home) * (double)expf((float)(-decay * walk->left));
    walk->u = home;
    walk->done = true;
}

/* Through segment k, or the rest of it. */
static void walk_segment(const struct cooling_curve *curve, int k, double g, bool up, struct walk *walk)
{
    const struct cooling_node *node = &curve->node[k], *end = up ? node + 1 : node;
    double rate = g - end->rate;
    if (rate * walk->rate > 0) walk_to(walk, end->u, rate);
    else walk_home(walk, node->u * power(g / node->rate, 1 / (1 - node->power)));
}

static double cooling_time(const struct rule *rule, float g)
{
    float part[POINTS];
    for (int i = 0; i < POINTS; i++) part[i] = rule->weight[i] / (1 - g * rule->at[i]);
    return (double)((part[0] + part[1]) + (part[2] + part[3]));
}

static double warming_time(const struct rule *rule, float g)
{
    float part[POINTS];
    for (int i = 0; i < POINTS; i++) part[i] = rule->weight[i] / (g - rule->at[i]);
    return (double)((part[0] + part[1]) + (part[2] + part[3]));
}

/* From node to node over whole blocks, the largest that the time and the equilibrium allow. `up` is literal. */
static inline int stride(const struct cooling_balance *balance, int node, float g, bool up, double *left)
{
    const float pole = up ? g : 1 / g;
    for (int l = 0; l >= 0;) {
        const struct level *level = &balance->level[l];
        const unsigned b = (unsigned)((node >> level->bits) - !up);
        const struct rule *rule = &level->rule[up ? WARM : COOL][b < level->n ? b : 0];
        double time = INFINITY;
        if (b < level->n && fabsf(pole - rule->middle) > rule->reach)
            time = up ? warming_time(rule, g) : cooling_time(rule, g);
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

double cooling_balance_advance(const struct cooling_curve *curve, int k, double u, double rho, double dt)
{
    const double g = curve->heating / rho;
    const struct cooling_node *at = &curve->node[k];
    struct walk walk = {u, g - at->rate * power(u / at->u, 1 - at->power), rho * dt, false};
    const bool up = walk.rate > 0;
    while (!walk.done && walk.rate != 0) {
        if (up && k == curve->n - 1) return walk.u + walk.rate * walk.left;
        walk_segment(curve, k, g, up, &walk);
        if (walk.done) break;
        int node = up ? stride(curve->balance, k + 1, (float)g, true, &walk.left)
                      : stride(curve->balance, k, (float)g, false, &walk.left);
        if (!up && node == 0) return curve->node[0].u;
        walk.u = curve->node[node].u;
        walk.rate = g - curve->node[node].rate;
        k = up ? node : node - 1;
    }
    return walk.u;
}
