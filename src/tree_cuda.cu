/* SPDX-License-Identifier: GPL-3.0-or-later
 * Cells by CUDA, bit for bit those of the CPU: the same operations in the same order (compiled without fused
 * products and sums, Makefile.am), and the cells numbered as there, though they are made level by level.
 *   cells   eight lanes a cell look for the bounds of its octants; a level a launch
 *   number  how many cells lie below each, from the lowest level up; from that the place of each, from the root down
 *   leaves  a warp each: sums run in the order of the rows, one lane an axis; stretched ones are split, in rounds
 *   boxes   of the other cells, a thread each, from the last made to the root */
#include "cub.cuh"
#include "tree.cuh"

enum { EIGHT = 8, GROUP = LANES * 3 };

/* A cell while the levels are made. */
struct tree_cell { int32_t first[N_SPECIES], count[N_SPECIES], parent, child, n_children; };

DEVICE struct key tree_key(const struct tree_tables *t, int s, int i)
{
    struct key key = {t->of[s].high[i], t->of[s].low[i]};
    return key;
}

/* Level at which the rows of a cell first lie in different octants, as tree_cells.c has it; beyond KEY_LEVELS if never. */
DEVICE int tree_level(const struct tree_tables *t, const int32_t *first, const int32_t *count)
{
    struct key start = {0, 0}, differ = {0, 0};
    bool any = false;
    for (int s = 0; s < N_SPECIES; s++) {
        if (count[s] == 0) continue;
        const struct key a = tree_key(t, s, first[s]), b = tree_key(t, s, first[s] + count[s] - 1);
        if (!any) start = a;
        any = true;
        differ.high |= (start.high ^ a.high) | (start.high ^ b.high);
        differ.low |= (start.low ^ a.low) | (start.low ^ b.low);
    }
    if (differ.high) return KEY_HALF - (63 - __clzll((long long)differ.high)) / 3;
    if (differ.low) return KEY_LEVELS - (63 - __clzll((long long)differ.low)) / 3;
    return KEY_LEVELS + 1;
}

/* The rows of octant threadIdx.x % 8 of a cell: their number in all; of octants without rows 0, and everywhere if the rows
 * do not part. The eight lanes of a cell together. */
DEVICE int tree_octant(const struct tree_tables *t, const int32_t *first, const int32_t *count, int32_t *own_first,
                       int32_t *own_count)
{
    const int octant = (int)threadIdx.x % EIGHT, level = tree_level(t, first, count);
    int rows = 0;
    for (int s = 0; s < N_SPECIES; s++) {
        int from = first[s], to = first[s] + count[s];
        while (from < to) {
            const int middle = from + (to - from) / 2;
            const bool before = level <= KEY_LEVELS && key_octant(tree_key(t, s, middle), level) <= octant;
            if (before) from = middle + 1;
            else to = middle;
        }
        const int start = __shfl_up_sync(~0u, from, 1);
        own_first[s] = octant > 0 ? start : first[s];
        own_count[s] = from - own_first[s];
        rows += own_count[s];
    }
    return rows;
}

/* Where this lane's child goes among those of its cell, and how many there are. */
DEVICE int tree_place(bool child, int *n_children)
{
    const unsigned lane = threadIdx.x % LANES, votes = __ballot_sync(~0u, child) >> (lane / EIGHT * EIGHT) & 0xff;
    *n_children = __popc(votes);
    return __popc(votes & ((1u << lane % EIGHT) - 1));
}

/* Cells [from, to). */
struct tree_level { int from, to; };

/* Of one level: those with more rows than a leaf get children, in whatever order. */
static __global__ void tree_split(struct tree_tables t, struct tree_cell *cell, struct tree_level level, int leaf_size, int room,
                                  struct tree_counts *counts)
{
    const int from = level.from, to = level.to;
    const int c = from + tree_thread() / EIGHT;
    const bool here = c < to;
    struct tree_cell own = cell[here ? c : from], child = {};
    int rows = 0, n_children, at = 0;
    for (int s = 0; s < N_SPECIES; s++) rows += own.count[s];
    if (!here || rows <= leaf_size)
        for (int s = 0; s < N_SPECIES; s++) own.count[s] = 0;
    const bool mine = tree_octant(&t, own.first, own.count, child.first, child.count) > 0;
    const int place = tree_place(mine, &n_children), octant = (int)threadIdx.x % EIGHT;
    if (octant == 0 && n_children > 0) at = atomicAdd(&counts->cells, n_children);
    at = __shfl_sync(~0u, at, 0, EIGHT);
    if (n_children == 0 || at + n_children > room) return;
    child.parent = c;
    child.child = -1;
    if (mine) cell[at + place] = child;
    if (octant > 0) return;
    cell[c].child = at;
    cell[c].n_children = n_children;
}

