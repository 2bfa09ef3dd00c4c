/* SPDX-License-Identifier: GPL-3.0-or-later
 * Memory by owner. Each block is preceded by a record of its owner and size; the owners' sums stand
 * in one small table behind a mutex. calloc leaves fresh pages untouched, so that the thread that
 * works on a large column is the one that places it. Reserved blocks are maps of their own, whose pages the
 * system gives when they are touched. */
#define _DEFAULT_SOURCE     /* MAP_ANONYMOUS, madvise */
#include "mem.h"
#include "fail.h"
#include <pthread.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>

enum { ALIGNMENT = 64, MAX_OWNERS = 64, PAGE = 4096 };

struct owner { const char *name; size_t now, peak; };

/* Stands in the ALIGNMENT bytes before the block. used: of a reserved block, which of its pages are in use (and counted
 * in `bytes`); mapped: bytes from raw on. */
struct record { void *raw; size_t bytes; struct owner *owner; unsigned char *used; size_t mapped; };

static struct {
    pthread_mutex_t lock;
    struct owner owner[MAX_OWNERS];
    int n;
    size_t now, peak;
} ledger = {.lock = PTHREAD_MUTEX_INITIALIZER};

static struct record *record_of(void *block)
{
    return (struct record *)(void *)((char *)block - ALIGNMENT);
}

/* The owner's row; beyond the table's end all share the last. The lock is held. */
static struct owner *find_owner(const char *name)
{
    for (int i = 0; i < ledger.n; i++)
        if (strcmp(ledger.owner[i].name, name) == 0) return &ledger.owner[i];
    if (ledger.n == MAX_OWNERS) return &ledger.owner[MAX_OWNERS - 1];
    ledger.owner[ledger.n].name = ledger.n < MAX_OWNERS - 1 ? name : "others";
    return &ledger.owner[ledger.n++];
}

static struct owner *book(const char *name, size_t gained, size_t lost)
{
    pthread_mutex_lock(&ledger.lock);
    struct owner *owner = find_owner(name);
    owner->now += gained - lost;
    ledger.now += gained - lost;
    if (owner->now > owner->peak) owner->peak = owner->now;
    if (ledger.now > ledger.peak) ledger.peak = ledger.now;
    pthread_mutex_unlock(&ledger.lock);
    return owner;
}

static size_t raw_bytes(const char *owner, size_t bytes)
{
    if (bytes > PTRDIFF_MAX - 2 * ALIGNMENT)
        fail(STATUS_FAULT, "%s asked for %zu bytes of memory, more than can exist", owner, bytes);
    return bytes + 2 * ALIGNMENT;
}

static _Noreturn void fail_memory(const char *owner, size_t bytes)
{
    fail(STATUS_ENVIRONMENT, "out of memory: %s asked for %.1f MB while %.1f MB are held",
         owner, 1e-6 * (double)bytes, 1e-6 * (double)mem_now());
}

static void *block_in(void *raw)
{
    uintptr_t start = (uintptr_t)raw + ALIGNMENT;
    return (char *)raw + ALIGNMENT + (ALIGNMENT - start % ALIGNMENT) % ALIGNMENT;
}

void *mem_alloc(const char *owner, size_t bytes)
{
    if (bytes == 0) return NULL;
    void *raw = calloc(1, raw_bytes(owner, bytes));
    if (!raw) fail_memory(owner, bytes);
    void *block = block_in(raw);
    *record_of(block) = (struct record){raw, bytes, book(owner, bytes, 0), NULL, 0};
    return block;
}

