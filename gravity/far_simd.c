/* SPDX-License-Identifier: GPL-3.0-or-later
 * The far field: cells on targets (targets in lanes), cells to a local expansion (cells in lanes, so
 * a batch of moments is transposed in registers), a local expansion on targets. Formulas: cell.h.
 * Compiled once an instruction set (see simd_v4.h). */
#include "cell.h"
#include "kernels.h"

enum { CELLS_CHUNK = 64, MOMENTS_MAX = 64 };

struct tile { float x[CELLS_CHUNK], y[CELLS_CHUNK], z[CELLS_CHUNK], mass[CELLS_CHUNK], unit[CELLS_CHUNK]; };

/* Positions of cells list[from..from+n) relative to the centre; unit: their scale in target units. */
static void far_stage(struct tile *tile, const struct gravity_far *far, int from, int n)
{
    double inverse = 1 / far->scale;
    for (int i = 0; i < n; i++) {
        const struct gravity_cell *cell = &far->cell[far->list[from + i]];
        tile->x[i] = (float)((cell->pos[0] - far->centre[0]) * inverse);
        tile->y[i] = (float)((cell->pos[1] - far->centre[1]) * inverse);
        tile->z[i] = (float)((cell->pos[2] - far->centre[2]) * inverse);
        tile->mass[i] = cell->mass;
        tile->unit[i] = cell->scale * (float)inverse;
    }
}

/* From the unit of the cells to that of pairs. */
HD void far_promote(struct gravity_targets *t, int i, struct cell_field sum, bool potential)
{
    const float area = t->unit * t->unit;
    simd_promote(t->ax + i, area * sum.x);
    simd_promote(t->ay + i, area * sum.y);
    simd_promote(t->az + i, area * sum.z);
    if (potential) simd_promote(t->depth + i, t->unit * sum.depth);
}

HD void far_cells(struct gravity_targets *t, const struct gravity_far *far, int quadrupole, bool potential)
{
    struct tile tile;
    float q[CELLS_CHUNK][6];
    for (int from = 0; from < far->n; from += CELLS_CHUNK) {
        int n = far->n - from < CELLS_CHUNK ? far->n - from : CELLS_CHUNK;
        far_stage(&tile, far, from, n);
        for (int j = 0; j < n && quadrupole; j++)
            for (int k = 0; k < 6; k++)
                q[j][k] = tile.unit[j] * tile.unit[j] * far->moment[(int64_t)far->width * far->list[from + j] + k];
        for (int i = 0; i < t->n; i += LANES) {
            real x = t->unit * simd_load(t->x + i), y = t->unit * simd_load(t->y + i), z = t->unit * simd_load(t->z + i);
            struct cell_field sum = { { 0 }, { 0 }, { 0 }, { 0 } };
            for (int j = 0; j < n; j++) {
                struct cell_vector r = { x - tile.x[j], y - tile.y[j], z - tile.z[j] };
                struct cell_quadrupole raw = { { 0 }, { 0 }, { 0 }, { 0 }, { 0 }, { 0 } };
                if (quadrupole) raw = (struct cell_quadrupole){ real_splat(q[j][0]), real_splat(q[j][1]),
                    real_splat(q[j][2]), real_splat(q[j][3]), real_splat(q[j][4]), real_splat(q[j][5]) };
                struct cell_field f = cell_field(r, real_splat(tile.mass[j]), raw, real_splat(far->soft2), quadrupole);
                sum.x += f.x;
                sum.y += f.y;
                sum.z += f.z;
                if (potential) sum.depth += f.depth;
            }
            far_promote(t, i, sum, potential);
        }
    }
}

