/* SPDX-License-Identifier: GPL-3.0-or-later
 * A device by the CUDA runtime: memory, copies and the first fault. */
#include "device.cuh"
#include <stdio.h>
extern "C" {
#include "mem.h"
}

struct device {
    int index;
    cudaStream_t stream;
    const char *kernel;     /* launched last */
    bool full;              /* the first fault was lack of memory */
    char name[256];
    char error[512];
};

bool device_sound(const struct device *device) { return !device->error[0]; }

/* Notes a fault of `what`, unless one is noted already. */
static void note(struct device *device, cudaError_t status, const char *what)
{
    if (status != cudaSuccess && device_sound(device))
        snprintf(device->error, sizeof device->error, "%s failed on %s: %s", what, device->name,
                 cudaGetErrorString(status));
}

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

void device_upload(struct device *device, void *to, const void *from, size_t bytes)
{
    if (bytes > 0 && device_sound(device))
        note(device, cudaMemcpyAsync(to, from, bytes, cudaMemcpyHostToDevice, device->stream), "a copy to the device");
}

void device_download(struct device *device, void *to, const void *from, size_t bytes)
{
    if (bytes == 0 || !device_sound(device)) return;
    note(device, cudaMemcpyAsync(to, from, bytes, cudaMemcpyDeviceToHost, device->stream), "a copy from the device");
    note(device, cudaStreamSynchronize(device->stream), device->kernel);
}

void device_launched(struct device *device, const char *kernel)
{
    device->kernel = kernel;
    note(device, cudaGetLastError(), kernel);
}

cudaStream_t device_stream(const struct device *device) { return device->stream; }
