/* SPDX-License-Identifier: GPL-3.0-or-later
 * Depth first, the nearest child first, past no cell that lies beyond the farthest row of a full list. */
#include "nearest.h"
#include <math.h>

static void insert(struct nearest *nearest, int count, int32_t row, double r2)
{
    int at = nearest->n < count ? nearest->n++ : count - 1;
    for (; at > 0 && (nearest->r2[at - 1] > r2 || (nearest->r2[at - 1] == r2 && nearest->row[at - 1] > row)); at--) {
        nearest->r2[at] = nearest->r2[at - 1];
        nearest->row[at] = nearest->row[at - 1];
    }
    nearest->r2[at] = r2;
    nearest->row[at] = row;
}

static bool beyond(const struct nearest *nearest, int count, double r2)
{
    return nearest->n == count && r2 > nearest->r2[count - 1];
}

static void look_at_rows(const struct sim *sim, const struct node *node, const double pos[3], int count,
                         struct nearest *nearest)
{
    for (int32_t i = node->first[GAS]; i < node->first[GAS] + node->count[GAS]; i++) {
        double now[3], r2 = 0;
        if (species_gone(&sim->species[GAS], i)) continue;
        sim_predict(&sim->time, &sim->species[GAS], i, now);
        for (int k = 0; k < 3; k++) {
            double d = now[k] - pos[k];
            d += box_shift(&sim->box, k, d);
            r2 += d * d;
        }
        bool full = nearest->n == count;
        if (full && (r2 > nearest->r2[count - 1] || (r2 == nearest->r2[count - 1] && i > nearest->row[count - 1])))
            continue;
        insert(nearest, count, i, r2);
    }
}

enum { CHILDREN = 8 };

static void visit(const struct sim *sim, int32_t n, const double pos[3], int count, struct nearest *nearest)
{
    const struct node *node = &sim->tree.node[n];
    if (node->n_children == 0) {
        look_at_rows(sim, node, pos, count, nearest);
        return;
    }
    int order[CHILDREN], kept = 0;
    double gap[CHILDREN];
    for (int c = 0; c < node->n_children; c++) {
        const struct node *child = &sim->tree.node[node->child + c];
        if (child->count[GAS] == 0) continue;
        double r2 = nearest_gap2(sim, child, pos);
        int at = kept++;
        for (; at > 0 && gap[at - 1] > r2; at--) {
            gap[at] = gap[at - 1];
            order[at] = order[at - 1];
        }
        gap[at] = r2;
        order[at] = c;
    }
    for (int c = 0; c < kept; c++)
        if (!beyond(nearest, count, gap[c])) visit(sim, node->child + order[c], pos, count, nearest);
}

void nearest_gas(const struct sim *sim, const double pos[3], int count, struct nearest *nearest)
{
    check(count > 0 && count <= NEAREST_MOST);
    nearest->n = 0;
    if (sim->tree.n_nodes > 0 && sim->species[GAS].n > 0) visit(sim, 0, pos, count, nearest);
}
