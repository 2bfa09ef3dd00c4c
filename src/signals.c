/* SPDX-License-Identifier: GPL-3.0-or-later
 * Signals: see signals.h. A handler can only leave a flag, so the two flags are static. */
#include "signals.h"
#include <signal.h>
#include <stddef.h>

static volatile sig_atomic_t stop_wanted, snapshot_wanted;

static void request_stop(int signal_number)
{
    if (signal_number == SIGINT && stop_wanted) {
        signal(SIGINT, SIG_DFL);
        raise(SIGINT);
    }
    stop_wanted = 1;
}

static void request_snapshot(int signal_number)
{
    (void)signal_number;
    snapshot_wanted = 1;
}

void signals_install(void)
{
    struct sigaction stop = {.sa_handler = request_stop, .sa_flags = SA_RESTART};
    struct sigaction snapshot = {.sa_handler = request_snapshot, .sa_flags = SA_RESTART};
    sigaction(SIGTERM, &stop, NULL);
    sigaction(SIGUSR1, &stop, NULL);
    sigaction(SIGINT, &stop, NULL);
    sigaction(SIGUSR2, &snapshot, NULL);
}

bool signals_stop(void) { return stop_wanted != 0; }

bool signals_snapshot(void)
{
    bool wanted = snapshot_wanted != 0;
    snapshot_wanted = 0;
    return wanted;
}
