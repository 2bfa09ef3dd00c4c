/* SPDX-License-Identifier: GPL-3.0-or-later
 * The walk for partners (partners.h). */
#include "partners.h"
#include "clouds.h"
#include "mem.h"
#include "nearest.h"
#include <math.h>

struct search {
    const struct sim *sim;
    int32_t row;
    struct body own;
    double span, widest;
    double speed;               /* 0: that of each cloud relative to the row */
    struct partners *list;
};

/* Place and velocity now. */
static void state_now(const struct sim *sim, int32_t row, double pos[3], double vel[3])
{
    const struct species *cloud = &sim->species[CLOUD];
    double lag = timeline_lag(&sim->time, cloud->rung[row], cloud->rung0[row]);
    sim_predict(&sim->time, cloud, row, pos);
    for (int k = 0; k < 3; k++) vel[k] = integrate_velocity(cloud->vel[row][k], (double)cloud->acc[row][k], lag);
}

struct body partners_body(const struct sim *sim, int32_t row)
{
    double mass = sim->species[CLOUD].mass[row];
    struct body body = {.mass = mass, .radius = clouds_radius(sim, mass)};
    state_now(sim, row, body.pos, body.vel);
    return body;
}

static void add(struct partners *list, int32_t row)
{
    if (list->n == list->capacity) {
        list->capacity = 2 * list->capacity + 16;
        list->row = mem_resize("clouds", list->row, (size_t)list->capacity * sizeof *list->row);
    }
    list->row[list->n++] = row;
}

static void look_at_rows(const struct search *s, const struct node *node)
{
    const struct sim *sim = s->sim;
    for (int32_t j = node->first[CLOUD]; j < node->first[CLOUD] + node->count[CLOUD]; j++) {
        if (j == s->row || species_gone(&sim->species[CLOUD], j)) continue;
        double pos[3], vel[3], r2 = 0, v2 = 0;
        state_now(sim, j, pos, vel);
        for (int k = 0; k < 3; k++) {
            double r = pos[k] - s->own.pos[k], v = vel[k] - s->own.vel[k];
            r += box_shift(&sim->box, k, r);
            r2 += r * r;
            v2 += v * v;
        }
        double speed = s->speed > 0 ? s->speed : sqrt(v2), way = s->own.radius + s->span * speed, reach = way + s->widest;
        if (r2 >= reach * reach) continue;
        reach = way + clouds_radius(sim, sim->species[CLOUD].mass[j]);
        if (r2 >= reach * reach) continue;
        if (s->speed > 0) add(s->list, j);
        else s->list->speed = fmax(s->list->speed, sqrt(v2));
    }
}

static void visit(const struct search *s, int32_t n)
{
    const struct node *node = &s->sim->tree.node[n];
    double v2 = 0;
    if (node->count[CLOUD] == 0) return;
    for (int k = 0; k < 3; k++) {
        double v = fabs((double)node->vel[k] - s->own.vel[k]) + (double)node->speed;
        v2 += v * v;
    }
    double reach = s->own.radius + s->widest + s->span * (s->speed > 0 ? s->speed : sqrt(v2));
    if (nearest_gap2(s->sim, node, s->own.pos) >= reach * reach) return;
    if (node->n_children == 0) look_at_rows(s, node);
    for (int32_t c = 0; c < node->n_children; c++) visit(s, node->child + c);
}

void partners_find(const struct sim *sim, int32_t row, double span, double widest, struct partners *list)
{
    struct search search = {sim, row, partners_body(sim, row), span, widest, 0, list};
    if (sim->tree.n_nodes == 0) return;
    visit(&search, 0);
    search.speed = list->speed;
    if (list->speed > 0) visit(&search, 0);
}
