/* SPDX-License-Identifier: GPL-3.0-or-later
 * The search for partners (partners.h): once for a group of clouds through the tree, whose cells know their largest cloud, then
 * one by one among those near the group. */
#include "partners.h"
#include "mem.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Clouds of a group. */
enum { MOST = 64 };

/* A cloud whose step ends now: whom it may have met, and the largest relative speed of those that came within its reach. */
struct found { int32_t *row; int32_t n, capacity; double speed; };

/* Clouds of one cell whose step ends now, next to each other in the list, with what bounds them all. One born since the tree was
 * built is a group of its own. */
struct group {
    int64_t first;
    int32_t n;
    struct body own[MOST];
    double span[MOST];
    double middle[3], half[3], vel[3], speed;   /* their box; a velocity, and the largest one against it */
    double radius, longest;                     /* the largest radius, the longest step */
};

/* Clouds near a group: what the search needs of their states now, a column each. */
struct near { int32_t *row; double *pos[3], *vel[3], *radius, *met2; int32_t n, capacity; };

struct search {
    const struct sim *sim;
    const struct cloud_size *size;
    const struct group *group;
    struct near *near;
    double least;               /* no relative speed counts for less */
    double way;                 /* of the group's farthest look, without the other's radius; 0: that of relative speeds */
};

static void velocity_now(const struct sim *sim, int32_t row, double vel[3])
{
    const struct species *cloud = &sim->species[CLOUD];
    double lag = timeline_lag(&sim->time, cloud->rung[row], cloud->rung0[row]);
    for (int k = 0; k < 3; k++) vel[k] = integrate_velocity(cloud->vel[row][k], (double)cloud->acc[row][k], lag);
}

struct body partners_body(const struct sim *sim, const struct cloud_size *size, int32_t row)
{
    double mass = sim->species[CLOUD].mass[row];
    struct body body = {.mass = mass, .radius = cloud_radius(size, mass)};
    sim_predict(&sim->time, &sim->species[CLOUD], row, body.pos);
    velocity_now(sim, row, body.vel);
    for (int k = 0; k < 3; k++) body.acc[k] = (double)sim->species[CLOUD].acc[row][k];
    return body;
}

/* --- radii of cells --- */

static void measure_node(const struct sim *sim, const void *data, int32_t n)
{
    const struct tree *tree = &sim->tree;
    const struct node *node = &tree->node[n];
    const double *mass = sim->species[CLOUD].mass;
    float largest = 0;
    for (int32_t k = 0; k < node->n_children; k++) largest = fmaxf(largest, tree->cloud_radius[node->child + k]);
    if (node->n_children == 0 && node->count[CLOUD] > 0) {
        double most = 0;
        for (int32_t i = node->first[CLOUD]; i < node->first[CLOUD] + node->count[CLOUD]; i++)
            most = mass[i] > most ? mass[i] : most;
        largest = nextafterf((float)cloud_radius(data, most), INFINITY);
    }
    tree->cloud_radius[n] = largest;
}

void partners_measure(struct sim *sim, const struct cloud_size *size, const int32_t *row, int64_t rows)
{
    tree_sweep(sim, CLOUD, row, rows, measure_node, size);
}

/* --- groups --- */

static double length(const double a[3]) { return sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]); }

static void fill_group(const struct sim *sim, const struct cloud_size *size, struct group *g)
{
    const struct species *cloud = &sim->species[CLOUD];
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (int32_t m = 0; m < g->n; m++) {
        const int32_t row = cloud->ending[g->first + m];
        struct body *own = &g->own[m];
        double apart[3];
        *own = partners_body(sim, size, row);
        g->span[m] = timeline_step(&sim->time, cloud->rung0[row]);
        if (m == 0) memcpy(g->vel, own->vel, sizeof g->vel);
        for (int k = 0; k < 3; k++) {
            low[k] = fmin(low[k], own->pos[k]);
            high[k] = fmax(high[k], own->pos[k]);
            apart[k] = own->vel[k] - g->vel[k];
        }
        g->speed = fmax(g->speed, length(apart));
        g->radius = fmax(g->radius, own->radius);
        g->longest = fmax(g->longest, g->span[m]);
    }
    for (int k = 0; k < 3; k++) {
        g->middle[k] = 0.5 * (low[k] + high[k]);
        g->half[k] = 0.5 * (high[k] - low[k]);
    }
}

/* Number of clouds from ending[first] on that share its cell of at most MOST clouds, or the leaf, of which a part is taken. */
static int32_t count_group(const struct sim *sim, int64_t first)
{
    const struct species *cloud = &sim->species[CLOUD];
    const struct node *node = sim->tree.node;
    const int32_t row = cloud->ending[first];
    int32_t n = 1;
    if (row >= node->first[CLOUD] + node->count[CLOUD]) return 1;
    while (node->count[CLOUD] > MOST && node->n_children > 0) {
        node = &sim->tree.node[node->child];
        while (row >= node->first[CLOUD] + node->count[CLOUD]) node++;
    }
    while (n < MOST && first + n < cloud->n_ending && cloud->ending[first + n] < node->first[CLOUD] + node->count[CLOUD]) n++;
    return n;
}

