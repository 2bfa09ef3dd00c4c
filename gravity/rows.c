/* SPDX-License-Identifier: GPL-3.0-or-later
 * The rows of the leaves as pair kernels read them: floats about the leaf's centre in one unit, in
 * the order of the keys, 16 bytes a row. A leaf is staged when a group first needs it in a step, so
 * that a step with few active rows touches few leaves. Which thread does it changes nothing. */
#include "gravity.h"
#include "mem.h"
#include "stage.h"

enum { BUSY = -1 };

static void use_rows(struct gravity *g, int64_t first, int64_t n)
{
    mem_use(g->row, (size_t)first * sizeof *g->row, (size_t)(first + n) * sizeof *g->row);
    mem_use(g->soft, (size_t)first * sizeof *g->soft, (size_t)(first + n) * sizeof *g->soft);
}

/* Of spread rows: those of other ranks have their places among the own ones, where they are here. */
static void reserve_rows(struct gravity *g, int64_t rows)
{
    if (rows != g->rows_room || (g->pair_form != SOFT_COMMON && !g->soft)) {
        mem_free(g->row);
        mem_free(g->soft);
        g->row = mem_reserve("gravity", (size_t)rows * sizeof *g->row);
        g->soft = g->pair_form != SOFT_COMMON ? mem_reserve("gravity", (size_t)rows * sizeof *g->soft) : NULL;
        g->rows_room = rows;
    }
    mem_drop(g->row, 0, (size_t)rows * sizeof *g->row);
    mem_drop(g->soft, 0, (size_t)rows * sizeof *g->soft);
    use_rows(g, g->first_row, g->n_rows);
}

void gravity_rows_build(struct sim *sim, struct gravity *g)
{
    int64_t rows = 0;
    g->first_row = g->n_rows = 0;
    for_species(sim, s) {
        rows += s->n;
        g->first_row += species_from(s);
        g->n_rows += species_to(s) - species_from(s);
    }
    if (rows > INT32_MAX) fail(STATUS_INPUT, "gravity: %lld rows of all species: at most 2^31 - 1", (long long)rows);
    g->leaf = mem_resize("gravity", g->leaf, (size_t)g->n_cells * sizeof *g->leaf);
    g->epoch = 1;
    if (sim->spread) {
        reserve_rows(g, rows);
        return;
    }
    g->row = mem_resize("gravity", g->row, (size_t)rows * sizeof *g->row);
    if (g->pair_form != SOFT_COMMON) g->soft = mem_resize("gravity", g->soft, (size_t)rows * sizeof *g->soft);
}

void gravity_rows_use(struct gravity *g, int32_t n) { use_rows(g, g->leaf[n].first, g->leaf[n].n); }

void gravity_rows_free(struct gravity *g)
{
    mem_free(g->leaf);
    mem_free(g->row);
    mem_free(g->soft);
}

/* Rows before a cell, in the order of the keys: of each species, those before its own. */
void gravity_rows_place(struct gravity *g, int32_t n, const struct node *node)
{
    g->leaf[n] = (struct gravity_leaf){0};
    for (int k = 0; k < N_SPECIES; k++) {
        g->leaf[n].first += node->first[k];
        g->leaf[n].n += node->count[k];
    }
}

static void stage_leaf(const struct sim *sim, const struct gravity *g, int32_t n)
{
    const struct node *node = &sim->tree.node[n];
    const int32_t first = g->leaf[n].first;
    struct stage stage = stage_at(sim, g, g->cell[n].pos, g->unit);
    struct gravity_sources out = {.row = g->row + first, .soft = g->pair_form == SOFT_COMMON ? NULL : g->soft + first};
    for (int k = 0; k < N_SPECIES; k++)
        stage_sources(&stage, &out, &sim->species[k], node->first[k], node->first[k] + node->count[k]);
}

const struct gravity_leaf *gravity_rows_leaf(const struct sim *sim, const struct gravity *g, int32_t n)
{
    struct gravity_leaf *leaf = &g->leaf[n];
    int32_t seen = __atomic_load_n(&leaf->staged, __ATOMIC_ACQUIRE);
    if (seen == g->epoch) return leaf;
    if (seen != BUSY && __atomic_compare_exchange_n(&leaf->staged, &seen, BUSY, false, __ATOMIC_ACQUIRE, __ATOMIC_ACQUIRE)) {
        stage_leaf(sim, g, n);
        __atomic_store_n(&leaf->staged, g->epoch, __ATOMIC_RELEASE);
    } else {
        while (__atomic_load_n(&leaf->staged, __ATOMIC_ACQUIRE) != g->epoch) {}
    }
    return leaf;
}
