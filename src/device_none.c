/* SPDX-License-Identifier: GPL-3.0-or-later
 * A build without CUDA: there never is a device. */
#include "device.h"
#include "fail.h"
#include "integrate_rows.h"
#include <stdio.h>

struct device *device_find(int rank, char *why, size_t why_bytes)
{
    (void)rank;
    snprintf(why, why_bytes, "this program was built without CUDA");
    return NULL;
}

void device_release(struct device *device) { check(!device); }
const char *device_name(const struct device *device) { check(!device); return "none"; }
const char *device_error(struct device *device) { check(!device); return NULL; }
bool device_full(const struct device *device) { check(!device); return false; }

void device_memory(const struct device *device, size_t *free, size_t *total)
{
    check(!device);
    *free = *total = 0;
}

bool device_sound(const struct device *device) { check(!device); return true; }
void device_forgive(struct device *device) { check(!device); }
void *device_alloc(struct device *device, const char *owner, size_t bytes) { check(!device && owner && bytes); return NULL; }
void device_free(struct device *device, void *block) { check(!device && !block); }
void device_upload(struct device *device, void *to, const void *from, size_t bytes) { check(!device && to && from && bytes); }
void device_download(struct device *device, void *to, const void *from, size_t bytes) { check(!device && to && from && bytes); }
void device_copy(struct device *device, void *to, const void *from, size_t bytes) { check(!device && to && from && bytes); }

void device_gather(struct device *device, void *to, const void *from, const int32_t *order, int64_t n, size_t row_bytes)
{
    check(!device && to && from && order && n && row_bytes);
}

void integrate_launch(struct device *device, enum integrate_part part, const struct timeline *time, const struct species *rows)
{
    check(!device && part < INTEGRATE_PARTS && time && rows);
}

int device_costs(struct device *device, const struct device_cost **list)
{
    check(!device);
    *list = NULL;
    return 0;
}

int64_t device_copied(const struct device *device) { check(!device); return 0; }