/* Moments of up to LANES cells, the cells in lanes, brought to the target's units. */
HD void far_moments(real *moment, const struct gravity_far *far, int from, int n, real unit, int order)
{
    static const float zero[MOMENTS_MAX];
    const int terms = CELL_TERMS(order) - CELL_TERMS(2);
    const float *of[LANES];
    for (int i = 0; i < LANES; i++) of[i] = i < n ? far->moment + (int64_t)far->width * far->list[from + i] : zero;
    for (int column = 0; column < terms; column += LANES) {
        real block[LANES];
        for (int i = 0; i < LANES; i++) block[i] = simd_load(of[i] + column);
        simd_transpose(block);
        for (int i = 0; i < LANES; i++) moment[column + i] = block[i];
    }
    real factor = unit;
    for (int k = 2; k < order; k++) {
        factor *= unit;
        for (int i = CELL_TERMS(k) - CELL_TERMS(2); i < CELL_TERMS(k + 1) - CELL_TERMS(2); i++) moment[i] *= factor;
    }
}

/* One batch of LANES cells, staged at tile[first], into the sums. */
HD void far_batch(real *sum, const struct gravity_far *far, const struct tile *tile, int from, int first, int n, int order)
{
    real moment[MOMENTS_MAX], d[CELL_TERMS_MAX];
    struct cell_vector r = { -simd_load(tile->x + first), -simd_load(tile->y + first), -simd_load(tile->z + first) };
    far_moments(moment, far, from + first, n, simd_load(tile->unit + first), order);
    cell_derivatives(d, r, real_splat(far->soft2), order);
    cell_to_local(sum, simd_load(tile->mass + first), moment, d, order);
}

/* The cells of a chunk and, up to whole batches, cells without mass. Their moments are asked for, line by line. */
HD void far_stage_batches(struct tile *tile, const struct gravity_far *far, int from, int n, int order)
{
    enum { LINE = 16 };     /* floats */
    for (int i = 0; i < n; i++) {
        const float *moment = far->moment + (int64_t)far->width * far->list[from + i];
        for (int k = 0; k < CELL_TERMS(order) - CELL_TERMS(2); k += LINE) __builtin_prefetch(moment + k);
    }
    far_stage(tile, far, from, n);
    for (int i = n; i % LANES != 0; i++) {
        tile->x[i] = tile->y[i] = tile->z[i] = tile->unit[i] = 1;
        tile->mass[i] = 0;
    }
}

HD void far_to_local(float *local, const struct gravity_far *far, int order)
{
    const int terms = CELL_TERMS(order + 1);
    real sum[CELL_TERMS_MAX + LANES];
    for (int i = 0; i < terms + LANES; i++) sum[i] = real_splat(0);
    for (int from = 0; from < far->n; from += CELLS_CHUNK) {
        int n = far->n - from < CELLS_CHUNK ? far->n - from : CELLS_CHUNK;
        struct tile tile;
        far_stage_batches(&tile, far, from, n, order);
        for (int first = 0; first < n; first += LANES)
            far_batch(sum, far, &tile, from, first, n - first, order);
    }
    float out[CELL_TERMS_MAX + LANES];
    for (int i = 0; i < terms; i += LANES) simd_store(out + i, simd_sums(sum + i));
    for (int i = 0; i < terms; i++) local[i] += out[i];
}

/* One batch of cells on one row at the centre, each in units of its own distance, so that no power of it overflows. */
HD void far_row_batch(real sum[4], const struct gravity_far *far, const struct tile *tile, int from, int first, int n, int order)
{
    real moment[MOMENTS_MAX], d[CELL_TERMS_MAX], local[4];
    struct cell_vector r = { -simd_load(tile->x + first), -simd_load(tile->y + first), -simd_load(tile->z + first) };
    real r2 = r.x * r.x + r.y * r.y + r.z * r.z, y = real_rsqrt_guess(r2);
    y *= 1.5f - 0.5f * r2 * y * y;
    r = (struct cell_vector){ y * r.x, y * r.y, y * r.z };
    far_moments(moment, far, from + first, n, y * simd_load(tile->unit + first), order);
    cell_derivatives(d, r, far->soft2 * y * y, order);
    cell_to_row(local, simd_load(tile->mass + first), moment, d, order);
    sum[0] += y * local[0];
    for (int k = 1; k < 4; k++) sum[k] += y * y * local[k];
}

