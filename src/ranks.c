/* SPDX-License-Identifier: GPL-3.0-or-later
 * Rows on several ranks: see ranks.h. */
#include "ranks.h"
#include "comm.h"
#include "ghosts.h"
#include "log.h"
#include "mem.h"
#include "module.h"
#include <math.h>
#include <string.h>

/* What stands against spreading: a module, or what one has found. */
static const char *obstacle(const struct sim *sim)
{
    for (int u = 0; u < sim->n_use; u++)
        if (sim->use[u].module->whole) return sim->use[u].module->name;
    return sim->device ? "the device" : sim->whole;
}

bool ranks_will_spread(const struct sim *sim) { return comm_size() > 1 && !obstacle(sim); }

void ranks_spread(struct sim *sim)
{
    const int size = comm_size(), rank = comm_rank();
    for_species(sim, s) {
        const int64_t from = s->n * rank / size, to = s->n * (rank + 1) / size;
        species_spread(s, from, to - from);
    }
    sim->spread = true;
}

static void join_species(struct species *s)
{
    int64_t *bytes = mem_array("ranks", int64_t, comm_size()), *rows = mem_array("ranks", int64_t, comm_size());
    comm_gather_counts(s->n_own, rows);
    for (int c = 0; c < N_COLUMNS; c++) {
        if (!species_has(s, c)) continue;
        const size_t row = species_row_bytes(c);
        for (int r = 0; r < comm_size(); r++) bytes[r] = rows[r] * (int64_t)row;
        species_use(s, (uint64_t)1 << c, 0, s->n);
        comm_gather_all(species_column(s, c), bytes);
    }
    species_join(s);
    mem_free(bytes);
    mem_free(rows);
}

void ranks_settle(struct sim *sim)
{
    if (comm_size() == 1) return;
    const char *why = obstacle(sim);
    if (!why) {
        if (!sim->spread) ranks_spread(sim);
        double most = (double)mem_restart_peak();
        comm_max(&most, 1);
        log_line("rows are spread: each rank holds its own; until now one held up to %.1f MB", 1e-6 * most);
        return;
    }
    log_line("every rank holds all rows, because of %s: memory does not fall with the number of ranks", why);
    if (!sim->spread) return;
    sim->spread = false;
    for_species(sim, s) join_species(s);
}

void ranks_sum(const struct sim *sim, double *values, int count) { if (sim->spread) comm_sum(values, count); }
void ranks_max(const struct sim *sim, double *values, int count) { if (sim->spread) comm_max(values, count); }

void ranks_tell(struct sim *sim, const char *wrong)
{
    double root = wrong ? comm_rank() : INFINITY, length = 0;
    if (sim->spread) comm_min(&root, 1);
    if (isinf(root)) return;
    if (comm_rank() == (int)root || !sim->spread) length = (double)strlen(wrong) + 1;
    if (sim->spread) comm_max(&length, 1);
    char *text = mem_alloc("messages", (size_t)length);
    if (wrong && (comm_rank() == (int)root || !sim->spread)) strcpy(text, wrong);
    if (sim->spread) comm_broadcast(text, (size_t)length, (int)root);
    problems_add(&sim->problems, "%s", text);
    mem_free(text);
}

/* Updates due a full step, in units of the smallest that doubles can add exactly. */
static double cell_work(const struct sim *sim, const struct node *node)
{
    double work = 0;
    for (int s = 0; s < N_SPECIES; s++)
        for (int32_t i = node->first[s]; i < node->first[s] + node->count[s]; i++)
            work += ldexp(1.0, RUNG_TOP - sim->species[s].rung[i]);
    return work;
}

void ranks_divide(struct sim *sim)
{
    int size = comm_size(), rank = comm_rank();
    if (sim->spread) return;        /* the build has done it */
    for (int s = 0; s < N_SPECIES; s++) {
        sim->species[s].own = 0;
        sim->species[s].n_own = size == 1 ? sim->species[s].n : 0;
    }
    if (size == 1) return;
    int32_t *atom, n = tree_groups(&sim->tree, ALL_SPECIES, RANKS_ATOM, "ranks", &atom);
    double total = 0, before = 0;
    double *work = mem_array("ranks", double, n);
    for (int32_t a = 0; a < n; a++) total += work[a] = cell_work(sim, &sim->tree.node[atom[a]]);
    for (int32_t a = 0; a < n; before += work[a++]) {
        int owner = (int)floor((before + 0.5 * work[a]) / total * size);
        if (owner != rank) continue;
        const struct node *node = &sim->tree.node[atom[a]];
        for (int s = 0; s < N_SPECIES; s++) {
            if (sim->species[s].n_own == 0) sim->species[s].own = node->first[s];
            sim->species[s].n_own += node->count[s];
        }
    }
    mem_free(work);
    mem_free(atom);
}

/* One message: for each species the number of rows, then row numbers, then the columns in turn. */
static size_t row_bytes(const struct species *s, uint64_t columns)
{
    size_t bytes = sizeof(int32_t);
    for (int c = 0; c < N_COLUMNS; c++)
        if (columns >> c & 1 && species_has(s, c)) bytes += species_row_bytes(c);
    return bytes;
}