/* below: cells below each. The level beneath has been done. */
static __global__ void tree_count_below(const struct tree_cell *cell, struct tree_level level, int32_t *below)
{
    const int c = level.from + tree_thread();
    if (c >= level.to) return;
    int sum = cell[c].n_children;
    for (int k = 0; k < cell[c].n_children; k++) sum += below[cell[c].child + k];
    below[c] = sum;
}

/* number: which node a cell becomes; behind: where the nodes below it begin. The level above has been done. */
static __global__ void tree_number(const struct tree_cell *cell, struct tree_level level, const int32_t *below, int32_t *number,
                                   int32_t *behind, struct node *node)
{
    const int c = level.from + tree_thread();
    if (c >= level.to) return;
    const struct tree_cell own = cell[c];
    struct node to_be = {};
    int at = behind[c];
    to_be.parent = own.parent >= 0 ? number[own.parent] : -1;
    to_be.child = own.n_children > 0 ? at : -1;
    to_be.n_children = (int16_t)own.n_children;
    for (int s = 0; s < N_SPECIES; s++) {
        to_be.first[s] = own.first[s];
        to_be.count[s] = own.count[s];
    }
    node[number[c]] = to_be;
    for (int k = 0; k < own.n_children; k++) number[own.child + k] = at + k;
    at += own.n_children;
    for (int k = 0; k < own.n_children; k++) {
        behind[own.child + k] = at;
        at += below[own.child + k];
    }
}

struct tree_input { struct timeline time; struct tree_tables tables; double blur; };

/* Rows of a leaf in shared memory: a coordinate of all of them after the other. */
struct tree_tile { double x[3][LANES], weight[LANES], last[3]; };

/* What a lane knows of one axis of a leaf (lanes 0 to 2). */
struct tree_axis { double sum, weight, low, high; };

DEVICE double tree_lane_least(double x)
{
    for (int lanes = LANES / 2; lanes > 0; lanes /= 2) x = smaller(x, __shfl_xor_sync(~0u, x, lanes));
    return x;
}

/* The j-th row of a leaf over all species: its place among those as they lie. */
DEVICE int tree_leaf_row(const struct tree_tables *t, const struct node *node, int j, int *species)
{
    int s = 0;
    while (j >= node->count[s]) j -= node->count[s++];
    *species = s;
    return t->of[s].order[node->first[s] + j];
}

/* Rows of the tile onto the axis of this lane, in their order. */
DEVICE void tree_axis_add(struct tree_axis *a, const struct tree_tile *tile, int lane, int n)
{
    __syncwarp();
    for (int j = 0; j < n && lane < 3; j++) {
        const double x = tile->x[lane][j], weight = tile->weight[j];
        a->weight += weight;
        a->sum += weight * x;
        a->low = smaller(a->low, x);
        a->high = larger(a->high, x);
    }
    __syncwarp();
}

DEVICE struct tree_axis tree_axis_open(void)
{
    const double inf = INFINITY;
    struct tree_axis a = {0, 0, inf, -inf};
    return a;
}

/* Positions of a leaf; returns the least squared distance of rows that follow each other. */
DEVICE double tree_positions(const struct tree_input *in, const struct node *node, bool equal, struct tree_tile *tile,
                             struct tree_axis *axis)
{
    const int lane = (int)threadIdx.x % LANES, rows = (int)node_rows(node, ALL_SPECIES);
    double least2 = INFINITY;
    *axis = tree_axis_open();
    for (int from = 0; from < rows; from += LANES) {
        const int n = min(rows - from, (int)LANES);
        double pos[3] = {0, 0, 0}, d2 = 0;
        if (lane < n) {
            int s, i = tree_leaf_row(&in->tables, node, from + lane, &s);
            tree_predict(&in->time, &in->tables.of[s], i, pos);
            tile->weight[lane] = equal ? 1 : in->tables.of[s].mass[i];
            for (int k = 0; k < 3; k++) tile->x[k][lane] = pos[k];
        }
        __syncwarp();
        if (lane < n && from + lane > 0) {
            for (int k = 0; k < 3; k++) {
                const double last = lane > 0 ? tile->x[k][lane - 1] : tile->last[k];
                d2 += (pos[k] - last) * (pos[k] - last);
            }
            least2 = d2 > 0 ? smaller(d2, least2) : least2;
        }
        tree_axis_add(axis, tile, lane, n);
        if (lane < 3) tile->last[lane] = tile->x[lane][n - 1];
        __syncwarp();
    }
    return tree_lane_least(least2);
}

