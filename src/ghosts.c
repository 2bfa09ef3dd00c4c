/* SPDX-License-Identifier: GPL-3.0-or-later
 * Copies of other ranks' cells and rows: see ghosts.h.
 *
 * A reply is, for each wanted cell in turn, a byte that says what follows: the records of its children, then the same for
 * each of them; and its rows, column by column. Both sides note what was sent in the order in which it was, so that what
 * has changed can be sent again without saying which cells and rows it is of. */
#include "ghosts_private.h"
#include "comm.h"
#include "mem.h"
#include "sim.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { CHILDREN_FOLLOW = 1, ROWS_FOLLOW = 2 };

#define BIT(name) ((uint64_t)1 << COLUMN_##name)
#define PLACE (BIT(pos) | BIT(mass) | BIT(rung) | BIT(rung0) | BIT(hole))
#define MOTION (PLACE | BIT(vel) | BIT(acc))
static const uint64_t shared = MOTION | BIT(u) | BIT(du) | BIT(h) | BIT(rho) | BIT(balsara) | BIT(omega) | BIT(div_v)
                             | BIT(next_rung);

void ghosts_put(struct buffer *b, const void *from, size_t bytes)
{
    if (bytes == 0) return;
    if (b->n + bytes > b->capacity) {
        b->capacity = b->n + bytes + b->capacity / 2 + 4096;
        b->data = mem_resize("ranks", b->data, b->capacity);
    }
    memcpy(b->data + b->n, from, bytes);
    b->n += bytes;
}

void ghosts_take(const char **from, void *to, size_t bytes)
{
    if (bytes > 0) memcpy(to, *from, bytes);
    *from += bytes;
}

static void note(struct spans *list, struct span span)
{
    if (list->n == list->capacity) {
        list->capacity = 2 * list->capacity + 64;
        list->span = mem_resize("ranks", list->span, (size_t)list->capacity * sizeof *list->span);
    }
    list->span[list->n++] = span;
}

struct ghosts *ghosts_of(struct sim *sim)
{
    if (!sim->ghosts) {
        sim->ghosts = mem_alloc("ranks", sizeof *sim->ghosts);
        sim->ghosts->peer = mem_array("ranks", struct peer, comm_size());
    }
    return sim->ghosts;
}

void ghosts_reserve_away(struct ghosts *g, const struct tree *tree)
{
    if (tree->capacity <= g->away_room) return;
    g->away_room = tree->capacity;
    g->away = mem_resize("ranks", g->away, (size_t)g->away_room * sizeof *g->away);
}

struct ghost_counts ghosts_counts(const struct sim *sim)
{ return sim->ghosts ? sim->ghosts->counts : (struct ghost_counts){0}; }

static void forget_wishes(struct ghosts *g)
{
    mem_free(g->wish);
    g->wish = NULL;
    g->n_wishes = g->wishes_room = 0;
}

void ghosts_free(struct ghosts *g)
{
    if (!g) return;
    for (int r = 0; r < comm_size(); r++) {
        struct spans *const lists[] = {&g->peer[r].rows_out, &g->peer[r].rows_in, &g->peer[r].cells_out, &g->peer[r].cells_in};
        for (size_t k = 0; k < sizeof lists / sizeof *lists; k++) mem_free(lists[k]->span);
    }
    forget_wishes(g);
    mem_free(g->peer);
    mem_free(g->away);
    mem_free(g->top);
    mem_free(g->top_from);
    mem_free(g);
}

/* --- asking --- */

void ghosts_want(const struct sim *sim, int32_t node, bool rows, const struct ghost_want *want)
{
    struct ghosts *g = sim->ghosts;
#pragma omp critical(ghosts)
    {
        if (g->n_wishes == g->wishes_room) {
            g->wishes_room = 2 * g->wishes_room + 256;
            g->wish = mem_resize("ranks", g->wish, (size_t)g->wishes_room * sizeof *g->wish);
        }
        g->wish[g->n_wishes++] = (struct wish){node, rows, *want};
    }
}

