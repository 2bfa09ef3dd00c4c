/* SPDX-License-Identifier: GPL-3.0-or-later
 * The life of a run: steps until the end, a request to stop, or numbers that fail. */
#ifndef TEPHRA_RUN_H
#define TEPHRA_RUN_H
#include "sim.h"

/* The tick, the active rows and every hook up to `last`; the first step of a run only finds the
 * forces at the start. False if a number failed on any rank. */
bool run_step(struct sim *sim, int last);
/* Steps to time.end. max_wall: seconds of the clock after which the run stops with a checkpoint,
 * INFINITY for never. Returns the exit status. */
int run_to_end(struct sim *sim, double max_wall);
#endif
