/* SPDX-License-Identifier: GPL-3.0-or-later
 * Domains: intervals of keys, one a rank. Their ends are found from the root down, all at once: each lies in a cell, whose
 * children's rows and work are summed over the ranks, and goes on into one of these until the cell is small
 * enough not to be cut. So the work of any number of rows is divided to within such a cell, by a few short sums.
 *
 * A cell of the octree that holds such an end has more rows than largest_group, and is split: the topmost cells of the
 * ranks, which lie between the ends, are cells of the one octree that the keys imply (after Warren & Salmon 1993).
 *
 * Domains stay as they are where to move rows costs more than the evener work saves. */
#include "comm.h"
#include "mem.h"
#include "ranks.h"
#include "sim.h"
#include "tree_cells.h"
#include <string.h>

/* A place in key order: the 126 bits of a key as one number, and one more for the end of all. */
__extension__ typedef unsigned __int128 place_t;
enum { PLACE_BITS = 3 * KEY_LEVELS };

static place_t place_of(struct key key) { return (place_t)key.high << 63 | key.low; }
static struct key key_of(place_t place)
{ return (struct key){(uint64_t)(place >> 63), (uint64_t)place & (((uint64_t)1 << 63) - 1)}; }

/* start: of each rank; the last is the end of all. corner, side: of the cube whose keys they are. */
struct domains { place_t *start; double corner[3], side; };

void domains_free(struct domains *domains)
{
    if (!domains) return;
    mem_free(domains->start);
    mem_free(domains);
}

/* Updates due until the next full step, of the rows before each one, in units of the shortest step or of 2^-20 of the longest:
 * whole numbers, whose sums are the same everywhere. */
static int64_t *work_before(const struct species *s)
{
    enum { MOST = 20 };
    int64_t *sum = mem_array("ranks", int64_t, s->n_own + 1);
    for (int64_t i = 0; i < s->n_own; i++) {
        const int steps = RUNG_TOP - s->rung[s->own + i];
        sum[i + 1] = sum[i] + ((int64_t)1 << (steps < MOST ? steps : MOST));
    }
    return sum;
}

/* An end that is looked for: a cell that holds it, its rows here, and the work before the cell, of all ranks. */
struct cut { place_t low; int level; int32_t from[N_SPECIES], to[N_SPECIES]; int64_t before, work, rows; };

/* Rows and work of the cell's eight children, here. */
static void weigh(const struct cells *b, const struct cut *cut, int64_t *const work[N_SPECIES], int64_t sums[16],
                  int32_t ends[8][N_SPECIES])
{
    memset(sums, 0, 16 * sizeof *sums);
    for (int s = 0; s < N_SPECIES; s++) {
        int32_t from = cut->from[s];
        const int32_t own = (int32_t)b->sim->species[s].own;
        for (int o = 0; o < 8; o++) {
            const int32_t to = from < cut->to[s] ? tree_cells_boundary(b, s, from, cut->to[s], cut->level + 1, o + 1) : from;
            ends[o][s] = to;
            sums[o] += to > from ? work[s][to - own] - work[s][from - own] : 0;
            sums[8 + o] += to - from;
            from = to;
        }
    }
}

/* Goes on into the child in which the work reaches `goal`. */
static void go_down(struct cut *cut, const int64_t sums[16], int32_t ends[8][N_SPECIES], double goal)
{
    int o = 0, last = 0;
    int64_t before = cut->before;
    for (int k = 0; k < 8; k++) last = sums[8 + k] > 0 ? k : last;
    for (; o < last && (double)(before + sums[o]) <= goal; o++) before += sums[o];
    for (int s = 0; s < N_SPECIES; s++) {
        if (o > 0) cut->from[s] = ends[o - 1][s];
        cut->to[s] = ends[o][s];
    }
    cut->before = before;
    cut->work = sums[o];
    cut->rows = sums[8 + o];
    cut->level++;
    cut->low += (place_t)o << (PLACE_BITS - 3 * cut->level);
}

/* Cells of so many rows are not cut. */
static int64_t least_cut(const struct cells *b)
{ return b->tree->largest_group > RANKS_ATOM ? b->tree->largest_group : RANKS_ATOM; }

static bool is_small(const struct cells *b, const struct cut *cut)
{
    return cut->rows <= least_cut(b) || cut->level == KEY_LEVELS;
}

