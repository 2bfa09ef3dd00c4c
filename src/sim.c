/* SPDX-License-Identifier: GPL-3.0-or-later
 * From a scene to a simulation: which modules it uses, their parameters, columns and hooks. */
#include "sim.h"
#include "comm.h"
#include "device.h"
#include "ghosts.h"
#include "log.h"
#include "mem.h"
#include "module.h"
#include "profile.h"
#include "start.h"
#include "tree_cells.h"
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

const char *const hook_names[N_HOOKS] = {
    "PREDICT", "ARRANGE", "H", "DENSITY", "FORCE", "CORRECT", "SOURCE", "EVENT", "LIMIT", "RECORD",
};

static const char default_integrator[] = "leapfrog";

static bool wanted(const struct sim *sim, const struct module *module, enum sim_purpose purpose)
{
    const char *integrator = scene_value(sim->scene, "time", "integrator");
    switch (module->kind) {
    case MODULE_FRAME: return purpose != SIM_START;
    case MODULE_DRIVER: return purpose == SIM_RUN;
    case MODULE_BLOCK: return scene_find(sim->scene, module->name) != NULL;
    case MODULE_INTEGRATOR:
        return purpose == SIM_RUN && strcmp(module->name, integrator ? integrator : default_integrator) == 0;
    }
    return false;
}

static void choose_modules(struct sim *sim, enum sim_purpose purpose)
{
    int count = 0;
    while (module_list[count]) count++;
    sim->use = mem_array("frame", struct use, count);
    for (int m = 0; m < count; m++)
        if (wanted(sim, module_list[m], purpose))
            sim->use[sim->n_use++] = (struct use){module_list[m], mem_alloc("frame", module_list[m]->state_bytes)};
}

static bool has_block(const struct module *module) { return module->params != NULL; }
static bool integrates(const struct module *module) { return module->kind == MODULE_INTEGRATOR; }

/* A name that stands in the scene but belongs to nothing. */
static void unknown(struct sim *sim, const char *place, const char *what, const char *word, bool (*fits)(const struct module *))
{
    const char *names[128];
    int count = 0;
    for (int m = 0; module_list[m] && count < 126; m++)
        if (fits(module_list[m])) names[count++] = module_list[m]->name;
    if (fits == has_block) {
        names[count++] = "units";
        names[count++] = "start";
    }
    for (int i = 0; i < count; i++)
        if (strcmp(names[i], word) == 0) return;
    const char *near = fail_nearest(word, names, count);
    problems_add(&sim->problems, "%s: %s \"%s\"%s%s%s%s", place, what, word, near ? " (did you mean \"" : "", near ? near : "",
                 near ? "\"?)" : "", strchr(word, ':') ? scene_colon_advice : "");
}

static void check_names(struct sim *sim)
{
    const struct scene *scene = sim->scene;
    for (int b = 0; b < scene->n; b++)
        unknown(sim, scene->block[b].place, "unknown block", scene->block[b].name, has_block);
    for (int m = 0; module_list[m]; m++)
        if (module_list[m]->kind == MODULE_INTEGRATOR && scene_find(scene, module_list[m]->name)
            && !sim_uses(sim, module_list[m]->name))
            problems_add(&sim->problems, "%s: the block has a meaning only with time.integrator: %s",
                         scene_place(scene, module_list[m]->name, NULL), module_list[m]->name);
    const char *integrator = scene_value(scene, "time", "integrator");
    if (integrator)
        unknown(sim, scene_place(scene, "time", "integrator"), "time.integrator: unknown integrator", integrator, integrates);
    for (int u = 0; u < sim->n_use; u++)
        for (const char *const *r = sim->use[u].module->requires; r && *r; r++)
            if (!sim_uses(sim, *r))
                problems_add(&sim->problems, "%s: block \"%s\" needs a block \"%s\" (--set %s={} adds one)",
                             scene_place(scene, sim->use[u].module->name, NULL), sim->use[u].module->name, *r, *r);
}

/* Columns that every scene has. */
static void declare_common(struct sim *sim)
{
    const enum column common[] = {COLUMN_pos, COLUMN_vel, COLUMN_mass, COLUMN_id, COLUMN_acc, COLUMN_rung, COLUMN_rung0};
    for (int s = 0; s < N_SPECIES; s++)
        for (size_t c = 0; c < sizeof common / sizeof *common; c++) species_need(&sim->species[s], common[c]);
}

/* Integrators come last: they look after the columns that others asked for. */
static void declare_modules(struct sim *sim)
{
    for (int last = 0; last < 2; last++)
        for (int u = 0; u < sim->n_use; u++) {
            const struct module *module = sim->use[u].module;
            if ((module->kind == MODULE_INTEGRATOR) == last && module->declare)
                module->declare(sim, sim->use[u].state);
        }
}

