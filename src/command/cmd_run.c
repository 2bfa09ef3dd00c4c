/* SPDX-License-Identifier: GPL-3.0-or-later
 * `tephra run`: a run from its scene, or its continuation from a checkpoint. */
#include "binding.h"
#include "cmd.h"
#include "comm.h"
#include "file/checkpoint.h"
#include "file/series.h"
#include "file/text_file.h"
#include "log.h"
#include "mem.h"
#include "module.h"
#include "output.h"
#include "ranks.h"
#include "run.h"
#include "signals.h"
#include "start.h"
#include "version.h"
#include <dirent.h>
#include <errno.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const char usage[] =
    "run SCENE.yml [--out DIR] [--force] [--set block.key=value] [--threads N] [--device auto|cpu|cuda] "
    "[--isa v2|v3|v4] [--max-wall 3h] | run --restart DIR [--set ...]";

static char *text_join(const char *a, const char *b)
{
    char *text = mem_alloc("frame", strlen(a) + strlen(b) + 1);
    return strcat(strcpy(text, a), b);
}

/* ./SCENE for path/to/SCENE.yml. */
static char *default_folder(const char *scene)
{
    const char *name = strrchr(scene, '/') ? strrchr(scene, '/') + 1 : scene;
    const char *dot = strrchr(name, '.');
    size_t length = dot && dot > name ? (size_t)(dot - name) : strlen(name);
    char *folder = mem_alloc("frame", length + 1);
    memcpy(folder, name, length);
    return folder;
}

/* STEM_NNN.csv, .hdf5 or .png. */
static bool numbered(const char *name, const char *stem)
{
    static const char *const endings[] = {".csv", ".hdf5", ".png"};
    const size_t length = strlen(stem);
    if (strncmp(name, stem, length) != 0 || name[length] != '_') return false;
    const size_t digits = strspn(name + length + 1, "0123456789");
    bool known = false;
    for (int e = 0; e < 3; e++) known = known || strcmp(name + length + 1 + digits, endings[e]) == 0;
    return known && digits >= 3;
}

static bool written_by_runs(const char *name)
{
    static const char *const fixed[] = {"used.yml", "log.txt", "profile.csv", "ranks.csv", "checkpoint.hdf5",
                                        "checkpoint.previous.hdf5", "stop"};
    bool ours = numbered(name, "snapshot") || numbered(name, "picture");
    for (size_t f = 0; f < sizeof fixed / sizeof *fixed; f++) ours = ours || strcmp(name, fixed[f]) == 0;
    for (const struct module *const *m = module_list; *m; m++) ours = ours || ((*m)->companion && numbered(name, (*m)->companion));
    return ours;
}

/* Takes away what a run writes, finished or not, and nothing else. */
static void clear_folder(const char *folder)
{
    log_warning("%s: taking away the files of the run before (--force)", folder);
    DIR *listing = opendir(folder);
    if (!listing) fail(STATUS_INPUT, "%s: cannot be read: %s (--out DIR names another)", folder, strerror(errno));
    for (struct dirent *entry = readdir(listing); entry; entry = readdir(listing)) {
        char *path = mem_format("frame", "%s/%s", folder, entry->d_name), *name = text_join(entry->d_name, "");
        const size_t length = strlen(name), unfinished = strlen(".tmp");
        if (length > unfinished && strcmp(name + length - unfinished, ".tmp") == 0) name[length - unfinished] = '\0';
        if (written_by_runs(name) || series_is(path)) unlink(path);
        mem_free(name);
        mem_free(path);
    }
    closedir(listing);
}

static _Noreturn void refuse_folder(const char *folder)
{
    fail(STATUS_INPUT, "%s: the run directory exists already (--out DIR names another, --force overwrites it, "
         "--restart %s goes on)", folder, folder);
}

/* Before the rows are made, which may take long: whether make_folder can do what it shall. */
static void check_folder(const char *folder, bool force)
{
    struct stat status;
    if (!*folder) fail(STATUS_INPUT, "--out: names no folder");
    if (!force && comm_rank() == 0 && stat(folder, &status) == 0 && S_ISDIR(status.st_mode) && access(folder, W_OK) == 0)
        refuse_folder(folder);
}

static void make_folder(const char *folder, bool force)
{
    if (comm_rank() != 0) return;
    if (mkdir(folder, 0777) == 0) return;
    struct stat status;
    if (errno != EEXIST || stat(folder, &status) != 0 || !S_ISDIR(status.st_mode))
        fail(STATUS_INPUT, "%s: the run directory cannot be made: %s (--out DIR names another)", folder, strerror(errno));
    if (access(folder, W_OK) != 0)
        fail(STATUS_INPUT, "%s: the run directory cannot be written to: %s (--out DIR names another)", folder, strerror(errno));
    if (!force) refuse_folder(folder);
    clear_folder(folder);
}

/* Whether the file itself, not what a link of that name leads to, lies in the folder. */
static bool lies_in(const char *path, const char *folder)
{
    char *own = text_join(path, ""), *slash = strrchr(own, '/');
    struct stat here, there;
    if (slash) slash[slash == own] = '\0';
    bool same = stat(slash ? own : ".", &here) == 0 && stat(folder, &there) == 0 && here.st_dev == there.st_dev
             && here.st_ino == there.st_ino;
    mem_free(own);
    return same;
}

