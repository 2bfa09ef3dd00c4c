/* SPDX-License-Identifier: GPL-3.0-or-later
 * The host shim itself: barriers, warp exchanges, votes and ordered compaction as a device does them. */
#include "launch.cuh"
#include <stdint.h>
extern "C" {
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
}
#include <signal.h>
#include <sys/wait.h>
#include <stdio.h>
#include <unistd.h>

/* Sum over a block: by exchange within a warp, by shared memory between warps. */
static __global__ void sum_block(const int *value, int *sum)
{
    __shared__ int part[32];
    int thread = (int)threadIdx.x, i = (int)(blockIdx.x * blockDim.x) + thread, x = value[i];
    for (int lanes = 16; lanes > 0; lanes /= 2) x += __shfl_xor_sync(~0u, x, lanes);
    if (thread % warpSize == 0) part[thread / warpSize] = x;
    __syncthreads();
    if (thread == 0)
        for (int w = 0; w < (int)blockDim.x / warpSize; w++) sum[blockIdx.x] += part[w];
}

static void test_sum(void **)
{
    static int value[8 * 128], sum[8];
    for (int i = 0; i < 8 * 128; i++) value[i] = i * i % 1009;
    launch(sum_block, dim3(8), dim3(128), cudaStream_t(), (const int *)value, (int *)sum);
    for (int b = 0; b < 8; b++) {
        int expected = 0;
        for (int i = 0; i < 128; i++) expected += value[b * 128 + i];
        assert_int_equal(sum[b], expected);
    }
}

/* Multiples of 3 in order, by vote and count of the lanes before. */
static __global__ void compact(const int *value, int n, int *out, int *count)
{
    int base = 0;
    for (int from = 0; from < n; from += warpSize) {
        int i = from + (int)threadIdx.x, keep = i < n && value[i] % 3 == 0;
        unsigned votes = __ballot_sync(~0u, keep);
        if (keep) out[base + __popc(votes & ((1u << threadIdx.x) - 1))] = value[i];
        base += __popc(votes);
    }
    if (threadIdx.x == 0) *count = base;
}

static void test_compaction(void **)
{
    static int value[1000], out[1000];
    int count = 0, expected = 0;
    for (int i = 0; i < 1000; i++) value[i] = i * 7 % 1000;
    launch(compact, dim3(1), dim3(32), cudaStream_t(), (const int *)value, 1000, (int *)out, &count);
    for (int i = 0; i < 1000; i++)
        if (value[i] % 3 == 0) assert_int_equal(out[expected++], value[i]);
    assert_int_equal(count, expected);
}

/* Shifts of lanes, and votes of a warp some of whose lanes have ended. */
static __global__ void shift(int *up, int *down, int *votes)
{
    int lane = (int)threadIdx.x;
    if (lane >= 20) return;
    up[lane] = __shfl_up_sync(0xfffffu, lane, 3);
    down[lane] = __shfl_down_sync(0xfffffu, lane, 3);
    votes[lane] = (int)__ballot_sync(0xfffffu, lane & 1);
}

static void test_shift(void **)
{
    int up[20], down[20], votes[20];
    launch(shift, dim3(1), dim3(32), cudaStream_t(), (int *)up, (int *)down, (int *)votes);
    for (int i = 0; i < 20; i++) {
        assert_int_equal(up[i], i < 3 ? i : i - 3);
        if (i < 17) assert_int_equal(down[i], i + 3);
        assert_int_equal(votes[i], 0xaaaaa);
    }
}

/* A barrier in one branch only ends the program instead of hanging it. */
static __global__ void diverge() {
    if (threadIdx.x < 40) __syncthreads();
    else __syncwarp();
    __syncthreads();
}

static void test_divergence(void **)
{
    pid_t child = fork();
    if (child == 0) {
        if (!freopen("/dev/null", "w", stderr)) _exit(1);
        launch(diverge, dim3(1), dim3(64), cudaStream_t());
        _exit(0);
    }
    int status = 0;
    waitpid(child, &status, 0);
    assert_true(WIFSIGNALED(status) && WTERMSIG(status) == SIGABRT);
}

int main()
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sum),
        cmocka_unit_test(test_compaction),
        cmocka_unit_test(test_shift),
        cmocka_unit_test(test_divergence),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
