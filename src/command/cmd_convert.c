/* SPDX-License-Identifier: GPL-3.0-or-later
 * `tephra convert`: rows of a file of any format that can be read, in another that its name tells. */
#include "cmd.h"
#include "comm.h"
#include "file/formats.h"
#include "file/h5.h"
#include "file/layout.h"
#include "file/snapshot.h"
#include "file/start_file.h"
#include "file/text_file.h"
#include "log.h"
#include "mem.h"
#include "module.h"
#include "start.h"
#include <errno.h>
#include <string.h>
#include <unistd.h>

static const char usage[] = "convert IN OUT.hdf5|OUT.gadget|OUT.gadget2|OUT.csv [--force] [--set start.strip_h=on]";

static void set(struct scene *scene, struct problems *problems, const char *assignment)
{
    scene_set(scene, assignment, problems);
}

/* A scene that starts from the file, in the units of files; dimensionless if the file is. */
static struct sim *sim_of(const char *in, const struct cmd_options *options)
{
    struct problems problems = {0};
    struct scene *scene = scene_new(".");
    struct h5 *file = formats_open(in);
    char *units = h5_read_attr_text(file, "Units", "units"), *assignment = mem_format("scene", "start.file=%s", in);
    bool none = units && strcmp(units, "none") == 0;
    set(scene, &problems, none ? "units={G: 1}" : "units={length: kpc, mass: 1e10 Msun, velocity: km/s}");
    set(scene, &problems, "start={}");
    set(scene, &problems, assignment);
    for (int i = 0; i < options->n_set; i++) set(scene, &problems, options->set[i]);
    mem_free(assignment);
    mem_free(units);
    h5_close(file);
    problems_report(&problems);
    struct sim *sim = sim_new(scene, SIM_START);
    problems_report(&sim->problems);
    return sim;
}

static void write_format(const struct format *format, const struct sim *sim, const char *path)
{
    struct text_file file = text_file_open(path);
    bool written = file.stream && format->write(file.stream, sim);
    int why = errno;
    if (!written && file.stream) {
        fclose(file.stream);
        unlink(file.unfinished);
        fail(STATUS_ENVIRONMENT, "cannot write %s: %s", path, strerror(why));
    }
    if (!text_file_close(&file)) fail(STATUS_ENVIRONMENT, "cannot write %s: %s", path, strerror(errno));
}

static int convert_run(int argc, char **argv)
{
    struct cmd_options options;
    if (!cmd_parse(&options, argc, argv, "force set", usage)) return STATUS_DONE;
    if (options.n_arguments != 2) fail(STATUS_INPUT, "usage: tephra %s", usage);
    const char *in = options.argument[0], *out = options.argument[1];
    const struct format *format = formats_of_name(out);
    if (!format && !formats_is_hdf5_name(out))
        fail(STATUS_INPUT, "%s: its name tells no format: end it with .hdf5, .gadget (format 1), .gadget2 (format 2) or .csv", out);
    if (access(out, F_OK) == 0 && !options.force) fail(STATUS_INPUT, "%s exists already; --force writes over it", out);
    cmd_check_writable(out, "OUT");
    struct sim *sim = sim_of(in, &options);
    start_file_need_all(sim, in);
    start_load(sim);
    problems_report(&sim->problems);
    if (format && comm_rank() == 0) write_format(format, sim, out);
    else if (!format) snapshot_write(sim, out, SNAPSHOT_DOUBLE);
    for_species(sim, s) log_line("%s: %lld %s rows", out, (long long)s->n, species_names[s->kind]);
    sim_free(sim);
    return STATUS_DONE;
}

const struct command convert_command = {"convert", usage, "a file in another format", convert_run};
