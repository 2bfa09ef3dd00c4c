/* SPDX-License-Identifier: GPL-3.0-or-later
 * What the integrators do to a row, on the CPU and on a device; and the launch of it there. integrate_cuda.cu is built where
 * nvcc works, device_none.c elsewhere. */
#ifndef TEPHRA_INTEGRATE_ROWS_H
#define TEPHRA_INTEGRATE_ROWS_H
#include "integrate.h"
#include "species.h"
#include "timeline.h"

struct device;

/* Of the rows that end their step: predict. Of the own ones among these, begin: room for new accelerations; correct; and
 * correct_shift: positions too. */
enum integrate_part { INTEGRATE_PREDICT, INTEGRATE_BEGIN, INTEGRATE_CORRECT, INTEGRATE_CORRECT_SHIFT, INTEGRATE_PARTS };

HD void integrate_predict_row(const struct timeline *time, const struct species *s, int64_t i)
{
    const double t = timeline_step(time, s->rung0[i]);
    for (int k = 0; k < 3; k++) {
        const double a = (double)s->acc[i][k];
        s->pos[i][k] = integrate_position(s->pos[i][k], s->vel[i][k], a, t);
        s->vel[i][k] = integrate_velocity(s->vel[i][k], a, t);
    }
    if (s->u && s->du) s->u[i] = integrate_energy(s->u[i], s->du[i], (float)t);
}

HD void integrate_begin_row(const struct species *s, int64_t i)
{
    for (int k = 0; k < 3; k++) {
        s->acc_old[i][k] = s->acc[i][k];
        s->acc[i][k] = 0;
    }
    if (s->du) {
        s->du_old[i] = s->du[i];
        s->du[i] = 0;
    }
}

HD void integrate_correct_row(const struct timeline *time, const struct species *s, int64_t i, bool shift)
{
    const double t = timeline_felt(time, s->rung[i], s->rung0[i]);
    for (int k = 0; k < 3; k++) {
        const double change = integrate_correction((double)s->acc_old[i][k], (double)s->acc[i][k], t);
        s->vel[i][k] += change;
        if (shift) s->pos[i][k] += integrate_shift(change, t);
    }
    if (s->u && s->du) s->u[i] = integrate_energy(s->u[i], s->du[i] - s->du_old[i], 0.5f * (float)t);
}

/* part is a literal at each call. */
HD void integrate_row(enum integrate_part part, const struct timeline *time, const struct species *s, int64_t i)
{
    if (part == INTEGRATE_PREDICT) integrate_predict_row(time, s, i);
    else if (part == INTEGRATE_BEGIN) integrate_begin_row(s, i);
    else integrate_correct_row(time, s, i, part == INTEGRATE_CORRECT_SHIFT);
}

/* rows: as rows_there tells. Nothing is done if the device has failed. */
void integrate_launch(struct device *device, enum integrate_part part, const struct timeline *time, const struct species *rows);
#endif
