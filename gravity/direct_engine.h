/* SPDX-License-Identifier: GPL-3.0-or-later
 * Direct summation on a device: every target row feels every source row. direct_cuda.cu is built
 * where nvcc works, direct_none.c elsewhere.
 *
 * Positions go over as floats about the sources' centre (DIRECT_FLOAT) or as pairs of floats, which
 * keep 48 bits (DIRECT_PAIR); pairs of rows are floats; sums are promoted to double every 128
 * sources. The order of a target's sum depends on the sources alone, neither on the other targets
 * nor on the shape of the launch. */
#ifndef TEPHRA_GRAVITY_DIRECT_ENGINE_H
#define TEPHRA_GRAVITY_DIRECT_ENGINE_H
#include <stdint.h>

struct device;
struct direct_engine;

enum direct_precision { DIRECT_FLOAT, DIRECT_PAIR };

struct direct_rows {
    int64_t n;
    const double (*pos)[3];
    const double *mass;         /* sources */
    const float *soft;          /* half the softening squared, as pair.h takes it */
    const int32_t *own;         /* targets: this row's index among the sources, -1 for none; NULL = -1 */
};

/* form: enum softening_form. threads of a block: 32, 64, 128 or 256; 0 chooses. */
struct direct_engine *direct_engine_create(struct device *device, int form, enum direct_precision precision,
                                           int threads);
void direct_engine_free(struct direct_engine *engine);
/* Sends the sources; they stay until the next call. */
void direct_engine_sources(struct direct_engine *engine, const struct direct_rows *sources);
/* Acceleration and potential of the targets, without G; no row feels itself. Sets nothing if the
 * device failed (device_error). */
void direct_engine_sum(struct direct_engine *engine, const struct direct_rows *targets, double (*acc)[3], double *pot);
#endif
