/* SPDX-License-Identifier: GPL-3.0-or-later
 * What the commands that work on a scene have in common: their options. */
#ifndef TEPHRA_CMD_H
#define TEPHRA_CMD_H
#include "sim.h"

enum { CMD_ARGUMENTS = 32 };

struct cmd_options {
    const char *argument[CMD_ARGUMENTS]; int n_arguments;   /* what is not an option */
    const char *set[64]; int n_set;             /* --set block.key=value, in order */
    const char *out, *restart, *device;
    bool force, roff;
    int threads;                                /* 0 = not given */
    double max_wall;                            /* seconds; INFINITY = not given */
    int64_t sample, repeat;                     /* force-test; -1 = not given */
};

/* Reads the options that `accepted` names ("set threads out"); anything else ends with STATUS_INPUT
 * and the command's usage. False after --help or -h, which print the usage: nothing is left to do. */
bool cmd_parse(struct cmd_options *options, int argc, char **argv, const char *accepted, const char *usage);
/* Threads of this rank: as asked, else OMP_NUM_THREADS, else the cores shared among the ranks. */
void cmd_set_threads(const struct cmd_options *options);
/* Scene with --set applied; syntax errors end the program. */
struct scene *cmd_scene(const struct cmd_options *options, const char *path);
/* A simulation of that scene with its rows; ends the program on mistakes. */
struct sim *cmd_sim(struct scene *scene);
/* The device as asked by --device (auto), for the modules to use from sim_begin on. */
void cmd_open_device(const struct cmd_options *options, struct sim *sim);
/* Ends the program with STATUS_INPUT where a file could not be made under that name; option: what names another. */
void cmd_check_writable(const char *path, const char *option);
#endif
