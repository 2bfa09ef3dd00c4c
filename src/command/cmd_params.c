/* SPDX-License-Identifier: GPL-3.0-or-later
 * `tephra params`: what may stand in a scene, printed from the tables that read it. */
#include "draw/chart.h"
#include "fail.h"
#include "module.h"
#include "start.h"
#include "units.h"
#include <string.h>

static const char usage[] = "params [BLOCK|GENERATOR|chart.NAME] [--roff]";

enum { MAX_SECTIONS = 127 };

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

static void print_section(const struct section *section, bool roff)
{
    const char *generator = generator_of(section->table);
    if (section->chart) printf(roff ? ".SS chart %s\n" : "chart.%s:\n", section->chart);
    else if (roff) printf(generator ? ".SS %s, generator %s\n" : ".SS %s\n", section->block, generator);
    else printf(generator ? "%s: {generator: %s}\n" : "%s:\n", section->block, generator);
    printf(roff ? "%s.\n" : "  # %s\n", section->heading);
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

static int params_run(int argc, char **argv)
{
    struct section section[MAX_SECTIONS + 1];
    const char *block = NULL;
    bool roff = false, found = false;
    for (int i = 1; i < argc; i++) {
        if (strcmp(argv[i], "--roff") == 0) roff = true;
        else if (argv[i][0] == '-' || block) fail(STATUS_INPUT, "%s: not understood; usage: tephra %s", argv[i], usage);
        else block = argv[i];
    }
    const int n = list_sections(section);
    if (roff && !block) printf(".SH PARAMETERS\n");
    for (int i = 0; i < n; i++) {
        if (block && !names(block, &section[i])) continue;
        print_section(&section[i], roff);
        found = true;
    }
    if (!found) fail_unknown(block, section, n);
    return STATUS_DONE;
}

const struct command params_command = {"params", usage, "what may stand in a scene: keys, defaults, units", params_run};
