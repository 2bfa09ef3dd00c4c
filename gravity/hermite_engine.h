/* SPDX-License-Identifier: GPL-3.0-or-later
 * The sums of Hermite's schemes on a device. hermite_cuda.cu is built where nvcc works, hermite_none.c elsewhere.
 *
 * The states of all rows stay there, in double; those that have changed are sent. A sum predicts all rows to now, in
 * double, as the CPU does, turns them into floats (a coordinate into a pair of floats), sums pairs in floats and promotes
 * the sums to doubles every 128 sources. Sources are cut into chunks by their number alone and the sums of the chunks are
 * added in order: neither the shape of the launch nor the other targets change a bit. */
#ifndef TEPHRA_GRAVITY_HERMITE_ENGINE_H
#define TEPHRA_GRAVITY_HERMITE_ENGINE_H
#include <stdbool.h>
#include <stdint.h>

struct device;
struct hermite_engine;

/* What floats count in: powers of two, and the velocity from which velocities count. */
struct hermite_units { double length, velocity, bulk[3]; };

/* States of n rows: numbers c of row place[i] at state[c * n + i]. They are position, velocity and the derivatives of the
 * acceleration that a row keeps, three each, then G times its mass and half its softening squared. began: the tick of the
 * state. */
struct hermite_states { int64_t n; const int32_t *place; const double *state; const int64_t *began; };

/* p: half the order, 2 or 3. bare: softenings may be zero. threads of a block: 32, 64 or 128; 0 chooses. */
struct hermite_engine *hermite_engine_create(struct device *device, int p, bool bare, int threads);
void hermite_engine_free(struct hermite_engine *engine);
/* Numbers of a state. */
int hermite_engine_width(const struct hermite_engine *engine);
/* Room for n rows; their states are unknown then. */
void hermite_engine_rows(struct hermite_engine *engine, int64_t n, const struct hermite_units *units);
void hermite_engine_put(struct hermite_engine *engine, const struct hermite_states *states);
/* Time now; a tick lasts so long. Derivative d (of 2 to 4) of the acceleration of target i along k into sum[(i derivatives
 * + d) 3 + k]; the targets are rows. Sets nothing if the device failed (device_error). */
struct hermite_now { int64_t tick; double tick_length; };
void hermite_engine_sum(struct hermite_engine *engine, const struct hermite_now *now, int derivatives, const int32_t *target,
                        int64_t n, double *sum);
#endif
