/* SPDX-License-Identifier: GPL-3.0-or-later
 * The topmost cells of all ranks, which every rank holds (ghosts.h). */
#include "ghosts_private.h"
#include "comm.h"
#include "mem.h"
#include "sim.h"
#include <string.h>

/* Whose topmost cells: in key order, so that every rank's follow each other. */
static char *gather(struct ghosts *g, const struct buffer *own, int64_t *bytes)
{
    int64_t before = 0, total = 0;
    g->counts.top_bytes += (int64_t)own->n * (comm_size() - 1);
    comm_gather_counts((int64_t)own->n, bytes);
    for (int r = 0; r < comm_size(); r++) {
        before += r < comm_rank() ? bytes[r] : 0;
        total += bytes[r];
    }
    char *all = mem_alloc("ranks", (size_t)total);
    if (own->n > 0) memcpy(all + before, own->data, own->n);
    comm_gather_all(all, bytes);
    return all;
}

/* The topmost cells in key order: theirs is the order of the ranks. */
static int32_t list_tops(const struct tree *tree, int32_t n, int32_t *list, int32_t count)
{
    const struct node *node = &tree->node[n];
    if (node->place != NODE_TOP) {
        list[count++] = n;
        return count;
    }
    for (int32_t k = 0; k < node->n_children; k++) count = list_tops(tree, node->child + k, list, count);
    return count;
}

static void take_top(struct sim *sim, int32_t n, int owner, float *closest, const char **from)
{
    struct node *node = &sim->tree.node[n], old = *node;
    struct ghosts *g = sim->ghosts;
    const bool own = owner == comm_rank();
    float least;
    ghosts_take(from, node, sizeof *node);
    ghosts_take(from, &least, sizeof least);
    int32_t there;
    ghosts_take(from, &there, sizeof there);
    node->parent = old.parent;
    node->child = own ? old.child : -1;
    node->place = own ? NODE_OWN : NODE_AWAY;
    if (closest) closest[n] = least;
    if (!own) g->away[n] = (struct away){owner, there, GHOST_NONE};
}

/* Whose each of the list is. */
static void keep_list(struct sim *sim, int32_t *list, int32_t count)
{
    struct ghosts *g = ghosts_of(sim);
    const int size = comm_size();
    if (!g->top_from) g->top_from = mem_array("ranks", int32_t, size + 1);
    memset(g->top_from, 0, (size_t)(size + 1) * sizeof *g->top_from);
    for (int32_t k = 0; k < count; k++)
        g->top_from[(sim->tree.node[list[k]].place == NODE_OWN ? comm_rank() : g->away[list[k]].owner) + 1]++;
    for (int r = 0; r < size; r++) g->top_from[r + 1] += g->top_from[r];
    mem_free(g->top);
    g->top = list;
}

/* Cells with `moved` alone, unless it is NULL; their places in the list go along. */
static void share_tops(struct sim *sim, float *closest, bool *moved)
{
    struct tree *tree = &sim->tree;
    struct buffer out = {0};
    ghosts_reserve_away(ghosts_of(sim), tree);
    int64_t *bytes = mem_array("ranks", int64_t, comm_size());
    int32_t *list = mem_array("ranks", int32_t, tree->n_top), count = list_tops(tree, 0, list, 0);
    for (int32_t k = 0; k < count; k++) {
        const int32_t n = list[k];
        if (tree->node[n].place != NODE_OWN || (moved && !moved[n])) continue;
        const float least = closest ? closest[n] : 0;
        ghosts_put(&out, &k, sizeof k);
        ghosts_put(&out, &tree->node[n], sizeof tree->node[n]);
        ghosts_put(&out, &least, sizeof least);
        ghosts_put(&out, &n, sizeof n);
    }
    char *all = gather(ghosts_of(sim), &out, bytes);
    const char *from = all;
    for (int r = 0; r < comm_size(); r++)
        for (const char *end = from + bytes[r]; from < end;) {
            int32_t k;
            ghosts_take(&from, &k, sizeof k);
            take_top(sim, list[k], r, closest, &from);
            if (moved) moved[list[k]] = true;
        }
    keep_list(sim, list, count);
    mem_free(all);
    mem_free(out.data);
    mem_free(bytes);
}

void ghosts_share_tops(struct sim *sim, float *closest) { share_tops(sim, closest, NULL); }
void ghosts_share_moved(struct sim *sim, bool *moved) { share_tops(sim, NULL, moved); }

void ghosts_share_top_column(struct sim *sim, enum node_column column)
{
    struct tree *tree = &sim->tree;
    if (tree->n_top == 0) return;
    const size_t node_bytes = tree_node_bytes(tree, column);
    char *data = tree_column(tree, column);
    struct buffer out = {0};
    int64_t *bytes = mem_array("ranks", int64_t, comm_size());
    int32_t *list = mem_array("ranks", int32_t, tree->n_top), count = list_tops(tree, 0, list, 0);
    for (int32_t k = 0; k < count; k++)
        if (tree->node[list[k]].place == NODE_OWN) ghosts_put(&out, data + (size_t)list[k] * node_bytes, node_bytes);
    char *all = gather(ghosts_of(sim), &out, bytes);
    const char *from = all;
    for (int32_t k = 0; k < count; k++) ghosts_take(&from, data + (size_t)list[k] * node_bytes, node_bytes);
    mem_free(all);
    mem_free(out.data);
    mem_free(list);
    mem_free(bytes);
}
