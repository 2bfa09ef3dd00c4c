/* SPDX-License-Identifier: GPL-3.0-or-later
 * The command line: finds the command and runs it. */
#include "comm.h"
#include "command/cmd.h"
#include "log.h"
#include "module.h"
#include "version.h"
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static void usage(FILE *stream)
{
    fprintf(stream, "tephra %s: a multi-phase TreeSPH program for galaxies and molecular clouds\n\n", version_number);
    for (const struct command *const *c = command_list; *c; c++)
        fprintf(stream, "  tephra %s\n      %s\n", (*c)->usage, (*c)->doc);
    fprintf(stream, "  tephra --version\n      version and build\n");
}

static int run_command(int argc, char **argv)
{
    if (argc < 2 || strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0 || strcmp(argv[1], "help") == 0) {
        usage(argc < 2 ? stderr : stdout);
        return argc < 2 ? STATUS_INPUT : STATUS_DONE;
    }
    if (strcmp(argv[1], "--version") == 0) {
        version_print(stdout);
        return STATUS_DONE;
    }
    const char *names[64];
    int count = 0;
    for (const struct command *const *c = command_list; *c; c++) {
        if (strcmp((*c)->name, argv[1]) == 0) return (*c)->run(argc - 1, argv + 1);
        names[count++] = (*c)->name;
    }
    const char *near = fail_nearest(argv[1], names, count);
    fail(STATUS_INPUT, "there is no command \"%s\"%s%s%s; `tephra --help` lists them", argv[1],
         near ? " (did you mean \"" : "", near ? near : "", near ? "\"?)" : "");
}

/* Threads that wait shall sleep instead of spinning: cores are often shared, and a step with few
 * active rows has more to wait for than to do. OpenMP reads this only when a program starts. */
static void let_threads_sleep(char **argv)
{
    if (getenv("OMP_WAIT_POLICY")) return;
    setenv("OMP_WAIT_POLICY", "passive", 1);
    execv("/proc/self/exe", argv);
}

/* What was asked for has come out, or the status says that it has not. */
static void finish_output(void)
{
    bool flushed = fflush(stdout) == 0;
    const char *why = flushed ? "" : strerror(errno);
    if (!flushed || ferror(stdout))
        fail(STATUS_ENVIRONMENT, "standard output cannot be written%s%s: make room, or lead it elsewhere", *why ? ": " : "", why);
}

int main(int argc, char **argv)
{
    let_threads_sleep(argv);
    signal(SIGXFSZ, SIG_IGN);   /* a file over the limit is then a failed write, with a message */
    comm_begin(&argc, &argv);
    log_silence(comm_rank() != 0);
    if (comm_rank() != 0 && !freopen("/dev/null", "w", stdout)) fclose(stdout);     /* told once */
    int status = run_command(argc, argv);
    finish_output();
    comm_end();
    return status;
}
