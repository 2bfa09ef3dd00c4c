/* SPDX-License-Identifier: GPL-3.0-or-later
 * The integrators by CUDA: a thread a row. */
#include "device.cuh"
extern "C" {
#include "integrate_rows.h"
}

enum { BLOCK = 256 };

template <int part>
static __global__ void __launch_bounds__(BLOCK) integrate_rows(struct timeline time, struct species rows)
{
    const int64_t k = (int64_t)blockIdx.x * blockDim.x + threadIdx.x;
    const bool all = part == INTEGRATE_PREDICT;
    const int32_t *list = all ? rows.ending : rows.active;
    if (k < (all ? rows.n_ending : rows.n_active))
        integrate_row((enum integrate_part)part, &time, &rows, list ? list[k] : all ? k : rows.own + k);
}

typedef void integrate_kernel(struct timeline, struct species);

void integrate_launch(struct device *device, enum integrate_part part, const struct timeline *time, const struct species *rows)
{
    static integrate_kernel *const kernel[INTEGRATE_PARTS] = {
        integrate_rows<INTEGRATE_PREDICT>, integrate_rows<INTEGRATE_BEGIN>, integrate_rows<INTEGRATE_CORRECT>,
        integrate_rows<INTEGRATE_CORRECT_SHIFT>};
    const int64_t n = part == INTEGRATE_PREDICT ? rows->n_ending : rows->n_active;
    if (n > 0)
        device_launch(device, "integrate_rows", kernel[part], dim3((unsigned)((n + BLOCK - 1) / BLOCK)), dim3(BLOCK), *time, *rows);
}
