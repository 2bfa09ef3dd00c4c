/* SPDX-License-Identifier: GPL-3.0-or-later
 * The walk for partners (partners.h). */
#include "partners.h"
#include "mem.h"
#include "nearest.h"
#include <stdlib.h>

struct found { int32_t *row; int32_t n, capacity; double speed; };

struct search {
    const struct sim *sim;
    const struct cloud_size *size;
    int32_t row;
    struct body own;
    double span, widest;
    double speed;               /* 0: that of each cloud relative to the row */
    struct found *list;
};

/* Place and velocity now. */
static void state_now(const struct sim *sim, int32_t row, double pos[3], double vel[3])
{
    const struct species *cloud = &sim->species[CLOUD];
    double lag = timeline_lag(&sim->time, cloud->rung[row], cloud->rung0[row]);
    sim_predict(&sim->time, cloud, row, pos);
    for (int k = 0; k < 3; k++) vel[k] = integrate_velocity(cloud->vel[row][k], (double)cloud->acc[row][k], lag);
}

struct body partners_body(const struct sim *sim, const struct cloud_size *size, int32_t row)
{
    double mass = sim->species[CLOUD].mass[row];
    struct body body = {.mass = mass, .radius = cloud_radius(size, mass)};
    state_now(sim, row, body.pos, body.vel);
    for (int k = 0; k < 3; k++) body.acc[k] = (double)sim->species[CLOUD].acc[row][k];
    return body;
}

static void add(struct found *list, int32_t row)
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
        reach = way + cloud_radius(s->size, sim->species[CLOUD].mass[j]);
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

static void find(const struct sim *sim, const struct cloud_size *size, int32_t row, double widest, struct found *list)
{
    const double span = timeline_step(&sim->time, sim->species[CLOUD].rung0[row]);
    struct search search = {sim, size, row, partners_body(sim, size, row), span, widest, 0, list};
    if (sim->tree.n_nodes == 0) return;
    visit(&search, 0);
    search.speed = list->speed;
    if (list->speed > 0) visit(&search, 0);
}

/* --- couples --- */

struct gathering {
    struct sim *sim;
    const struct cloud_size *size;
    struct partners *all;
    int32_t *index;             /* party of each row of the table, less 1 */
};

static void join(struct gathering *g, int32_t row, double span)
{
    struct partners *all = g->all;
    if (g->index[row] > 0) return;
    const struct species *cloud = &g->sim->species[CLOUD];
    const double rested = cloud->rested ? cloud->rested[row] - timeline_now(&g->sim->time) : -INFINITY;
    all->party[all->n] = (struct party){partners_body(g->sim, g->size, row), cloud->id[row], row, 0, span, -1, rested};
    g->index[row] = ++all->n;
}

static int by_key(const void *a, const void *b)
{
    uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

/* Each couple once, whoever's list it is in. */
static void pair_up(const struct sim *sim, struct partners *all, uint64_t *key, int64_t n)
{
    if (n > 0) qsort(key, (size_t)n, sizeof *key, by_key);
    for (int64_t k = 0; k < n; k++) {
        if (k > 0 && key[k] == key[k - 1]) continue;
        struct couple *couple = &all->couple[all->couples++];
        *couple = (struct couple){.a = (int32_t)(key[k] >> 32), .b = (int32_t)(key[k] & UINT32_MAX)};
        for (int x = 0; x < 3; x++)
            couple->shift[x] = box_shift(&sim->box, x, all->party[couple->b].body.pos[x] - all->party[couple->a].body.pos[x]);
    }
}

static void list_couples(struct gathering *g, const struct found *found, int64_t most)
{
    const struct species *cloud = &g->sim->species[CLOUD];
    uint64_t *key = mem_array("clouds", uint64_t, most);
    int64_t n = 0;
    for (int64_t e = 0; e < cloud->n_ending && most > 0; e++)
        join(g, cloud->ending[e], timeline_step(&g->sim->time, cloud->rung0[cloud->ending[e]]));
    for (int64_t e = 0; e < cloud->n_ending; e++)
        for (int32_t k = 0; k < found[e].n; k++) {
            join(g, found[e].row[k], INFINITY);
            uint64_t a = (uint64_t)g->index[cloud->ending[e]] - 1, b = (uint64_t)g->index[found[e].row[k]] - 1;
            key[n++] = a < b ? a << 32 | b : b << 32 | a;
        }
    pair_up(g->sim, g->all, key, n);
    mem_free(key);
}

void partners_gather(struct sim *sim, const struct cloud_size *size, double widest, float *speed, struct partners *partners)
{
    const struct species *cloud = &sim->species[CLOUD];
    struct found *found = mem_array("clouds", struct found, cloud->n_ending);
    struct gathering g = {sim, size, partners, mem_array("clouds", int32_t, cloud->n)};
    int64_t most = 0;
#pragma omp parallel for schedule(dynamic, 16)
    for (int64_t e = 0; e < cloud->n_ending; e++) {
        int32_t row = cloud->ending[e];
        if (!species_gone(cloud, row)) find(sim, size, row, widest, &found[e]);
        speed[row] = (float)found[e].speed;
    }
    for (int64_t e = 0; e < cloud->n_ending; e++) most += found[e].n;
    partners->party = mem_array("clouds", struct party, most > 0 ? cloud->n_ending + most : 0);
    partners->couple = mem_array("clouds", struct couple, most);
    list_couples(&g, found, most);
    for (int64_t e = 0; e < cloud->n_ending; e++) mem_free(found[e].row);
    mem_free(found);
    mem_free(g.index);
}

void partners_free(struct partners *partners)
{
    mem_free(partners->party);
    mem_free(partners->couple);
}
