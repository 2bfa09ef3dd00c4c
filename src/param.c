/* SPDX-License-Identifier: GPL-3.0-or-later
 * Parameter tables: reading a block of the scene by them, writing the used values back, describing
 * them. A value is read whole or not at all: what follows a number must be a unit. */
#include "param.h"
#include "fail.h"
#include "mem.h"
#include "scene.h"
#include "units.h"
#include <errno.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* What the meaning of a text depends on: where relative paths start, units, the block's preset (which of a default's
 * alternatives holds). */
struct context { const char *folder; const struct units *units; int preset; };

static void *field_of(const struct param *param, void *values) { return (char *)values + param->offset; }

static char *text_of(const char *text) { return mem_text("parameters", text); }

static bool is_none(const struct param *param, const char *text)
{
    return param->fallback && strcmp(param->fallback, "none") == 0 && strcmp(text, "none") == 0;
}

/* 30000, 1e5, -3; a 64-bit whole number is exact. NULL, or why not. */
static char *parse_count(const char *text, int64_t *value)
{
    char *end;
    errno = 0;
    long long whole = strtoll(text, &end, 10);
    if (errno) return text_of("is too large for a whole number");
    if (end > text && *end == '\0') {
        *value = whole;
        return NULL;
    }
    double real;
    char *why = units_parse(&(struct units){.length = 1, .mass = 1, .velocity = 1}, text, "", &real);
    if (why || real != floor(real)) {
        mem_free(why);
        return text_of("expects a whole number");
    }
    if (fabs(real) >= 0x1p63) return text_of("is too large for a whole number");
    *value = (int64_t)real;
    return NULL;
}

static char *parse_flag(const char *text, bool *value)
{
    static const char *const words[] = {"off", "on", "no", "yes", "false", "true"};
    for (int i = 0; i < 6; i++)
        if (strcmp(text, words[i]) == 0) {
            *value = i % 2;
            return NULL;
        }
    return text_of("expects on or off");
}

/* The words of "leapfrog|pec" in a copy that is returned; *count of them in words. */
enum { MAX_CHOICES = 32 };
static char *split_choices(const char *choices, const char *words[MAX_CHOICES], int *count)
{
    char *buffer = text_of(choices);
    *count = 0;
    for (char *next = buffer, *word; (word = strsep(&next, "|"));) {
        check(*count < MAX_CHOICES);
        words[(*count)++] = word;
    }
    return buffer;
}

static char *parse_choice(const struct param *param, const char *text, int *value)
{
    const char *words[MAX_CHOICES];
    int count;
    char *buffer = split_choices(param->choices, words, &count), *why = NULL;
    *value = -1;
    for (int i = 0; i < count; i++)
        if (strcmp(words[i], text) == 0) *value = i;
    if (*value < 0) {
        const char *near = fail_nearest(text, words, count);
        why = mem_format("parameters", "must be one of %s%s%s%s", param->choices, near ? " (did you mean \"" : "",
                         near ? near : "", near ? "\"?)" : "");
    }
    mem_free(buffer);
    return why;
}

static char *absolute_path(const char *folder, const char *text)
{
    return *text == '/' ? text_of(text) : mem_format("parameters", "%s/%s", folder, text);
}

/* "0 ... 1e30": as %g, without the signs and zeros that nobody writes in an exponent. */
static char *range_text(const struct param *param)
{
    char *text = mem_format("parameters", "%g ... %g", param->low, param->high), *to = text;
    for (const char *from = text; *from; from++) {
        *to++ = *from;
        if (*from != 'e') continue;
        if (from[1] == '-') *to++ = '-';
        from += 1 + (from[2] == '0');
    }
    *to = '\0';
    return text;
}

static char *check_range(const struct param *param, double value, const struct units *units)
{
    if ((param->low == 0.0 && param->high == 0.0) || (value >= param->low && value <= param->high)) return NULL;
    const char *scale = param->type == PARAM_REAL && *param->unit && units->physical ? " in code units" : "";
    char *range = range_text(param), *why = mem_format("parameters", "must lie in %s%s", range, scale);
    mem_free(range);
    return why;
}