/* --force would take the files away that the run begins from. */
static void spare_start_files(const struct sim *sim, const char *folder)
{
    struct param_target targets[3];
    start_targets(sim->start, targets);
    for (const struct param_target *target = targets; target->table; target++)
        for (const struct param *p = target->table; p->name; p++) {
            const char *path = p->type == PARAM_PATH ? *(char *const *)((const char *)target->values + p->offset) : NULL;
            char *end = path ? realpath(path, NULL) : NULL;
            if (path && (lies_in(path, folder) || (end && lies_in(end, folder))))
                fail(STATUS_INPUT, "%s: start.%s lies in the run directory, which --force would clear (--out DIR names another)",
                     path, p->name);
            free(end);
        }
}

/* Without a whole used.yml a run cannot be continued: a folder that has just been made goes again. */
static void write_used(const struct sim *sim, bool fresh)
{
    if (comm_rank() != 0) return;
    char *path = text_join(sim->folder, "/used.yml");
    struct text_file file = text_file_open(path);
    if (file.stream) sim_write_used(sim, file.stream);
    if (!text_file_close(&file)) {
        int why = errno;
        char *log = text_join(sim->folder, "/log.txt");
        if (fresh) unlink(log);
        if (fresh) rmdir(sim->folder);
        mem_free(log);
        fail(STATUS_ENVIRONMENT, "%s: cannot be written: %s", path, strerror(why));
    }
    mem_free(path);
}

/* --set may change only what the tables allow at a restart; unknown names are told elsewhere. */
static void check_restart(struct sim *sim, const struct cmd_options *options)
{
    for (int i = 0; i < options->n_set; i++) {
        size_t length = strcspn(options->set[i], "=");
        bool may = false;
        for (int u = 0; u < sim->n_use && !may; u++) {
            const struct module *module = sim->use[u].module;
            for (const struct param *p = module->params; p && p->name && !may; p++) {
                char *name = mem_format("frame", "%s.%s", module->name, p->name);
                may = p->at_restart && strlen(name) == length && strncmp(name, options->set[i], length) == 0;
                mem_free(name);
            }
        }
        if (!may)
            problems_add(&sim->problems, "--set %s: may not change when a run is continued (`tephra params` marks what may)",
                         options->set[i]);
    }
}

static void open_log(const struct sim *sim, bool append)
{
    char *path = text_join(sim->folder, "/log.txt");
    log_open(path, append);
    mem_free(path);
    int64_t rows = 0;
    for_species(sim, s) rows += s->n;
    log_line("tephra %s, %lld rows, %d rank%s of %d thread%s, in %s", version_number, (long long)rows, comm_size(),
             comm_size() > 1 ? "s" : "", omp_get_max_threads(), omp_get_max_threads() > 1 ? "s" : "", sim->folder);
    binding_log();
    for_species(sim, s) log_line("  %-6s %lld rows", species_names[s->kind], (long long)s->n);
}

static int go(struct sim *sim, const struct cmd_options *options)
{
    sim_warn(sim);
    signals_install();
    int status = run_to_end(sim, options->max_wall);
    sim_free(sim);
    log_close();
    return status;
}

static int fresh(const struct cmd_options *options)
{
    struct scene *scene = cmd_scene(options, options->argument[0]);
    char *folder = options->out ? text_join(options->out, "") : default_folder(options->argument[0]);
    check_folder(folder, options->force);
    struct sim *sim = sim_new(scene, SIM_RUN);
    problems_report(&sim->problems);
    cmd_open_device(options, sim);
    sim->spread = ranks_will_spread(sim);
    start_load(sim);
    problems_report(&sim->problems);
    sim_begin(sim);
    problems_report(&sim->problems);
    if (options->force) spare_start_files(sim, folder);
    make_folder(folder, options->force);
    comm_barrier();
    sim->folder = folder;
    open_log(sim, false);
    write_used(sim, true);
    int status = go(sim, options);
    mem_free(folder);
    return status;
}

static int again(const struct cmd_options *options)
{
    char *folder = text_join(options->restart, ""), *used = text_join(folder, "/used.yml");
    char *checkpoint = text_join(folder, "/checkpoint.hdf5");
    if (access(checkpoint, R_OK) != 0)
        fail(STATUS_INPUT, "%s: cannot be read: %s (--restart takes the directory of a run, and a checkpoint.previous.hdf5 "
             "in it may be given this name)", checkpoint, strerror(errno));
    struct sim *sim = sim_new(cmd_scene(options, used), SIM_RUN);
    check_restart(sim, options);
    problems_report(&sim->problems);
    cmd_open_device(options, sim);
    sim->spread = ranks_will_spread(sim);
    checkpoint_read(sim, checkpoint);
    problems_report(&sim->problems);
    sim_begin(sim);
    problems_report(&sim->problems);
    sim->folder = folder;
    sim->started = sim->rebuild_next = true;
    output_advise(sim);
    series_trim(sim);
    open_log(sim, true);
    bool finished = sim->time.tick >= sim->time.tick_end;
    if (!finished) write_used(sim, false);
    log_line("going on from t = %g", timeline_now(&sim->time));
    if (finished) log_line("the run is finished: nothing to do");
    int status = go(sim, options);
    char *const texts[] = {folder, used, checkpoint};
    for (int i = 0; i < 3; i++) mem_free(texts[i]);
    return status;
}

static int run(int argc, char **argv)
{
    struct cmd_options options;
    if (!cmd_parse(&options, argc, argv, "out force set threads device max-wall restart isa", usage)) return STATUS_DONE;
    if (options.n_arguments != (options.restart ? 0 : 1)) fail(STATUS_INPUT, "usage: tephra %s", usage);
    if (options.restart && (options.out || options.force))
        fail(STATUS_INPUT, "--restart goes on in the run's own directory: --out and --force have no meaning with it");
    cmd_set_threads(&options);
    return options.restart ? again(&options) : fresh(&options);
}

const struct command run_command = {"run", usage, "run a scene", run};