/* --- who is near --- */

/* Square of the distance of a box, given by its middle and half its sides, from the group's: nearest images. */
static double gap2(const struct search *s, const double middle[3], const double half[3])
{
    double sum = 0;
    for (int k = 0; k < 3; k++) {
        double x = middle[k] - s->group->middle[k];
        x += box_shift(&s->sim->box, k, x);
        const double gap = fabs(x) - half[k] - s->group->half[k];
        sum += gap > 0 ? gap * gap : 0;
    }
    return sum;
}

/* How far the group looks for clouds of at most that radius and, against its velocity, that speed. */
static double look(const struct search *s, double radius, const double apart[3], double more)
{
    const double margin = 1 + 1e-12;    /* other sums than those of a pair */
    const struct group *g = s->group;
    if (s->way > 0) return margin * (radius + s->way);
    const double speed = length(apart) + more + g->speed;
    return margin * (radius + g->radius + g->longest * (speed > s->least ? speed : s->least));
}

static void resize_near(struct near *near, int32_t capacity)
{
    const size_t bytes = (size_t)capacity * sizeof(double);
    near->capacity = capacity;
    near->row = mem_resize("clouds", near->row, (size_t)capacity * sizeof *near->row);
    near->radius = mem_resize("clouds", near->radius, bytes);
    near->met2 = mem_resize("clouds", near->met2, bytes);
    for (int k = 0; k < 3; k++) {
        near->pos[k] = mem_resize("clouds", near->pos[k], bytes);
        near->vel[k] = mem_resize("clouds", near->vel[k], bytes);
    }
}

static void free_near(struct near *near)
{
    mem_free(near->row);
    mem_free(near->radius);
    mem_free(near->met2);
    for (int k = 0; k < 3; k++) {
        mem_free(near->pos[k]);
        mem_free(near->vel[k]);
    }
}

static void add_near(struct near *near, int32_t row, const double pos[3], const double vel[3], double radius)
{
    if (near->n == near->capacity) resize_near(near, 2 * near->capacity + 64);
    const int32_t n = near->n++;
    near->row[n] = row;
    near->radius[n] = radius;
    for (int k = 0; k < 3; k++) {
        near->pos[k][n] = pos[k];
        near->vel[k][n] = vel[k];
    }
}

/* reach: how far the group looks into the cell. */
static void look_at_rows(const struct search *s, const struct node *node, double reach)
{
    static const double point[3] = {0};
    const struct species *cloud = &s->sim->species[CLOUD];
    for (int32_t j = node->first[CLOUD]; j < node->first[CLOUD] + node->count[CLOUD]; j++) {
        double pos[3], vel[3], apart[3];
        sim_predict(&s->sim->time, cloud, j, pos);
        const double away2 = gap2(s, pos, point);
        if (away2 >= reach * reach || species_gone(cloud, j)) continue;
        velocity_now(s->sim, j, vel);
        for (int k = 0; k < 3; k++) apart[k] = vel[k] - s->group->vel[k];
        const double radius = cloud_radius(s->size, cloud->mass[j]), own = look(s, radius, apart, 0);
        if (away2 < own * own) add_near(s->near, j, pos, vel, radius);
    }
}

/* The tree knows the largest component of a velocity against that of the cell. */
static void visit(const struct search *s, int32_t n)
{
    const struct node *node = &s->sim->tree.node[n];
    double middle[3], half[3], apart[3];
    for (int k = 0; k < 3; k++) {
        middle[k] = node->pos[k] + 0.5 * ((double)node->low[k] + (double)node->high[k]);
        half[k] = 0.5 * ((double)node->high[k] - (double)node->low[k]);
        apart[k] = (double)node->vel[k] - s->group->vel[k];
    }
    const double reach = look(s, (double)s->sim->tree.cloud_radius[n], apart, sqrt(3) * (double)node->speed);
    if (gap2(s, middle, half) >= reach * reach) return;
    if (node->n_children == 0) look_at_rows(s, node, reach);
    for (int32_t c = node->child; c < node->child + node->n_children; c++)
        if (s->sim->tree.node[c].count[CLOUD] > 0) visit(s, c);
}

/* --- pairs --- */

/* The image nearest to `own` of each of those near. */
static void take_images(const struct sim *sim, const struct body *own, const struct near *near)
{
    if (!box_closed(&sim->box)) return;
    for (int k = 0; k < 3; k++)
        for (int32_t j = 0; j < near->n; j++) near->pos[k][j] += box_shift(&sim->box, k, near->pos[k][j] - own->pos[k]);
}