bool ghosts_have_rows(const struct sim *sim, int32_t node, enum ghost_rows rows)
{
    return sim->tree.node[node].place == NODE_OWN || sim->ghosts->away[node].rows >= (int8_t)rows;
}

static int by_node(const void *a, const void *b)
{
    const struct wish *x = a, *y = b;
    if (x->node != y->node) return x->node < y->node ? -1 : 1;
    return (int)y->rows - (int)x->rows;
}

/* Wishes for one cell become one, whose box holds their boxes. Order does not matter: extremes. */
static void merge_wishes(struct ghosts *g)
{
    int64_t n = 0;
    if (g->n_wishes > 1) qsort(g->wish, (size_t)g->n_wishes, sizeof *g->wish, by_node);
    for (int64_t w = 0; w < g->n_wishes; w++) {
        const struct wish *wish = &g->wish[w];
        struct wish *last = n > 0 ? &g->wish[n - 1] : NULL;
        if (!last || last->node != wish->node || last->rows != wish->rows) {
            g->wish[n++] = *wish;
            continue;
        }
        for (int k = 0; k < 3; k++) {
            last->want.low[k] = fmin(last->want.low[k], wish->want.low[k]);
            last->want.high[k] = fmax(last->want.high[k], wish->want.high[k]);
        }
        last->want.domain |= wish->want.domain;
        last->want.rows = last->want.rows > wish->want.rows ? last->want.rows : wish->want.rows;
        last->want.angle = fminf(last->want.angle, wish->want.angle);
    }
    g->n_wishes = n;
}

/* --- what a rank sends --- */

/* Squared distance of a cell's box from another box. */
static double gap2(const struct node *node, const double low[3], const double high[3])
{
    double sum = 0;
    for (int k = 0; k < 3; k++) {
        const double below = low[k] - (node->pos[k] + (double)node->high[k]), above = node->pos[k] + (double)node->low[k] - high[k];
        const double gap = below > 0 ? below : above > 0 ? above : 0;
        sum += gap * gap;
    }
    return sum;
}

/* From the nearest of a rank's topmost cells, as far as it matters: below `enough` no nearer one is looked for. */
static double domain_gap2(const struct sim *sim, const struct node *node, int owner, double enough)
{
    double least = INFINITY;
    const struct ghosts *g = sim->ghosts;
    for (int32_t t = g->top_from[owner]; t < g->top_from[owner + 1] && least > enough; t++) {
        const struct node *top = &sim->tree.node[g->top[t]];
        double low[3], high[3];
        for (int k = 0; k < 3; k++) {
            low[k] = top->pos[k] + (double)top->low[k];
            high[k] = top->pos[k] + (double)top->high[k];
        }
        least = fmin(least, gap2(node, low, high));
    }
    return least;
}

static bool is_likely(const struct sim *sim, const struct node *node, int to, const struct ghost_want *want)
{
    double side = 0;
    for (int k = 0; k < 3; k++) side = fmax(side, (double)node->high[k] - (double)node->low[k]);
    const double reach = isinf(want->angle) ? 0 : side / (double)want->angle, reach2 = reach * reach;
    return (want->domain ? domain_gap2(sim, node, to, reach2) : gap2(node, want->low, want->high)) <= reach2;
}

static void put_node(const struct tree *tree, int32_t n, struct buffer *out)
{
    ghosts_put(out, &tree->node[n], sizeof tree->node[n]);
    for (int c = 0; c < N_NODE_COLUMNS; c++) {
        const size_t bytes = tree_node_bytes(tree, c);
        if (bytes > 0) ghosts_put(out, (const char *)tree_column(tree, c) + (size_t)n * bytes, bytes);
    }
}

static void put_rows(const struct species *s, uint64_t columns, int32_t first, int32_t n, struct buffer *out)
{
    for (int c = 0; c < N_COLUMNS; c++) {
        const size_t row = species_row_bytes(c);
        if (columns >> c & 1 && species_has(s, c))
            ghosts_put(out, (const char *)species_column(s, c) + (size_t)first * row, (size_t)n * row);
    }
}

