/* SPDX-License-Identifier: GPL-3.0-or-later
 * What the processor can do, and the choice of --isa. */
#include "isa.h"
#include "fail.h"
#include <string.h>

const char *const isa_names[N_ISA] = {"v2", "v3", "v4"};

static int chosen = -1;

bool isa_runs(enum isa isa)
{
    __builtin_cpu_init();
    bool v3 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi2");
    bool v4 = v3 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl")
           && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw");
    return isa == ISA_V4 ? v4 : isa == ISA_V3 ? v3 : true;
}

enum isa isa_now(void)
{
    if (chosen >= 0) return (enum isa)chosen;
    return isa_runs(ISA_V4) ? ISA_V4 : isa_runs(ISA_V3) ? ISA_V3 : ISA_V2;
}

void isa_choose(const char *word)
{
    for (int i = 0; i < N_ISA; i++) {
        if (strcmp(word, isa_names[i]) != 0) continue;
        if (!isa_runs((enum isa)i)) fail(STATUS_INPUT, "--isa %s: this processor does not have x86-64-%s", word, word);
        chosen = i;
        return;
    }
    fail(STATUS_INPUT, "--isa %s: expects v2, v3 or v4", word);
}
