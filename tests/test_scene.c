/* SPDX-License-Identifier: GPL-3.0-or-later
 * Scene files: what is read, where it stood, and that every malformed one is a problem, never a crash. */
#include "scene.h"
#include "fail.h"
#include "mem.h"
#include "random.h"
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>

struct outcome { struct scene *scene; struct problems problems; };

/* Reads a scene of these bytes from a file called scene.yml in a folder of its own. */
static struct outcome read_bytes(const char *bytes, size_t count)
{
    char folder[] = "/tmp/tephra-test-XXXXXX";
    assert_non_null(mkdtemp(folder));
    assert_int_equal(chdir(folder), 0);
    FILE *file = fopen("scene.yml", "wb");
    assert_int_equal(fwrite(bytes, 1, count, file), count);
    fclose(file);
    struct outcome outcome = {NULL, {0, NULL}};
    outcome.scene = scene_read("scene.yml", &outcome.problems);
    assert_non_null(outcome.scene);
    unlink("scene.yml");
    assert_int_equal(chdir("/"), 0);
    rmdir(folder);
    return outcome;
}

static struct outcome read_text(const char *text) { return read_bytes(text, strlen(text)); }

static void discard(struct outcome *outcome)
{
    scene_free(outcome->scene);
    mem_free(outcome->problems.text);
}

static void test_example(void **state)
{
    (void)state;
    size_t before = mem_now();
    struct outcome o = read_text(
        "# a comment\n"
        "title: Evrard collapse\n"
        "units: {G: 1}    # dimensionless\n"
        "start: {generator: evrard, n: 30000}\n"
        "gravity:\n"
        "    softening: 0.003\n"
        "    accuracy: 1e-3\n"
        "sph:\n"
        "cooling: off\n"
        "stars: {}\n");
    assert_int_equal(o.problems.count, 0);
    assert_string_equal(o.scene->title, "Evrard collapse");
    assert_int_equal(o.scene->n, 5);
    assert_string_equal(scene_value(o.scene, "units", "G"), "1");
    assert_string_equal(scene_value(o.scene, "start", "n"), "30000");
    assert_string_equal(scene_value(o.scene, "gravity", "accuracy"), "1e-3");
    assert_null(scene_value(o.scene, "gravity", "order"));
    assert_null(scene_value(o.scene, "nothing", "order"));
    assert_non_null(scene_find(o.scene, "sph"));
    assert_int_equal(scene_find(o.scene, "sph")->n, 0);
    assert_int_equal(scene_find(o.scene, "stars")->n, 0);
    assert_null(scene_find(o.scene, "cooling"));
    const struct scene_block *gravity = scene_find(o.scene, "gravity");
    assert_string_equal(gravity->place, "scene.yml:5");
    assert_string_equal(gravity->entry[1].place, "scene.yml:7");
    assert_true(o.scene->folder[0] == '/');
    discard(&o);
    assert_int_equal(mem_now(), before);
}

static void test_malformed(void **state)
{
    (void)state;
    static const struct { const char *text; int count; const char *says; } table[] = {
        {"", 1, "scene.yml: is empty"},
        {"\n\n# only a comment\n", 1, "scene.yml: is empty"},
        {"gravity", 1, "scene.yml:1: expects blocks"},
        {"- a\n- b\n", 1, "scene.yml:1: expects blocks"},
        {"gravity: 3\n", 1, "scene.yml:1: gravity: expects a block such as {key: value}, or off, not 3"},
        {"a: {b: 1}\ngravity: [1, 2]\n", 1, "scene.yml:2: gravity: expects a block"},
        {"sph:\n  n: 1\n  n: 2\n", 1, "scene.yml:3: sph.n: given twice, first at scene.yml:2"},
        {"sph: {n: 1}\n\nsph: {n: 2}\n", 1, "scene.yml:3: sph: given twice, first at scene.yml:1"},
        {"title: a\ntitle: b\n", 1, "scene.yml:2: title: given twice"},
        {"title: {a: b}\n", 1, "scene.yml:1: title: expects one number, word or text"},
        {"sph:\n  a: {b: 1}\n", 1, "scene.yml:2: sph.a: expects one number, word or text, not a block"},
        {"sph:\n  a: [1, [2]]\n", 1, "scene.yml:2: sph.a: expects one number, word or text, not a list"},
        {"sph:\n  ? [1, 2]\n  : 3\n", 1, "scene.yml:2: sph: expects one number"},
        {"sph:\n\tn: 1\n", 1, "scene.yml:2: not valid YAML"},
        {"sph:\n\tn: 1\n", 1, "indent with spaces, not tabs"},
        {"sph: {n: 1\n", 1, "not valid YAML" },
        {"sph: {n: 1}}\n", 1, "scene.yml:1: not valid YAML" },
        {"sph:\n   n: 1\n  m: 2\n", 1, "scene.yml:3: not valid YAML"},
        {"sph: {n: \"abc}\n", 1, "not valid YAML"},
        {"sph: *nowhere\n", 1, "not valid YAML"},
        {"%YAML 7.3\n---\nsph: {}\n", 1, "not valid YAML"},
        {"sph: {n: 1}\n---\ngravity: {}\n", 1, "scene.yml:3: a second document"},
        {"sph: {a: \"x\\0y\"}\n", 1, "text with a zero byte"},
        {"a: 1\nb: 2\nc: {d: 1, d: 2}\n", 3, "scene.yml:3: c.d: given twice"},
        {"# \xc3\x28\nsph: {}\n", 1, "scene.yml:1: not valid YAML"},
        {"sph: {}\ntitle: \xff\xfe\n", 1, "scene.yml:2: not valid YAML"},
        {"sph: {}\ntitle: \x01\n", 1, "scene.yml:2: not valid YAML"},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        struct outcome o = read_text(table[i].text);
        if (o.problems.count != table[i].count || !strstr(o.problems.text, table[i].says))
            fail_msg("case %zu: %d problems:\n%s", i, o.problems.count, o.problems.text ? o.problems.text : "");
        discard(&o);
    }
}

