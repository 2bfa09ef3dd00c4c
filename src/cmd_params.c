/* SPDX-License-Identifier: GPL-3.0-or-later
 * `tephra params`: what may stand in a scene, printed from the tables that read it. */
#include "fail.h"
#include "module.h"
#include "start.h"
#include "units.h"
#include <string.h>

static const char usage[] = "params [BLOCK] [--roff]";

enum { MAX_SECTIONS = 128 };

/* A table of parameters under its heading. */
struct section { const char *block, *heading; const struct param *table; };

static int list_sections(struct section section[MAX_SECTIONS])
{
    int n = 0;
    section[n++] = (struct section){"units", "what the numbers of the scene are measured in", units_params};
    section[n++] = (struct section){"start", "where the particles come from", start_params};
    for (const struct generator *const *g = generator_list; *g && n < MAX_SECTIONS; g++)
        section[n++] = (struct section){"start", (*g)->doc, (*g)->params};
    for (const struct module *const *m = module_list; *m && n < MAX_SECTIONS; m++)
        if ((*m)->params) section[n++] = (struct section){(*m)->name, (*m)->doc, (*m)->params};
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
    if (roff) printf(generator ? ".SS %s, generator %s\n" : ".SS %s\n", section->block, generator);
    else printf(generator ? "%s: {generator: %s}\n" : "%s:\n", section->block, generator);
    printf(roff ? "%s.\n" : "  # %s\n", section->heading);
    param_describe(stdout, section->block, section->table, roff);
    if (!roff) putchar('\n');
}

static void fail_unknown(const char *name, const struct section *section, int n)
{
    const char *names[MAX_SECTIONS];
    for (int i = 0; i < n; i++) {
        const char *generator = generator_of(section[i].table);
        names[i] = generator ? generator : section[i].block;
    }
    const char *near = fail_nearest(name, names, n);
    fail(STATUS_INPUT, "no block is called \"%s\"%s%s%s; tephra params lists them all", name,
         near ? " (did you mean \"" : "", near ? near : "", near ? "\"?)" : "");
}

static int params_run(int argc, char **argv)
{
    struct section section[MAX_SECTIONS];
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
        const char *generator = generator_of(section[i].table);
        if (block && strcmp(block, section[i].block) != 0 && !(generator && strcmp(block, generator) == 0)) continue;
        print_section(&section[i], roff);
        found = true;
    }
    if (!found) fail_unknown(block, section, n);
    return STATUS_DONE;
}

const struct command params_command = {"params", usage, "what may stand in a scene: keys, defaults, units", params_run};