void *mem_reserve(const char *owner, size_t bytes)
{
    if (bytes == 0) return NULL;
    const size_t pages = (bytes + PAGE - 1) / PAGE, mapped = (pages + 1) * PAGE;
    void *raw = mmap(NULL, mapped, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (raw == MAP_FAILED) fail_memory(owner, bytes);
    void *block = (char *)raw + PAGE;
    *record_of(block) = (struct record){raw, 0, book(owner, 0, 0), mem_alloc(owner, (pages + 7) / 8), mapped};
    return block;
}

void mem_use(void *block, size_t from, size_t to)
{
    if (!block || from >= to || !record_of(block)->used) return;
    struct record *record = record_of(block);
    size_t gained = 0;
    for (size_t page = from / PAGE; page <= (to - 1) / PAGE; page++) {
        const unsigned bit = 1u << (page & 7);
        gained += record->used[page >> 3] & bit ? 0 : PAGE;
        record->used[page >> 3] = (unsigned char)(record->used[page >> 3] | bit);
    }
    record->bytes += gained;
    book(record->owner->name, gained, 0);
}

void mem_drop(void *block, size_t from, size_t to)
{
    if (!block || from >= to || !record_of(block)->used) return;
    struct record *record = record_of(block);
    const size_t first = (from + PAGE - 1) / PAGE, end = to / PAGE;
    size_t lost = 0;
    for (size_t page = first; page < end; page++) {
        const unsigned bit = 1u << (page & 7);
        if (!(record->used[page >> 3] & bit)) continue;
        size_t next = page;
        for (; next < end && record->used[next >> 3] >> (next & 7) & 1; next++)
            record->used[next >> 3] = (unsigned char)(record->used[next >> 3] & ~(1u << (next & 7)));
        madvise((char *)block + page * PAGE, (next - page) * PAGE, MADV_DONTNEED);
        lost += (next - page) * PAGE;
        page = next;
    }
    record->bytes -= lost;
    book(record->owner->name, 0, lost);
}

void *mem_resize(const char *owner, void *block, size_t bytes)
{
    if (!block) return mem_alloc(owner, bytes);
    if (bytes == 0) {
        mem_free(block);
        return NULL;
    }
    struct record old = *record_of(block);
    check(!old.used);
    ptrdiff_t offset = (char *)block - (char *)old.raw;
    void *raw = realloc(old.raw, raw_bytes(owner, bytes));
    if (!raw) fail_memory(owner, bytes);
    void *moved = block_in(raw);
    char *contents = (char *)raw + offset;
    if (moved != contents) memmove(moved, contents, old.bytes < bytes ? old.bytes : bytes);
    book(old.owner->name, 0, old.bytes);
    *record_of(moved) = (struct record){raw, bytes, book(owner, bytes, 0), NULL, 0};
    return moved;
}

void mem_free(void *block)
{
    if (!block) return;
    struct record old = *record_of(block);
    book(old.owner->name, 0, old.bytes);
    mem_free(old.used);
    if (old.mapped) munmap(old.raw, old.mapped);
    else free(old.raw);
}

char *mem_text(const char *owner, const char *text)
{
    size_t bytes = strlen(text) + 1;
    return memcpy(mem_alloc(owner, bytes), text, bytes);
}

char *mem_vformat(const char *owner, const char *format, va_list arguments)
{
    va_list again;
    va_copy(again, arguments);
    size_t bytes = (size_t)vsnprintf(NULL, 0, format, again) + 1;
    va_end(again);
    char *text = mem_alloc(owner, bytes);
    vsnprintf(text, bytes, format, arguments);
    return text;
}

char *mem_format(const char *owner, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    char *text = mem_vformat(owner, format, arguments);
    va_end(arguments);
    return text;
}

size_t mem_now(void)
{
    pthread_mutex_lock(&ledger.lock);
    size_t now = ledger.now;
    pthread_mutex_unlock(&ledger.lock);
    return now;
}

size_t mem_peak(void)
{
    pthread_mutex_lock(&ledger.lock);
    size_t peak = ledger.peak;
    pthread_mutex_unlock(&ledger.lock);
    return peak;
}

size_t mem_restart_peak(void)
{
    pthread_mutex_lock(&ledger.lock);
    const size_t peak = ledger.peak;
    ledger.peak = ledger.now;
    pthread_mutex_unlock(&ledger.lock);
    return peak;
}

size_t mem_process_peak(void)
{
    struct rusage usage;
    return getrusage(RUSAGE_SELF, &usage) == 0 ? (size_t)usage.ru_maxrss * 1024 : 0;
}

void mem_report(FILE *stream)
{
    pthread_mutex_lock(&ledger.lock);
    fprintf(stream, "%-16s %12s %12s\n", "memory of", "now [MB]", "highest");
    for (int i = 0; i < ledger.n; i++) {
        const struct owner *owner = &ledger.owner[i];
        fprintf(stream, "%-16s %12.3f %12.3f\n", owner->name, 1e-6 * (double)owner->now, 1e-6 * (double)owner->peak);
    }
    fprintf(stream, "%-16s %12.3f %12.3f\n", "all", 1e-6 * (double)ledger.now, 1e-6 * (double)ledger.peak);
    pthread_mutex_unlock(&ledger.lock);
}
