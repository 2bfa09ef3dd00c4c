/* SPDX-License-Identifier: GPL-3.0-or-later
 * The host shim: takes the place of src/launch.cuh, so that g++ compiles the very .cu files and
 * make check runs their kernels on the CPU, under AddressSanitizer too. A block's threads are
 * fibers (shim.cpp) that take turns at __syncthreads and at warp exchanges; blocks run one after
 * another. It shows wrong indices, divergent barriers and reads out of bounds, but no races that
 * need real concurrency, and no speed. */
#ifndef TEPHRA_LAUNCH_CUH
#define TEPHRA_LAUNCH_CUH
#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define __global__
#define __device__
#define __host__
#define __forceinline__ inline __attribute__((always_inline))
#define __shared__ static
#define __launch_bounds__(...)
#define __align__(n) alignas(n)
#define DEVICE static __device__ __forceinline__
#define CUDART_VERSION 13000

struct dim3 {
    unsigned x, y, z;
    dim3(unsigned x = 1, unsigned y = 1, unsigned z = 1) : x(x), y(y), z(z) {}
};
struct alignas(16) float4 { float x, y, z, w; };
struct float3 { float x, y, z; };
static inline float3 make_float3(float x, float y, float z) { return {x, y, z}; }
static inline float4 make_float4(float x, float y, float z, float w) { return {x, y, z, w}; }
static inline float rsqrtf(float x) { return 1.f / sqrtf(x); }
template <typename T> static inline T min(T a, T b) { return b < a ? b : a; }
template <typename T> static inline T max(T a, T b) { return a < b ? b : a; }
static inline int __popc(unsigned x) { return __builtin_popcount(x); }
static inline int __ffs(int x) { return __builtin_ffs(x); }
static inline int __clzll(long long x) { return x == 0 ? 64 : __builtin_clzll((unsigned long long)x); }
static inline int __ffsll(long long x) { return __builtin_ffsll(x); }

extern dim3 threadIdx, blockIdx, blockDim, gridDim;
enum { warpSize = 32 };

/* Runs body(context) once a thread of every block. */
void shim_run(void (*body)(const void *), const void *context, dim3 grid, dim3 block);
void __syncthreads();
void __syncwarp(unsigned mask = ~0u);
/* Puts a value of at most 16 bytes up and gets the one that `lane` of the warp put up. */
void shim_exchange(const void *give, void *take, size_t bytes, int lane);
unsigned __ballot_sync(unsigned mask, int predicate);
static inline int __any_sync(unsigned mask, int predicate) { return __ballot_sync(mask, predicate) != 0; }
static inline int __all_sync(unsigned mask, int predicate) { return __ballot_sync(mask, !predicate) == 0; }

static inline int shim_lane() { return (int)(threadIdx.x % warpSize); }
template <typename T> static T __shfl_sync(unsigned, T value, int lane, int width = warpSize)
{
    T taken;
    shim_exchange(&value, &taken, sizeof value, (shim_lane() & -width) + (lane & (width - 1)));
    return taken;
}
template <typename T> static T __shfl_xor_sync(unsigned mask, T value, int lanes)
{ return __shfl_sync(mask, value, shim_lane() ^ lanes); }
template <typename T> static T __shfl_up_sync(unsigned mask, T value, unsigned lanes)
{ return __shfl_sync(mask, value, shim_lane() < (int)lanes ? shim_lane() : shim_lane() - (int)lanes); }
template <typename T> static T __shfl_down_sync(unsigned mask, T value, unsigned lanes)
{ return __shfl_sync(mask, value, shim_lane() + (int)lanes > 31 ? shim_lane() : shim_lane() + (int)lanes); }
static inline int __float_as_int(float x) { int bits; memcpy(&bits, &x, sizeof bits); return bits; }
template <typename T> static T atomicMax(T *place, T value) { T old = *place; *place = max(old, value); return old; }
template <typename T> static T atomicAdd(T *place, T value) { T old = *place; *place += value; return old; }

/* Puts items into the order in which `before` has them, by heaps. */
template <typename Before> static void shim_sort(int32_t *item, size_t n, Before before)
{
    for (size_t end = 2 * n; end > 1; end--) {     /* first the heap is made, from its middle down; then its top is taken */
        const size_t size = end > n ? n : end - 1, from = end > n ? end - n - 1 : 0;
        if (end <= n) {
            const int32_t top = item[0];
            item[0] = item[size];
            item[size] = top;
        }
        for (size_t i = from, child; (child = 2 * i + 1) < size; i = child) {
            if (child + 1 < size && before(item[child], item[child + 1])) child++;
            if (!before(item[i], item[child])) break;
            const int32_t swap = item[i];
            item[i] = item[child];
            item[child] = swap;
        }
    }
}

/* The part of the runtime that device_cuda.cu calls; memory of the device is memory of the host. */
typedef struct shim_stream *cudaStream_t;
enum cudaError_t { cudaSuccess, cudaErrorMemoryAllocation = 2, cudaErrorInsufficientDriver = 35, cudaErrorNoDevice = 100 };
enum cudaMemcpyKind { cudaMemcpyHostToDevice = 1, cudaMemcpyDeviceToHost, cudaMemcpyDeviceToDevice };
struct cudaDeviceProp { char name[256]; };

/* SHIM_BYTES in the environment: the largest block there is; unset, 1 GiB.
 * SHIM_DEVICES in the environment: how many there are; unset, one. -1: no driver. */
