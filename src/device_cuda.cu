/* SPDX-License-Identifier: GPL-3.0-or-later
 * A device by the CUDA runtime: memory, copies and the first fault. */
#include "device.cuh"
#include <stdio.h>
#include <string.h>
extern "C" {
#include "mem.h"
}

/* Launches and copies whose times are not read yet: between two events each. */
enum { PENDING = 256, COSTS = 128 };
struct pending { cudaEvent_t from, to; int cost; };

struct device {
    int index;
    cudaStream_t stream;
    const char *kernel;     /* launched last */
    bool full;              /* the first fault was lack of memory */
    char name[256];
    char error[512];
    struct pending pending[PENDING];
    int n_pending, n_costs;
    int64_t copied;
    struct device_cost cost[COSTS];
};

bool device_sound(const struct device *device) { return !device->error[0]; }

/* Notes a fault of `what`, unless one is noted already. */
static void note(struct device *device, cudaError_t status, const char *what)
{
    if (status != cudaSuccess && device_sound(device))
        snprintf(device->error, sizeof device->error, "%s failed on %s: %s", what, device->name,
                 cudaGetErrorString(status));
}

/* Where the costs of what has this name stand. */
static int cost_of(struct device *device, const char *name)
{
    for (int c = 0; c < device->n_costs; c++)
        if (device->cost[c].name == name || strcmp(device->cost[c].name, name) == 0) return c;
    if (device->n_costs == COSTS) return COSTS - 1;
    device->cost[device->n_costs].name = name;
    return device->n_costs++;
}

/* Reads the times of all that has been begun. */
static void settle(struct device *device)
{
    for (int p = 0; p < device->n_pending; p++) {
        float milliseconds = 0;
        cudaEventSynchronize(device->pending[p].to);
        if (cudaEventElapsedTime(&milliseconds, device->pending[p].from, device->pending[p].to) == cudaSuccess)
            device->cost[device->pending[p].cost].seconds += 1e-3 * (double)milliseconds;
    }
    device->n_pending = 0;
}

static void begin(struct device *device, const char *name, size_t bytes)
{
    if (device->n_pending == PENDING) settle(device);
    struct pending *p = &device->pending[device->n_pending];
    p->cost = cost_of(device, name);
    device->cost[p->cost].calls++;
    device->cost[p->cost].bytes += (int64_t)bytes;
    if (!p->from) note(device, cudaEventCreate(&p->from), name);
    if (!p->to) note(device, cudaEventCreate(&p->to), name);
    if (device_sound(device)) note(device, cudaEventRecord(p->from, device->stream), name);
}

static void end(struct device *device)
{
    struct pending *p = &device->pending[device->n_pending];
    if (!device_sound(device)) return;
    note(device, cudaEventRecord(p->to, device->stream), device->cost[p->cost].name);
    device->n_pending++;
}

int device_costs(struct device *device, const struct device_cost **list)
{
    settle(device);
    *list = device->cost;
    return device->n_costs;
}

int64_t device_copied(const struct device *device) { return device->copied; }

struct device *device_find(int rank, char *why, size_t why_bytes)
{
    int count = 0;
    cudaError_t status = cudaGetDeviceCount(&count);
    if (status == cudaErrorInsufficientDriver) {
        snprintf(why, why_bytes, "no NVIDIA driver, or one too old for CUDA %d.%d", CUDART_VERSION / 1000,
                 CUDART_VERSION / 10 % 100);
        return NULL;
    }
    if (status != cudaSuccess || count == 0) {
        snprintf(why, why_bytes, "no NVIDIA device: %s", cudaGetErrorString(status ? status : cudaErrorNoDevice));
        return NULL;
    }
    struct device *device = (struct device *)mem_alloc("device", sizeof *device);
    device->index = rank % count;
    cudaDeviceProp properties;
    status = cudaGetDeviceProperties(&properties, device->index);
    if (status == cudaSuccess) status = cudaSetDevice(device->index);
    if (status == cudaSuccess) status = cudaStreamCreate(&device->stream);
    if (status != cudaSuccess) {
        snprintf(why, why_bytes, "device %d cannot be used: %s", device->index, cudaGetErrorString(status));
        mem_free(device);
        return NULL;
    }
    snprintf(device->name, sizeof device->name, "%s", properties.name);
    device->kernel = "the device";
    return device;
}

