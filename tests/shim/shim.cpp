// SPDX-License-Identifier: GPL-3.0-or-later
// Fibers of the host shim (launch.cuh): a stack for each thread of the block. A fiber runs until it
// meets a barrier of its block or of its warp, or ends; the scheduler lets a barrier pass when every
// thread that it joins has come, and ends the program when threads wait at different ones.
#include "launch.cuh"
#include <stdint.h>
#include <stdio.h>

// Leaves a stack for another: what a function must keep (System V ABI for x86-64) goes on the one, *from, and comes back from
// the other. (swapcontext asks the kernel for the signal mask each time: seven times slower.)
extern "C" void shim_switch(void **from, void *to);
__asm__(".text\n.globl shim_switch\n.type shim_switch, @function\nshim_switch:\n"
        "pushq %rbp\npushq %rbx\npushq %r12\npushq %r13\npushq %r14\npushq %r15\n"
        "movq %rsp, (%rdi)\nmovq %rsi, %rsp\n"
        "popq %r15\npopq %r14\npopq %r13\npopq %r12\npopq %rbx\npopq %rbp\nret\n"
        ".size shim_switch, .-shim_switch\n");

enum { THREADS_MAX = 1024, STACK_BYTES = 64 << 10 };
enum state { READY, AT_BLOCK, AT_WARP, ENDED };

struct fiber {
    void *stack;
    enum state state;
    alignas(16) char given[16];
};

dim3 threadIdx, blockIdx, blockDim, gridDim;

static struct {
    struct fiber fiber[THREADS_MAX];
    char *stacks;
    void *scheduler;
    int threads, now;
    void (*body)(const void *);
    const void *context;
} shim;

static void fiber_main()
{
    shim.body(shim.context);
    shim.fiber[shim.now].state = ENDED;
    shim_switch(&shim.fiber[shim.now].stack, shim.scheduler);
}

static void fiber_wait(enum state where)
{
    int self = shim.now;
    shim.fiber[self].state = where;
    shim_switch(&shim.fiber[self].stack, shim.scheduler);
}

static void fiber_resume(int i)
{
    shim.now = i;
    threadIdx = dim3((unsigned)i % blockDim.x, (unsigned)i / blockDim.x % blockDim.y, (unsigned)i / blockDim.x / blockDim.y);
    shim_switch(&shim.scheduler, shim.fiber[i].stack);
}

// Makes the threads [from, to) ready if all of them that have not ended wait at `where`.
static bool pass(enum state where, int from, int to)
{
    for (int i = from; i < to; i++)
        if (shim.fiber[i].state != where && shim.fiber[i].state != ENDED) return false;
    bool any = false;
    for (int i = from; i < to; i++)
        if (shim.fiber[i].state == where) {
            shim.fiber[i].state = READY;
            any = true;
        }
    return any;
}

static bool pass_barriers()
{
    bool any = pass(AT_BLOCK, 0, shim.threads);
    for (int from = 0; from < shim.threads; from += warpSize)
        any = pass(AT_WARP, from, min(from + warpSize, shim.threads)) || any;
    return any;
}

// As if fiber_main had just been called: the stack pointer is 8 above a multiple of 16 there.
static void fiber_start(struct fiber *f, char *stack)
{
    enum { KEPT = 6 };
    uint64_t *top = (uint64_t *)(stack + STACK_BYTES - 16);
    *--top = 0;
    *--top = (uint64_t)(uintptr_t)fiber_main;
    for (int i = 0; i < KEPT; i++) *--top = 0;
    f->stack = top;
    f->state = READY;
}

static void run_block()
{
    for (int i = 0; i < shim.threads; i++) fiber_start(&shim.fiber[i], shim.stacks + (size_t)i * STACK_BYTES);
    do {
        for (int i = 0; i < shim.threads; i++)
            if (shim.fiber[i].state == READY) fiber_resume(i);
    } while (pass_barriers());
    for (int i = 0; i < shim.threads; i++)
        if (shim.fiber[i].state != ENDED) {
            fprintf(stderr, "shim: thread %d of block (%u, %u) waits at a barrier that not every thread reaches\n", i,
                    blockIdx.x, blockIdx.y);
            abort();
        }
}

void shim_run(void (*body)(const void *), const void *context, dim3 grid, dim3 block)
{
    shim.body = body;
    shim.context = context;
    shim.threads = (int)(block.x * block.y * block.z);
    if (shim.threads > THREADS_MAX) {
        fprintf(stderr, "shim: %d threads in a block, at most %d\n", shim.threads, THREADS_MAX);
        abort();
    }
    shim.stacks = (char *)malloc((size_t)shim.threads * STACK_BYTES);
    gridDim = grid;
    blockDim = block;
    for (unsigned z = 0; z < grid.z; z++)
        for (unsigned y = 0; y < grid.y; y++)
            for (unsigned x = 0; x < grid.x; x++) {
                blockIdx = dim3(x, y, z);
                run_block();
            }
    free(shim.stacks);
}

void __syncthreads() { fiber_wait(AT_BLOCK); }
void __syncwarp(unsigned) { fiber_wait(AT_WARP); }

void shim_exchange(const void *give, void *take, size_t bytes, int lane)
{
    memcpy(shim.fiber[shim.now].given, give, bytes);
    fiber_wait(AT_WARP);
    memcpy(take, shim.fiber[(shim.now & -warpSize) + lane].given, bytes);
    fiber_wait(AT_WARP);
}

unsigned __ballot_sync(unsigned mask, int predicate)
{
    unsigned votes = 0;
    shim.fiber[shim.now].given[0] = predicate != 0;
    fiber_wait(AT_WARP);
    for (int lane = 0, first = shim.now & -warpSize; lane < warpSize && first + lane < shim.threads; lane++)
        if (mask >> lane & 1 && shim.fiber[first + lane].state != ENDED)
            votes |= (unsigned)shim.fiber[first + lane].given[0] << lane;
    fiber_wait(AT_WARP);
    return votes;
}
