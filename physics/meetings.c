/* SPDX-License-Identifier: GPL-3.0-or-later
 * A queue of the next meetings by time (meetings.h). An entry is void once one of its clouds has changed; whoever changes
 * looks at all of its couples again. */
#include "meetings.h"
#include "mem.h"
#include <math.h>

struct meeting { double time; int32_t couple; int version[2]; };

struct queue {
    struct party *party;
    const struct couple *couple;
    struct meeting *heap;
    int64_t n, capacity;
    int32_t *first, *list;      /* couples of each party */
};

static bool before(const struct queue *q, const struct meeting *x, const struct meeting *y)
{
    if (x->time != y->time) return x->time < y->time;
    uint64_t id[2][2];
    const struct meeting *meeting[2] = {x, y};
    for (int m = 0; m < 2; m++) {
        const struct couple *couple = &q->couple[meeting[m]->couple];
        uint64_t a = q->party[couple->a].id, b = q->party[couple->b].id;
        id[m][0] = a < b ? a : b;
        id[m][1] = a < b ? b : a;
    }
    return id[0][0] != id[1][0] ? id[0][0] < id[1][0] : id[0][1] < id[1][1];
}

static void put(struct queue *q, const struct meeting *meeting)
{
    if (q->n == q->capacity) {
        q->capacity = 2 * q->capacity + 64;
        q->heap = mem_resize("clouds", q->heap, (size_t)q->capacity * sizeof *q->heap);
    }
    int64_t at = q->n++;
    for (; at > 0 && before(q, meeting, &q->heap[(at - 1) / 2]); at = (at - 1) / 2) q->heap[at] = q->heap[(at - 1) / 2];
    q->heap[at] = *meeting;
}

static struct meeting take(struct queue *q)
{
    struct meeting first = q->heap[0], last = q->heap[--q->n];
    int64_t at = 0;
    for (int64_t child; (child = 2 * at + 1) < q->n; at = child) {
        if (child + 1 < q->n && before(q, &q->heap[child + 1], &q->heap[child])) child++;
        if (!before(q, &q->heap[child], &last)) break;
        q->heap[at] = q->heap[child];
    }
    q->heap[at] = last;
    return first;
}

/* The next meeting of a couple from `now` on, if it has one. */
static void look(struct queue *q, int32_t c, double now)
{
    const struct couple *couple = &q->couple[c];
    const struct party *a = &q->party[couple->a], *b = &q->party[couple->b];
    struct meeting meeting = {.couple = c, .version = {a->version, b->version}};
    double r[3], v[3], from = fmax(now, -fmin(a->span, b->span));
    if (a->joined >= 0 || b->joined >= 0) return;
    for (int k = 0; k < 3; k++) {
        r[k] = b->body.pos[k] - a->body.pos[k] + couple->shift[k];
        v[k] = b->body.vel[k] - a->body.vel[k];
    }
    if (collide_contact(r, v, a->body.radius + b->body.radius, from, &meeting.time)) put(q, &meeting);
}

static void list_couples(struct queue *q, int32_t n, int64_t couples)
{
    q->first = mem_array("clouds", int32_t, n + 2);
    q->list = mem_array("clouds", int32_t, 2 * couples + 1);
    for (int64_t c = 0; c < couples; c++) {
        q->first[q->couple[c].a + 2]++;
        q->first[q->couple[c].b + 2]++;
    }
    for (int32_t p = 2; p < n + 2; p++) q->first[p] += q->first[p - 1];
    for (int64_t c = 0; c < couples; c++) {
        q->list[q->first[q->couple[c].a + 1]++] = (int32_t)c;
        q->list[q->first[q->couple[c].b + 1]++] = (int32_t)c;
    }
}

int64_t meetings_run(struct party *party, int32_t n, const struct couple *couple, int64_t couples,
                     const struct meetings_rule *rule)
{
    struct queue q = {.party = party, .couple = couple};
    int64_t left = 0;
    list_couples(&q, n, couples);
    for (int64_t c = 0; c < couples; c++) look(&q, (int32_t)c, -INFINITY);
    while (q.n > 0) {
        struct meeting meeting = take(&q);
        const struct couple *two = &couple[meeting.couple];
        struct party *a = &party[two->a], *b = &party[two->b];
        if (a->joined >= 0 || b->joined >= 0 || a->version != meeting.version[0] || b->version != meeting.version[1]) continue;
        if (a->version >= MEETINGS_MOST || b->version >= MEETINGS_MOST) {
            left++;
            continue;
        }
        if (!rule->meet(rule->data, a, b, two->shift, meeting.time)) continue;
        a->version++;
        b->version++;
        for (int32_t k = q.first[two->a]; k < q.first[two->a + 1]; k++) look(&q, q.list[k], meeting.time);
        for (int32_t k = q.first[two->b]; k < q.first[two->b + 1]; k++) look(&q, q.list[k], meeting.time);
    }
    mem_free(q.heap);
    mem_free(q.first);
    mem_free(q.list);
    return left;
}
