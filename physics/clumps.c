/* SPDX-License-Identifier: GPL-3.0-or-later
 * The module `clumps`: at every snapshot the gas that is denser than a threshold is divided into groups of friends of
 * friends (Davis, Efstathiou, Frenk & White 1985, ApJ 292, 371) and listed in clumps_NNN.csv. Two rows are friends
 * within `linking` mean distances of rows at the threshold. */
#include "comm.h"
#include "file/layout.h"
#include "file/text_file.h"
#include "log.h"
#include "mem.h"
#include "module.h"
#include "output.h"
#include "sort.h"
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct clumps { double density, linking; int64_t least; };

static const struct param params[] = {
    {"density", PARAM_REAL, "density", NULL, 1e-300, 1e300, NULL, "only gas denser than this", true, offsetof(struct clumps, density)},
    {"linking", PARAM_REAL, "", "1", 0.01, 100, NULL, "friends lie within this many (m/density)^(1/3)", true,
     offsetof(struct clumps, linking)},
    {"least", PARAM_COUNT, "", "50", 1, 1000000000, NULL, "rows of a clump, at least", true, offsetof(struct clumps, least)},
    {0}
};
static const char *const needed[] = {"sph", NULL};

/* The dense rows, sorted by the cells of a mesh whose diagonal is the linking length: rows of one cell are friends. */
struct mesh {
    const struct species *gas;
    double length, side, low[3];
    int64_t n, cells;
    uint64_t *key;      /* of each row; then of each cell */
    int32_t *row;
    int32_t *first;     /* of each cell, and the end */
    int32_t *group;     /* of each cell: a cell of the same group, its root where they are the same */
};
enum { BITS = 21 };

static uint64_t key_of(const int64_t cell[3])
{
    return (uint64_t)cell[0] << (2 * BITS) | (uint64_t)cell[1] << BITS | (uint64_t)cell[2];
}

static void sow(struct mesh *mesh, double density)
{
    const struct species *gas = mesh->gas;
    double high[3] = {-INFINITY, -INFINITY, -INFINITY};
    mesh->key = mem_array("clumps", uint64_t, gas->n);
    mesh->row = mem_array("clumps", int32_t, gas->n);
    for (int k = 0; k < 3; k++) mesh->low[k] = INFINITY;
    for (int64_t i = 0; i < gas->n; i++) {
        if (!((double)gas->rho[i] > density)) continue;
        mesh->row[mesh->n++] = (int32_t)i;
        for (int k = 0; k < 3; k++) {
            mesh->low[k] = fmin(mesh->low[k], gas->pos[i][k]);
            high[k] = fmax(high[k], gas->pos[i][k]);
        }
    }
    double most = 0;
    for (int k = 0; k < 3 && mesh->n > 0; k++) most = fmax(most, high[k] - mesh->low[k]);
    mesh->side = fmax(mesh->length / sqrt(3.0), most / ((1 << BITS) - 8));
    for (int64_t i = 0; i < mesh->n; i++) {
        int64_t cell[3];
        for (int k = 0; k < 3; k++) cell[k] = (int64_t)((gas->pos[mesh->row[i]][k] - mesh->low[k]) / mesh->side) + 2;
        mesh->key[i] = key_of(cell);
    }
    sort_keys(mesh->key, mesh->row, mesh->n);
    mesh->first = mem_array("clumps", int32_t, mesh->n + 1);
    mesh->group = mem_array("clumps", int32_t, mesh->n + 1);
    for (int64_t i = 0; i < mesh->n; i++) {
        if (i > 0 && mesh->key[i] == mesh->key[mesh->cells - 1]) continue;
        mesh->group[mesh->cells] = (int32_t)mesh->cells;
        mesh->first[mesh->cells] = (int32_t)i;
        mesh->key[mesh->cells++] = mesh->key[i];
    }
    mesh->first[mesh->cells] = (int32_t)mesh->n;
}

static int32_t root_of(const struct mesh *mesh, int32_t cell)
{
    while (mesh->group[cell] != cell) cell = mesh->group[cell] = mesh->group[mesh->group[cell]];
    return cell;
}

static int32_t find_cell(const struct mesh *mesh, uint64_t key)
{
    int64_t low = 0, high = mesh->cells;
    while (low < high) {
        int64_t middle = (low + high) / 2;
        if (mesh->key[middle] < key) low = middle + 1;
        else high = middle;
    }
    return low < mesh->cells && mesh->key[low] == key ? (int32_t)low : -1;
}

static bool touch(const struct mesh *mesh, int32_t a, int32_t b)
{
    for (int32_t i = mesh->first[a]; i < mesh->first[a + 1]; i++)
        for (int32_t j = mesh->first[b]; j < mesh->first[b + 1]; j++) {
            const double *x = mesh->gas->pos[mesh->row[i]], *y = mesh->gas->pos[mesh->row[j]];
            double d[3] = {x[0] - y[0], x[1] - y[1], x[2] - y[2]};
            if (d[0] * d[0] + d[1] * d[1] + d[2] * d[2] < mesh->length * mesh->length) return true;
        }
    return false;
}

