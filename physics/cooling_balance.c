/* SPDX-License-Identifier: GPL-3.0-or-later
 * Makes the rules of cooling_balance.h and walks over them. Times are times rho, rates over rho. */
#include "cooling_balance.h"
#include "cooling_advance.h"
#include "mem.h"
#include <gsl/gsl_eigen.h>
#include <math.h>

/* How far the pole must be from the middle of a block, in half widths: with x of these Gauss' rule of 4 points is
 * good to (x + sqrt(x^2 - 1))^-8, 5e-4 of the time of such a block and 2e-6 where the pole is twice as far. */
static const double clearance = 1.5;

/* --- making --- */

/* Points of a measure; both rules of a child are two of these. */
struct measure { int n; double at[2 * COOLING_POINTS], weight[2 * COOLING_POINTS]; };

/* Gauss' rule of a measure of a few points: the recurrence of its orthogonal polynomials (Stieltjes), whose
 * tridiagonal matrix has the points as eigenvalues (Golub & Welsch 1969). */
static struct measure reduce(const struct measure *m)
{
    double a[COOLING_POINTS] = {0}, b[COOLING_POINTS] = {0}, before[2 * COOLING_POINTS] = {0}, now[2 * COOLING_POINTS];
    double sum = 0, norm = 0;
    int n = 0;
    for (int i = 0; i < m->n; i++) sum += m->weight[i];
    for (int i = 0; i < m->n; i++) now[i] = 1 / sqrt(sum);
    while (n < COOLING_POINTS) {
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
    double matrix[COOLING_POINTS * COOLING_POINTS] = {0}, value[COOLING_POINTS], vector[COOLING_POINTS * COOLING_POINTS];
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

static struct cooling_rule make_rule(const struct measure *m, struct range range)
{
    struct cooling_rule rule = {.middle = (float)(0.5 * (range.low + range.high)),
                        .reach = (float)(clearance * 0.5 * (range.high - range.low))};
    for (int i = 0; i < COOLING_POINTS; i++) {
        rule.at[i] = i < m->n ? (float)m->at[i] : rule.middle;
        rule.weight[i] = i < m->n ? (float)m->weight[i] : 0;
    }
    return rule;
}

/* What the blocks of one level know: measures of 1/Q and of Q, and the range of Q. */
struct draft { struct measure of[COOLING_WAYS]; struct range q; };

/* A power law over a segment: points of Gauss-Legendre in ln u. */
static struct draft draft_segment(const struct cooling_node *node)
{
    static const double point[COOLING_POINTS] = {-0.8611363115940526, -0.3399810435848563, 0.3399810435848563, 0.8611363115940526};
    static const double weight[COOLING_POINTS] = {0.3478548451374538, 0.6521451548625461, 0.6521451548625461, 0.3478548451374538};
    double length = log(node[1].u / node[0].u);
    struct draft draft = {{{.n = COOLING_POINTS}, {.n = COOLING_POINTS}},
                          {fmin(node[0].rate, node[1].rate), fmax(node[0].rate, node[1].rate)}};
    struct measure *cool = &draft.of[COOLING_DOWN], *warm = &draft.of[COOLING_UP];
    for (int i = 0; i < COOLING_POINTS; i++) {
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
    for (int d = 0; d < COOLING_WAYS; d++) {
        struct measure sum = a->of[d];
        for (int i = 0; i < b->of[d].n; i++) {
            sum.at[sum.n] = b->of[d].at[i];
            sum.weight[sum.n++] = b->of[d].weight[i];
        }
        both.of[d] = reduce(&sum);
    }
    return both;
}

static void make_level(struct cooling_level *level, int bits, const struct draft *draft, int n)
{
    *level = (struct cooling_level){.bits = bits, .n = (unsigned)n};
    for (int d = 0; d < COOLING_WAYS; d++) level->rule[d] = mem_array("cooling", struct cooling_rule, n);
    for (int b = 0; b < n; b++) {
        struct range q = draft[b].q, x = {1 / q.high, 1 / q.low};
        level->rule[COOLING_DOWN][b] = make_rule(&draft[b].of[COOLING_DOWN], x);
        level->rule[COOLING_UP][b] = make_rule(&draft[b].of[COOLING_UP], q);
    }
}

struct cooling_balance *cooling_balance_new(const struct cooling_curve *curve)
{
    struct cooling_balance *balance = mem_alloc("cooling", sizeof *balance);
    struct draft *draft = mem_array("cooling", struct draft, curve->n - 1);
    for (int k = 0; k < curve->n - 1; k++) draft[k] = draft_segment(&curve->node[k]);
    for (int bits = 0, n = curve->n - 1; n > 0; bits++, n /= 2) {
        if (bits % COOLING_STRIDE == 0) make_level(&balance->level[balance->n_levels++], bits, draft, n);
        for (int b = 0; b < n / 2; b++) draft[b] = join(&draft[2 * b], &draft[2 * b + 1]);
    }
    mem_free(draft);
    return balance;
}

void cooling_balance_free(struct cooling_balance *balance)
{
    if (!balance) return;
    for (int l = 0; l < balance->n_levels; l++)
        for (int d = 0; d < COOLING_WAYS; d++) mem_free(balance->level[l].rule[d]);
    mem_free(balance);
}
