/* SPDX-License-Identifier: GPL-3.0-or-later
 * What becomes of the potential where rows divide or change their species (contact.h). */
#include "contact.h"
#include "gravity.h"
#include <math.h>

double gravity_pair(const struct sim *sim, enum species_kind a, enum species_kind b, double r)
{
    const struct gravity *g = sim_state(sim, "gravity");
    return g ? -g->G * (double)pair_any(g->form, r * r, 1, g->half_soft2[a] + g->half_soft2[b]).depth : 0;
}

double gravity_contact(const struct sim *sim, enum species_kind a, enum species_kind b)
{
    return gravity_pair(sim, a, b, 0);
}

/* A row that changes its softening, and the halves of it squared that it brings to pairs before and after. */
struct change {
    const struct sim *sim;
    const struct gravity *g;
    enum species_kind kind;
    int64_t row;
    double pos[3], before, after;
};

/* Between the row and a mass elsewhere. */
static double change_by(const struct change *c, const double pos[3], double mass, double half_soft2)
{
    double r2 = 0;
    for (int k = 0; k < 3; k++) r2 += (pos[k] - c->pos[k]) * (pos[k] - c->pos[k]);
    double before = (double)pair_any(c->g->form, r2, mass, c->before + half_soft2).depth;
    return c->g->G * (before - (double)pair_any(c->g->form, r2, mass, c->after + half_soft2).depth);
}

static double change_by_rows(const struct change *c, enum species_kind kind, int64_t first, int64_t end)
{
    const struct species *s = &c->sim->species[kind];
    double sum = 0, now[3];
    for (int64_t i = first; i < end; i++) {
        if (kind == c->kind && i == c->row) continue;
        sim_predict(&c->sim->time, s, i, now);
        sum += change_by(c, now, s->mass[i], gravity_half_soft2(c->g, s, i));
    }
    return sum;
}

/* Far cells act from their centres: at a distance d the error is of the order of (size/d)^2 and of (softening/d)^2. */
static bool is_far(const struct change *c, const struct node *node)
{
    enum { SIZES = 2, SOFTENINGS = 5 };
    double d2 = 0, size = 0, soft2 = 0;
    for (int k = 0; k < 3; k++) {
        d2 += (node->pos[k] - c->pos[k]) * (node->pos[k] - c->pos[k]);
        size = fmax(size, (double)(node->high[k] - node->low[k]));
    }
    for (int s = 0; s < N_SPECIES; s++) soft2 = fmax(soft2, 2 * c->g->half_soft2[s]);
    return d2 > SIZES * SIZES * size * size && d2 > SOFTENINGS * SOFTENINGS * soft2;
}

static double visit(const struct change *c, int32_t n)
{
    const struct node *node = &c->sim->tree.node[n];
    double sum = 0;
    if (is_far(c, node)) return change_by(c, node->pos, (double)node->mass, 0.5 * c->g->far_soft2);
    for (int k = 0; k < node->n_children; k++) sum += visit(c, node->child + k);
    for (int s = 0; s < N_SPECIES && node->n_children == 0; s++)
        sum += change_by_rows(c, (enum species_kind)s, node->first[s], node->first[s] + node->count[s]);
    return sum;
}

double gravity_resoften(const struct sim *sim, enum species_kind kind, int64_t row, enum species_kind to)
{
    const struct gravity *g = sim_state(sim, "gravity");
    if (!g || g->half_soft2[kind] == g->half_soft2[to]) return 0;
    struct change change = {sim, g, kind, row, {0}, g->half_soft2[kind], g->half_soft2[to]};
    sim_predict(&sim->time, &sim->species[kind], row, change.pos);
    double sum = visit(&change, 0);
    for (int s = 0; s < N_SPECIES; s++) {       /* rows born since the tree was built */
        const struct node *root = &sim->tree.node[0];
        sum += change_by_rows(&change, (enum species_kind)s, root->first[s] + root->count[s], sim->species[s].n);
    }
    return sum;
}
