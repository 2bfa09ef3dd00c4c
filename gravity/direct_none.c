/* SPDX-License-Identifier: GPL-3.0-or-later
 * A build without CUDA: there is no device, so no engine is ever made. */
#include "direct_engine.h"
#include "fail.h"

struct direct_engine *direct_engine_create(struct device *device, int form, enum direct_precision precision, int threads)
{
    (void)form, (void)precision, (void)threads;
    check(!device);
    return 0;
}

void direct_engine_free(struct direct_engine *engine) { check(!engine); }

void direct_engine_sources(struct direct_engine *engine, const struct direct_rows *sources)
{
    check(engine && sources);
}

void direct_engine_sum(struct direct_engine *engine, const struct direct_rows *targets, double (*acc)[3], double *pot)
{
    check(engine && targets && acc && pot);
}