/* Where the steps of all rows end now, none of them has to be predicted. */
static uint64_t columns_of(const struct sim *sim, enum ghost_rows rows)
{ return rows == GHOST_ALL ? shared : timeline_synchronous(&sim->time) ? PLACE : MOTION; }

static void send_rows(struct sim *sim, int32_t n, int to, enum ghost_rows rows, struct buffer *out)
{
    const struct node *node = &sim->tree.node[n];
    for (int s = 0; s < N_SPECIES; s++) {
        if (node->count[s] == 0) continue;
        put_rows(&sim->species[s], columns_of(sim, rows), node->first[s], node->count[s], out);
        if (rows == GHOST_ALL) note(&sim->ghosts->peer[to].rows_out, (struct span){s, node->first[s], node->count[s]});
    }
}

/* A cell that the other rank knows: its children or its rows, if they are asked for or likely to be. */
static void send_cell(struct sim *sim, int32_t n, int to, const struct asked *asked, bool surely, struct buffer *out)
{
    const struct tree *tree = &sim->tree;
    const struct node *node = &tree->node[n];
    const bool ends = node->n_children == 0 || node_rows(node, ALL_SPECIES) <= asked->want.leaf;
    unsigned char follows = 0;
    if (surely) follows = asked->rows ? ROWS_FOLLOW : CHILDREN_FOLLOW;
    else if (is_likely(sim, node, to, &asked->want))
        follows = !ends ? CHILDREN_FOLLOW : asked->want.rows > GHOST_NONE ? ROWS_FOLLOW : 0;
    ghosts_put(out, &follows, 1);
    if (follows & CHILDREN_FOLLOW) {
        const int32_t first = node->child, children = node->n_children;
        for (int32_t k = 0; k < children; k++) put_node(tree, first + k, out);
        for (int32_t k = first; k < first + children; k++) ghosts_put(out, &k, sizeof k);
        note(&sim->ghosts->peer[to].cells_out, (struct span){0, first, children});
        for (int32_t k = 0; k < children; k++) send_cell(sim, first + k, to, asked, false, out);
    }
    if (follows & ROWS_FOLLOW) send_rows(sim, n, to, asked->want.rows, out);
}

/* --- what a rank receives --- */

static void take_node(struct tree *tree, int32_t n, const char **from)
{
    ghosts_take(from, &tree->node[n], sizeof tree->node[n]);
    for (int c = 0; c < N_NODE_COLUMNS; c++) {
        const size_t bytes = tree_node_bytes(tree, c);
        if (bytes > 0) ghosts_take(from, (char *)tree_column(tree, c) + (size_t)n * bytes, bytes);
    }
}

static void take_rows(struct species *s, uint64_t columns, int32_t first, int32_t n, const char **from)
{
    species_use(s, columns, first, (int64_t)first + n);
    for (int c = 0; c < N_COLUMNS; c++) {
        const size_t row = species_row_bytes(c);
        if (columns >> c & 1 && species_has(s, c))
            ghosts_take(from, (char *)species_column(s, c) + (size_t)first * row, (size_t)n * row);
    }
}

static void receive_rows(struct sim *sim, int32_t n, int owner, enum ghost_rows rows, const char **from)
{
    struct ghosts *g = sim->ghosts;
    const struct node node = sim->tree.node[n];
    for (int s = 0; s < N_SPECIES; s++) {
        if (node.count[s] == 0) continue;
        take_rows(&sim->species[s], columns_of(sim, rows), node.first[s], node.count[s], from);
        g->counts.rows += node.count[s];
        if (rows == GHOST_ALL) note(&g->peer[owner].rows_in, (struct span){s, node.first[s], node.count[s]});
    }
    if (g->away[n].rows < (int8_t)rows) g->away[n].rows = (int8_t)rows;
}

