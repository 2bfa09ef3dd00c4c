/* SPDX-License-Identifier: GPL-3.0-or-later
 * A build without CUDA: there is no device, so no engine is ever made. */
#include "engine.h"
#include "fail.h"

struct sph_engine *sph_engine_create(struct device *device, int warps)
{
    (void)warps;
    check(!device);
    return 0;
}

void sph_engine_free(struct sph_engine *engine) { check(!engine); }
void sph_engine_cells(struct sph_engine *engine, const struct sph_cell *cell, int32_t n) { check(engine && cell && n); }
void sph_engine_groups(struct sph_engine *engine, const struct sph_groups *groups) { check(engine && groups); }
void sph_engine_places(struct sph_engine *engine, const struct sph_rows *rows) { check(engine && rows); }
void sph_engine_lengths(struct sph_engine *engine, const struct sph_rows *rows, float *h_max) { check(engine && rows && h_max); }

void sph_engine_search(struct sph_engine *engine, const struct sph_plan *plan, const struct sph_quest *quest,
                       const struct sph_rows *rows)
{
    check(engine && plan && quest && rows);
}

void sph_engine_density(struct sph_engine *engine, const struct sph_plan *plan, const struct sph_rows *rows)
{
    check(engine && plan && rows);
}

void sph_engine_force(struct sph_engine *engine, const struct sph_plan *plan, const struct sph_rows *rows)
{
    check(engine && plan && rows);
}