/* "1e-2, 3e-3": at least one number. */
static char *parse_list(const struct param *param, const char *text, const struct units *units, struct param_list *list)
{
    struct param_list found = {0};
    char *buffer = text_of(text), *why = NULL;
    for (char *next = buffer, *word; !why && (word = strsep(&next, ","));) {
        word += strspn(word, " ");
        if (found.n == PARAM_LIST_MAX) {
            why = mem_format("parameters", "has more than %d numbers", PARAM_LIST_MAX);
            break;
        }
        why = units_parse(units, word, param->unit, &found.value[found.n]);
        if (!why) why = check_range(param, found.value[found.n], units);
        found.n++;
    }
    mem_free(buffer);
    if (!why) *list = found;
    return why;
}

/* Fills the field from a text, or says why not and leaves it alone. */
static char *parse_value(const struct context *context, const struct param *param, const char *text, void *field)
{
    bool none = is_none(param, text);
    char *why = NULL;
    double real = NAN;
    int64_t count = -1;
    switch (param->type) {
    case PARAM_REAL:
        if (!none) why = units_parse(context->units, text, param->unit, &real);
        if (!none && !why) why = check_range(param, real, context->units);
        if (!why) *(double *)field = real;
        return why;
    case PARAM_COUNT:
        if (!none) why = parse_count(text, &count);
        if (!none && !why) why = check_range(param, (double)count, context->units);
        if (!why) *(int64_t *)field = count;
        return why;
    case PARAM_FLAG:
        return parse_flag(text, field);
    case PARAM_CHOICE:
        return parse_choice(param, text, field);
    case PARAM_LIST:
        return parse_list(param, text, context->units, field);
    case PARAM_TEXT:
        *(char **)field = none ? NULL : text_of(text);
        return NULL;
    case PARAM_PATH:
        *(char **)field = none ? NULL : absolute_path(context->folder, text);
        return NULL;
    }
    check(!"a known type of parameter");
    return NULL;
}

static const struct scene_entry *find_entry(const struct scene_block *block, const char *key)
{
    for (int i = 0; block && i < block->n; i++)
        if (strcmp(block->entry[i].key, key) == 0) return &block->entry[i];
    return NULL;
}

static void read_entry(const struct scene_entry *entry, const char *block, const struct context *context,
                       const struct param *param, void *field, struct problems *problems)
{
    if (!*entry->value && param->type != PARAM_TEXT) {
        problems_add(problems, "%s: %s.%s: has no value", entry->place, block, param->name);
        return;
    }
    if (entry->list && param->type != PARAM_LIST && param->type != PARAM_TEXT) {
        problems_add(problems, "%s: %s.%s: expects one value, not the list [%s]", entry->place, block, param->name, entry->value);
        return;
    }
    char *working = entry->typed ? getcwd(NULL, 0) : NULL;
    const struct context here = {working ? working : context->folder, context->units, context->preset};
    char *why = parse_value(&here, param, entry->value, field);
    if (why) problems_add(problems, "%s: %s.%s = %s: %s", entry->place, block, param->name, entry->value, why);
    mem_free(why);
    free(working);
}

static int preset_of(const struct param_target *tables, const struct scene_block *block, const struct context *context)
{
    int preset = 0;
    for (; tables->table; tables++)
        for (const struct param *param = tables->table; param->name; param++) {
            if (strcmp(param->name, "preset") != 0) continue;
            const struct scene_entry *entry = find_entry(block, param->name);
            mem_free(parse_value(context, param, entry ? entry->value : param->fallback, &preset));
        }
    return preset;
}

/* Alternative number `preset` of a default "50|100"; the last one stands for all that follow. */
static char *alternative(const char *fallback, int preset)
{
    for (const char *bar; preset > 0 && (bar = strchr(fallback, '|')); preset--) fallback = bar + 1;
    return mem_format("parameters", "%.*s", (int)strcspn(fallback, "|"), fallback);
}

static void read_default(const char *place, const char *block, const struct context *context,
                         const struct param *param, void *field, struct problems *problems)
{
    if (!param->fallback) {
        problems_add(problems, "%s: %s.%s: must be given (%s)", place, block, param->name, param->text);
        return;
    }
    char *text = alternative(param->fallback, context->preset), *why = parse_value(context, param, text, field);
    if (why)
        problems_add(problems, "%s: %s.%s: must be given; its default, %s, does not fit: %s", place, block, param->name,
                     text, why);
    mem_free(text);
    mem_free(why);
}

