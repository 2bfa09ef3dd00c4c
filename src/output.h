/* SPDX-License-Identifier: GPL-3.0-or-later
 * The block `output`: what a run writes into its directory, and when. */
#ifndef TEPHRA_OUTPUT_H
#define TEPHRA_OUTPUT_H
#include "draw/picture.h"
#include "energy.h"

struct output {
    double snapshot_every, energy_every, picture_every, checkpoint_every, energy_limit, mass_limit;
    int snapshot_precision;
    int64_t snapshots, pictures;    /* written so far: the next numbers */
    struct energy energy;
    struct picture picture;
    int64_t recorded;               /* tick of the last row of energies */
    bool snapshot_asked;
    double logged;                  /* by the clock: the last line of the log */
};

/* An unscheduled checkpoint or a last snapshot, in the run directory. */
void output_checkpoint(struct sim *sim);
void output_snapshot(struct sim *sim);
/* After a checkpoint was written or read: what a failure of the environment shall tell. */
void output_advise(const struct sim *sim);
/* Whether the rows' energies are recorded at the present tick. */
bool output_records(const struct sim *sim);
#endif