HD void far_on_row(double field[4], const struct gravity_far *far, int order)
{
    real sum[4] = { { 0 }, { 0 }, { 0 }, { 0 } };
    for (int from = 0; from < far->n; from += CELLS_CHUNK) {
        int n = far->n - from < CELLS_CHUNK ? far->n - from : CELLS_CHUNK;
        struct tile tile;
        far_stage_batches(&tile, far, from, n, order);
        for (int first = 0; first < n; first += LANES)
            far_row_batch(sum, far, &tile, from, first, n - first, order);
    }
    for (int k = 0; k < 4; k++) {
        double lanes[LANES] = { 0 };
        simd_promote(lanes, sum[k]);
        for (int i = 0; i < LANES; i++) field[k] += lanes[i];
    }
}

HD void far_at_targets(struct gravity_targets *t, const float *local, int order)
{
    for (int i = 0; i < t->n; i += LANES) {
        struct cell_vector r = { t->unit * simd_load(t->x + i), t->unit * simd_load(t->y + i), t->unit * simd_load(t->z + i) };
        far_promote(t, i, cell_at(local, r, order), true);
    }
}

/* Rows in lanes. */
HD void far_of_rows(float *moment, const struct gravity_source *rows, int n_rows, float unit, int order)
{
    const int terms = CELL_TERMS(order) - CELL_TERMS(2);
    real sum[MOMENTS_MAX + LANES];
    for (int i = 0; i < terms + LANES; i++) sum[i] = real_splat(0);
    for (int from = 0; from < n_rows; from += CELLS_CHUNK) {
        int n = n_rows - from < CELLS_CHUNK ? n_rows - from : CELLS_CHUNK;
        struct tile tile;
        for (int i = 0; i < n; i++) {
            const struct gravity_source row = rows[from + i];
            tile.x[i] = -unit * row.x;
            tile.y[i] = -unit * row.y;
            tile.z[i] = -unit * row.z;
            tile.mass[i] = row.mass;
        }
        for (int i = n; i % LANES != 0; i++) tile.x[i] = tile.y[i] = tile.z[i] = tile.mass[i] = 0;
        for (int i = 0; i < n; i += LANES) {
            struct cell_powers x = cell_power(simd_load(tile.x + i)), y = cell_power(simd_load(tile.y + i)),
                               z = cell_power(simd_load(tile.z + i));
            cell_add_row(sum, simd_load(tile.mass + i), &x, &y, &z, order);
        }
    }
    float out[MOMENTS_MAX + LANES];
    for (int i = 0; i < terms; i += LANES) simd_store(out + i, simd_sums(sum + i));
    for (int i = 0; i < terms; i++) moment[i] = out[i];
}

#define CELLS(name, quadrupole, potential) \
    static void name(struct gravity_targets *t, const struct gravity_far *far) { far_cells(t, far, quadrupole, potential); }
CELLS(monopoles, 0, false)
CELLS(monopoles_pot, 0, true)
CELLS(quadrupoles, 1, false)
CELLS(quadrupoles_pot, 1, true)

#define ORDER(n) \
    static void of_rows_##n(float *moment, const struct gravity_source *row, int rows, float unit) \
    { far_of_rows(moment, row, rows, unit, n); } \
    static void to_local_##n(float *local, const struct gravity_far *far) { far_to_local(local, far, n); } \
    static void on_row_##n(double *field, const struct gravity_far *far) { far_on_row(field, far, n); } \
    static void at_targets_##n(struct gravity_targets *t, const float *local) { far_at_targets(t, local, n); }
ORDER(3)
ORDER(4)
ORDER(5)
ORDER(6)

const struct gravity_far_table SIMD_NAME(gravity_far_table) = {
    .monopoles = { monopoles, monopoles_pot },
    .quadrupoles = { quadrupoles, quadrupoles_pot },
    .of_rows = { of_rows_3, of_rows_4, of_rows_5, of_rows_6 },
    .to_local = { to_local_3, to_local_4, to_local_5, to_local_6 },
    .on_row = { on_row_3, on_row_4, on_row_5, on_row_6 },
    .at_targets = { at_targets_3, at_targets_4, at_targets_5, at_targets_6 },
};
