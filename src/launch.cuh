/* SPDX-License-Identifier: GPL-3.0-or-later
 * How .cu files name CUDA: this header, or its namesake in tests/shim, which runs the very same
 * kernels on the CPU, one fiber a thread. Dynamic shared memory is not used. */
#ifndef TEPHRA_LAUNCH_CUH
#define TEPHRA_LAUNCH_CUH
#include <cuda_runtime.h>

/* A function of kernels: inlined, so that nothing of a warp lies in memory that it need not. */
#define DEVICE static __device__ __forceinline__

template <typename... Parameters, typename... Arguments>
static void launch(void (*kernel)(Parameters...), dim3 grid, dim3 block, cudaStream_t stream, Arguments... arguments)
{
    kernel<<<grid, block, 0, stream>>>(arguments...);
}
#endif
