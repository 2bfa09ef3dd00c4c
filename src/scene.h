/* SPDX-License-Identifier: GPL-3.0-or-later
 * A scene file: YAML of two levels, block and key (libyaml), with --set on top. Holds text only;
 * meaning comes from parameter tables (param.h). Every value remembers where it was written. */
#ifndef TEPHRA_SCENE_H
#define TEPHRA_SCENE_H
#include <stdbool.h>

struct problems;

struct scene_entry {
    char *key, *value;
    char *place;        /* "evrard.yml:12", "--set", "command line" */
    bool typed;         /* on the command line: relative paths start from the working directory */
    bool list;          /* written as [a, b]; the value is "a, b", as it is typed after --set */
};
struct scene_block { char *name; char *place; struct scene_entry *entry; int n; };
struct scene {
    char *path, *folder;            /* as given; folder that relative paths start from */
    char *title;
    struct scene_block *block; int n;
};

/* Reads a scene file. Syntax errors, a key given twice and nesting deeper than two levels go to
 * `problems`. A flow mapping ({a: 1}) and a block mapping are the same. `sph: {}` and `sph:` make
 * an empty block; `sph: off` makes none. */
struct scene *scene_read(const char *path, struct problems *problems);
/* An empty scene whose relative paths start from `folder`. */
struct scene *scene_new(const char *folder);
void scene_free(struct scene *scene);
/* Applies "block.key=value", "block={}" or "block=off". A key of an absent block is a problem. */
void scene_set(struct scene *scene, const char *assignment, struct problems *problems);
/* Gives block.key a value unless it has one, or the scene no such block; place: as scene_place shall say it. */
bool scene_default(struct scene *scene, const char *block, const char *key, const char *value, const char *place);
struct scene_block *scene_find(const struct scene *scene, const char *block);
/* Text of block.key, or NULL. */
const char *scene_value(const struct scene *scene, const char *block, const char *key);
/* The end of a message about a name with a colon in it: {softening:0.05} is one word to YAML. */
extern const char scene_colon_advice[];
/* Where block.key was written ("evrard.yml:12", "--set"): for messages. Without such a key (or with
 * NULL) the block's place, without such a block the file's name. */
const char *scene_place(const struct scene *scene, const char *block, const char *key);
#endif
