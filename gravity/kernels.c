/* SPDX-License-Identifier: GPL-3.0-or-later
 * The kernel tables by instruction set. */
#include "kernels.h"

static const struct gravity_kernels kernels[N_ISA] = {
    [ISA_V2] = {4, &gravity_pair_table_v2, &gravity_far_table_v2, &gravity_exact_table_v2, &gravity_judge_table_v2,
                &hermite_table_v2, &hermite_float_table_v2},
    [ISA_V3] = {8, &gravity_pair_table_v3, &gravity_far_table_v3, &gravity_exact_table_v3, &gravity_judge_table_v3,
                &hermite_table_v3, &hermite_float_table_v3},
    [ISA_V4] = {16, &gravity_pair_table_v4, &gravity_far_table_v4, &gravity_exact_table_v4, &gravity_judge_table_v4,
                &hermite_table_v4, &hermite_float_table_v4},
};

const struct gravity_kernels *gravity_kernels_find(enum isa isa) { return &kernels[isa]; }
