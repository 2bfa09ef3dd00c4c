/* SPDX-License-Identifier: GPL-3.0-or-later
 * One octree over the global Morton key (128 bits, 42 a dimension) of all species. A cell holds a
 * contiguous range of rows of each species. Cells and groups are functions of the keys alone, never
 * of threads or ranks. Between rebuilds the cells are refitted: their centres drift and their boxes
 * grow with the largest speed within, until it pays to look at the rows again; rows that were active
 * widen them where they must. */
#ifndef TEPHRA_TREE_H
#define TEPHRA_TREE_H
#include "hd.h"
#include "species.h"

struct sim;

/* Where a cell's rows are. With one rank, and where every rank holds all rows, all are NODE_OWN. */
enum node_place {
    NODE_OWN,       /* this rank's, down to the rows */
    NODE_TOP,       /* of several ranks: every rank holds it, with all its children */
    NODE_AWAY       /* another rank's: as far as it was opened (ghosts.h) */
};

struct node {
    double pos[3];              /* centre of mass now (of the rows' centres, if all masses are 0) */
    float vel[3];               /* its velocity */
    float low[3], high[3];      /* box of all rows now, relative to pos; may be larger than needed */
    float speed;                /* largest |v - vel| of a row, any component, until the box is fitted anew */
    float slack;                /* by how much the box has grown since it was fitted; 0: fitted at tree->fitted */
    float mass;
    int32_t parent, child;      /* first child, children are contiguous; -1 = none here */
    int16_t n_children;         /* with child = -1: of a closed cell, whose children another rank holds */
    int8_t stretched;           /* floats about one centre would not tell its rows apart; never a group */
    int8_t place;               /* enum node_place */
    int32_t first[N_SPECIES], count[N_SPECIES];
};

struct tree {
    struct node *node;          /* node[0] is the root; children come after their parent */
    int32_t n_nodes, capacity, column_room;     /* cells; for how many there is room, also in the node columns */
    int32_t n_top;              /* the cells of several ranks and, below them, the topmost of each; 0 with one rank */
    int32_t n_fixed;            /* cells but for those that were opened; n_nodes with one rank */
    int32_t largest_group;      /* domains are not cut through cells of this many rows */
    int leaf_size;              /* a cell with more rows is split, and a stretched one */
    double blur;                /* rows nearer to each other than this need not be told apart */
    int64_t built, fitted;      /* ticks */
    double corner[3], side;     /* of the root's cube */
    int32_t *active_count;      /* per node: active own rows within; valid after tree_mark_active */
    struct tree_engine *engine; /* on a device; made at the first build there */
    int width[N_NODE_COLUMNS];  /* elements a node; 0 = nobody asked */
#define NODE(name, type, dims, ...) type (*name) dims;
    NODE_COLUMNS(NODE)
#undef NODE
};

/* Asks for a node column of `width` elements a node. Before the first build. */
void tree_need(struct tree *tree, enum node_column column, int width);
/* Asks that leaves hold at most `rows` rows; the smallest wish counts. Groups that are to be smaller
 * than leaves are not to be had; rows at one place share a leaf, however many they are. */
void tree_need_leaf(struct tree *tree, int rows);
/* Keys, sort, permutation of every species, cells. False, on all ranks, if a position is not finite on any. */
bool tree_build(struct sim *sim);
/* Brings the cells to the present tick: centres drift, boxes grow or, where they have grown loose, are fitted anew. */
void tree_refit(struct sim *sim);
/* Widens boxes and speeds for the rows whose step ends now and whose paths have just changed: the step's last act. */
void tree_follow(struct sim *sim);
/* The same for rows of one species that were changed in the midst of their step; ascending. */
void tree_follow_rows(struct sim *sim, enum species_kind kind, const int32_t *row, int64_t n);
/* Fills a node column from the leaves to the root: of all cells or, where `row` is not NULL, of those above `rows` rows of a
 * species, ascending. `measure` sets it for one cell, from its children's or, of a leaf, from its rows. Of spread rows only
 * this rank's own cells. */
typedef void tree_measure(const struct sim *sim, const void *data, int32_t node);
void tree_sweep(struct sim *sim, enum species_kind kind, const int32_t *row, int64_t rows, tree_measure *measure, const void *data);
/* Fills active_count along the paths from the root to the active rows. */
void tree_mark_active(struct sim *sim);
/* Cells that are the topmost with at most `size` rows of the species in `mask` (and at least one) and
 * are not stretched: a partition of those rows in key order. Cells of other ranks' rows alone are left out.
 * Returns their number; *groups belongs to the caller. */
int32_t tree_groups(const struct tree *tree, unsigned mask, int size, const char *owner, int32_t **groups);
void tree_free(struct tree *tree);
/* Makes room for so many cells and their columns; those there are stay. */
void tree_reserve(struct tree *tree, int32_t nodes);
/* Storage of a node column, NULL if nobody asked for it, and the bytes of one node of it. */
void *tree_column(const struct tree *tree, enum node_column column);
size_t tree_node_bytes(const struct tree *tree, enum node_column column);
/* Its children are not here. */
static inline bool node_is_closed(const struct node *node) { return node->child < 0 && node->n_children > 0; }
HD int64_t node_rows(const struct node *node, unsigned mask)
{
    int64_t rows = 0;
    for (int s = 0; s < N_SPECIES; s++) rows += mask >> s & 1 ? node->count[s] : 0;
    return rows;
}
#endif
