/* SPDX-License-Identifier: GPL-3.0-or-later
 * A build without CUDA: there is no device, so no engine is ever made. */
#include "walk_engine.h"
#include "fail.h"

struct walk_engine *walk_engine_create(struct device *device, int warps)
{
    (void)warps;
    check(!device);
    return 0;
}

void walk_engine_free(struct walk_engine *engine) { check(!engine); }
void walk_engine_sources(struct walk_engine *engine, const struct walk_sources *sources) { check(engine && sources); }

void walk_engine_sum(struct walk_engine *engine, const struct walk_groups *groups, float (*field)[4])
{
    check(engine && groups && field);
}

struct walk_counts walk_engine_counts(struct walk_engine *engine)
{
    check(engine);
    return (struct walk_counts){0, 0};
}
