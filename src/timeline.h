/* SPDX-License-Identifier: GPL-3.0-or-later
 * Integer time. The longest step is dt_max, 2^RUNG_TOP ticks; a row on rung r takes steps of 2^r
 * ticks and is active whenever 2^r divides the tick. Ticks count from the start of the run.
 *
 * A row holds its state (pos, vel, u, acc, du) at its own time, the tick at which its step began;
 * nothing is stored half way. Two bytes a row suffice for that: the step began at the last multiple
 * of 2^rung0, and it ends at the next multiple of 2^rung. rung < rung0 is a row that was woken
 * within its step. At tick_end every row is active, whatever its rung. */
#ifndef TEPHRA_TIMELINE_H
#define TEPHRA_TIMELINE_H
#include "hd.h"
#include <stdbool.h>
#include <stdint.h>

enum { RUNG_TOP = 40 };

struct timeline {
    double start;           /* time at tick 0 */
    double dt_max;          /* 2^RUNG_TOP ticks */
    int64_t tick;           /* now: the state that this step makes */
    int64_t tick_end;       /* the run ends here */
    int64_t snapshot, energy, checkpoint, picture; /* cadences in ticks; 0 = none */
    int evaluations;        /* forces a step: 1, or 2 to know them at the corrected state */
    bool common;            /* one step for all rows */
    bool classic;           /* time.criterion: classic */
};

HD double timeline_seconds(const struct timeline *t, int64_t ticks)
{ return (double)ticks * (t->dt_max / (double)((int64_t)1 << RUNG_TOP)); }
HD double timeline_now(const struct timeline *t)
{ return t->start + timeline_seconds(t, t->tick); }
HD bool timeline_divides(int64_t tick, int rung)
{ return (tick & (((int64_t)1 << rung) - 1)) == 0; }
HD bool timeline_active(const struct timeline *t, int rung)
{ return timeline_divides(t->tick, rung) || t->tick == t->tick_end; }
/* Tick at which the step of a row that is not active now, or is about to be predicted, began. */
HD int64_t timeline_began(const struct timeline *t, int rung0)
{ return (t->tick - 1) & ~(((int64_t)1 << rung0) - 1); }
/* Time from the row's state to now: 0 for active rows, which PREDICT has brought to now. */
HD double timeline_lag(const struct timeline *t, int rung, int rung0)
{ return timeline_active(t, rung) ? 0.0 : timeline_seconds(t, t->tick - timeline_began(t, rung0)); }
/* Length of the step that ends now for an active row; 0 at the very start. */
HD double timeline_step(const struct timeline *t, int rung0)
{ return t->tick == 0 ? 0.0 : timeline_seconds(t, t->tick - timeline_began(t, rung0)); }
/* A row whose rung falls by more levels than this within its step was woken because a neighbour changed at once, by a supernova,
 * say; measured in doc/manual/integrators.md. */
enum { RUNG_SUDDEN = 4 };
HD bool timeline_sudden(int rung, int rung0) { return rung0 - rung > RUNG_SUDDEN; }
/* Part of the step that ends now to which the rates at its end belong: all of it, but of a row that was woken suddenly only what
 * is left since then. Its rung divided the tick at which that was. */
HD double timeline_felt(const struct timeline *t, int rung, int rung0)
{
    const double step = timeline_step(t, rung0), since = timeline_seconds(t, (int64_t)1 << rung);
    return timeline_sudden(rung, rung0) && since < step ? since : step;
}
/* The highest rung not above RUNG_TOP whose step divides the tick and lasts at most dt, to the rounding of a float; -1
 * if even one tick is longer than dt. */
int timeline_rung(const struct timeline *t, double dt);
/* All rows are synchronous now. */
HD bool timeline_synchronous(const struct timeline *t)
{ return timeline_active(t, RUNG_TOP); }
#endif
