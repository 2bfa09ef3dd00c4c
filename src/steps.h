/* SPDX-License-Identifier: GPL-3.0-or-later
 * When the tree is built anew, and what the log tells of time steps. */
#ifndef TEPHRA_STEPS_H
#define TEPHRA_STEPS_H

#include <stdbool.h>

struct sim;

/* Whether the tree is built anew in this step's ARRANGE; from PREDICT on. */
bool steps_rebuild_due(const struct sim *sim);
/* Whether so much was done with the present tree that rows may be born in this step's EVENT (ranks_append), which asks for a
 * new one at the next step: at the end of a step of few rows that costs more than the step. Births that can wait should. */
bool steps_births_due(const struct sim *sim);
/* The smallest step of all rows that are active now: its criterion and its row. On every rank. */
void steps_log_smallest(struct sim *sim);
/* At the end of a run: the updates that common steps (time.steps: common, rounded as all steps are) would have taken over
 * those done; beside it the same where every row takes just the step of its own that it is allowed. On every rank. */
void steps_log_gain(const struct sim *sim);
#endif