/* Velocities; returns by how much one may change until its row's step ends. */
DEVICE double tree_velocities(const struct tree_input *in, const struct node *node, bool equal, struct tree_tile *tile,
                              struct tree_axis *axis)
{
    const int lane = (int)threadIdx.x % LANES, rows = (int)node_rows(node, ALL_SPECIES);
    double change = 0;
    *axis = tree_axis_open();
    for (int from = 0; from < rows; from += LANES) {
        const int n = min(rows - from, (int)LANES);
        if (lane < n) {
            int s, i = tree_leaf_row(&in->tables, node, from + lane, &s);
            const struct tree_table *table = &in->tables.of[s];
            const double lag = timeline_lag(&in->time, table->rung[i], table->rung0[i]);
            double most = 0;
            tile->weight[lane] = equal ? 1 : table->mass[i];
            for (int k = 0; k < 3; k++) {
                const double acc = (double)table->acc[3 * i + k];
                tile->x[k][lane] = integrate_velocity(table->vel[3 * i + k], acc, lag);
                most = larger(most, fabs(acc));
            }
            change = larger(change, most * timeline_seconds(&in->time, (int64_t)1 << table->rung[i]));
        }
        tree_axis_add(axis, tile, lane, n);
    }
    return -tree_lane_least(-change);
}

/* Centre, box and speed of a leaf; returns the least distance of its rows. The warp. */
DEVICE double tree_measure_leaf(const struct tree_input *in, struct node *to, struct tree_tile *tile)
{
    const int lane = (int)threadIdx.x % LANES;
    struct node node = *to;
    struct tree_axis pos, vel;
    double least2 = tree_positions(in, &node, false, tile, &pos);
    const double mass = __shfl_sync(~0u, pos.weight, 0);
    const bool equal = !(mass > 0);
    if (equal) tree_positions(in, &node, equal, tile, &pos);
    const double change = tree_velocities(in, &node, equal, tile, &vel);
    struct centre c;
    double low[3], high[3], slow[3], fast[3];
    c.weight = __shfl_sync(~0u, pos.weight, 0);
    for (int k = 0; k < 3; k++) {
        c.pos[k] = __shfl_sync(~0u, pos.sum, k);
        c.vel[k] = __shfl_sync(~0u, vel.sum, k);
        low[k] = __shfl_sync(~0u, pos.low, k);
        high[k] = __shfl_sync(~0u, pos.high, k);
        slow[k] = __shfl_sync(~0u, vel.low, k);
        fast[k] = __shfl_sync(~0u, vel.high, k);
    }
    centre_set(&node, &c, mass);
    for (int k = 0; k < 3; k++) {
        const double v = node.vel[k];
        widen(&node, k, low[k] - node.pos[k], high[k] - node.pos[k]);
        node.speed = (float)larger(node.speed, above(larger(fast[k] - v, v - slow[k]) + change));
    }
    if (lane == 0) *to = node;
    __syncwarp();
    return larger(sqrt(least2), in->blur);
}

/* Leaves among nodes [from, to), a warp each: measured; split[n - from]: how many children a stretched one is to have. */
static __global__ void __launch_bounds__(GROUP) tree_leaves(struct tree_input in, struct node *node, struct tree_level range,
                                                            float *closest, int32_t *split)
{
    const int from = range.from, to = range.to;
    __shared__ struct tree_tile tile[GROUP / LANES];
    const int n = from + tree_thread() / LANES, lane = (int)threadIdx.x % LANES;
    int n_children = 0;
    if (n > to) return;
    if (n < to) {
        closest[n] = INFINITY;
        if (node[n].n_children == 0) {
            const double distance = (double)(float)tree_measure_leaf(&in, &node[n], &tile[threadIdx.x / LANES]);
            int32_t first[N_SPECIES], count[N_SPECIES];
            if (lane == 0) closest[n] = (float)distance;
            if (is_stretched(&node[n], distance))
                tree_place(tree_octant(&in.tables, node[n].first, node[n].count, first, count) > 0, &n_children);
        }
    }
    if (lane == 0) split[n - from] = n_children;     /* and one more, 0, for the sum of all */
}

