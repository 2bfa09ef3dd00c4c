/* SPDX-License-Identifier: GPL-3.0-or-later
 * A build without CUDA: there is no device, so no engine is ever made. */
#include "hermite_engine.h"
#include "fail.h"

struct hermite_engine *hermite_engine_create(struct device *device, int p, bool bare, int threads)
{
    (void)p, (void)bare, (void)threads;
    check(!device);
    return 0;
}

void hermite_engine_free(struct hermite_engine *engine) { check(!engine); }

int hermite_engine_width(const struct hermite_engine *engine)
{
    check(engine);
    return 0;
}

void hermite_engine_rows(struct hermite_engine *engine, int64_t n, const struct hermite_units *units)
{
    check(engine && n >= 0 && units);
}

void hermite_engine_put(struct hermite_engine *engine, const struct hermite_states *states) { check(engine && states); }

void hermite_engine_sum(struct hermite_engine *engine, const struct hermite_now *now, int derivatives, const int32_t *target,
                        int64_t n, double *sum)
{
    check(engine && now && derivatives && target && n >= 0 && sum);
}
