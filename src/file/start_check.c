/* SPDX-License-Identifier: GPL-3.0-or-later
 * Looks at the rows that a file gave (start_check.h). */
#include "start_check.h"
#include "comm.h"
#include "mem.h"
#include "ranks.h"
#include "sort.h"
#include <float.h>
#include <inttypes.h>
#include <math.h>

static double component(const struct species *table, enum column column, int64_t index)
{
    const void *values = species_column(table, column);
    return column_table[column].kind == 'd' ? ((const double *)values)[index] : (double)((const float *)values)[index];
}

/* Beyond this the square of a position or a velocity leaves single precision. */
static const double largest = 1e18;

/* Names the first row whose number is not finite or outside [least, most]. */
static void check_column(const struct start_rows *r, const struct species *table, enum column column, double least, double most)
{
    if (!species_column(table, column)) return;
    const struct column_info *info = &column_table[column];
    int64_t wrong = 0, first = -1;
    for (int64_t i = species_from(table) * info->components; i < species_to(table) * info->components; i++) {
        double value = component(table, column, i);
        if (isfinite(value) && value >= least && value <= most) continue;
        if (wrong++ == 0) first = i;
    }
    int64_t all = wrong;
    if (r->sim->spread) comm_sum_int(&all, 1);
    if (all == 0) return;
    char more[40] = "", *text = NULL;
    if (all > 1) snprintf(more, sizeof more, " (and %" PRId64 " more)", all - 1);
    if (wrong > 0) {
        const double value = component(table, column, first);
        const bool large = isfinite(value) && fabs(value) > most;
        text = mem_format("messages", "%s: %s particle %" PRIu64 " has %s = %g%s: %s", r->path, species_names[table->kind],
                          table->id[first / info->components], info->file_name, value, more,
                          large ? "too much for the scene's units: choose larger ones"
                                : "correct it in the file, or leave the row out");
    }
    ranks_tell(r->sim, text);
    mem_free(text);
}

struct ids { uint64_t *key; int32_t *kind; int64_t n; };

/* Each to the rank that its number says, so that equal ones meet. */
static void bring_together(struct ids *ids)
{
    const int size = comm_size();
    int64_t *count = mem_array("files", int64_t, 4 * size), *came = count + size, *bytes = came + size, *in_bytes = bytes + size;
    int64_t *at = mem_array("files", int64_t, size + 1), n = 0;
    for (int64_t i = 0; i < ids->n; i++) at[ids->key[i] % (uint64_t)size + 1]++;
    for (int r = 0; r < size; r++) {
        count[r] = at[r + 1];
        at[r + 1] += at[r];
    }
    comm_exchange_counts(count, came, 1);
    for (int r = 0; r < size; r++) n += came[r];
    struct ids out = {mem_array("files", uint64_t, ids->n), mem_array("files", int32_t, ids->n), ids->n};
    struct ids in = {mem_array("files", uint64_t, n), mem_array("files", int32_t, n), n};
    for (int64_t i = 0; i < ids->n; i++) {
        const int64_t to = at[ids->key[i] % (uint64_t)size]++;
        out.key[to] = ids->key[i];
        out.kind[to] = ids->kind[i];
    }
    for (int wide = 0; wide < 2; wide++) {
        const int64_t width = (int64_t)(wide ? sizeof *in.key : sizeof *in.kind);
        for (int r = 0; r < size; r++) {
            bytes[r] = count[r] * width;
            in_bytes[r] = came[r] * width;
        }
        if (wide) comm_exchange(out.key, bytes, in.key, in_bytes);
        else comm_exchange(out.kind, bytes, in.kind, in_bytes);
    }
    mem_free(out.key);
    mem_free(out.kind);
    mem_free(ids->key);
    mem_free(ids->kind);
    mem_free(count);
    mem_free(at);
    *ids = in;
}

static void check_ids(const struct start_rows *r)
{
    struct ids ids = {0};
    int64_t at = 0;
    for_species(r->sim, table) ids.n += species_to(table) - species_from(table);
    ids.key = mem_array("files", uint64_t, ids.n);
    ids.kind = mem_array("files", int32_t, ids.n);
    for_species(r->sim, table)
        for (int64_t i = species_from(table); i < species_to(table); i++, at++) {
            ids.key[at] = table->id[i];
            ids.kind[at] = (int32_t)table->kind;
        }
    if (r->sim->spread) bring_together(&ids);
    sort_keys(ids.key, ids.kind, ids.n);
    int64_t wrong = 0, first = 0;
    for (int64_t i = 1; i < ids.n; i++)
        if (ids.key[i] == ids.key[i - 1] && wrong++ == 0) first = i;
    int64_t all = wrong;
    if (r->sim->spread) comm_sum_int(&all, 1);
    char *text = NULL;
    if (wrong > 0)
        text = mem_format("messages", "%s: the id %" PRIu64 " is used twice (%s and %s), as are %" PRId64
                          " more: ids must be unique over all species", r->path, ids.key[first],
                          species_names[ids.kind[first - 1]], species_names[ids.kind[first]], all - 1);
    ranks_tell(r->sim, text);
    mem_free(text);
    mem_free(ids.key);
    mem_free(ids.kind);
}

void start_check_rows(const struct start_rows *r)
{
    double mass = 0;
    for_species(r->sim, table) {
        check_column(r, table, COLUMN_pos, -largest, largest);
        check_column(r, table, COLUMN_vel, -largest, largest);
        check_column(r, table, COLUMN_mass, table->kind == GAS ? DBL_MIN : 0, INFINITY);
        check_column(r, table, COLUMN_u, 0, INFINITY);
        check_column(r, table, COLUMN_h, 0, largest);
        if (table->kind == GAS && r->with_kelvin > 0 && r->with_kelvin < table->n)
            problems_add(&r->sim->problems, "%s: some gas has InternalEnergy, some only Temperature: give all the same",
                         r->path);
        for (int c = FIRST_ELEMENT; c < END_ELEMENTS; c++) check_column(r, table, c, 0, INFINITY);
        for (int64_t i = species_from(table); i < species_to(table); i++) mass += table->mass[i];
    }
    ranks_sum(r->sim, &mass, 1);
    if (mass == 0)
        problems_add(&r->sim->problems, "%s: all masses are 0: give the rows Masses, or the Header a MassTable", r->path);
    check_ids(r);
}