/* The children of stretched leaves among nodes [from, to): behind all others, offset[n - from] from there. */
static __global__ void tree_split_leaves(struct tree_tables t, struct node *node, struct tree_level range, const int32_t *split,
                                         const int32_t *offset)
{
    const int from = range.from, to = range.to;
    const int n = from + tree_thread() / LANES, lane = (int)threadIdx.x % LANES;
    if (n >= to || split[n - from] == 0) return;
    struct node child = {};
    int n_children;
    const bool mine = tree_octant(&t, node[n].first, node[n].count, child.first, child.count) > 0;
    const int place = tree_place(mine, &n_children), at = to + offset[n - from];
    child.parent = n;
    child.child = -1;
    if (lane >= EIGHT) return;
    if (mine) node[at + place] = child;
    if (lane > 0) return;
    node[n].child = at;
    node[n].n_children = (int16_t)n_children;
}

/* Cells [from, to) whose children are done: number[c] of the levels or, without, the nodes themselves. */
static __global__ void tree_finish(struct node *node, float *closest, struct tree_level level, const int32_t *number)
{
    const int c = level.from + tree_thread();
    if (c >= level.to) return;
    const int n = number ? number[c] : c;
    struct node own = node[n];
    float near = closest[n];
    if (own.n_children > 0) measure_inner(node, &own);
    for (int k = 0; k < own.n_children; k++) near = fminf(near, closest[own.child + k]);
    closest[n] = near;
    own.stretched = is_stretched(&own, (double)near);
    node[n] = own;
}

struct tree_engine *tree_engine_create(struct device *device)
{
    struct tree_engine *e = (struct tree_engine *)mem_alloc("tree", sizeof *e);
    e->device = device;
    return e;
}

void tree_engine_free(struct tree_engine *e)
{
    if (!e) return;
    for (int b = 0; b < N_BLOCKS; b++) device_free(e->device, e->block[b].at);
    for (int s = 0; s < N_SPECIES; s++)
        for (int c = 0; c < N_TREE_COLUMNS; c++) device_free(e->device, e->column[s][c].at);
    mem_free(e);
}

/* All levels; false if there was not room enough, of which there is now. */
static bool split_levels(struct tree_engine *e, int leaf_size)
{
    struct tree_cell root = {}, *cell = (struct tree_cell *)reserve(e, &e->block[CELLS], (size_t)e->room * sizeof *cell);
    root.parent = root.child = -1;
    for (int s = 0; s < N_SPECIES; s++) root.count[s] = e->tables.of[s].n;
    device_upload(e->device, cell, &root, sizeof root);
    write_counts(e, (struct tree_counts){1, 0, 0});
    e->levels = 0;
    for (int from = 0, to = 1; from < to;) {
        e->level[e->levels++] = from;
        const struct tree_level level = {from, to};
        device_launch(e->device, "tree_split", tree_split, blocks_for((int64_t)(to - from) * EIGHT, THREADS), dim3(THREADS),
                      e->tables, cell, level, leaf_size, e->room, counts_of(e));
        const int cells = read_counts(e).cells;
        if (!device_sound(e->device)) break;
        if (cells > e->room) {
            e->room = cells + cells / 2;
            return false;
        }
        from = to;
        to = cells;
    }
    e->level[e->levels] = read_counts(e).cells;
    e->nodes = e->level[e->levels];
    return true;
}

static struct tree_level level_of(const struct tree_engine *e, int l)
{
    struct tree_level level = {e->level[l], e->level[l + 1]};
    return level;
}

static dim3 level_grid(const struct tree_engine *e, int l) { return blocks_for(e->level[l + 1] - e->level[l], THREADS); }

/* The cells in the CPU's order. */
static void number_cells(struct tree_engine *e)
{
    const size_t bytes = (size_t)e->nodes * sizeof(int32_t);
    const struct tree_cell *cell = (const struct tree_cell *)e->block[CELLS].at;
    int32_t *below = (int32_t *)reserve(e, &e->block[BELOW], bytes), *number = (int32_t *)reserve(e, &e->block[NUMBER], bytes),
            *behind = (int32_t *)reserve(e, &e->block[BEHIND], bytes);
    struct node *node = (struct node *)reserve(e, &e->block[NODES], (size_t)e->room * sizeof *node);
    const int32_t root[2] = {0, 1};
    device_upload(e->device, number, &root[0], sizeof *root);
    device_upload(e->device, behind, &root[1], sizeof *root);
    for (int l = e->levels - 1; l >= 0; l--)
        device_launch(e->device, "tree_count_below", tree_count_below, level_grid(e, l), dim3(THREADS), cell, level_of(e, l),
                      below);
    for (int l = 0; l < e->levels; l++)
        device_launch(e->device, "tree_number", tree_number, level_grid(e, l), dim3(THREADS), cell, level_of(e, l),
                      (const int32_t *)below, number, behind, node);
}

