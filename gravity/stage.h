/* SPDX-License-Identifier: GPL-3.0-or-later
 * Rows into tiles: predicted to now, relative to the target group's centre, in units of its size.
 * The double difference is taken here, once a row; kernels see floats. */
#ifndef TEPHRA_GRAVITY_STAGE_H
#define TEPHRA_GRAVITY_STAGE_H
#include "gravity.h"

struct stage {
    const struct sim *sim;
    const struct gravity *g;
    double centre[3], inverse;      /* 1 / unit of length */
    float half_soft2[N_SPECIES];    /* in that unit */
    bool synchronous;               /* no row needs prediction */
};

static inline struct stage stage_at(const struct sim *sim, const struct gravity *g, const double centre[3], double unit)
{
    struct stage stage = {.sim = sim, .g = g, .centre = {centre[0], centre[1], centre[2]}, .inverse = 1 / unit,
                          .synchronous = timeline_synchronous(&sim->time)};
    for (int s = 0; s < N_SPECIES; s++) stage.half_soft2[s] = (float)(g->half_soft2[s] * stage.inverse * stage.inverse);
    return stage;
}

static inline void stage_position(const struct stage *stage, const struct species *s, int64_t i, float x[3])
{
    double pos[3] = {s->pos[i][0], s->pos[i][1], s->pos[i][2]};
    if (!stage->synchronous) sim_predict(&stage->sim->time, s, i, pos);
    for (int k = 0; k < 3; k++) x[k] = (float)((pos[k] - stage->centre[k]) * stage->inverse);
}

/* Appends rows [from, to) of a species; there is room. */
static inline void stage_sources(const struct stage *stage, struct gravity_sources *out, const struct species *s,
                                 int64_t from, int64_t to)
{
    float soft = stage->half_soft2[s->kind];
    for (int64_t i = from; i < to; i++) {
        float x[3];
        stage_position(stage, s, i, x);
        out->row[out->n] = (struct gravity_source){x[0], x[1], x[2], (float)(stage->g->G * s->mass[i])};
        out->soft[out->n++] = soft;
    }
}
#endif
