/* SPDX-License-Identifier: GPL-3.0-or-later
 * The kernel tables and the choice among them at run time. */
#include "kernels.h"
#include <stddef.h>
#include <string.h>

static const struct gravity_kernels kernels[] = {
    { "v4", 16, &gravity_pair_table_v4, &gravity_far_table_v4, &gravity_exact_table_v4, &gravity_judge_table_v4 },
    { "v3", 8, &gravity_pair_table_v3, &gravity_far_table_v3, &gravity_exact_table_v3, &gravity_judge_table_v3 },
    { "v2", 4, &gravity_pair_table_v2, &gravity_far_table_v2, &gravity_exact_table_v2, &gravity_judge_table_v2 },
};

static bool kernels_run(const struct gravity_kernels *k)
{
    __builtin_cpu_init();
    bool v3 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi2");
    bool v4 = v3 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl")
           && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw");
    return k->lanes == 16 ? v4 : k->lanes == 8 ? v3 : true;
}

const struct gravity_kernels *gravity_kernels_find(const char *isa)
{
    for (size_t i = 0; i < sizeof kernels / sizeof *kernels; i++)
        if ((isa == NULL || strcmp(isa, kernels[i].isa) == 0) && kernels_run(&kernels[i])) return &kernels[i];
    return NULL;
}