/* Where the children of nodes [from, to) go; returns how many there are. */
static int add_up(struct tree_engine *e, int n)
{
    size_t bytes = 0;
    int32_t total = 0;
    int32_t *split = (int32_t *)e->block[SPLIT].at,
            *offset = (int32_t *)reserve(e, &e->block[OFFSET], ((size_t)n + 1) * sizeof *offset);
    if (!device_sound(e->device)) return 0;
    cub::DeviceScan::ExclusiveSum(NULL, bytes, split, offset, n + 1, device_stream(e->device));
    void *temporary = reserve(e, &e->block[TEMPORARY], bytes);
    if (!device_sound(e->device)) return 0;
    device_launching(e->device, "tree_sum");
    cub::DeviceScan::ExclusiveSum(temporary, bytes, split, offset, n + 1, device_stream(e->device));
    device_launched(e->device, "tree_sum");
    device_download(e->device, &total, offset + n, sizeof total);
    return total;
}

/* Measures leaves and splits those that are stretched, until none is; false if there was not room enough. */
static bool settle_leaves(struct tree_engine *e, double blur)
{
    struct node *node = (struct node *)e->block[NODES].at;
    float *closest = (float *)reserve(e, &e->block[CLOSEST], (size_t)e->room * sizeof *closest);
    const struct tree_input in = {e->time, e->tables, blur};
    e->rounds = 0;
    for (int from = 0, to = e->nodes; from < to;) {
        const struct tree_level range = {from, to};
        const dim3 grid = blocks_for((int64_t)(to - from + 1) * LANES, GROUP), block(GROUP);
        int32_t *split = (int32_t *)reserve(e, &e->block[SPLIT], ((size_t)(to - from) + 1) * sizeof *split);
        device_launch(e->device, "tree_leaves", tree_leaves, grid, block, in, node, range, closest, split);
        const int more = add_up(e, to - from);
        if (!device_sound(e->device)) return true;
        if (to + more > e->room) {
            e->room = to + more + (to + more) / 2;
            return false;
        }
        e->round[e->rounds++] = to;
        device_launch(e->device, "tree_split_leaves", tree_split_leaves, grid, block, e->tables, node, range,
                      (const int32_t *)split, (const int32_t *)e->block[OFFSET].at);
        from = to;
        to += more;
    }
    e->nodes = e->round[e->rounds - 1];
    return true;
}

static void finish(struct tree_engine *e)
{
    struct node *node = (struct node *)e->block[NODES].at;
    float *closest = (float *)e->block[CLOSEST].at;
    const int32_t *number = (const int32_t *)e->block[NUMBER].at;
    for (int r = e->rounds - 1; r > 0; r--) {
        const struct tree_level round = {e->round[r - 1], e->round[r]};
        device_launch(e->device, "tree_finish", tree_finish, blocks_for(round.to - round.from, THREADS), dim3(THREADS), node,
                      closest, round, (const int32_t *)NULL);
    }
    for (int l = e->levels - 1; l >= 0; l--)
        device_launch(e->device, "tree_finish", tree_finish, level_grid(e, l), dim3(THREADS), node, closest, level_of(e, l),
                      number);
}

int32_t tree_engine_build(struct tree_engine *e, const struct tree *tree)
{
    struct tree_cube cube = {{tree->corner[0], tree->corner[1], tree->corner[2]}, ldexp(1.0, KEY_LEVELS) / tree->side};
    int64_t rows = 0;
    for (int s = 0; s < N_SPECIES; s++) rows += e->tables.of[s].n;
    tree_sort(e, cube);
    if (rows == 0) return 0;
    const int64_t likely = 64 + 4 * rows / tree->leaf_size;
    if (e->room < likely) e->room = (int32_t)likely;
    bool fits;
    do {
        fits = split_levels(e, tree->leaf_size);
        if (!fits || !device_sound(e->device)) continue;
        number_cells(e);
        fits = settle_leaves(e, tree->blur);
    } while (!fits && device_sound(e->device));
    if (device_sound(e->device)) finish(e);
    return e->nodes;
}

void tree_engine_nodes(struct tree_engine *e, struct node *node)
{
    device_download(e->device, node, e->block[NODES].at, (size_t)e->nodes * sizeof *node);
}