/* The largest relative speed of those that can have come within reach within the span: r < a + span v, a the sum of the radii, or,
 * without roots, d = r^2 - a^2 - (span v)^2 < 0 or d^2 < (2 a span v)^2. Its own row is at rest against it. Two loops:
 * that of pairs alone is one of vectors with any compiler. */
static double fastest(struct near *near, const struct body *own, double span)
{
    const double *x = near->pos[0], *y = near->pos[1], *z = near->pos[2], span2 = span * span;
    const double *u = near->vel[0], *v = near->vel[1], *w = near->vel[2], *radius = near->radius;
    double *met2 = near->met2, most2 = 0;
    for (int32_t j = 0; j < near->n; j++) {
        const double rx = x[j] - own->pos[0], ry = y[j] - own->pos[1], rz = z[j] - own->pos[2];
        const double vx = u[j] - own->vel[0], vy = v[j] - own->vel[1], vz = w[j] - own->vel[2];
        const double a = own->radius + radius[j], v2 = vx * vx + vy * vy + vz * vz, way2 = span2 * v2;
        const double d = rx * rx + ry * ry + rz * rz - a * a - way2;
        met2[j] = ((d < 0) | (d * d < 4 * a * a * way2)) ? v2 : 0;
    }
    for (int32_t j = 0; j < near->n; j++) most2 = met2[j] > most2 ? met2[j] : most2;
    return sqrt(most2);
}

static void list_partners(const struct near *near, const struct body *own, int32_t row, double way, struct found *found)
{
    const double *x = near->pos[0], *y = near->pos[1], *z = near->pos[2];
    for (int32_t j = 0; j < near->n; j++) {
        const double rx = x[j] - own->pos[0], ry = y[j] - own->pos[1], rz = z[j] - own->pos[2];
        const double reach = own->radius + way + near->radius[j];
        if (rx * rx + ry * ry + rz * rz >= reach * reach || near->row[j] == row) continue;
        if (found->n == found->capacity) {
            found->capacity = 2 * found->capacity + 4;
            found->row = mem_resize("clouds", found->row, (size_t)found->capacity * sizeof *found->row);
        }
        found->row[found->n++] = near->row[j];
    }
}

static void find(const struct sim *sim, const struct cloud_size *size, struct group *group, struct near *near, struct found *found)
{
    fill_group(sim, size, group);
    struct search search = {sim, size, group, near, 2 * group->speed, 0};
    double way = 0;
    near->n = 0;
    visit(&search, 0);
    const struct species *cloud = &sim->species[CLOUD];
    for (int32_t m = 0; m < group->n; m++) {
        const struct body *own = &group->own[m];
        if (species_gone(cloud, cloud->ending[group->first + m])) continue;
        take_images(sim, own, near);
        found[m].speed = fastest(near, own, group->span[m]);
        if (found[m].speed > 0) way = fmax(way, own->radius + group->span[m] * found[m].speed);
    }
    if (way > group->radius + group->longest * search.least) {      /* whoever lies within the way was not looked for */
        search.way = way;
        near->n = 0;
        visit(&search, 0);
    }
    for (int32_t m = 0; m < group->n; m++) {
        if (!(found[m].speed > 0)) continue;
        take_images(sim, &group->own[m], near);
        list_partners(near, &group->own[m], cloud->ending[group->first + m], group->span[m] * found[m].speed, &found[m]);
    }
}

static void find_all(const struct sim *sim, const struct cloud_size *size, struct found *found)
{
    const int64_t n = sim->species[CLOUD].n_ending;
    int64_t *first = mem_array("clouds", int64_t, n + 1), groups = 0;
    for (int64_t e = 0; e < n; e += count_group(sim, e)) first[groups++] = e;
    first[groups] = n;
#pragma omp parallel
    {
        struct near near = {0};
#pragma omp for schedule(dynamic, 4)
        for (int64_t g = 0; g < groups; g++) {
            struct group group = {.first = first[g], .n = (int32_t)(first[g + 1] - first[g])};
            find(sim, size, &group, &near, found + first[g]);
        }
        free_near(&near);
    }
    mem_free(first);
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

void partners_gather(struct sim *sim, const struct cloud_size *size, float *speed, struct partners *partners)
{
    const struct species *cloud = &sim->species[CLOUD];
    struct found *found = mem_array("clouds", struct found, cloud->n_ending);
    struct gathering g = {sim, size, partners, mem_array("clouds", int32_t, cloud->n)};
    int64_t most = 0;
    if (sim->tree.n_nodes > 0) find_all(sim, size, found);
    for (int64_t e = 0; e < cloud->n_ending; e++) speed[cloud->ending[e]] = (float)found[e].speed;
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