struct sim *sim_new(struct scene *scene, enum sim_purpose purpose)
{
    struct sim *sim = mem_alloc("frame", sizeof *sim);
    sim->scene = scene;
    sim->tree.built = -1;
    sim->time.tick_end = INT64_MAX;
    units_read(&sim->units, scene, &sim->problems);
    choose_modules(sim, purpose);
    check_names(sim);
    if (purpose != SIM_FORCES) start_read(sim);
    for (int u = 0; u < sim->n_use; u++) {
        const struct module *module = sim->use[u].module;
        struct param_target targets[] = {{module->params, sim->use[u].state}, {NULL, NULL}};
        if (module->params) param_read(scene, module->name, targets, &sim->units, &sim->problems);
    }
    for (int s = 0; s < N_SPECIES; s++) sim->species[s].kind = (enum species_kind)s;
    if (sim->problems.count > 0 || purpose == SIM_START) return sim;
    declare_common(sim);
    declare_modules(sim);
    return sim;
}

static void list_calls(struct sim *sim)
{
    sim->call = mem_array("frame", struct call, sim->n_use * N_HOOKS);
    for (int h = 0; h < N_HOOKS; h++)
        for (int u = 0; u < sim->n_use; u++)
            if (sim->use[u].module->hook[h]) sim->call[sim->n_call++] = (struct call){h, u};
    sim->profile = profile_new(sim->n_call);
}

void sim_begin(struct sim *sim)
{
    for_species(sim, s) species_reserve(s, s->n);
    for (int u = 0; u < sim->n_use; u++)
        if (sim->use[u].module->begin) sim->use[u].module->begin(sim, sim->use[u].state);
    list_calls(sim);
}

void sim_warn(struct sim *sim)
{
    const struct species *gas = &sim->species[GAS];
    if (gas->n > 0 && !species_has(gas, COLUMN_rho))
        log_warning("%lld rows of gas, and no module gives them pressure: they move as dust (sph: {} would)", (long long)gas->n);
    for (int u = 0; u < sim->n_use; u++)
        if (sim->use[u].module->warn) sim->use[u].module->warn(sim, sim->use[u].state);
}

static int64_t copied(const struct sim *sim) { return sim->device ? device_copied(sim->device) : 0; }

void sim_run_hook(struct sim *sim, int hook)
{
    for (int c = 0; c < sim->n_call; c++) {
        if (sim->call[c].hook != hook) continue;
        const struct use *use = &sim->use[sim->call[c].use];
        int64_t rows = 0;
        for_species(sim, s) rows += s->n_active;
        profile_start(sim->profile, copied(sim));
        if (!use->module->resident) rows_here(sim, ALL_SPECIES, COL_ALL, hook == HOOK_RECORD ? 0 : COL_ALL);
        use->module->hook[hook](sim, use->state);
        profile_stop(sim->profile, c, rows, copied(sim));
    }
}

/* Which entries of rung[from..to-1] end their step at a tick that 2^level divides, appended to list. */
static int64_t find(const uint8_t *rung, int64_t from, int64_t to, int level, int32_t *list)
{
    enum { BLOCK = 256 };
    int64_t count = 0;
    for (int64_t b = from; b < to; b += BLOCK) {
        int64_t end = b + BLOCK < to ? b + BLOCK : to;
        uint8_t lowest = UINT8_MAX;
        for (int64_t i = b; i < end; i++) lowest = rung[i] < lowest ? rung[i] : lowest;
        if (lowest > level) continue;
        for (int64_t i = b; i < end; i++)
            if (rung[i] <= level) list[count++] = (int32_t)i;
    }
    return count;
}

int64_t sim_find_active(struct sim *sim)
{
    int level = timeline_synchronous(&sim->time) ? UINT8_MAX : __builtin_ctzll((uint64_t)sim->time.tick);
    int64_t ending[N_SPECIES] = {0};
    rows_here(sim, ALL_SPECIES, COL(rung), 0);
    for_species(sim, s) {
        rows_listed(s);
        int64_t before = find(s->rung, species_from(s), s->own, level, s->ending);
        s->active = s->ending + before;
        s->n_active = find(s->rung, s->own, s->own + s->n_own, level, s->active);
        s->n_ending = before + s->n_active
                    + find(s->rung, s->own + s->n_own, species_to(s), level, s->active + s->n_active);
        ending[s->kind] = s->n_ending;
    }
    if (sim->spread) comm_sum_int(ending, N_SPECIES);
    sim->ending = 0;
    for_species(sim, s) sim->ending += s->all_ending = ending[s->kind];
    return sim->ending;
}

