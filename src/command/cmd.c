/* SPDX-License-Identifier: GPL-3.0-or-later
 * Options of the commands: see cmd.h. */
#include "cmd.h"
#include "comm.h"
#include "device.h"
#include "isa.h"
#include "log.h"
#include "mem.h"
#include "module.h"
#include "start.h"
#include <errno.h>
#include <getopt.h>
#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { SET = 1, OUT, RESTART, DEVICE, FORCE, THREADS, MAX_WALL, SAMPLE, REPEAT, ISA, ROFF, HELP };

static const struct option all_options[] = {
    {"set", required_argument, NULL, SET},
    {"out", required_argument, NULL, OUT},
    {"restart", required_argument, NULL, RESTART},
    {"device", required_argument, NULL, DEVICE},
    {"force", no_argument, NULL, FORCE},
    {"threads", required_argument, NULL, THREADS},
    {"max-wall", required_argument, NULL, MAX_WALL},
    {"sample", required_argument, NULL, SAMPLE},
    {"repeat", required_argument, NULL, REPEAT},
    {"isa", required_argument, NULL, ISA},
    {"roff", no_argument, NULL, ROFF},
    {0}
};
static const struct option help_option = {"help", no_argument, NULL, HELP};    /* of every command */

static bool names_word(const char *list, const char *word)
{
    size_t length = strlen(word);
    for (const char *at = strstr(list, word); at; at = strstr(at + 1, word))
        if ((at == list || at[-1] == ' ') && (at[length] == ' ' || at[length] == '\0')) return true;
    return false;
}

static int64_t whole_number(const char *text, const char *option, double low, double high)
{
    char *end;
    double value = strtod(text, &end);
    if (end == text || *end || value != floor(value) || value < low || value > high)
        fail(STATUS_INPUT, "--%s %s: must be a whole number from %.0f to %.0f", option, text, low, high);
    return (int64_t)value;
}

static void take(struct cmd_options *options, int option, const char *value)
{
    switch (option) {
    case SET:
        if (options->n_set == 64) fail(STATUS_INPUT, "--set: at most 64 of them");
        options->set[options->n_set++] = value;
        break;
    case OUT: options->out = value; break;
    case RESTART: options->restart = value; break;
    case DEVICE: options->device = value; break;
    case FORCE: options->force = true; break;
    case ROFF: options->roff = true; break;
    case THREADS: options->threads = (int)whole_number(value, "threads", 1, 4096); break;
    case SAMPLE: options->sample = whole_number(value, "sample", 1, 1e9); break;
    case REPEAT: options->repeat = whole_number(value, "repeat", 1, 1e6); break;
    case MAX_WALL: {
        char *why = units_parse_wall(value, &options->max_wall);
        if (why) fail(STATUS_INPUT, "--max-wall %s: %s", value, why);
        break;
    }
    case ISA: isa_choose(value); break;
    default: break;
    }
}

bool cmd_parse(struct cmd_options *options, int argc, char **argv, const char *accepted, const char *usage)
{
    *options = (struct cmd_options){.max_wall = INFINITY, .sample = -1, .repeat = -1};
    struct option known[sizeof all_options / sizeof *all_options + 1] = {help_option};
    int count = 1;
    for (const struct option *o = all_options; o->name; o++)
        if (names_word(accepted, o->name)) known[count++] = *o;
    optind = 1;
    opterr = 0;
    int option;
    while ((option = getopt_long(argc, argv, "h", known, NULL)) != -1) {
        if (option == HELP || option == 'h') {
            printf("usage: tephra %s\n", usage);
            return false;
        }
        if (option == '?') fail(STATUS_INPUT, "%s: not an option, or its value is missing; usage: tephra %s",
                                argv[optind - 1], usage);
        take(options, option, optarg);
    }
    for (; optind < argc; optind++) {
        if (options->n_arguments == CMD_ARGUMENTS) fail(STATUS_INPUT, "too many arguments; usage: tephra %s", usage);
        options->argument[options->n_arguments++] = argv[optind];
    }
    return true;
}

void cmd_set_threads(const struct cmd_options *options)
{
    int threads = options->threads;
    if (threads == 0 && !getenv("OMP_NUM_THREADS")) threads = comm_processors();
    if (threads > 0) omp_set_num_threads(threads);
}

void cmd_open_device(const struct cmd_options *options, struct sim *sim)
{
    int choice = options->device ? device_choice(options->device) : DEVICE_AUTO;
    if (choice < 0) fail(STATUS_INPUT, "--device %s: expects auto, cpu or cuda", options->device);
    sim->device = device_open((enum device_choice)choice);
    sim->device_needed = choice == DEVICE_CUDA;
    double everywhere = sim->device != NULL;    /* modules decide by it, and all ranks must decide alike */
    comm_min(&everywhere, 1);
    if (sim->device && !(everywhere > 0)) {
        log_line("device: another rank found none: all compute on the CPU");
        device_close(sim->device);
        sim->device = NULL;
    }
}

struct scene *cmd_scene(const struct cmd_options *options, const char *path)
{
    struct problems problems = {0};
    struct scene *scene = scene_read(path, &problems);
    problems_report(&problems);
    for (int i = 0; i < options->n_set; i++) scene_set(scene, options->set[i], &problems);
    problems_report(&problems);
    return scene;
}

struct sim *cmd_sim(struct scene *scene)
{
    struct sim *sim = sim_new(scene, SIM_RUN);
    problems_report(&sim->problems);
    start_load(sim);
    problems_report(&sim->problems);
    return sim;
}

void cmd_check_writable(const char *path, const char *option)
{
    if (comm_rank() != 0) return;
    struct stat status;
    char *probe = mem_format("files", "%s.tmp", path);
    bool folder = stat(path, &status) == 0 && S_ISDIR(status.st_mode);
    FILE *file = folder ? NULL : fopen(probe, "a");
    if (!file) fail(STATUS_INPUT, "%s: cannot be written: %s (%s names another)", path,
                    folder ? "it is a folder" : strerror(errno), option);
    fclose(file);
    unlink(probe);
    mem_free(probe);
}
