/* SPDX-License-Identifier: GPL-3.0-or-later
 * Scene files. libyaml parses the text into a document whose nodes know their lines; here its two
 * levels become blocks and entries, and all that is not two levels of plain text becomes a problem. */
#include "scene.h"
#include "fail.h"
#include "mem.h"
#include <errno.h>
#include <libgen.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <yaml.h>

const char scene_colon_advice[] = ": a blank is missing behind the colon";

enum { LARGEST_FILE = 1 << 20 };

/* One YAML text on its way into a scene. */
struct source {
    struct scene *scene;
    const char *path;           /* NULL: an assignment of --set */
    yaml_document_t document;
    struct problems *problems;
};

static char *copy(const char *text) { return mem_text("scene", text); }

/* A scene without a file is all made of the command line. */
static const char *place_of_set(const struct scene *scene) { return scene->path ? "--set" : "command line"; }

static char *place_of(const struct source *source, const yaml_node_t *node)
{
    if (!source->path) return copy(place_of_set(source->scene));
    return mem_format("scene", "%s:%zu", source->path, node->start_mark.line + 1);
}

static bool is_one_of(const char *text, const char *const words[])
{
    while (*words && strcmp(text, *words) != 0) words++;
    return *words != NULL;
}

static bool means_off(const char *text)
{
    return is_one_of(text, (const char *const[]){"off", "no", "false", NULL});
}

static bool means_empty(const char *text)
{
    return is_one_of(text, (const char *const[]){"", "~", "null", "on", "yes", "true", NULL});
}

/* The scalar's text, or NULL with a problem. */
static const char *text_of(const struct source *source, const yaml_node_t *node, const char *what)
{
    const char *text = node->type == YAML_SCALAR_NODE ? (const char *)node->data.scalar.value : NULL;
    if (text && strlen(text) == node->data.scalar.length) return text;
    char *place = place_of(source, node);
    const char *found = node->type == YAML_SEQUENCE_NODE ? "a list" : node->type == YAML_MAPPING_NODE
                      ? "a block; a scene has two levels only: blocks, and keys in them" : "a text with a zero byte";
    problems_add(source->problems, "%s: %s: expects one number, word or text, not %s", place, what, found);
    mem_free(place);
    return NULL;
}

struct scene_block *scene_find(const struct scene *scene, const char *block)
{
    for (int i = 0; i < scene->n; i++)
        if (strcmp(scene->block[i].name, block) == 0) return &scene->block[i];
    return NULL;
}

static struct scene_entry *find_entry(const struct scene_block *block, const char *key)
{
    for (int i = 0; i < block->n; i++)
        if (strcmp(block->entry[i].key, key) == 0) return &block->entry[i];
    return NULL;
}

const char *scene_value(const struct scene *scene, const char *block, const char *key)
{
    const struct scene_block *found = scene_find(scene, block);
    const struct scene_entry *entry = found ? find_entry(found, key) : NULL;
    return entry ? entry->value : NULL;
}

const char *scene_place(const struct scene *scene, const char *block, const char *key)
{
    const struct scene_block *found = scene_find(scene, block);
    const struct scene_entry *entry = found && key ? find_entry(found, key) : NULL;
    return entry ? entry->place : found ? found->place : scene->path ? scene->path : "command line";
}

static struct scene_block *add_block(struct scene *scene, const char *name, const char *place)
{
    scene->block = mem_resize("scene", scene->block, (size_t)(scene->n + 1) * sizeof *scene->block);
    struct scene_block *block = &scene->block[scene->n++];
    *block = (struct scene_block){copy(name), copy(place), NULL, 0};
    return block;
}

/* Takes copies of the texts. */
static void set_entry(struct scene_block *block, struct scene_entry given)
{
    struct scene_entry *entry = find_entry(block, given.key);
    if (!entry) {
        block->entry = mem_resize("scene", block->entry, (size_t)(block->n + 1) * sizeof *block->entry);
        entry = &block->entry[block->n++];
        *entry = (struct scene_entry){.key = copy(given.key)};
    }
    mem_free(entry->value);
    mem_free(entry->place);
    entry->value = copy(given.value);
    entry->place = copy(given.place);
    entry->typed = given.typed;
    entry->list = given.list;
}