void device_release(struct device *device)
{
    for (int p = 0; p < PENDING; p++) {
        if (device->pending[p].from) cudaEventDestroy(device->pending[p].from);
        if (device->pending[p].to) cudaEventDestroy(device->pending[p].to);
    }
    cudaStreamDestroy(device->stream);
    mem_free(device);
}

const char *device_name(const struct device *device) { return device->name; }

void device_memory(const struct device *, size_t *free, size_t *total)
{
    if (cudaMemGetInfo(free, total) != cudaSuccess) *free = *total = 0;
}

const char *device_error(struct device *device)
{
    note(device, cudaStreamSynchronize(device->stream), device->kernel);
    return device_sound(device) ? NULL : device->error;
}

bool device_full(const struct device *device) { return device->full; }

void device_forgive(struct device *device)
{
    if (device->full) device->error[0] = '\0';
}

void *device_alloc(struct device *device, const char *owner, size_t bytes)
{
    void *block = NULL;
    size_t free, total;
    if (!device_sound(device)) return NULL;
    if (cudaMalloc(&block, bytes) == cudaSuccess) return block;
    device->full = true;
    device_memory(device, &free, &total);
    snprintf(device->error, sizeof device->error, "%s needs %.2f GB on %s, where %.2f GB are free", owner,
             (double)bytes * 1e-9, device->name, (double)free * 1e-9);
    return NULL;
}

void device_free(struct device *device, void *block)
{
    if (block) note(device, cudaFree(block), "giving memory back");
}

static void copy(struct device *device, const char *name, void *to, const void *from, size_t bytes, cudaMemcpyKind kind)
{
    if (bytes == 0 || !device_sound(device)) return;
    begin(device, name, bytes);
    note(device, cudaMemcpyAsync(to, from, bytes, kind, device->stream), name);
    end(device);
    device->copied += kind == cudaMemcpyDeviceToDevice ? 0 : (int64_t)bytes;
}

void device_upload(struct device *device, void *to, const void *from, size_t bytes)
{
    copy(device, "copies to the device", to, from, bytes, cudaMemcpyHostToDevice);
}

void device_download(struct device *device, void *to, const void *from, size_t bytes)
{
    copy(device, "copies from the device", to, from, bytes, cudaMemcpyDeviceToHost);
    if (bytes > 0 && device_sound(device)) note(device, cudaStreamSynchronize(device->stream), device->kernel);
}

void device_copy(struct device *device, void *to, const void *from, size_t bytes)
{
    copy(device, "copies on the device", to, from, bytes, cudaMemcpyDeviceToDevice);
}

/* A thread a word: to[i] = from[order[i]] for rows of so many words. */
template <typename word>
static __global__ void __launch_bounds__(256) device_gather_rows(word *to, const word *from, const int32_t *order, int64_t n,
                                                                 int words)
{
    const int64_t w = (int64_t)blockIdx.x * blockDim.x + threadIdx.x, row = w / words;
    if (row < n) to[w] = from[(int64_t)order[row] * words + w % words];
}

void device_gather(struct device *device, void *to, const void *from, const int32_t *order, int64_t n, size_t row_bytes)
{
    enum { BLOCK = 256 };
    const bool bytes = row_bytes == 1;
    const int words = bytes ? 1 : (int)(row_bytes / sizeof(uint32_t));
    const dim3 grid((unsigned)((n * words + BLOCK - 1) / BLOCK)), block(BLOCK);
    if (n == 0) return;
    if (bytes)
        device_launch(device, "device_gather_rows", device_gather_rows<uint8_t>, grid, block, (uint8_t *)to, (const uint8_t *)from,
                      order, n, words);
    else
        device_launch(device, "device_gather_rows", device_gather_rows<uint32_t>, grid, block, (uint32_t *)to,
                      (const uint32_t *)from, order, n, words);
}

void device_launching(struct device *device, const char *kernel) { begin(device, kernel, 0); }

void device_launched(struct device *device, const char *kernel)
{
    device->kernel = kernel;
    note(device, cudaGetLastError(), kernel);
    end(device);
}

cudaStream_t device_stream(const struct device *device) { return device->stream; }
