/* SPDX-License-Identifier: GPL-3.0-or-later
 * Requests from outside: SIGTERM, SIGUSR1 and SIGINT stop a run with a checkpoint (a second SIGINT
 * ends it at once), SIGUSR2 asks for a snapshot at the next full synchronisation. */
#ifndef TEPHRA_SIGNALS_H
#define TEPHRA_SIGNALS_H
#include <stdbool.h>

void signals_install(void);
bool signals_stop(void);
/* True once for each request. */
bool signals_snapshot(void);
#endif
