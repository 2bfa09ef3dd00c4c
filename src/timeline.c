/* SPDX-License-Identifier: GPL-3.0-or-later
 * The integer time line: see timeline.h. */
#include "timeline.h"
#include <math.h>

int timeline_rung(const struct timeline *t, double dt)
{
    const double rounding = 0x1p-23;    /* dt comes from floats: dt_max itself may have been rounded down */
    double ticks = (1 + rounding) * dt / timeline_seconds(t, 1);
    if (!(ticks >= 1)) return -1;
    int rung = ticks >= (double)((int64_t)1 << RUNG_TOP) ? RUNG_TOP : ilogb(ticks);
    while (!timeline_divides(t->tick, rung)) rung--;
    return rung;
}