static void receive_children(struct sim *sim, int32_t n, int owner, const char **from)
{
    struct tree *tree = &sim->tree;
    struct ghosts *g = sim->ghosts;
    const int32_t first = tree->n_nodes, children = tree->node[n].n_children;
    tree_reserve(tree, first + children);
    ghosts_reserve_away(g, tree);
    tree->n_nodes += children;
    for (int32_t k = 0; k < children; k++) {
        struct node *node = &tree->node[first + k];
        take_node(tree, first + k, from);
        g->away[first + k] = (struct away){owner, 0, GHOST_NONE};
        node->parent = n;
        node->place = NODE_AWAY;
        node->child = -1;
    }
    for (int32_t k = 0; k < children; k++) ghosts_take(from, &g->away[first + k].there, sizeof g->away[0].there);
    tree->node[n].child = first;
    g->counts.cells += children;
    note(&g->peer[owner].cells_in, (struct span){0, first, children});
}

static void receive_cell(struct sim *sim, int32_t n, int owner, enum ghost_rows rows, const char **from)
{
    unsigned char follows;
    ghosts_take(from, &follows, 1);
    if (follows & CHILDREN_FOLLOW) {
        receive_children(sim, n, owner, from);
        const int32_t first = sim->tree.node[n].child, children = sim->tree.node[n].n_children;
        for (int32_t k = 0; k < children; k++) receive_cell(sim, first + k, owner, rows, from);
    }
    if (follows & ROWS_FOLLOW) receive_rows(sim, n, owner, rows, from);
}

/* --- rounds --- */

/* Bytes to and from each rank, and the message that came. */
static char *exchange(struct ghosts *g, const struct buffer *out, const int64_t *out_bytes, int64_t *in_bytes)
{
    int64_t total = 0;
    g->counts.bytes += (int64_t)out->n;
    comm_exchange_counts(out_bytes, in_bytes, 1);
    for (int r = 0; r < comm_size(); r++) total += in_bytes[r];
    char *in = mem_alloc("ranks", (size_t)total);
    comm_exchange(out->data, out_bytes, in, in_bytes);
    return in;
}

/* Wishes by the rank that they go to; order[k] is the k-th of them. */
static int64_t *order_wishes(const struct ghosts *g, int64_t *count)
{
    int64_t *order = mem_array("ranks", int64_t, g->n_wishes), n = 0;
    for (int r = 0; r < comm_size(); r++) {
        const int64_t before = n;
        for (int64_t w = 0; w < g->n_wishes; w++)
            if (g->away[g->wish[w].node].owner == r) order[n++] = w;
        count[r] = n - before;
    }
    return order;
}

static char *ask(struct ghosts *g, const int64_t *order, const int64_t *count, int64_t *in_bytes)
{
    struct buffer out = {0};
    int64_t *bytes = mem_array("ranks", int64_t, comm_size());
    for (int64_t k = 0; k < g->n_wishes; k++) {
        const struct wish *wish = &g->wish[order[k]];
        const struct asked asked = {g->away[wish->node].there, wish->rows, wish->want};
        ghosts_put(&out, &asked, sizeof asked);
    }
    for (int r = 0; r < comm_size(); r++) bytes[r] = count[r] * (int64_t)sizeof(struct asked);
    char *in = exchange(g, &out, bytes, in_bytes);
    mem_free(out.data);
    mem_free(bytes);
    return in;
}

static char *answer(struct sim *sim, const char *asked, const int64_t *asked_bytes, int64_t *in_bytes)
{
    struct buffer out = {0};
    int64_t *bytes = mem_array("ranks", int64_t, comm_size());
    for (int r = 0; r < comm_size(); r++) {
        const size_t before = out.n;
        for (int64_t at = 0; at < asked_bytes[r]; at += (int64_t)sizeof(struct asked)) {
            struct asked one;
            ghosts_take(&asked, &one, sizeof one);
            send_cell(sim, one.there, r, &one, true, &out);
        }
        bytes[r] = (int64_t)(out.n - before);
    }
    char *in = exchange(sim->ghosts, &out, bytes, in_bytes);
    mem_free(out.data);
    mem_free(bytes);
    return in;
}

