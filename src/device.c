/* SPDX-License-Identifier: GPL-3.0-or-later
 * The choice of --device: what is asked for, what there is, and one line where they differ. */
#include "device.h"
#include "comm.h"
#include "fail.h"
#include "log.h"
#include <string.h>

int device_choice(const char *word)
{
    static const char *const choices[] = {[DEVICE_AUTO] = "auto", [DEVICE_CPU] = "cpu", [DEVICE_CUDA] = "cuda"};
    for (int i = 0; i < (int)(sizeof choices / sizeof *choices); i++)
        if (strcmp(word, choices[i]) == 0) return i;
    return -1;
}

struct device *device_open(enum device_choice choice)
{
    if (choice == DEVICE_CPU) return NULL;
    char why[256] = "";
    struct device *device = device_find(comm_rank(), why, sizeof why);
    if (device) {
        size_t free, total;
        device_memory(device, &free, &total);
        log_line("device: %s, %.1f of %.1f GB free", device_name(device), (double)free * 1e-9, (double)total * 1e-9);
    } else if (choice == DEVICE_CUDA) {
        fail(STATUS_INPUT, "--device cuda: %s", why);
    } else {
        log_line("device: the CPU (%s)", why);
    }
    return device;
}

void device_close(struct device *device)
{
    if (device) device_release(device);
}
