/* SPDX-License-Identifier: GPL-3.0-or-later
 * Cooling on a device: the curves lie there, a thread follows a row along its own (cooling_advance.h). cooling_cuda.cu is built
 * where nvcc works, cooling_none.c elsewhere. */
#ifndef TEPHRA_COOLING_ENGINE_H
#define TEPHRA_COOLING_ENGINE_H
#include "cooling_advance.h"
#include "timeline.h"

struct device;
struct cooling_engine;

/* Copies the curves. */
struct cooling_engine *cooling_engine_create(struct device *device, const struct cooling_law *law);
void cooling_engine_free(struct cooling_engine *engine);
/* Cools the active rows (rows_there) over the step that ends now; adds what is booked to `booked`, and gives the largest u that a
 * row began with. Sums are over blocks of rows, in order. Nothing is done if the device has failed. */
void cooling_engine_advance(struct cooling_engine *engine, const struct timeline *time, const struct species *rows,
                            double booked[N_RESERVOIRS], float *hottest);
#endif
