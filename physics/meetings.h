/* SPDX-License-Identifier: GPL-3.0-or-later
 * All meetings of clouds within a step, one after the other in the order of time (doc/manual/clouds.md, section 3). */
#ifndef TEPHRA_MEETINGS_H
#define TEPHRA_MEETINGS_H
#include "collide.h"
#include <stdint.h>

struct sim;

/* A cloud that takes part, with its state now. */
struct party {
    struct body body;
    uint64_t id;
    int32_t row;
    int version;            /* how often it has met another */
    double span;            /* length of the step that ends now; INFINITY: its step goes on */
    int32_t joined;         /* the party that took it in; -1: none */
    double rested;          /* time, relative to now, from which on it may bounce */
};

/* Two of them that may meet, a < b, and what makes b's image the nearest one. */
struct couple { int32_t a, b; double shift[3]; };

/* What a meeting does; false: nothing, since they have turned already. */
struct meetings_rule {
    bool (*meet)(void *data, struct party *a, struct party *b, const double shift[3], double time);
    void *data;
};

/* Lets the couples meet, each within the shorter of its two steps. Clouds that have met go on on their new paths and may
 * meet again. Ties of time are settled by the ids. Returns how many meetings were left to the next step, since a cloud had
 * had MEETINGS_MOST of them. */
enum { MEETINGS_MOST = 100 };
int64_t meetings_run(struct party *party, int32_t n, const struct couple *couple, int64_t couples,
                     const struct meetings_rule *rule);
#endif