/* The ends of all domains but the last: size - 1 cells of which each is to be cut off before or behind. */
static struct cut *find_cuts(const struct cells *b, int64_t *const work[N_SPECIES], int64_t *total)
{
    const int cuts = comm_size() - 1;
    struct cut *cut = mem_array("ranks", struct cut, cuts);
    int64_t *sums = mem_array("ranks", int64_t, 16 * cuts);
    int32_t (*ends)[8][N_SPECIES] = mem_alloc("ranks", (size_t)cuts * sizeof *ends);
    int64_t all[2] = {0};
    for (int s = 0; s < N_SPECIES; s++) {
        const struct species *table = &b->sim->species[s];
        all[0] += table->n_own > 0 ? work[s][table->n_own] : 0;
        all[1] += table->n_own;
    }
    comm_sum_int(all, 2);
    for (int c = 0; c < cuts; c++) {
        cut[c] = (struct cut){.work = all[0], .rows = all[1]};
        for (int s = 0; s < N_SPECIES; s++) {
            cut[c].from[s] = (int32_t)b->sim->species[s].own;
            cut[c].to[s] = cut[c].from[s] + (int32_t)b->sim->species[s].n_own;
        }
    }
    for (bool going = true; going;) {
        going = false;
        for (int c = 0; c < cuts; c++)
            if (is_small(b, &cut[c])) memset(sums + 16 * c, 0, 16 * sizeof *sums);
            else weigh(b, &cut[c], work, sums + 16 * c, ends[c]);
        comm_sum_int(sums, 16 * cuts);
        for (int c = 0; c < cuts; c++) {
            if (is_small(b, &cut[c])) continue;
            go_down(&cut[c], sums + 16 * c, ends[c], (double)all[0] * (c + 1) / (cuts + 1));
            going |= !is_small(b, &cut[c]);
        }
    }
    mem_free(sums);
    mem_free(ends);
    *total = all[0];
    return cut;
}

static struct domains *even_domains(const struct cells *b, int64_t *const work[N_SPECIES])
{
    const int size = comm_size();
    struct domains *domains = mem_alloc("ranks", sizeof *domains);
    int64_t total;
    domains->side = b->tree->side;
    memcpy(domains->corner, b->tree->corner, sizeof domains->corner);
    struct cut *cut = find_cuts(b, work, &total);
    domains->start = mem_array("ranks", place_t, size + 1);
    domains->start[size] = (place_t)1 << PLACE_BITS;
    for (int c = 0; c < size - 1; c++) {
        const bool behind = (double)total * (c + 1) / size - (double)cut[c].before >= 0.5 * (double)cut[c].work;
        domains->start[c + 1] = cut[c].low + (behind ? (place_t)1 << (PLACE_BITS - 3 * cut[c].level) : 0);
    }
    mem_free(cut);
    return domains;
}

/* First own row whose key is at or behind a place. */
static int64_t row_at(const struct cells *b, const struct species *s, place_t place)
{
    int64_t from = s->own, to = s->own + s->n_own;
    while (from < to) {
        const int64_t middle = (from + to) / 2;
        if (place_of(tree_cells_key(b, s->kind, middle)) < place) from = middle + 1;
        else to = middle;
    }
    return from;
}

/* Own rows, of all species, from one place to another. */
static int64_t rows_between(const struct cells *b, place_t from, place_t to)
{
    int64_t rows = 0;
    for_species(b->sim, s) rows += row_at(b, s, to) - row_at(b, s, from);
    return rows;
}

/* Whether the domains of the last build may stay: of the same cube, and every cell through which they are cut still has too
 * many rows for a group. */
static bool may_stay(const struct cells *b, const struct domains *old)
{
    if (!old || old->side != b->tree->side || memcmp(old->corner, b->tree->corner, sizeof old->corner) != 0) return false;
    const int cuts = comm_size() - 1;
    const place_t end = (place_t)1 << PLACE_BITS;
    int64_t *rows = mem_array("ranks", int64_t, cuts);
    bool fine = true;
    for (int c = 0; c < cuts; c++) {
        const place_t place = old->start[c + 1];
        place_t side = 8;               /* of the smallest cell within which the place lies */
        while (side < end && place % side == 0) side <<= 3;
        rows[c] = place % side == 0 ? INT32_MAX : rows_between(b, place / side * side, place / side * side + side);
    }
    comm_sum_int(rows, cuts);
    for (int c = 0; c < cuts; c++) fine = fine && rows[c] > least_cut(b);
    mem_free(rows);
    return fine;
}

/* Adds up the own rows' work by the domains that they lie in. */
static void add_work(const struct cells *b, const struct domains *domains, int64_t *const work[N_SPECIES], int64_t *sum)
{
    for_species(b->sim, s)
        for (int r = 0; r < comm_size(); r++)
            sum[r] += work[s->kind][row_at(b, s, domains->start[r + 1]) - s->own]
                    - work[s->kind][row_at(b, s, domains->start[r]) - s->own];
}