static void free_block(struct scene_block *block)
{
    for (int i = 0; i < block->n; i++) {
        mem_free(block->entry[i].key);
        mem_free(block->entry[i].value);
        mem_free(block->entry[i].place);
    }
    mem_free(block->entry);
    mem_free(block->name);
    mem_free(block->place);
}

static void remove_block(struct scene *scene, struct scene_block *block)
{
    free_block(block);
    memmove(block, block + 1, (size_t)(scene->block + scene->n - (block + 1)) * sizeof *block);
    scene->n--;
}

/* Belongs to the caller; NULL with a problem. */
static char *value_of(struct source *source, const yaml_node_t *node, const char *what)
{
    char *all = NULL;
    if (node->type != YAML_SEQUENCE_NODE) {
        const char *text = text_of(source, node, what);
        return text ? copy(text) : NULL;
    }
    for (const yaml_node_item_t *item = node->data.sequence.items.start; item < node->data.sequence.items.top; item++) {
        const char *text = text_of(source, yaml_document_get_node(&source->document, *item), what);
        char *longer = text ? mem_format("scene", "%s%s%s", all ? all : "", all ? ", " : "", text) : NULL;
        mem_free(all);
        if (!(all = longer)) return NULL;
    }
    return all ? all : copy("");
}

static void read_entry(struct source *source, struct scene_block *block, const yaml_node_pair_t *pair)
{
    const yaml_node_t *key_node = yaml_document_get_node(&source->document, pair->key);
    const char *key = text_of(source, key_node, block->name);
    if (!key) return;
    char *place = place_of(source, key_node), *what = mem_format("scene", "%s.%s", block->name, key);
    const struct scene_entry *earlier = find_entry(block, key);
    const yaml_node_t *value_node = yaml_document_get_node(&source->document, pair->value);
    char *value = value_of(source, value_node, what);
    if (earlier && source->path)
        problems_add(source->problems, "%s: %s: given twice, first at %s", place, what, earlier->place);
    else if (value)
        set_entry(block, (struct scene_entry){(char *)key, value, place, !source->path, value_node->type == YAML_SEQUENCE_NODE});
    mem_free(value);
    mem_free(place);
    mem_free(what);
}

static void read_mapping(struct source *source, const char *name, const yaml_node_t *node, const char *place)
{
    struct scene_block *block = scene_find(source->scene, name);
    if (block && source->path) {
        problems_add(source->problems, "%s: %s: given twice, first at %s", place, name, block->place);
        return;
    }
    if (!block) block = add_block(source->scene, name, place);
    if (node->type != YAML_MAPPING_NODE) return;
    const yaml_node_pair_t *end = node->data.mapping.pairs.top;
    for (const yaml_node_pair_t *pair = node->data.mapping.pairs.start; pair < end; pair++)
        read_entry(source, block, pair);
}

/* The value of a top-level key: a mapping, nothing, or a switch. */
static void read_block(struct source *source, const char *name, const yaml_node_t *node, const char *place)
{
    const char *text = node->type == YAML_SCALAR_NODE ? (const char *)node->data.scalar.value : NULL;
    struct scene_block *block = scene_find(source->scene, name);
    if (node->type == YAML_MAPPING_NODE || (text && means_empty(text)))
        read_mapping(source, name, node, place);
    else if (!text || !means_off(text))
        problems_add(source->problems, "%s: %s: expects a block such as {key: value}, or off, not %s", place, name,
                     text ? text : "a list");
    else if (block && !source->path)
        remove_block(source->scene, block);
    else if (!source->path)
        problems_add(source->problems, "%s: %s=off: the scene has no block \"%s\"", place, name, name);
}