static inline int shim_devices()
{
    const char *text = getenv("SHIM_DEVICES");
    return text ? atoi(text) : 1;
}
static inline cudaError_t cudaGetDeviceCount(int *count)
{
    *count = shim_devices();
    return *count < 0 ? cudaErrorInsufficientDriver : *count == 0 ? cudaErrorNoDevice : cudaSuccess;
}
static inline cudaError_t cudaGetDeviceProperties(cudaDeviceProp *p, int) { strcpy(p->name, "host shim"); return cudaSuccess; }
static inline cudaError_t cudaSetDevice(int) { return cudaSuccess; }
static inline cudaError_t cudaStreamCreate(cudaStream_t *stream) { *stream = NULL; return cudaSuccess; }
static inline cudaError_t cudaStreamDestroy(cudaStream_t) { return cudaSuccess; }
static inline cudaError_t cudaStreamSynchronize(cudaStream_t) { return cudaSuccess; }
struct shim_event { struct timespec at; };
typedef struct shim_event *cudaEvent_t;
static inline cudaError_t cudaEventCreate(cudaEvent_t *e) { *e = (cudaEvent_t)calloc(1, sizeof **e); return cudaSuccess; }
static inline cudaError_t cudaEventDestroy(cudaEvent_t e) { free(e); return cudaSuccess; }
static inline cudaError_t cudaEventRecord(cudaEvent_t e, cudaStream_t) { clock_gettime(CLOCK_MONOTONIC, &e->at); return cudaSuccess; }
static inline cudaError_t cudaEventSynchronize(cudaEvent_t) { return cudaSuccess; }
static inline cudaError_t cudaEventElapsedTime(float *ms, cudaEvent_t from, cudaEvent_t to)
{
    *ms = (float)(1e3 * (double)(to->at.tv_sec - from->at.tv_sec) + 1e-6 * (double)(to->at.tv_nsec - from->at.tv_nsec));
    return cudaSuccess;
}
static inline cudaError_t cudaGetLastError() { return cudaSuccess; }
static inline cudaError_t cudaMemGetInfo(size_t *free, size_t *total) { *free = *total = (size_t)1 << 30; return cudaSuccess; }
static inline cudaError_t cudaFree(void *block) { free(block); return cudaSuccess; }
static inline cudaError_t cudaMalloc(void **block, size_t bytes)
{
    const char *limit = getenv("SHIM_BYTES");
    *block = bytes > (limit ? strtoull(limit, NULL, 10) : (size_t)1 << 30) ? NULL : malloc(bytes);
    if (*block) memset(*block, 0xff, bytes); /* NaN: nobody counts on cleared memory */
    return *block ? cudaSuccess : cudaErrorMemoryAllocation;
}
static inline cudaError_t cudaMemcpyAsync(void *to, const void *from, size_t bytes, cudaMemcpyKind, cudaStream_t)
{
    memcpy(to, from, bytes);
    return cudaSuccess;
}
static inline const char *cudaGetErrorString(cudaError_t e)
{
    return e == cudaErrorMemoryAllocation ? "out of memory" : e == cudaErrorNoDevice ? "no CUDA-capable device is detected"
         : e == cudaSuccess ? "no error" : "CUDA driver version is insufficient for CUDA runtime version";
}

/* What of CUB is called (src/cub.cuh): without memory of theirs, they say that they need a byte. */
#define TEPHRA_CUB_CUH
namespace cub {
struct DeviceRadixSort {
    template <typename Key, typename Value>
    static cudaError_t SortPairs(void *temporary, size_t &bytes, const Key *key, Key *key_out, const Value *value, Value *value_out,
                                 int n, int begin_bit, int end_bit, cudaStream_t)
    {
        bytes = 1;
        if (!temporary) return cudaSuccess;
        const Key mask = (Key)((end_bit < (int)(8 * sizeof(Key)) ? (Key)1 << end_bit : 0) - ((Key)1 << begin_bit));
        int32_t *place = (int32_t *)malloc((size_t)n * sizeof *place);
        for (int i = 0; i < n; i++) place[i] = i;
        shim_sort(place, (size_t)n, [=](int32_t a, int32_t b) {
            return (key[a] & mask) != (key[b] & mask) ? (key[a] & mask) < (key[b] & mask) : a < b;
        });
        for (int i = 0; i < n; i++) {
            key_out[i] = key[place[i]];
            value_out[i] = value[place[i]];
        }
        free(place);
        return cudaSuccess;
    }
};
struct DeviceScan {
    template <typename Value>
    static cudaError_t ExclusiveSum(void *temporary, size_t &bytes, const Value *value, Value *sum, int n, cudaStream_t)
    {
        bytes = 1;
        Value before = 0;
        for (int i = 0; i < n && temporary; i++) {
            const Value own = value[i];
            sum[i] = before;
            before += own;
        }
        return cudaSuccess;
    }
};
}

template <typename Call> static void shim_call(const void *call) { (*(const Call *)call)(); }

template <typename... Parameters, typename... Arguments>
static void launch(void (*kernel)(Parameters...), dim3 grid, dim3 block, cudaStream_t, Arguments... arguments)
{
    auto call = [=]() { kernel(arguments...); };
    shim_run(shim_call<decltype(call)>, &call, grid, block);
}
#endif