/* Whether the busiest rank saves more by the new domains than rows cost that move. */
static bool move_pays(const struct cells *b, const struct domains *old, const struct domains *new, int64_t *const work[N_SPECIES])
{
    enum { MOVES = 10 };    /* rows that move for the cost of one update: 0.3 of its 3 microseconds at least */
    const int size = comm_size();
    int64_t *sum = mem_array("ranks", int64_t, 2 * size + 1), most[2] = {0};
    add_work(b, old, work, sum);
    add_work(b, new, work, sum + size);
    for (int r = 1; r < size; r++) {
        const int64_t rows = rows_between(b, old->start[r], new->start[r]);
        sum[2 * size] += rows < 0 ? -rows : rows;
    }
    comm_sum_int(sum, 2 * size + 1);
    for (int k = 0; k < 2 * size; k++) most[k / size] = sum[k] > most[k / size] ? sum[k] : most[k / size];
    const bool pays = (most[0] - most[1]) * MOVES > sum[2 * size];
    mem_free(sum);
    return pays;
}

static void choose_domains(struct cells *b)
{
    struct domains **domains = &b->sim->domains;
    int64_t *work[N_SPECIES] = {NULL};
    for_species(b->sim, s) work[s->kind] = work_before(s);
    struct domains *new = even_domains(b, work);
    const bool stay = may_stay(b, *domains) && !move_pays(b, *domains, new, work);
    domains_free(stay ? new : *domains);
    if (!stay) *domains = new;
    b->sim->domains_kept += stay;
    b->sim->domains_moved += !stay;
    for (int s = 0; s < N_SPECIES; s++) mem_free(work[s]);
}

/* What goes to each rank, and comes from each. */
struct traffic { int64_t *out, *in, *out_bytes, *in_bytes; };

static void move_column(struct species *s, int c, const struct traffic *t, int64_t own, int64_t n_own)
{
    const size_t row = species_row_bytes(c);
    char *column = species_column(s, c);
    for (int r = 0; r < comm_size(); r++) {
        t->out_bytes[r] = t->out[r] * (int64_t)row;
        t->in_bytes[r] = t->in[r] * (int64_t)row;
    }
    char *in = mem_alloc("ranks", (size_t)n_own * row);
    comm_exchange(column + (size_t)s->own * row, t->out_bytes, in, t->in_bytes);
    mem_drop(column, 0, (size_t)own * row);
    mem_drop(column, (size_t)(own + n_own) * row, (size_t)s->n * row);
    mem_use(column, (size_t)own * row, (size_t)(own + n_own) * row);
    if (n_own > 0) memcpy(column + (size_t)own * row, in, (size_t)n_own * row);
    mem_free(in);
}

static void exchange_species(struct cells *b, struct species *s, const struct domains *domains)
{
    const int size = comm_size(), rank = comm_rank();
    int64_t *room = mem_array("ranks", int64_t, 5 * size), *all = room + 4 * size, own = 0, n_own = 0;
    const struct traffic t = {room, room + size, room + 2 * size, room + 3 * size};
    for (int r = 0; r < size; r++)
        t.out[r] = row_at(b, s, domains->start[r + 1]) - row_at(b, s, domains->start[r]);
    comm_exchange_counts(t.out, t.in, 1);
    for (int r = 0; r < size; r++) n_own += t.in[r];
    comm_gather_counts(n_own, all);
    for (int r = 0; r < rank; r++) own += all[r];
    for (int c = 0; c < N_COLUMNS; c++) {
        if (!species_has(s, c)) continue;
        if (column_table[c].lifetime == KEEP) move_column(s, c, &t, own, n_own);
        else species_use(s, (uint64_t)1 << c, own, own + n_own);
    }
    s->own = own;
    s->n_own = n_own;
    s->ending = s->active = mem_resize("columns", s->ending, (size_t)(n_own + 1) * sizeof *s->ending);
    mem_free(room);
}

void domains_exchange(struct cells *b)
{
    choose_domains(b);
    for_species(b->sim, s) exchange_species(b, s, b->sim->domains);
}

/* A topmost cell of a rank: its first and its last key, and how many rows. */
struct top { struct key first, last; int32_t count[N_SPECIES], owner; };
struct tops { struct top *top; int n, capacity; };

static struct top *add_top(struct tops *tops)
{
    if (tops->n == tops->capacity) {
        tops->capacity = 2 * tops->capacity + 64;
        tops->top = mem_resize("ranks", tops->top, (size_t)tops->capacity * sizeof *tops->top);
    }
    return &tops->top[tops->n++];
}

static struct top make_top(const struct cells *b, const int32_t from[N_SPECIES], const int32_t to[N_SPECIES])
{
    struct top top = {.first = key_of(((place_t)1 << PLACE_BITS) - 1), .owner = comm_rank()};
    for (int s = 0; s < N_SPECIES; s++) {
        top.count[s] = to[s] - from[s];
        if (to[s] == from[s]) continue;
        const struct key first = tree_cells_key(b, s, from[s]), last = tree_cells_key(b, s, to[s] - 1);
        if (place_of(first) < place_of(top.first)) top.first = first;
        if (place_of(last) > place_of(top.last)) top.last = last;
    }
    return top;
}

