/* SPDX-License-Identifier: GPL-3.0-or-later
 * `tephra params`: what may stand in a scene, printed from the tables that read it. */
#include "cmd.h"
#include "draw/chart.h"
#include "mem.h"
#include "fail.h"
#include "module.h"
#include "start.h"
#include "units.h"
#include <string.h>

static const char usage[] = "params [BLOCK[.KEY]|GENERATOR[.KEY]|chart.NAME] [--roff]";

enum { MAX_SECTIONS = 127, MAX_KEYS = 256 };

/* A table of parameters under its heading. */
struct section { const char *block, *heading; const struct param *table; const char *chart; };

static int list_sections(struct section section[MAX_SECTIONS + 1])
{
    int n = 0;
    section[n++] = (struct section){"units", "what the numbers of the scene are measured in", units_params, NULL};
    section[n++] = (struct section){"start", "where the particles come from", start_params, NULL};
    for (const struct generator *const *g = generator_list; *g && n < MAX_SECTIONS; g++)
        section[n++] = (struct section){"start", (*g)->doc, (*g)->params, NULL};
    for (const struct module *const *m = module_list; *m && n < MAX_SECTIONS; m++)
        if ((*m)->params) section[n++] = (struct section){(*m)->name, (*m)->doc, (*m)->params, NULL};
    for (const struct chart *const *c = chart_list; *c && n < MAX_SECTIONS; c++)
        section[n++] = (struct section){"chart", (*c)->doc, (*c)->params, (*c)->name};
    section[n++] = (struct section){"chart", "every chart", chart_params, NULL};
    return n;
}

/* Generators and integrators share the block of the frame; their name tells whose keys these are. */
static const char *generator_of(const struct param *table)
{
    for (const struct generator *const *g = generator_list; *g; g++)
        if ((*g)->params == table) return (*g)->name;
    return NULL;
}

static void print_heading(const struct section *section, bool roff)
{
    const char *generator = generator_of(section->table);
    if (section->chart) printf(roff ? ".SS chart %s\n" : "chart.%s:\n", section->chart);
    else if (roff) printf(generator ? ".SS %s, generator %s\n" : ".SS %s\n", section->block, generator);
    else printf(generator ? "%s: {generator: %s}\n" : "%s:\n", section->block, generator);
    printf(roff ? "%s.\n" : "  # %s\n", section->heading);
}

static void print_section(const struct section *section, bool roff)
{
    print_heading(section, roff);
    param_describe(stdout, section->block, section->table, roff);
    if (!roff) putchar('\n');
}

static void fail_unknown(const char *name, const struct section *section, int n)
{
    const char *names[MAX_SECTIONS + 1];
    for (int i = 0; i < n; i++) {
        const char *generator = generator_of(section[i].table);
        names[i] = generator ? generator : section[i].chart ? section[i].chart : section[i].block;
    }
    const char *near = fail_nearest(name, names, n);
    fail(STATUS_INPUT, "no block is called \"%s\"%s%s%s; tephra params lists them all", name,
         near ? " (did you mean \"" : "", near ? near : "", near ? "\"?)" : "");
}

static bool find_chart(const char *name)
{
    for (const struct chart *const *c = chart_list; *c; c++)
        if (strcmp((*c)->name, name) == 0) return true;
    return false;
}

/* By its block, by its generator, or as chart.NAME, which means the keys of every chart too. */
static bool names(const char *word, const struct section *section)
{
    const char *generator = generator_of(section->table), *chart = strncmp(word, "chart.", 6) == 0 ? word + 6 : NULL;
    if (chart) return section->table == chart_params ? find_chart(chart) : section->chart && strcmp(chart, section->chart) == 0;
    return strcmp(word, section->block) == 0 || (generator && strcmp(word, generator) == 0);
}

/* One key of each section that `block` names: a generator's start.mass is not that of another. */
static void print_key(const char *block, const char *key, const struct section *section, int n, bool roff)
{
    const char *names_there[MAX_KEYS];
    int count = 0;
    bool found = false, there = false;
    for (int i = 0; i < n; i++) {
        if (!names(block, &section[i])) continue;
        there = true;
        for (const struct param *p = section[i].table; p && p->name; p++) {
            if (count < MAX_KEYS) names_there[count++] = p->name;
            if (strcmp(p->name, key) != 0) continue;
            const struct param one[] = {*p, {0}};
            print_heading(&section[i], roff);
            param_describe(stdout, section[i].block, one, roff);
            found = true;
        }
    }
    if (!there) fail_unknown(block, section, n);
    const char *near = found ? NULL : fail_nearest(key, names_there, count);
    if (!found)
        fail(STATUS_INPUT, "%s has no key \"%s\"%s%s%s; tephra params %s lists them", block, key, near ? " (did you mean \"" : "",
             near ? near : "", near ? "\"?)" : "", block);
}

static int params_run(int argc, char **argv)
{
    struct cmd_options options;
    struct section section[MAX_SECTIONS + 1];
    if (!cmd_parse(&options, argc, argv, "roff", usage)) return STATUS_DONE;
    if (options.n_arguments > 1) fail(STATUS_INPUT, "usage: tephra %s", usage);
    const char *block = options.argument[0];
    const char *dot = block && strncmp(block, "chart.", strlen("chart.")) != 0 ? strchr(block, '.') : NULL;
    bool found = false;
    const int n = list_sections(section);
    if (dot) {
        char *name = mem_format("parameters", "%.*s", (int)(dot - block), block);
        print_key(name, dot + 1, section, n, options.roff);
        mem_free(name);
        return STATUS_DONE;
    }
    if (options.roff && !block) printf(".SH PARAMETERS\n");
    for (int i = 0; i < n; i++) {
        if (block && !names(block, &section[i])) continue;
        print_section(&section[i], options.roff);
        found = true;
    }
    if (!found) fail_unknown(block, section, n);
    return STATUS_DONE;
}

const struct command params_command = {"params", usage, "what may stand in a scene: keys, defaults, units", params_run};