static char *pack(const struct sim *sim, uint64_t columns, char *to)
{
    for (int k = 0; k < N_SPECIES; k++) {
        const struct species *s = &sim->species[k];
        memcpy(to, &s->n_active, sizeof s->n_active);
        to += sizeof s->n_active;
        memcpy(to, s->active, (size_t)s->n_active * sizeof *s->active);
        to += (size_t)s->n_active * sizeof *s->active;
        for (int c = 0; c < N_COLUMNS; c++) {
            if (!(columns >> c & 1) || !species_has(s, c) || s->n_active == 0) continue;
            species_gather(species_row_bytes(c), species_column(s, c), to, s->active, s->n_active);
            to += (size_t)s->n_active * species_row_bytes(c);
        }
    }
    return to;
}

static const char *unpack(struct sim *sim, uint64_t columns, const char *from)
{
    for (int k = 0; k < N_SPECIES; k++) {
        struct species *s = &sim->species[k];
        int64_t rows;
        memcpy(&rows, from, sizeof rows);
        from += sizeof rows;
        const char *list = from;
        from += (size_t)rows * sizeof(int32_t);
        for (int c = 0; c < N_COLUMNS; c++) {
            if (!(columns >> c & 1) || !species_has(s, c) || rows == 0) continue;
            size_t bytes = species_row_bytes(c);
            char *data = species_column(s, c);
            for (int64_t r = 0; r < rows; r++, from += bytes) {
                int32_t row;
                memcpy(&row, list + (size_t)r * sizeof row, sizeof row);
                memcpy(data + (size_t)row * bytes, from, bytes);
            }
        }
    }
    return from;
}

void ranks_share(struct sim *sim, uint64_t columns)
{
    int size = comm_size();
    if (size == 1) return;
    rows_here(sim, ALL_SPECIES, columns, columns);
    if (sim->spread) {
        ghosts_share(sim, columns);
        return;
    }
    int64_t own = 0, total = 0, offset = 0, *bytes = mem_array("ranks", int64_t, size);
    for (int k = 0; k < N_SPECIES; k++)
        own += (int64_t)sizeof(int64_t) + sim->species[k].n_active * (int64_t)row_bytes(&sim->species[k], columns);
    comm_gather_counts(own, bytes);
    for (int r = 0; r < size; r++) {
        if (r < comm_rank()) offset += bytes[r];
        total += bytes[r];
    }
    char *all = mem_alloc("ranks", (size_t)total);
    pack(sim, columns, all + offset);
    comm_gather_all(all, bytes);
    const char *from = all;
    for (int r = 0; r < size; r++) from = unpack(sim, columns, from);
    mem_free(all);
    mem_free(bytes);
}

int64_t ranks_append(struct sim *sim, enum species_kind kind, int64_t rows)
{
    struct species *s = &sim->species[kind];
    check(!s->spread);
    int64_t first = s->n, before = s->ending ? s->active - s->ending : 0;
    if (first + rows > s->capacity) species_reserve(s, first + rows + first / 2);
    s->active = s->ending + before;
    for (int c = 0; c < N_COLUMNS; c++)
        if (species_has(s, c))
            memset((char *)species_column(s, c) + (size_t)first * species_row_bytes(c), 0, (size_t)rows * species_row_bytes(c));
    if (comm_rank() == comm_size() - 1) {
        if (s->n_own == 0) s->own = first;
        s->n_own += rows;
    }
    s->n = first + rows;
    sim->rebuild_next = true;
    return first;
}

void ranks_remove(struct sim *sim, enum species_kind kind, int64_t row)
{
    struct species *s = &sim->species[kind];
    check(s->shrinks && !s->spread);
    s->id[row] = UINT64_MAX;
    s->mass[row] = 0;
    for (int c = FIRST_ELEMENT; c < END_ELEMENTS; c++) {
        double *element = species_column(s, (enum column)c);
        if (element) element[row] = 0;
    }
    if (kind == GAS) sim->rebuild_next = true;  /* or it would count among neighbours */
}

void ranks_share_rows(struct sim *sim)
{
    if (comm_size() == 1 || sim->spread) return;
    uint64_t columns = sim->want_potential ? (uint64_t)1 << COLUMN_pot : 0;
    for (int c = 0; c < N_COLUMNS; c++)
        if (column_table[c].lifetime == KEEP) columns |= (uint64_t)1 << c;
    ranks_share(sim, columns);
    for_species(sim, s) comm_min_bytes(s->rung, s->n);
}

bool ranks_failed(const struct sim *sim)
{
    double failed = sim->failure.set;
    comm_max(&failed, 1);
    return failed > 0;
}

static void share_h(struct sim *sim, void *state)
{
    (void)state;
    if (sim->species[GAS].n > 0) ranks_share(sim, (uint64_t)1 << COLUMN_h);
}

static void share_density(struct sim *sim, void *state)
{
    (void)state;
    if (sim->species[GAS].n == 0) return;
    uint64_t columns = (uint64_t)1 << COLUMN_rho | (uint64_t)1 << COLUMN_balsara;
    /* With terms of grad h; and u, which may follow the density then. */
    if (species_has(&sim->species[GAS], COLUMN_omega)) columns |= (uint64_t)1 << COLUMN_omega | (uint64_t)1 << COLUMN_u;
    ranks_share(sim, columns);
}

const struct module ranks_module = {
    .name = "ranks", .doc = "what one rank computes reaches the others", .kind = MODULE_DRIVER,
    .resident = true, .hook = {[HOOK_H] = share_h, [HOOK_DENSITY] = share_density},
};
