/* SPDX-License-Identifier: GPL-3.0-or-later
 * SPH by CUDA: what is done row by row, and cell by cell, by the formulas of row.h. */
#include "device.cuh"
#include "kernels.cuh"

enum { BLOCK = 256 };

DEVICE int64_t sph_thread(void) { return (int64_t)blockIdx.x * blockDim.x + threadIdx.x; }
static dim3 grid_for(int64_t n) { return dim3((unsigned)((n + BLOCK - 1) / BLOCK)); }

static __global__ void __launch_bounds__(BLOCK) sph_mark_leaves(const struct sph_cell *cell, int32_t n, int32_t *leaf)
{
    const int32_t c = (int32_t)sph_thread();
    if (c >= n || cell[c].n_children > 0) return;
    for (int32_t i = cell[c].first; i < cell[c].first + cell[c].count; i++) leaf[i] = c;
}

void sph_launch_leaves(struct device *device, const struct sph_cell *cell, int32_t n, int32_t *leaf)
{
    if (n > 0) device_launch(device, "sph_mark_leaves", sph_mark_leaves, grid_for(n), dim3(BLOCK), cell, n, leaf);
}

static __global__ void __launch_bounds__(BLOCK) sph_place_rows(struct sph_field f, struct sph_rows rows, struct sph_place *place)
{
    const int64_t i = sph_thread();
    if (i >= rows.gas.n) return;
    const struct sph_cell *leaf = &f.cell[f.leaf[i]];
    const double vel[3] = {(double)leaf->vel[0], (double)leaf->vel[1], (double)leaf->vel[2]};
    place[i] = sph_row_place(leaf->pos, vel, &rows.time, &rows.gas, i);
}

void sph_launch_places(struct device *device, const struct sph_field *field, const struct sph_rows *rows, struct sph_place *place)
{
    if (rows->gas.n > 0)
        device_launch(device, "sph_place_rows", sph_place_rows, grid_for(rows->gas.n), dim3(BLOCK), *field, *rows, place);
}

static __global__ void __launch_bounds__(BLOCK) sph_state_rows(struct sph_law law, struct sph_rows rows, struct sph_state *state)
{
    const int64_t i = sph_thread();
    if (i < rows.gas.n) state[i] = sph_row_state(law, &rows.time, &rows.gas, i);
}

void sph_launch_states(struct device *device, struct sph_law law, const struct sph_rows *rows, struct sph_state *state)
{
    if (rows->gas.n > 0)
        device_launch(device, "sph_state_rows", sph_state_rows, grid_for(rows->gas.n), dim3(BLOCK), law, *rows, state);
}

static __global__ void __launch_bounds__(BLOCK) sph_clear_lengths(float *h_max, int32_t n)
{
    const int32_t c = (int32_t)sph_thread();
    if (c < n) h_max[c] = 0.f;
}

/* A leaf tells its ancestors: of numbers that are not negative the largest has the largest bits, whatever the order. */
static __global__ void __launch_bounds__(BLOCK) sph_fit_lengths(const struct sph_cell *cell, int32_t n, struct sph_rows rows,
                                                                float *h_max)
{
    int32_t c = (int32_t)sph_thread();
    if (c >= n || cell[c].n_children > 0) return;
    float largest = 0;
    for (int32_t i = cell[c].first; i < cell[c].first + cell[c].count; i++) largest = fmaxf(largest, rows.gas.h[i]);
    const int bits = __float_as_int(largest * expf(SPH_GROWTH));
    for (; c >= 0; c = cell[c].parent)
        if (atomicMax((int *)&h_max[c], bits) >= bits) return;
}

void sph_launch_lengths(struct device *device, const struct sph_cell *cell, int32_t n, const struct sph_rows *rows, float *h_max)
{
    if (n == 0) return;
    device_launch(device, "sph_clear_lengths", sph_clear_lengths, grid_for(n), dim3(BLOCK), h_max, n);
    device_launch(device, "sph_fit_lengths", sph_fit_lengths, grid_for(n), dim3(BLOCK), cell, n, *rows, h_max);
}

static __global__ void __launch_bounds__(BLOCK) sph_finish_rows(struct sph_law law, struct sph_rows rows,
                                                                const struct sph_density *sum)
{
    const int64_t a = sph_thread();
    if (a >= rows.gas.n_active) return;
    const int64_t i = rows.gas.active ? rows.gas.active[a] : rows.gas.own + a;
    sph_row_density(law, &rows.gas, i, (float)timeline_step(&rows.time, rows.gas.rung0[i]), sum[a]);
}

void sph_launch_finish(struct device *device, struct sph_law law, const struct sph_rows *rows, const struct sph_density *sum)
{
    if (rows->gas.n_active > 0)
        device_launch(device, "sph_finish_rows", sph_finish_rows, grid_for(rows->gas.n_active), dim3(BLOCK), law, *rows, sum);
}