static void read_top(struct source *source, const yaml_node_pair_t *pair)
{
    const yaml_node_t *key = yaml_document_get_node(&source->document, pair->key);
    const yaml_node_t *value = yaml_document_get_node(&source->document, pair->value);
    const char *name = text_of(source, key, "a block's name");
    if (!name) return;
    char *place = place_of(source, key);
    if (strcmp(name, "title") != 0) {
        read_block(source, name, value, place);
    } else if (source->scene->title) {
        problems_add(source->problems, "%s: title: given twice", place);
    } else {
        const char *title = text_of(source, value, name);
        if (title) source->scene->title = copy(title);
    }
    mem_free(place);
}

/* The parser's complaint, with the line. A byte that is no text is told by its offset only. */
static void report_syntax(const struct source *source, const yaml_parser_t *parser, const char *text)
{
    size_t line = parser->problem_mark.line + 1;
    if (parser->error == YAML_READER_ERROR) {
        line = 1;
        for (size_t i = 0; i < parser->problem_offset; i++) line += text[i] == '\n';
    }
    const char *start = text;
    for (size_t i = 1; i < line && start; i++) start = strchr(start, '\n') ? strchr(start, '\n') + 1 : NULL;
    bool tab = start && start[strspn(start, " ")] == '\t';
    problems_add(source->problems, "%s:%zu: not valid YAML: %s%s%s%s", source->path ? source->path : "--set", line,
                 parser->problem ? parser->problem : "unknown error", parser->context ? " " : "",
                 parser->context ? parser->context : "", tab ? " (indent with spaces, not tabs)" : "");
}

/* Parses the text and hands its root node on; NULL, with a problem, if there is none. */
static const yaml_node_t *parse(struct source *source, const char *text, size_t bytes)
{
    yaml_parser_t parser;
    yaml_document_t second;
    const yaml_node_t *root = NULL;
    if (!yaml_parser_initialize(&parser)) fail(STATUS_ENVIRONMENT, "out of memory: the YAML parser");
    yaml_parser_set_input_string(&parser, (const unsigned char *)text, bytes);
    if (!yaml_parser_load(&parser, &source->document)) {
        report_syntax(source, &parser, text);
        memset(&source->document, 0, sizeof source->document);
    } else if (!(root = yaml_document_get_root_node(&source->document))) {
        problems_add(source->problems, "%s: is empty", source->path ? source->path : "--set");
    } else if (!yaml_parser_load(&parser, &second)) {
        report_syntax(source, &parser, text);
    } else {
        const yaml_node_t *more = yaml_document_get_root_node(&second);
        if (more)
            problems_add(source->problems, "%s:%zu: a second document begins here; a scene is one document",
                         source->path ? source->path : "--set", more->start_mark.line + 1);
        yaml_document_delete(&second);
    }
    yaml_parser_delete(&parser);
    return root;
}

/* The file's text with a zero byte behind, or NULL with a problem. */
static char *read_file(const char *path, size_t *bytes, struct problems *problems)
{
    FILE *file = fopen(path, "rb");
    char *text = mem_alloc("scene", LARGEST_FILE + 2);
    *bytes = file ? fread(text, 1, LARGEST_FILE + 1, file) : 0;
    if (!file || ferror(file))
        problems_add(problems, "%s: cannot be read: %s", path, strerror(errno));
    else if (*bytes >= 4 && memcmp(text, "\x89HDF", 4) == 0)
        problems_add(problems, "%s: is an HDF5 file, not a scene; a scene names it as start: {file: %s}", path, path);
    else if (*bytes > LARGEST_FILE)
        problems_add(problems, "%s: is larger than 1 MB: not a scene file", path);
    else {
        fclose(file);
        return text;
    }
    if (file) fclose(file);
    mem_free(text);
    return NULL;
}

static char *folder_of(const char *path)
{
    char *buffer = copy(path), *folder = dirname(buffer), *absolute = realpath(folder, NULL);
    char *result = copy(absolute ? absolute : folder);
    free(absolute);
    mem_free(buffer);
    return result;
}

