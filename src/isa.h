/* SPDX-License-Identifier: GPL-3.0-or-later
 * The instruction set of the kernels, which are compiled for x86-64-v2, v3 and v4. */
#ifndef TEPHRA_ISA_H
#define TEPHRA_ISA_H
#include <stdbool.h>

enum isa { ISA_V2, ISA_V3, ISA_V4, N_ISA };
extern const char *const isa_names[N_ISA];

/* Whether this processor runs it. */
bool isa_runs(enum isa isa);
/* The one in use: the highest that runs, or what isa_choose set. */
enum isa isa_now(void);
/* For the whole program, before any module is made (--isa); ends with STATUS_INPUT if the word names
 * none or the processor lacks it. */
void isa_choose(const char *word);
#endif