bool ghosts_open(struct sim *sim)
{
    if (!sim->spread) return false;
    const int size = comm_size();
    struct ghosts *g = ghosts_of(sim);
    merge_wishes(g);
    int64_t wanted = g->n_wishes, *room = mem_array("ranks", int64_t, 3 * size), *count = room, *asked_bytes = room + size,
            *in_bytes = room + 2 * size;
    comm_sum_int(&wanted, 1);
    if (wanted > 0) {
        int64_t *order = order_wishes(g, count), k = 0;
        char *asked = ask(g, order, count, asked_bytes), *in = answer(sim, asked, asked_bytes, in_bytes);
        const char *from = in;
        for (int r = 0; r < size; r++)
            for (int64_t end = k + count[r]; k < end; k++)
                receive_cell(sim, g->wish[order[k]].node, r, g->wish[order[k]].want.rows, &from);
        mem_free(order);
        mem_free(asked);
        mem_free(in);
        g->used = true;
        g->counts.rounds++;
    }
    forget_wishes(g);
    mem_free(room);
    return wanted > 0;
}

/* --- keeping copies fresh --- */

static void share(struct sim *sim, uint64_t columns, int column)
{
    const int size = comm_size();
    struct ghosts *g = ghosts_of(sim);
    struct buffer out = {0};
    int64_t *bytes = mem_array("ranks", int64_t, 2 * size), *in_bytes = bytes + size;
    const size_t node_bytes = column < 0 ? 0 : tree_node_bytes(&sim->tree, column);
    for (int r = 0; r < size; r++) {
        const size_t before = out.n;
        const struct spans *rows = &g->peer[r].rows_out, *cells = &g->peer[r].cells_out;
        for (int64_t k = 0; columns && k < rows->n; k++)
            put_rows(&sim->species[rows->span[k].kind], columns, rows->span[k].first, rows->span[k].n, &out);
        for (int64_t k = 0; column >= 0 && k < cells->n; k++)
            ghosts_put(&out, (const char *)tree_column(&sim->tree, column) + (size_t)cells->span[k].first * node_bytes,
                     (size_t)cells->span[k].n * node_bytes);
        bytes[r] = (int64_t)(out.n - before);
    }
    char *in = exchange(sim->ghosts, &out, bytes, in_bytes);
    const char *from = in;
    for (int r = 0; r < size; r++) {
        const struct spans *rows = &g->peer[r].rows_in, *cells = &g->peer[r].cells_in;
        for (int64_t k = 0; columns && k < rows->n; k++)
            take_rows(&sim->species[rows->span[k].kind], columns, rows->span[k].first, rows->span[k].n, &from);
        for (int64_t k = 0; column >= 0 && k < cells->n; k++)
            ghosts_take(&from, (char *)tree_column(&sim->tree, column) + (size_t)cells->span[k].first * node_bytes,
                 (size_t)cells->span[k].n * node_bytes);
    }
    mem_free(out.data);
    mem_free(in);
    mem_free(bytes);
}

void ghosts_share(struct sim *sim, uint64_t columns) { if (sim->spread) share(sim, columns, -1); }
void ghosts_share_node_column(struct sim *sim, enum node_column column) { if (sim->spread) share(sim, 0, (int)column); }

static void close_cells(struct sim *sim)
{
    struct tree *tree = &sim->tree;
    struct ghosts *g = ghosts_of(sim);
    tree->n_nodes = tree->n_fixed;
    for (int32_t n = 0; n < tree->n_top; n++) {
        if (tree->node[n].place != NODE_AWAY) continue;
        tree->node[n].child = -1;
        g->away[n].rows = GHOST_NONE;
    }
    for (int r = 0; r < comm_size(); r++)
        g->peer[r].rows_out.n = g->peer[r].rows_in.n = g->peer[r].cells_out.n = g->peer[r].cells_in.n = 0;
    forget_wishes(g);
}

void ghosts_close(struct sim *sim) { if (sim->spread && sim->tree.n_top > 0) close_cells(sim); }

void ghosts_forget(struct sim *sim)
{
    if (!sim->spread) return;
    ghosts_close(sim);
    for_species(sim, s) if (ghosts_of(sim)->used) species_forget(s);
    ghosts_of(sim)->used = false;
}
