/* SPDX-License-Identifier: GPL-3.0-or-later
 * What .cu files know of a device beyond device.h: how to launch a kernel on it. */
#ifndef TEPHRA_DEVICE_CUH
#define TEPHRA_DEVICE_CUH
#include "launch.cuh"
extern "C" {
#include "device.h"

cudaStream_t device_stream(const struct device *device);
/* Around a launch: its time is taken; a fault of it is noted, and later ones name this kernel. */
void device_launching(struct device *device, const char *kernel);
void device_launched(struct device *device, const char *kernel);
}

template <typename... Parameters, typename... Arguments>
static void device_launch(struct device *device, const char *name, void (*kernel)(Parameters...), dim3 grid, dim3 block,
                          Arguments... arguments)
{
    if (!device_sound(device)) return;
    device_launching(device, name);
    launch(kernel, grid, block, device_stream(device), arguments...);
    device_launched(device, name);
}
#endif