static void test_odd_but_valid(void **state)
{
    (void)state;
    struct outcome o = read_text("\xef\xbb\xbf%YAML 1.1\n---\n\"sph\": {'n' : '1 kpc', m: &x 2, k: *x, empty: , list: [1 pc, two, *x], none: []}\n"
                                 "title: \xce\xb1 Centauri\n...\n");
    assert_int_equal(o.problems.count, 0);
    assert_string_equal(scene_value(o.scene, "sph", "n"), "1 kpc");
    assert_string_equal(scene_value(o.scene, "sph", "k"), "2");
    assert_string_equal(scene_value(o.scene, "sph", "empty"), "");
    assert_string_equal(scene_value(o.scene, "sph", "list"), "1 pc, two, 2");
    assert_string_equal(scene_value(o.scene, "sph", "none"), "");
    assert_string_equal(o.scene->title, "\xce\xb1 Centauri");
    discard(&o);
    o = read_text("sph: {n: 1}\r\ngravity: {a: 2}\r\n");
    assert_int_equal(o.problems.count, 0);
    assert_string_equal(scene_value(o.scene, "sph", "n"), "1");
    discard(&o);
}

static void test_large_and_deep(void **state)
{
    (void)state;
    enum {BYTES = 3 << 20, DEEP = 20000};
    char *text = malloc(BYTES);
    memset(text, 'x', BYTES);
    struct outcome o = read_bytes(text, BYTES);
    assert_int_equal(o.problems.count, 1);
    assert_non_null(strstr(o.problems.text, "larger than 1 MB"));
    discard(&o);
    memset(text, '[', DEEP);
    o = read_bytes(text, DEEP);
    assert_int_equal(o.problems.count, 1);
    discard(&o);
    memcpy(text, "sph: ", 5);
    for (int i = 5; i + 3 < DEEP; i += 3) memcpy(text + i, "{a:", 3);
    o = read_bytes(text, DEEP - 3);
    assert_true(o.problems.count >= 1);
    discard(&o);
    memcpy(text, "\x89HDF\r\n\x1a\n", 8);
    o = read_bytes(text, 2000);
    assert_non_null(strstr(o.problems.text, "HDF5 file, not a scene"));
    discard(&o);
    free(text);
    struct problems problems = {0, NULL};
    scene_free(scene_read("/nowhere/scene.yml", &problems));
    scene_free(scene_read("/tmp", &problems));
    assert_int_equal(problems.count, 2);
    assert_non_null(strstr(problems.text, "/nowhere/scene.yml: cannot be read: No such file"));
    assert_non_null(strstr(problems.text, "/tmp: cannot be read: Is a directory"));
    mem_free(problems.text);
}

