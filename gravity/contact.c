/* SPDX-License-Identifier: GPL-3.0-or-later
 * What becomes of the potential where rows divide or change their species (contact.h). */
#include "contact.h"
#include "gravity.h"
#include <math.h>

bool gravity_gas_is_adaptive(const struct sim *sim)
{
    const struct gravity *g = sim_state(sim, "gravity");
    return g && g->adaptive;
}

double gravity_pair(const struct sim *sim, enum species_kind a, enum species_kind b, double r)
{
    const struct gravity *g = sim_state(sim, "gravity");
    return g ? -g->G * (double)pair_any(g->form, r * r, 1, g->half_soft2[a] + g->half_soft2[b]).depth : 0;
}

double gravity_contact(const struct sim *sim, enum species_kind a, enum species_kind b)
{
    return gravity_pair(sim, a, b, 0);
}

/* What is asked: pieces, and how far from their middle they reach. */
struct field {
    const struct sim *sim;
    const struct gravity *g;
    const struct gravity_piece *piece;
    int n;
    enum species_kind kind;         /* of the rows that do not count */
    const int64_t *without;
    double pos[3], reach;
};

/* Of the pieces with a mass elsewhere. */
static double field_of(const struct field *f, const double pos[3], double mass, double half_soft2)
{
    double sum = 0;
    for (int p = 0; p < f->n; p++) {
        const struct gravity_piece *piece = &f->piece[p];
        double r2 = 0;
        for (int k = 0; k < 3; k++) r2 += (pos[k] - piece->pos[k]) * (pos[k] - piece->pos[k]);
        sum -= piece->mass * (double)pair_any(f->g->form, r2, mass, f->g->half_soft2[piece->kind] + half_soft2).depth;
    }
    return f->g->G * sum;
}

static double field_of_rows(const struct field *f, enum species_kind kind, int64_t first, int64_t end)
{
    const struct species *s = &f->sim->species[kind];
    double sum = 0, now[3];
    for (int64_t i = first; i < end; i++) {
        if (kind == f->kind && (i == f->without[0] || i == f->without[1])) continue;
        sim_predict(&f->sim->time, s, i, now);
        sum += field_of(f, now, s->mass[i], gravity_half_soft2(f->g, s, i));
    }
    return sum;
}

/* Far cells act from their centres: at a distance d the error is of the order of (size/d)^2 and, where softenings are not all the
 * same Plummer's, which cells have too, of (softening/d)^2. */
static bool is_far(const struct field *f, const struct node *node)
{
    enum { SIZES = 3, SOFTENINGS = 5 };
    double d2 = 0, size = f->reach, soft2 = 0;
    for (int k = 0; k < 3; k++) {
        d2 += (node->pos[k] - f->pos[k]) * (node->pos[k] - f->pos[k]);
        size = fmax(size, (double)(node->high[k] - node->low[k]));
    }
    for (int s = 0; s < N_SPECIES && f->g->form != SOFT_COMMON; s++) soft2 = fmax(soft2, 2 * f->g->half_soft2[s]);
    if (f->g->adaptive) {
        const double support = 2 * (double)f->sim->tree.h_max[node - f->sim->tree.node];
        soft2 = fmax(soft2, support * support);
    }
    return d2 > SIZES * SIZES * size * size && d2 > SOFTENINGS * SOFTENINGS * soft2;
}

static double visit(const struct field *f, int32_t n)
{
    const struct node *node = &f->sim->tree.node[n];
    double sum = 0;
    if (is_far(f, node)) return field_of(f, node->pos, (double)node->mass, 0.5 * f->g->far_soft2);
    for (int k = 0; k < node->n_children; k++) sum += visit(f, node->child + k);
    for (int s = 0; s < N_SPECIES && node->n_children == 0; s++)
        sum += field_of_rows(f, (enum species_kind)s, node->first[s], node->first[s] + node->count[s]);
    return sum;
}

double gravity_field(const struct sim *sim, const struct gravity_piece *piece, int n, enum species_kind kind,
                     const int64_t without[2])
{
    const struct gravity *g = sim_state(sim, "gravity");
    if (!g || sim->tree.n_nodes == 0) return 0;
    struct field f = {.sim = sim, .g = g, .piece = piece, .n = n, .kind = kind, .without = without};
    for (int p = 0; p < n; p++)
        for (int k = 0; k < 3; k++) f.pos[k] += piece[p].pos[k] / n;
    for (int p = 0; p < n; p++)
        for (int k = 0; k < 3; k++) f.reach = fmax(f.reach, 2 * fabs(piece[p].pos[k] - f.pos[k]));
    double sum = visit(&f, 0);
    for (int s = 0; s < N_SPECIES; s++) {       /* rows born since the tree was built */
        const struct node *root = &sim->tree.node[0];
        sum += field_of_rows(&f, (enum species_kind)s, root->first[s] + root->count[s], sim->species[s].n);
    }
    return sum;
}

double gravity_among(const struct sim *sim, const struct gravity_piece *piece, int64_t n)
{
    const struct gravity *g = sim_state(sim, "gravity");
    double sum = 0;
    for (int64_t p = 1; p < n && g; p++) {
        const double half_soft2 = g->half_soft2[piece[p].kind], *own = piece[p].pos;
        for (int64_t q = 0; q < p; q++) {
            const double x = piece[q].pos[0] - own[0], y = piece[q].pos[1] - own[1], z = piece[q].pos[2] - own[2];
            const double soft2 = half_soft2 + g->half_soft2[piece[q].kind];
            sum -= piece[p].mass * (double)pair_any(g->form, x * x + y * y + z * z, piece[q].mass, soft2).depth;
        }
    }
    return g ? g->G * sum : 0;
}

double gravity_resoften(const struct sim *sim, enum species_kind kind, int64_t row, enum species_kind to)
{
    const struct gravity *g = sim_state(sim, "gravity");
    if (!g || g->half_soft2[kind] == g->half_soft2[to]) return 0;
    struct gravity_piece piece[2] = {{.kind = kind, .mass = -1}, {.kind = to, .mass = 1}};
    for (int p = 0; p < 2; p++) sim_predict(&sim->time, &sim->species[kind], row, piece[p].pos);
    return gravity_field(sim, piece, 2, kind, (const int64_t[2]){row, -1});
}
