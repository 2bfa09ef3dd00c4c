/* SPDX-License-Identifier: GPL-3.0-or-later
 * A build without CUDA: there is no device, so no engine is ever made. */
#include "cooling_engine.h"
#include "fail.h"

struct cooling_engine *cooling_engine_create(struct device *device, const struct cooling_law *law)
{
    check(!device && law);
    return 0;
}

void cooling_engine_free(struct cooling_engine *engine) { check(!engine); }

void cooling_engine_advance(struct cooling_engine *engine, const struct timeline *time, const struct species *rows,
                            double booked[N_RESERVOIRS], float *hottest)
{
    check(engine && time && rows && booked && hottest);
}
