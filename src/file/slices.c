/* SPDX-License-Identifier: GPL-3.0-or-later
 * Rows of a file in slices (slices.h). */
#include "slices.h"
#include "comm.h"
#include "h5.h"
#include "layout.h"
#include "mem.h"
#include "sim.h"
#include "sort.h"
#include <math.h>
#include <string.h>

/* Brings n rows into the order of their ids. Returns these, ascending. */
static uint64_t *sort_ids(const uint64_t *id, int64_t n, int32_t *order)
{
    uint64_t *key = mem_array("files", uint64_t, n);
    for (int64_t i = 0; i < n; i++) key[i] = id[order[i]];
    sort_keys(key, order, n);
    return key;
}

/* How many ids, ascending, are below one. */
static int64_t count_below(const uint64_t *key, int64_t n, uint64_t id)
{
    int64_t from = 0, to = n;
    while (from < to) {
        const int64_t middle = (from + to) / 2;
        if (key[middle] < id) from = middle + 1;
        else to = middle;
    }
    return from;
}

/* The id at which each rank's slice but the first begins, bit by bit: the largest below which no more ids of all ranks are
 * than there are rows in the slices before. Ids are unique, so that they are as many. */
static uint64_t *find_ends(const struct slices *s, const uint64_t *key)
{
    const int cuts = comm_size() - 1;
    uint64_t *end = mem_array("files", uint64_t, cuts);
    int64_t *below = mem_array("files", int64_t, cuts);
    double most = s->n_here > 0 ? (double)key[s->n_here - 1] : 0;
    comm_max(&most, 1);
    for (int bit = most < 1 ? 0 : most < 0x1p63 ? ilogb(most) : 63; bit >= 0; bit--) {
        for (int c = 0; c < cuts; c++) below[c] = count_below(key, s->n_here, end[c] | (uint64_t)1 << bit);
        comm_sum_int(below, cuts);
        int64_t goal = 0;
        for (int c = 0; c < cuts; c++) {
            goal += s->slice[c];
            if (below[c] <= goal) end[c] |= (uint64_t)1 << bit;
        }
    }
    mem_free(below);
    return end;
}

/* What goes where, and the order of what comes. */
static void find_routes(struct slices *s, const uint64_t *key)
{
    const int size = comm_size(), rank = comm_rank();
    const int64_t row = (int64_t)sizeof *key;
    uint64_t *end = find_ends(s, key);
    s->out = mem_array("files", int64_t, 2 * size);
    s->in = s->out + size;
    for (int64_t r = 0, from = 0; r < size; r++) {
        const int64_t to = r < size - 1 ? count_below(key, s->n_here, end[r]) : s->n_here;
        s->out[r] = to - from;
        from = to;
    }
    comm_exchange_counts(s->out, s->in, 1);
    int64_t *out_bytes = mem_array("files", int64_t, 2 * size), *in_bytes = out_bytes + size, came = 0;
    for (int r = 0; r < size; r++) {
        out_bytes[r] = s->out[r] * row;
        in_bytes[r] = s->in[r] * row;
        came += s->in[r];
    }
    check(came == s->slice[rank]);
    uint64_t *id = mem_array("files", uint64_t, came);
    s->sorted = mem_array("files", int32_t, came);
    comm_exchange(key, out_bytes, id, in_bytes);
    for (int64_t i = 0; i < came; i++) s->sorted[i] = (int32_t)i;
    mem_free(sort_ids(id, came, s->sorted));
    mem_free(id);
    mem_free(out_bytes);
    mem_free(end);
}

static struct slices first_rank_alone(int64_t rows)
{
    struct slices s = {.rows = rows, .slice = mem_array("files", int64_t, comm_size())};
    s.slice[0] = rows;
    if (comm_rank() == 0) s.n_here = rows;
    return s;
}

struct slices slices_by_id(const struct sim *sim, const struct species *table, int type)
{
    const int64_t size = comm_size(), from = sim->spread ? table->own : 0;
    const int64_t end = sim->spread ? table->own + table->n_own : comm_rank() == 0 ? table->n : 0;
    int32_t *order = mem_array("files", int32_t, end - from);
    int64_t n = 0, rows;
    for (int64_t i = from; i < end; i++)
        if (!species_gone(table, i) && layout_type_of(table, i) == type) order[n++] = (int32_t)i;
    rows = n;
    if (sim->spread) comm_sum_int(&rows, 1);
    struct slices s = first_rank_alone(rows);
    for (int64_t r = 0; sim->spread && r < size; r++) s.slice[r] = rows * (r + 1) / size - rows * r / size;
    s.n_here = n;
    s.order = order;
    uint64_t *key = sort_ids(table->id, n, order);
    if (sim->spread) find_routes(&s, key);
    mem_free(key);
    return s;
}

struct slices slices_of_rows(const struct sim *sim, const struct species *table)
{
    struct slices s = first_rank_alone(table->n);
    if (!sim->spread) return s;
    s.n_here = table->n_own;
    comm_gather_counts(s.n_here, s.slice);
    return s;
}

void slices_free(struct slices *s)
{
    mem_free(s->order);
    mem_free(s->slice);
    mem_free(s->out);
    mem_free(s->sorted);
}

static size_t kind_bytes(char kind) { return kind == 'b' ? 1 : kind == 'f' || kind == 'i' ? 4 : 8; }

void slices_write_rows(const struct slices *s, const struct slices_set *set, const void *own)
{
    const int size = comm_size(), rank = comm_rank();
    const int64_t row = (int64_t)kind_bytes(set->kind) * set->components;
    if (rank > 0) {
        if (s->slice[rank] > 0) comm_send(own, s->slice[rank] * row, 0);
        return;
    }
    int64_t most = 0;
    for (int r = 1; r < size; r++) most = s->slice[r] > most ? s->slice[r] : most;
    char *other = mem_alloc("files", (size_t)(most * row));
    h5_begin_set(set->file, set->path, set->kind, s->rows, set->components);
    h5_add_rows(set->file, s->slice[0], own);
    for (int r = 1; r < size; r++) {
        if (s->slice[r] == 0) continue;
        comm_receive(other, s->slice[r] * row, r);
        h5_add_rows(set->file, s->slice[r], other);
    }
    h5_end_set(set->file);
    mem_free(other);
}

/* From the rows that this rank brings in to those of its slice. */
static void *route(const struct slices *s, size_t row, void *values)
{
    const int size = comm_size();
    const int64_t n = s->slice[comm_rank()];
    int64_t *out_bytes = mem_array("files", int64_t, 2 * size), *in_bytes = out_bytes + size;
    for (int r = 0; r < size; r++) {
        out_bytes[r] = s->out[r] * (int64_t)row;
        in_bytes[r] = s->in[r] * (int64_t)row;
    }
    void *came = mem_alloc("files", (size_t)n * row);
    comm_exchange(values, out_bytes, came, in_bytes);
    mem_free(values);
    void *slice = mem_alloc("files", (size_t)n * row);
    species_gather(row, came, slice, s->sorted, n);
    mem_free(came);
    mem_free(out_bytes);
    return slice;
}

void slices_write_by_id(const struct slices *s, const struct slices_set *set, void *values)
{
    void *slice = s->out ? route(s, kind_bytes(set->kind) * (size_t)set->components, values) : values;
    slices_write_rows(s, set, slice);
    mem_free(slice);
}