/* Cells up to two away hold all friends; of each pair of cells the later one in order is looked for. */
static void link_cells(struct mesh *mesh)
{
    const int64_t mask = (1 << BITS) - 1;
    for (int32_t c = 0; c < mesh->cells; c++) {
        const int64_t key = (int64_t)mesh->key[c], at[3] = {key >> (2 * BITS), key >> BITS & mask, key & mask};
        for (int n = 63; n < 125; n++) {
            const int64_t to[3] = {at[0] + n / 25 - 2, at[1] + n / 5 % 5 - 2, at[2] + n % 5 - 2};
            int32_t other = find_cell(mesh, key_of(to));
            if (other < 0 || root_of(mesh, other) == root_of(mesh, c) || !touch(mesh, c, other)) continue;
            int32_t a = root_of(mesh, c), b = root_of(mesh, other);
            mesh->group[a > b ? a : b] = a < b ? a : b;
        }
    }
}

struct clump { int64_t rows; double mass, pos[3], vel[3], densest; };

static int by_mass(const void *a, const void *b)
{
    double x = ((const struct clump *)a)->mass, y = ((const struct clump *)b)->mass;
    return (x < y) - (x > y);
}

/* Sums over the groups; those of enough rows come first, by mass. */
static struct clump *add_up(const struct mesh *mesh, int64_t least, int64_t *count)
{
    struct clump *clump = mem_array("clumps", struct clump, mesh->cells + 1);
    const struct species *gas = mesh->gas;
    for (int32_t c = 0; c < mesh->cells; c++) {
        struct clump *sum = &clump[root_of(mesh, c)];
        for (int32_t i = mesh->first[c]; i < mesh->first[c + 1]; i++) {
            int32_t row = mesh->row[i];
            sum->rows++;
            sum->mass += gas->mass[row];
            sum->densest = fmax(sum->densest, (double)gas->rho[row]);
            for (int k = 0; k < 3; k++) {
                sum->pos[k] += gas->mass[row] * gas->pos[row][k];
                sum->vel[k] += gas->mass[row] * gas->vel[row][k];
            }
        }
    }
    *count = 0;
    for (int64_t c = 0; c < mesh->cells; c++)
        if (clump[c].rows >= least) clump[(*count)++] = clump[c];
    qsort(clump, (size_t)*count, sizeof *clump, by_mass);
    return clump;
}

static void write_file(const struct sim *sim, const struct clump *clump, int64_t count)
{
    const struct units *units = &sim->units;
    const char *const unit[] = {"M", "M L^-3", "L", "L", "L", "V", "V", "V"};
    const char *const name[] = {"mass", "densest", "x", "y", "z", "vx", "vy", "vz"};
    char *path = output_companion(sim, "clumps", "csv"), text[64];
    struct text_file whole = text_file_open(path);
    FILE *file = whole.stream;
    if (!file) fail(STATUS_ENVIRONMENT, "%s: cannot be written: %s", path, strerror(errno));
    fprintf(file, "clump,rows");
    for (int k = 0; k < 8; k++) {
        layout_unit_text(units->physical, unit[k], text, sizeof text);
        fprintf(file, ",%s [%s]", name[k], text);
    }
    for (int64_t c = 0; c < count; c++) {
        fprintf(file, "\n%lld,%lld,%.8g,%.6g", (long long)c + 1, (long long)clump[c].rows,
                clump[c].mass * layout_factor(units, "M"), clump[c].densest * layout_factor(units, "M L^-3"));
        for (int k = 0; k < 3; k++) fprintf(file, ",%.8g", clump[c].pos[k] / clump[c].mass * layout_factor(units, "L"));
        for (int k = 0; k < 3; k++) fprintf(file, ",%.8g", clump[c].vel[k] / clump[c].mass * layout_factor(units, "V"));
    }
    fprintf(file, "\n");
    if (!text_file_close(&whole)) fail(STATUS_ENVIRONMENT, "%s: cannot be written: %s", path, strerror(errno));
    mem_free(path);
}

/* After the snapshot of this tick (module output comes first), on the one rank that writes: each holds all rows. */
static void record(struct sim *sim, void *state)
{
    const struct clumps *clumps = state;
    const struct species *gas = &sim->species[GAS];
    if (comm_rank() != 0 || gas->n == 0 || !output_wrote_snapshot(sim)) return;
    double mass = 0, sum = 0;
    for (int64_t i = 0; i < gas->n; i++) mass += gas->mass[i];
    struct mesh mesh = {.gas = gas, .length = clumps->linking * cbrt(mass / (double)gas->n / clumps->density)};
    sow(&mesh, clumps->density);
    link_cells(&mesh);
    int64_t count;
    struct clump *clump = add_up(&mesh, clumps->least, &count);
    write_file(sim, clump, count);
    for (int64_t c = 0; c < count; c++) sum += clump[c].mass;
    log_line("clumps: t = %g: %lld hold %.3g %% of the gas, the largest %.4g", timeline_now(&sim->time), (long long)count,
             100 * sum / mass, count > 0 ? clump[0].mass : 0);
    mem_free(clump);
    mem_free(mesh.key);
    mem_free(mesh.row);
    mem_free(mesh.first);
    mem_free(mesh.group);
}

const struct module clumps_module = {
    .name = "clumps", .whole = true, .open_space = true, .doc = "groups of dense gas, listed at every snapshot", .params = params,
    .companion = "clumps", .requires = needed, .state_bytes = sizeof(struct clumps), .hook = {[HOOK_RECORD] = record},
};