/* All names of the tables; the list belongs to the caller. */
static const char **known_names(const struct param_target *tables, int *count)
{
    const char **names = NULL;
    *count = 0;
    for (; tables->table; tables++)
        for (const struct param *param = tables->table; param->name; param++) {
            names = mem_resize("parameters", names, (size_t)(*count + 1) * sizeof *names);
            names[(*count)++] = param->name;
        }
    return names;
}

static void report_unknown(const struct scene *scene, const char *block, const struct param_target *tables,
                           struct problems *problems)
{
    const struct scene_block *found = scene_find(scene, block);
    int count;
    const char **names = known_names(tables, &count);
    for (int i = 0; found && i < found->n; i++) {
        const struct scene_entry *entry = &found->entry[i];
        bool known = false;
        for (int k = 0; k < count; k++) known |= strcmp(names[k], entry->key) == 0;
        if (known) continue;
        const char *near = fail_nearest(entry->key, names, count);
        problems_add(problems, "%s: %s.%s: unknown key%s%s%s%s", entry->place, block, entry->key, near ? " (did you mean \"" : "",
                     near ? near : "", near ? "\"?)" : "", strchr(entry->key, ':') ? scene_colon_advice : "");
    }
    mem_free(names);
}

void param_read(const struct scene *scene, const char *block, const struct param_target *tables,
                const struct units *units, struct problems *problems)
{
    struct context context = {scene->folder, units, 0};
    const struct scene_block *found = scene_find(scene, block);
    const char *place = scene_place(scene, block, NULL);
    context.preset = preset_of(tables, found, &context);
    for (const struct param_target *target = tables; target->table; target++)
        for (const struct param *param = target->table; param->name; param++) {
            const struct scene_entry *entry = find_entry(found, param->name);
            void *field = field_of(param, target->values);
            if (entry) read_entry(entry, block, &context, param, field, problems);
            else read_default(place, block, &context, param, field, problems);
        }
    report_unknown(scene, block, tables, problems);
}

bool param_chosen(const struct scene *scene, const char *block, const struct param *table, const char *key)
{
    const char *value = scene ? scene_value(scene, block, key) : NULL;
    if (!value) return false;
    struct context context = {scene->folder, NULL, 0};
    const int preset = preset_of((struct param_target[]){{table, NULL}, {NULL, NULL}}, scene_find(scene, block), &context);
    while (table->name && strcmp(table->name, key) != 0) table++;
    check(table->name && table->fallback);
    char *fallback = alternative(table->fallback, preset);
    const bool chosen = strtod(value, NULL) != strtod(fallback, NULL);
    mem_free(fallback);
    return chosen;
}

/* The shortest decimal number that reads back as the same bits. */
static void write_real(FILE *stream, double value)
{
    char text[40];
    for (int digits = 15; digits <= 17; digits++) {
        snprintf(text, sizeof text, "%.*g", digits, value);
        if (strtod(text, NULL) == value) break;
    }
    fputs(text, stream);
}

/* Bytes above 127 are UTF-8 and stay. */
void param_write_text(FILE *stream, const char *text)
{
    fputc('"', stream);
    for (; *text; text++) {
        unsigned char c = (unsigned char)*text;
        if (c == '"' || c == '\\') fprintf(stream, "\\%c", c);
        else if (c < ' ' || c == 127) fprintf(stream, "\\x%02x", c);
        else fputc(c, stream);
    }
    fputc('"', stream);
}

