/* SPDX-License-Identifier: GPL-3.0-or-later
 * Rows as kernels see them: predicted to now, floats relative to a centre. The double difference is
 * taken here, once a row. */
#ifndef TEPHRA_GRAVITY_STAGE_H
#define TEPHRA_GRAVITY_STAGE_H
#include "gravity.h"

struct stage {
    const struct sim *sim;
    const struct gravity *g;
    struct gravity_frame frame;
    float half_soft2[N_SPECIES], half_soft2_hole;   /* in units of length of the frame */
    bool synchronous;               /* no row needs prediction */
};

static inline struct stage stage_at(const struct sim *sim, const struct gravity *g, const double centre[3], double unit)
{
    struct stage stage = {.sim = sim, .g = g, .frame = {{centre[0], centre[1], centre[2]}, 1 / unit, g->G},
                          .synchronous = timeline_synchronous(&sim->time)};
    for (int s = 0; s < N_SPECIES; s++) stage.half_soft2[s] = (float)(g->half_soft2[s] / (unit * unit));
    stage.half_soft2_hole = (float)(g->half_soft2_hole / (unit * unit));
    return stage;
}

/* Appends rows [from, to) of a species; there is room. The column soft may be absent. */
static inline void stage_sources(const struct stage *stage, struct gravity_sources *out, const struct species *s,
                                 int64_t from, int64_t to)
{
    enum { BLOCK = 64 };
    gravity_stage_rows *const rows = stage->g->kernels->pair->stage;
    for (int64_t i = from; out->soft && i < to; i++) out->soft[out->n + (i - from)] = stage->half_soft2[s->kind];
    const float twice = (float)(2 * stage->frame.inverse * stage->frame.inverse);
    for (int64_t i = from; out->soft && stage->g->adaptive && s->kind == GAS && i < to; i++)
        out->soft[out->n + (i - from)] = twice * s->h[i] * s->h[i];
    for (int64_t i = from; out->soft && s->hole && i < to; i++)
        if (s->hole[i]) out->soft[out->n + (i - from)] = stage->half_soft2_hole;
    if (stage->synchronous) {
        rows(out->row + out->n, &stage->frame, (const double (*)[3])s->pos + from, s->mass + from, to - from);
        out->n += (int)(to - from);
        return;
    }
    for (int64_t first = from; first < to; first += BLOCK) {
        double pos[BLOCK][3];
        int64_t end = to < first + BLOCK ? to : first + BLOCK;
        for (int64_t i = first; i < end; i++) sim_predict(&stage->sim->time, s, i, pos[i - first]);
        rows(out->row + out->n, &stage->frame, (const double (*)[3])pos, s->mass + first, end - first);
        out->n += (int)(end - first);
    }
}
#endif