/* A cell and its own rows. */
struct cell { place_t low; int level; int32_t from[N_SPECIES], to[N_SPECIES]; };

/* The largest cells with own rows that lie within the domain, in key order. */
static void find_tops(const struct cells *b, const place_t domain[2], const struct cell *cell, struct tops *tops)
{
    bool empty = true;
    for (int s = 0; s < N_SPECIES; s++) empty = empty && cell->from[s] == cell->to[s];
    if (empty) return;
    if (cell->low >= domain[0] && cell->low + ((place_t)1 << (PLACE_BITS - 3 * cell->level)) <= domain[1]) {
        *add_top(tops) = make_top(b, cell->from, cell->to);
        return;
    }
    struct cell child = *cell;
    child.level++;
    for (int o = 0; o < 8; o++) {
        child.low = cell->low + ((place_t)o << (PLACE_BITS - 3 * child.level));
        for (int s = 0; s < N_SPECIES; s++)
            child.to[s] = child.from[s] < cell->to[s]
                        ? tree_cells_boundary(b, s, child.from[s], cell->to[s], child.level, o + 1) : child.from[s];
        find_tops(b, domain, &child, tops);
        memcpy(child.from, child.to, sizeof child.from);
    }
}

static struct tops gather_tops(const struct cells *b, const struct domains *domains)
{
    const int size = comm_size(), rank = comm_rank();
    struct tops own = {0}, all = {0};
    struct cell root = {0};
    for (int s = 0; s < N_SPECIES; s++) {
        root.from[s] = (int32_t)b->sim->species[s].own;
        root.to[s] = root.from[s] + (int32_t)b->sim->species[s].n_own;
    }
    find_tops(b, domains->start + rank, &root, &own);
    int64_t *bytes = mem_array("ranks", int64_t, size), before = 0, total = 0;
    comm_gather_counts(own.n * (int64_t)sizeof *own.top, bytes);
    for (int r = 0; r < size; r++) {
        before += r < rank ? bytes[r] : 0;
        total += bytes[r];
    }
    all.top = mem_alloc("ranks", (size_t)total);
    all.n = (int)(total / (int64_t)sizeof *all.top);
    if (own.n > 0) memcpy((char *)all.top + before, own.top, (size_t)own.n * sizeof *own.top);
    comm_gather_all(all.top, bytes);
    mem_free(own.top);
    mem_free(bytes);
    return all;
}

/* Node n holds the rows of tops [from, to): it is one of them, or it is split as keys want it. */
static void make_node(struct tree *tree, const struct tops *tops, int32_t n, int from, int to)
{
    if (to - from == 1) {
        tree->node[n].place = tops->top[from].owner == comm_rank() ? NODE_OWN : NODE_AWAY;
        return;
    }
    const int level = tree_cells_level(tops->top[from].first, tops->top[to - 1].last);
    int start[9], children = 0;
    for (int t = from; t < to; t++)
        if (t == from || key_octant(tops->top[t].first, level) != key_octant(tops->top[t - 1].first, level)) start[children++] = t;
    start[children] = to;
    const int32_t first = tree_cells_add(tree, children);
    tree->node[n].place = NODE_TOP;
    tree->node[n].child = first;
    tree->node[n].n_children = (int16_t)children;
    int32_t row[N_SPECIES];
    memcpy(row, tree->node[n].first, sizeof row);
    for (int k = 0; k < children; k++) {
        struct node child = {.parent = n, .child = -1};
        memcpy(child.first, row, sizeof row);
        for (int t = start[k]; t < start[k + 1]; t++)
            for (int s = 0; s < N_SPECIES; s++) child.count[s] += tops->top[t].count[s];
        for (int s = 0; s < N_SPECIES; s++) row[s] += child.count[s];
        tree->node[first + k] = child;
    }
    for (int k = 0; k < children; k++) make_node(tree, tops, first + k, start[k], start[k + 1]);
}

void domains_tops(struct cells *b)
{
    struct tree *tree = b->tree;
    struct tops tops = gather_tops(b, b->sim->domains);
    struct node root = {.parent = -1, .child = -1};
    for (int s = 0; s < N_SPECIES; s++) root.count[s] = (int32_t)b->sim->species[s].n;
    if (tops.n > 0) {
        tree_cells_add(tree, 1);
        tree->node[0] = root;
        make_node(tree, &tops, 0, 0, tops.n);
    }
    mem_free(tops.top);
}