static void test_set(void **state)
{
    (void)state;
    struct outcome o = read_text("gravity: {softening: 0.1, order: 2}\ncooling: {}\n");
    static const char *const good[] = {
        "gravity.softening=0.2", "gravity.solver = tree", "sph={}", "sph.neighbours=40", "cooling=off",
        "stars={imf: kroupa, mass: 3 Msun}", "gravity={accuracy: 1e-4}", "start={}", "start.file=a=b.hdf5",
        "title=new title", "clouds=on",
    };
    for (size_t i = 0; i < sizeof good / sizeof *good; i++) scene_set(o.scene, good[i], &o.problems);
    assert_int_equal(o.problems.count, 0);
    assert_string_equal(scene_value(o.scene, "gravity", "softening"), "0.2");
    assert_string_equal(scene_value(o.scene, "gravity", "order"), "2");
    assert_string_equal(scene_value(o.scene, "gravity", "solver"), "tree");
    assert_string_equal(scene_value(o.scene, "gravity", "accuracy"), "1e-4");
    assert_string_equal(scene_value(o.scene, "sph", "neighbours"), "40");
    assert_string_equal(scene_value(o.scene, "stars", "mass"), "3 Msun");
    assert_string_equal(scene_value(o.scene, "start", "file"), "a=b.hdf5");
    assert_string_equal(o.scene->title, "new title");
    assert_null(scene_find(o.scene, "cooling"));
    assert_non_null(scene_find(o.scene, "clouds"));
    assert_string_equal(scene_find(o.scene, "sph")->entry[0].place, "--set");
    assert_string_equal(scene_find(o.scene, "gravity")->place, "scene.yml:1");
    discard(&o);
}

static void test_set_wrong(void **state)
{
    (void)state;
    static const struct { const char *assignment, *says; } table[] = {
        {"grvity.softening=0.2", "the scene has no block \"grvity\" (did you mean \"gravity\"?)"},
        {"sph.neighbours=40", "--set sph={} before it adds one"},
        {"cooling=off", "cooling=off: the scene has no block"},
        {"sph", "expects block.key=value, block={} or block=off"},
        {"", "expects block.key=value"},
        {"=", "expects block.key=value"},
        {".=1", "expects block.key=value"},
        {"gravity.=1", "expects block.key=value"},
        {"gravity.softening=", "expects block.key=value"},
        {"gravity.softening", "expects block.key=value"},
        {"a.b.c=1", "expects block.key=value"},
        {"sph=3", "expects a block such as {key: value}, or off, not 3"},
        {"sph={", "not valid YAML" },
        {"sph={a: {b: 1}}", "sph.a: expects one number" },
        {"sph=[1]", "expects a block"},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        struct outcome o = read_text("gravity: {softening: 0.1}\n");
        scene_set(o.scene, table[i].assignment, &o.problems);
        if (o.problems.count != 1 || !strstr(o.problems.text, table[i].says))
            fail_msg("case %zu: %d problems:\n%s", i, o.problems.count, o.problems.text ? o.problems.text : "");
        assert_string_equal(scene_value(o.scene, "gravity", "softening"), "0.1");
        discard(&o);
    }
    struct scene *scene = scene_new(".");
    struct problems none = {0, NULL};
    scene_set(scene, "gravity={}", &none);
    scene_set(scene, "gravity.softening=1", &none);
    assert_int_equal(none.count, 0);
    assert_true(scene->folder[0] == '/' && !scene->path);
    scene_free(scene);
}

/* Random damage to a good scene: whatever is read, the program survives and frees all it took. */
static void test_damage(void **state)
{
    (void)state;
    static const char good[] = "title: Evrard\nunits: {G: 1}\nstart:\n  generator: evrard\n  n: 30000\n"
                               "time: {end: 3, integrator: leapfrog}\ngravity: {softening: 0.003, accuracy: 1e-3}\n";
    static const char bytes[] = "{}[]:,#&*!|>'\"%@`-? \t\n\r\\\x00\x01\xff\xc3~=";
    size_t before = mem_now();
    for (uint64_t i = 0; i < 2000; i++) {
        char text[sizeof good];
        memcpy(text, good, sizeof good);
        struct random key = {1, i, 0, random_stream("damage")};
        for (uint64_t hit = 0; hit < 1 + i % 4; hit++) {
            size_t at = (size_t)(random_uniform(&key, 2 * hit) * (sizeof good - 1));
            text[at] = bytes[(size_t)(random_uniform(&key, 2 * hit + 1) * (sizeof bytes - 1))];
        }
        struct outcome o = read_bytes(text, (size_t)(random_uniform(&key, 100) * sizeof good));
        assert_true(o.problems.count == 0 || (o.problems.text && *o.problems.text));
        discard(&o);
    }
    assert_int_equal(mem_now(), before);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_example), cmocka_unit_test(test_malformed), cmocka_unit_test(test_odd_but_valid),
        cmocka_unit_test(test_large_and_deep), cmocka_unit_test(test_set), cmocka_unit_test(test_set_wrong),
        cmocka_unit_test(test_damage),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
