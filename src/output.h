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
    bool wrote_snapshot;            /* at this tick */
    double logged;                  /* by the clock: the last line of the log */
};

/* An unscheduled checkpoint or a last snapshot, in the run directory. */
void output_checkpoint(struct sim *sim);
void output_snapshot(struct sim *sim);
/* After a checkpoint was written or read: what a failure of the environment shall tell. */
void output_advise(const struct sim *sim);
/* In RECORD, after the module output (the first of the list that has one): a snapshot of this tick was written. Alike on
 * all ranks. What lies beside snapshots is due then, and only then. */
bool output_wrote_snapshot(const struct sim *sim);
/* For mem_free: DIR/COMPANION_NNN.EXTENSION with that snapshot's number, for a module that names its companion. */
char *output_companion(const struct sim *sim, const char *module, const char *extension);
/* Whether the rows' energies are recorded at the present tick. */
bool output_records(const struct sim *sim);
#endif