static void write_value(FILE *stream, const struct param *param, const void *field)
{
    const char *text = NULL, *words[MAX_CHOICES];
    char *buffer;
    int count = 0;
    switch (param->type) {
    case PARAM_REAL:
        if (isnan(*(const double *)field)) fputs("none", stream);
        else write_real(stream, *(const double *)field);
        return;
    case PARAM_COUNT:
        if (*(const int64_t *)field == -1 && is_none(param, "none")) fputs("none", stream);
        else fprintf(stream, "%lld", (long long)*(const int64_t *)field);
        return;
    case PARAM_FLAG:
        fputs(*(const bool *)field ? "on" : "off", stream);
        return;
    case PARAM_CHOICE:
        buffer = split_choices(param->choices, words, &count);
        fputs(words[*(const int *)field], stream);
        mem_free(buffer);
        return;
    case PARAM_LIST:
        for (const struct param_list *list = field; count < list->n; count++) {
            if (count > 0) fputs(", ", stream);
            write_real(stream, list->value[count]);
        }
        return;
    case PARAM_TEXT:
    case PARAM_PATH:
        text = *(char *const *)field;
        if (text) param_write_text(stream, text);
        else fputs("none", stream);
        return;
    }
}

void param_write(FILE *stream, const struct param_target *tables)
{
    for (; tables->table; tables++)
        for (const struct param *param = tables->table; param->name; param++) {
            fprintf(stream, "  %s: ", param->name);
            write_value(stream, param, field_of(param, tables->values));
            fputc('\n', stream);
        }
}

void param_free(const struct param_target *tables)
{
    for (; tables->table; tables++)
        for (const struct param *param = tables->table; param->name; param++) {
            if (param->type != PARAM_TEXT && param->type != PARAM_PATH) continue;
            char **text = field_of(param, tables->values);
            mem_free(*text);
            *text = NULL;
        }
}

/* The range for people, to whom 1e30 means that there is no limit. */
static char *range_words(const struct param *param)
{
    if (param->high < 1e30 || param->low < 0.0 || param->low > 1e-30) return range_text(param);
    return text_of(param->low == 0.0 ? "0 or more" : "positive");
}

/* What a value must be: "length, 0 ... 1e30", "whole number", "leapfrog|pec". */
static char *expectation(const struct param *param)
{
    static const char *const kinds[] = {
        [PARAM_REAL] = "number", [PARAM_COUNT] = "whole number", [PARAM_FLAG] = "on|off",
        [PARAM_CHOICE] = NULL, [PARAM_LIST] = "numbers", [PARAM_TEXT] = "text", [PARAM_PATH] = "path",
    };
    const char *kind = param->type == PARAM_CHOICE ? param->choices
                     : param->type == PARAM_REAL && *param->unit ? param->unit : kinds[param->type];
    char *words = text_of(kind);
    for (char *c = words; param->type == PARAM_REAL && *c; c++)
        if (*c == '_') *c = ' ';
    if (param->low == 0.0 && param->high == 0.0) return words;
    char *range = range_words(param);
    char *text = mem_format("parameters", "%s, %s", words, range);
    mem_free(words);
    mem_free(range);
    return text;
}

static void write_roff(FILE *stream, const char *text)
{
    if (*text == '.' || *text == '\'') fputs("\\&", stream);
    for (; *text; text++) {
        if (*text == '\\') fputs("\\e", stream);
        else if (*text == '-') fputs("\\-", stream);
        else fputc(*text, stream);
    }
}

static void describe_roff(FILE *stream, const char *block, const struct param *param, const char *expects)
{
    fprintf(stream, ".TP\n.B %s.%s\n", block, param->name);
    write_roff(stream, param->text);
    fputs("\n(", stream);
    write_roff(stream, expects);
    fputs(param->fallback ? "; default " : "; must be given", stream);
    if (param->fallback) write_roff(stream, *param->fallback ? param->fallback : "empty");
    fputs(param->at_restart ? "; may change at a restart)\n" : ")\n", stream);
}

void param_describe(FILE *stream, const char *block, const struct param *table, bool roff)
{
    for (const struct param *param = table; param && param->name; param++) {
        char *expects = expectation(param), *name = mem_format("parameters", "%s.%s", block, param->name);
        const char *fallback = param->fallback ? param->fallback : "(required)";
        if (roff) describe_roff(stream, block, param, expects);
        else
            fprintf(stream, "  %-28s %-20s %s%s\n      %s\n", name, *fallback ? fallback : "\"\"", expects,
                    param->at_restart ? "; may change at a restart" : "", param->text);
        mem_free(expects);
        mem_free(name);
    }
}
