/* SPDX-License-Identifier: GPL-3.0-or-later
 * A build without CUDA: there is no device, so no engine is ever made. */
#include "tree_engine.h"
#include "fail.h"

struct tree_engine *tree_engine_create(struct device *device)
{
    check(!device);
    return NULL;
}

void tree_engine_free(struct tree_engine *engine) { check(!engine); }

bool tree_engine_rows(struct tree_engine *engine, const struct timeline *time, const struct tree_rows rows[N_SPECIES],
                      double extent[2][3])
{
    check(engine && time && rows && extent);
    return false;
}

int32_t tree_engine_build(struct tree_engine *engine, const struct tree *tree)
{
    check(engine && tree);
    return 0;
}

void tree_engine_order(struct tree_engine *engine, int species, int32_t *order) { check(engine && species >= 0 && order); }
void tree_engine_nodes(struct tree_engine *engine, struct node *node) { check(engine && node); }