struct scene *scene_new(const char *folder)
{
    struct scene *scene = mem_alloc("scene", sizeof *scene);
    char *absolute = realpath(folder, NULL);
    scene->folder = copy(absolute ? absolute : folder);
    free(absolute);
    return scene;
}

struct scene *scene_read(const char *path, struct problems *problems)
{
    struct scene *scene = mem_alloc("scene", sizeof *scene);
    scene->path = copy(path);
    scene->folder = folder_of(path);
    size_t bytes;
    char *text = read_file(path, &bytes, problems);
    if (!text) return scene;
    struct source source = {.scene = scene, .path = path, .problems = problems};
    const yaml_node_t *root = parse(&source, text, bytes);
    if (root && root->type != YAML_MAPPING_NODE)
        problems_add(problems, "%s:%zu: expects blocks such as gravity: {softening: 0.01}", path,
                     root->start_mark.line + 1);
    else if (root)
        for (const yaml_node_pair_t *pair = root->data.mapping.pairs.start; pair < root->data.mapping.pairs.top; pair++)
            read_top(&source, pair);
    yaml_document_delete(&source.document);
    mem_free(text);
    return scene;
}

void scene_free(struct scene *scene)
{
    if (!scene) return;
    for (int i = 0; i < scene->n; i++) free_block(&scene->block[i]);
    mem_free(scene->block);
    mem_free(scene->title);
    mem_free(scene->path);
    mem_free(scene->folder);
    mem_free(scene);
}

bool scene_default(struct scene *scene, const char *block, const char *key, const char *value, const char *place)
{
    struct scene_block *found = scene_find(scene, block);
    if (!found || find_entry(found, key)) return false;
    set_entry(found, (struct scene_entry){.key = (char *)key, .value = (char *)value, .place = (char *)place});
    return true;
}

/* --set block.key=value */
static void set_key(struct scene *scene, const char *name, const char *key, const char *value,
                    struct problems *problems)
{
    struct scene_block *block = scene_find(scene, name);
    if (block) {
        set_entry(block, (struct scene_entry){(char *)key, (char *)value, (char *)place_of_set(scene), true, false});
        return;
    }
    const char **names = mem_array("scene", const char *, scene->n + 1);
    for (int i = 0; i < scene->n; i++) names[i] = scene->block[i].name;
    const char *near = fail_nearest(name, names, scene->n);
    problems_add(problems, "--set %s.%s=%s: the scene has no block \"%s\"%s%s%s; --set %s={} before it adds one",
                 name, key, value, name, near ? " (did you mean \"" : "", near ? near : "", near ? "\"?)" : "", name);
    mem_free(names);
}

/* --set block=value, the value being YAML: {}, {key: value}, off. */
static void set_block(struct scene *scene, const char *name, const char *value, struct problems *problems)
{
    struct source source = {.scene = scene, .problems = problems};
    const yaml_node_t *root = parse(&source, value, strlen(value));
    if (root) read_block(&source, name, root, place_of_set(scene));
    yaml_document_delete(&source.document);
}

static char *trim(char *text)
{
    text += strspn(text, " \t");
    size_t length = strlen(text);
    while (length > 0 && strchr(" \t", text[length - 1])) text[--length] = '\0';
    return text;
}

void scene_set(struct scene *scene, const char *assignment, struct problems *problems)
{
    char *buffer = copy(assignment), *equals = strchr(buffer, '='), *dot = strchr(buffer, '.');
    if (dot && equals && dot > equals) dot = NULL;
    if (equals) *equals = '\0';
    if (dot) *dot = '\0';
    const char *name = trim(buffer), *key = dot ? trim(dot + 1) : NULL, *value = equals ? trim(equals + 1) : "";
    if (!*name || !*value || (key && (!*key || strchr(key, '.')))) {
        problems_add(problems, "--set %s: expects block.key=value, block={} or block=off", assignment);
    } else if (key) {
        set_key(scene, name, key, value, problems);
    } else if (strcmp(name, "title") == 0) {
        mem_free(scene->title);
        scene->title = copy(value);
    } else {
        set_block(scene, name, value, problems);
    }
    mem_free(buffer);
}
