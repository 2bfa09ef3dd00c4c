/* SPDX-License-Identifier: GPL-3.0-or-later
 * A device beside the CPU. device.c chooses; device_cuda.cu is built where nvcc works and
 * device_none.c elsewhere, so one program runs with and without a device.
 *
 * A fault of the device is kept, the first one, with the name of the kernel or copy that it struck;
 * every later call does nothing. So device_error is asked once, after a whole pass. */
#ifndef TEPHRA_DEVICE_H
#define TEPHRA_DEVICE_H
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct device;                      /* NULL is the CPU, and no function but device_close accepts it */

enum device_choice { DEVICE_AUTO, DEVICE_CPU, DEVICE_CUDA };

/* The choice named auto, cpu or cuda; -1 for any other word. */
int device_choice(const char *word);
/* The device of this rank, or NULL. `auto` without a usable device logs one line that says why;
 * `cuda` without one ends with STATUS_INPUT. */
struct device *device_open(enum device_choice choice);
void device_close(struct device *device);

/* Of device_cuda.cu and device_none.c. The device numbered rank modulo their number, or NULL with
 * the reason in `why`. */
struct device *device_find(int rank, char *why, size_t why_bytes);
void device_release(struct device *device);
const char *device_name(const struct device *device);
/* Bytes free now and in all. */
void device_memory(const struct device *device, size_t *free, size_t *total);
/* What went wrong first, or NULL. Waits for the work in flight. */
const char *device_error(struct device *device);
/* Nothing went wrong yet, as far as is known without waiting. */
bool device_sound(const struct device *device);
/* Whether that was lack of memory, which a run on the CPU survives. */
bool device_full(const struct device *device);
/* After lack of memory: what is there can be brought home. */
void device_forgive(struct device *device);
/* What the device has spent since the start on each kernel and on copies, in the order of their first use; waits for the work in
 * flight. bytes: copied. The list lasts until the next work. */
struct device_cost { const char *name; int64_t calls, bytes; double seconds; };
int device_costs(struct device *device, const struct device_cost **list);
/* Bytes that went over, both ways together, since the start. */
int64_t device_copied(const struct device *device);
/* Memory of the device, not cleared; NULL if it does not fit, which is an error of the device. */
void *device_alloc(struct device *device, const char *owner, size_t bytes);
void device_free(struct device *device, void *block);
void device_upload(struct device *device, void *to, const void *from, size_t bytes);
/* Waits for the work in flight. */
void device_download(struct device *device, void *to, const void *from, size_t bytes);
/* Both on the device. */
void device_copy(struct device *device, void *to, const void *from, size_t bytes);
/* to[i] = from[order[i]] for n rows of 1 or a multiple of 4 bytes, all on the device. */
void device_gather(struct device *device, void *to, const void *from, const int32_t *order, int64_t n, size_t row_bytes);
#endif
