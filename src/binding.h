/* SPDX-License-Identifier: GPL-3.0-or-later
 * Where ranks and threads may run: told in the log, so that a run on the wrong processors is seen. */
#ifndef TEPHRA_BINDING_H
#define TEPHRA_BINDING_H

/* All ranks. One line a machine, with the processors of each of its ranks, and a warning where there are more threads than
 * processors for them. */
void binding_log(void);
#endif