static const struct use *find_use(const struct sim *sim, const char *module)
{
    for (int u = 0; u < sim->n_use; u++)
        if (strcmp(sim->use[u].module->name, module) == 0) return &sim->use[u];
    return NULL;
}

bool sim_uses(const struct sim *sim, const char *module) { return find_use(sim, module) != NULL; }

void *sim_state(const struct sim *sim, const char *module)
{
    const struct use *use = find_use(sim, module);
    return use ? use->state : NULL;
}

double sim_real(const struct sim *sim, const char *name, double fallback)
{
    for (int u = 0; u < sim->n_use; u++)
        for (const struct param *p = sim->use[u].module->params; p && p->name; p++)
            if (p->type == PARAM_REAL && strcmp(p->name, name) == 0)
                return *(const double *)((const char *)sim->use[u].state + p->offset);
    return fallback;
}

bool sim_leave_device(struct sim *sim, const char *module, const char *error)
{
    if (!device_full(sim->device) || sim->device_needed) {
        sim_stop(sim, STATUS_ENVIRONMENT, "%s: %s", module, error);
        return false;
    }
    log_line("%s: %s; the CPU goes on", module, error);
    device_forgive(sim->device);
    for_species(sim, s) rows_leave(s);
    sim->device_left = true;
    return true;
}

void sim_stop(struct sim *sim, enum status status, const char *format, ...)
{
    if (sim->failure.set) return;
    sim->failure = (struct failure){true, status, ""};
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(sim->failure.text, sizeof sim->failure.text, format, arguments);
    va_end(arguments);
}

void sim_fail(struct sim *sim, const struct species *table, int64_t row, const char *what)
{
#pragma omp critical(sim_failure)
    if (!sim->failure.set) {
        rows_here(sim, ALL_SPECIES, COL_ALL, 0);   /* the row is told with all that it has */
        sim->failure.set = true;
        sim->failure.status = STATUS_NUMBERS;
        char *text = sim->failure.text;
        int size = sizeof sim->failure.text;
        int used = snprintf(text, (size_t)size, "%s particle %llu at t = %g: %s (", species_names[table->kind],
                            (unsigned long long)table->id[row], timeline_now(&sim->time), what);
        for (int c = 0; c < N_COLUMNS && used < size; c++) {
            const char *data = species_column(table, c);
            if (!data || column_table[c].kind == 'u') continue;
            used += snprintf(text + used, (size_t)(size - used), "%s%s", c ? ", " : "", column_table[c].name);
            for (int k = 0; k < column_table[c].components && used < size; k++) {
                const char *at = data + (size_t)row * species_row_bytes(c) + k * column_table[c].element_bytes;
                double value = column_table[c].kind == 'd' ? *(const double *)at : (double)*(const float *)at;
                used += snprintf(text + used, (size_t)(size - used), " %.6g", value);
            }
        }
        if (used < size) snprintf(text + used, (size_t)(size - used), ")");
    }
}

void sim_write_used(const struct sim *sim, FILE *stream)
{
    struct param_target targets[3];
    if (sim->scene->title) {
        fputs("title: ", stream);
        param_write_text(stream, sim->scene->title);
        fputc('\n', stream);
    }
    units_write(stream, &sim->units);
    fprintf(stream, "start:\n");
    start_targets(sim->start, targets);
    param_write(stream, targets);
    for (int u = 0; u < sim->n_use; u++) {
        const struct module *module = sim->use[u].module;
        if (!module->params) continue;
        fprintf(stream, "%s:\n", module->name);
        param_write(stream, (struct param_target[]){{module->params, sim->use[u].state}, {NULL, NULL}});
    }
}

void sim_free(struct sim *sim)
{
    if (!sim) return;
    for (int u = 0; u < sim->n_use; u++) {
        if (sim->n_call > 0 && sim->use[u].module->end) sim->use[u].module->end(sim, sim->use[u].state);
        param_free((struct param_target[]){{sim->use[u].module->params, sim->use[u].state}, {NULL, NULL}});
        mem_free(sim->use[u].state);
    }
    for (int s = 0; s < N_SPECIES; s++) species_free(&sim->species[s]);
    tree_free(&sim->tree);
    device_close(sim->device);
    ghosts_free(sim->ghosts);
    domains_free(sim->domains);
    start_free(sim->start);
    scene_free(sim->scene);
    profile_free(sim->profile);
    mem_free(sim->use);
    mem_free(sim->call);
    mem_free(sim);
}
