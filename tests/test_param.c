/* SPDX-License-Identifier: GPL-3.0-or-later
 * Parameter tables: each type read, refused and written back; every message a user may see. */
#include "param.h"
#include "fail.h"
#include "mem.h"
#include "scene.h"
#include "units.h"
#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>

struct values {
    double softening, accuracy, temperature, limit;
    int64_t n, seed;
    bool flag;
    int solver;
    char *name, *file;
    struct param_list list;
};

static const struct param table[] = {
    {"softening", PARAM_REAL, "length", NULL, 0, 1e30, NULL, "Softening length.", true,
     offsetof(struct values, softening)},
    {"accuracy", PARAM_REAL, "", "1e-3", 1e-7, 0.3, NULL, "Error of 99 % of the rows.", false,
     offsetof(struct values, accuracy)},
    {"temperature", PARAM_REAL, "temperature", "1e4 K", 0, 1e12, NULL, "Floor.", false,
     offsetof(struct values, temperature)},
    {"limit", PARAM_REAL, "energy", "none", 0, 0, NULL, "Limit.", false, offsetof(struct values, limit)},
    {"n", PARAM_COUNT, "", "1000", 1, 2e9, NULL, "Rows.", false, offsetof(struct values, n)},
    {0}
};
static const struct param second_table[] = {
    {"seed", PARAM_COUNT, "", "none", 0, 0, NULL, "Seed.", false, offsetof(struct values, seed)},
    {"flag", PARAM_FLAG, "", "off", 0, 0, NULL, "A switch.", false, offsetof(struct values, flag)},
    {"solver", PARAM_CHOICE, "", "auto", 0, 0, "auto|direct|tree", "-k\\n. Way.", false,
     offsetof(struct values, solver)},
    {"name", PARAM_TEXT, "", "", 0, 0, NULL, "Name.", false, offsetof(struct values, name)},
    {"file", PARAM_PATH, "", "none", 0, 0, NULL, ".Path.", false, offsetof(struct values, file)},
    {"list", PARAM_LIST, "length", "1, 2.5", 0, 100, NULL, "Numbers.", false, offsetof(struct values, list)},
    {0}
};

static const struct units plain = {false, 1, 1, 1, 1};
static const struct units physical = {true, 3.0856775814913673e21, 1.98841e43, 1e5, 43009.17};

static void read_block(const char *block, const struct units *units, struct values *values, struct problems *problems)
{
    struct scene *scene = scene_new("/somewhere");
    char *assignment = mem_format("test", "gravity={%s}", block);
    if (block) scene_set(scene, assignment, problems);
    mem_free(assignment);
    *values = (struct values){0};
    const struct param_target targets[] = {{table, values}, {second_table, values}, {NULL, NULL}};
    param_read(scene, "gravity", targets, units, problems);
    scene_free(scene);
}

static void free_values(struct values *values)
{
    param_free((const struct param_target[]){{table, values}, {second_table, values}, {NULL, NULL}});
}

static void test_good(void **state)
{
    (void)state;
    struct problems none = {0, NULL};
    struct values v;
    size_t before = mem_now();
    read_block("softening: 0.1", &plain, &v, &none);
    assert_true(v.softening == 0.1 && v.accuracy == 1e-3 && v.temperature == 1e4 && isnan(v.limit));
    assert_true(v.n == 1000 && v.seed == -1 && !v.flag && v.solver == 0 && !v.file);
    assert_true(v.list.n == 2 && v.list.value[0] == 1 && v.list.value[1] == 2.5);
    assert_string_equal(v.name, "");
    free_values(&v);
    read_block("softening: 3 kpc, limit: 1e51 erg, n: 1e5, seed: 9223372036854775807, flag: yes, solver: tree, "
               "name: 'a \"b\"', file: x/y.hdf5, temperature: 20K, "
               "list: '1 kpc, 20 pc'", &physical, &v, &none);
    assert_true(v.softening == 3.0 && v.temperature == 20.0 && fabs(v.limit * 1.98841e53 / 1e51 - 1.0) < 1e-12);
    assert_true(v.n == 100000 && v.seed == INT64_MAX && v.flag && v.solver == 2);
    assert_true(v.list.n == 2 && v.list.value[0] == 1 && fabs(v.list.value[1] / 0.02 - 1) < 1e-12);
    assert_string_equal(v.name, "a \"b\"");
    char *here = getcwd(NULL, 0), *path = mem_format("test", "%s/x/y.hdf5", here);
    assert_string_equal(v.file, path);      /* typed on the command line, not in a file */
    mem_free(path);
    free(here);
    free_values(&v);
    read_block("softening: 0, limit: none, file: /x.hdf5, seed: none", &plain, &v, &none);
    assert_true(v.softening == 0.0 && isnan(v.limit) && v.seed == -1);
    assert_string_equal(v.file, "/x.hdf5");
    free_values(&v);
    assert_int_equal(none.count, 0);
    assert_int_equal(mem_now(), before);
}

static void test_messages(void **state)
{
    (void)state;
    static const struct { const char *block; bool physical; const char *says; } cases[] = {
        {"softening: -0.1", false, "command line: gravity.softening = -0.1: must lie in 0 ... 1e30"},
        {"softening: 3 Msun", true, "command line: gravity.softening = 3 Msun: expects a length, not a mass (Msun)"},
        {"softening: 3 kpc", false, "gravity.softening = 3 kpc: has a unit (kpc), but the scene is dimensionless"},
        {"softening: -3 pc", true, "gravity.softening = -3 pc: must lie in 0 ... 1e30 in code units"},
        {"softening: abc", false, "gravity.softening = abc: is not a number"},
        {"softening: [1]", false, "gravity.softening: expects one value, not the list [1]"},
        {"softening: 0.7abc", false, "gravity.softening = 0.7abc: unknown unit \"abc\""},
        {"softening: nan", false, "gravity.softening = nan: is not a number"},
        {"softening: 1e31", false, "must lie in"},
        {"softening: none", false, "gravity.softening = none: is not a number"},
        {"softening: ", false, "gravity.softening: has no value"},
        {"softening: 1, acuracy: 2", false, "command line: gravity.acuracy: unknown key (did you mean \"accuracy\"?)"},
        {"softening: 1, zzzzzz: 2", false, "command line: gravity.zzzzzz: unknown key\n"},
        {"softening: 1, accuracy: 0.31", false, "gravity.accuracy = 0.31: must lie in 1e-7 ... 0.3"},
        {"softening: 1, n: 1.5", false, "gravity.n = 1.5: expects a whole number"},
        {"softening: 1, n: 12abc", false, "gravity.n = 12abc: expects a whole number"},
        {"softening: 1, n: 3 kpc", true, "gravity.n = 3 kpc: expects a whole number"},
        {"softening: 1, n: 0", false, "gravity.n = 0: must lie in 1 ... 2e9"},
        {"softening: 1, n: none", false, "gravity.n = none: expects a whole number"},
        {"softening: 1, seed: 9223372036854775808", false, "too large"},
        {"softening: 1, seed: 1e19", false, "too large"},
        {"softening: 1, flag: maybe", false, "gravity.flag = maybe: expects on or off"},
        {"softening: 1, solver: tre", false, "must be one of auto|direct|tree (did you mean \"tree\"?)"},
        {"softening: 1, solver: ewald", false, "must be one of auto|direct|tree\n"},
        {"softening: 1, list: '1,,2'", false, "gravity.list = 1,,2: has no value"},
        {"softening: 1, list: '1,101'", false, "gravity.list = 1,101: must lie in 0 ... 100"},
        {"softening: 1, list: '1,2 K'", true, "expects a length, not a temperature"},
        {"softening: 1, list: '1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1'", false, "has more than 24 numbers"},
        {"accuracy: 1e-2", false, "command line: gravity.softening: must be given (Softening length.)"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct problems problems = {0, NULL};
        struct values v;
        read_block(cases[i].block, cases[i].physical ? &physical : &plain, &v, &problems);
        if (problems.count != 1 || !strstr(problems.text, cases[i].says))
            fail_msg("%s: %d problems:\n%s", cases[i].block, problems.count, problems.text ? problems.text : "");
        free_values(&v);
        mem_free(problems.text);
    }
}

/* All mistakes of a scene are told at once, each with its line. */
static void test_together(void **state)
{
    (void)state;
    struct problems problems = {0, NULL};
    struct values v = {0};
    char path[] = "/tmp/tephra-test-XXXXXX";
    FILE *file = fdopen(mkstemp(path), "w");
    fputs("units: {G: 1}\ngravity:\n  softening: -0.1\n  # why not\n  solvr: tree\n  n: many\n", file);
    fclose(file);
    struct scene *scene = scene_read(path, &problems);
    const struct param_target targets[] = {{table, &v}, {second_table, &v}, {NULL, NULL}};
    param_read(scene, "gravity", targets, &plain, &problems);
    param_free(targets);
    char *wanted = mem_format("test", "%s:3: gravity.softening = -0.1: must lie in 0 ... 1e30\n"
                              "%s:6: gravity.n = many: expects a whole number\n"
                              "%s:5: gravity.solvr: unknown key (did you mean \"solver\"?)\n", path, path, path);
    assert_int_equal(problems.count, 3);
    assert_string_equal(problems.text, wanted);
    mem_free(problems.text);
    mem_free(wanted);
    problems = (struct problems){0, NULL};
    param_read(scene, "absent", targets, &plain, &problems);
    param_free(targets);
    wanted = mem_format("test", "%s: absent.softening: must be given (Softening length.)\n", path);
    assert_string_equal(problems.text, wanted);
    mem_free(problems.text);
    mem_free(wanted);
    scene_free(scene);
    remove(path);
}

/* A path that stands in a scene file starts from that file's folder. */
static void test_path(void **state)
{
    (void)state;
    struct problems none = {0, NULL};
    struct values v = {0};
    char folder[] = "/tmp/tephra-test-XXXXXX";
    assert_non_null(mkdtemp(folder));
    char *path = mem_format("test", "%s/scene.yml", folder), *wanted = mem_format("test", "%s/sub/x.hdf5", folder);
    FILE *file = fopen(path, "w");
    fputs("gravity: {file: sub/x.hdf5}\n", file);
    fclose(file);
    struct scene *scene = scene_read(path, &none);
    const struct param_target targets[] = {{second_table, &v}, {NULL, NULL}};
    param_read(scene, "gravity", targets, &plain, &none);
    assert_int_equal(none.count, 0);
    assert_string_equal(v.file, wanted);
    param_free(targets);
    scene_free(scene);
    remove(path);
    remove(folder);
    mem_free(path);
    mem_free(wanted);
}

/* A default that a dimensionless scene cannot have must be given. */
static void test_default_with_unit(void **state)
{
    (void)state;
    static const struct param cloud[] = {
        {"radius", PARAM_REAL, "length", "50 pc", 0, 0, NULL, "Radius.", false, offsetof(struct values, softening)}, {0}
    };
    struct problems problems = {0, NULL};
    struct values v = {0};
    struct scene *scene = scene_new("/");
    scene_set(scene, "clouds={}", &problems);
    const struct param_target targets[] = {{cloud, &v}, {NULL, NULL}};
    param_read(scene, "clouds", targets, &physical, &problems);
    assert_true(problems.count == 0 && v.softening == 0.05);
    param_read(scene, "clouds", targets, &plain, &problems);
    assert_int_equal(problems.count, 1);
    assert_non_null(strstr(problems.text, "clouds.radius: must be given; its default, 50 pc, does not fit: has a"));
    mem_free(problems.text);
    scene_free(scene);
}

static void round_trip(const struct values *first)
{
    struct problems none = {0, NULL};
    struct values copy = *first, second = {0};
    const struct param_target out[] = {{table, &copy}, {second_table, &copy}, {NULL, NULL}};
    const struct param_target in[] = {{table, &second}, {second_table, &second}, {NULL, NULL}};
    char path[] = "/tmp/tephra-test-XXXXXX";
    FILE *file = fdopen(mkstemp(path), "w");
    fputs("gravity:\n", file);
    param_write(file, out);
    fclose(file);
    struct scene *scene = scene_read(path, &none);
    param_read(scene, "gravity", in, &physical, &none);
    remove(path);
    scene_free(scene);
    if (none.count) fail_msg("%s", none.text);
    assert_true(memcmp(&first->softening, &second.softening, sizeof first->softening) == 0);
    assert_true(first->accuracy == second.accuracy && first->temperature == second.temperature);
    assert_true(first->limit == second.limit || (isnan(first->limit) && isnan(second.limit)));
    assert_true(first->n == second.n && first->seed == second.seed);
    assert_true(first->flag == second.flag && first->solver == second.solver);
    assert_int_equal(first->list.n, second.list.n);
    for (int k = 0; k < first->list.n; k++) assert_true(first->list.value[k] == second.list.value[k]);
    if (first->name) assert_string_equal(first->name, second.name);
    if (first->file) assert_string_equal(first->file, second.file);
    else assert_null(second.file);
    param_free(in);
}

static void test_round_trip(void **state)
{
    (void)state;
    const struct values table_of_values[] = {
        {0.1, 1e-3, 1e4, NAN, 30000, -1, false, 0, (char[]){""}, NULL, {1, {1.0 / 3}}},
        {1.0 / 3, nextafter(0.1, 1), 123456.789012345678, -DBL_MAX, 1, INT64_MAX, true, 2,
          (char[]){ "quotes \" ' and \\ and : # {x}\n\ttab \xce\xb1" }, (char[]){ "/a b/\"c\".hdf5" },
          {3, {5e-324, 0.1, 100}} },
        { 5e-324, 0.3, 0.0, DBL_MIN, 2000000000, INT64_MIN, true, 1, (char[]){ "no" }, (char[]){ "/x" }, {2, {0, 1}} },
    };
    for (size_t i = 0; i < sizeof table_of_values / sizeof *table_of_values; i++) round_trip(&table_of_values[i]);
}

static void test_describe(void **state)
{
    (void)state;
    char text[4000] = "", roff[4000] = "";
    FILE *stream = fmemopen(text, sizeof text, "w");
    param_describe(stream, "gravity", table, false);
    fclose(stream);
    assert_non_null(strstr(text, "gravity.softening"));
    assert_non_null(strstr(text, "(required)"));
    assert_non_null(strstr(text, "length, 0 or more; may change at a restart"));
    stream = fmemopen(roff, sizeof roff, "w");
    param_describe(stream, "gravity", second_table, true);
    fclose(stream);
    assert_non_null(strstr(roff, ".TP\n.B gravity.solver\n\\-k\\en. Way.\n(auto|direct|tree; default auto)\n"));
    assert_non_null(strstr(roff, "\\&.Path.\n(path; default none)\n"));
}

/* A default may depend on the block's preset; what is written stands above it. */
static void test_presets(void **state)
{
    (void)state;
    struct chosen { int preset, kernel; int64_t n; double alpha; };
    static const struct param chosen[] = {
        {"kernel", PARAM_CHOICE, "", "cubic|wendland", 0, 0, "cubic|wendland", "W.", false, offsetof(struct chosen, kernel)},
        {"n", PARAM_COUNT, "", "50|100", 1, 1000, NULL, "N.", false, offsetof(struct chosen, n)},
        {"alpha", PARAM_REAL, "", "1", 0, 10, NULL, "A.", false, offsetof(struct chosen, alpha)},
        {"preset", PARAM_CHOICE, "", "classic", 0, 0, "classic|modern", "P.", false, offsetof(struct chosen, preset)},
        {0}
    };
    static const struct { const char *block; struct chosen values; } cases[] = {
        {"sph={}", {0, 0, 50, 1}}, {"sph={preset: modern}", {1, 1, 100, 1}},
        {"sph={preset: modern, n: 60, alpha: 2}", {1, 1, 60, 2}}, {"sph={preset: classic, kernel: wendland}", {0, 1, 50, 1}},
    };
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        struct problems problems = {0};
        struct scene *scene = scene_new("/somewhere");
        struct chosen values;
        scene_set(scene, cases[c].block, &problems);
        param_read(scene, "sph", (struct param_target[]){{chosen, &values}, {NULL, NULL}}, &plain, &problems);
        assert_int_equal(problems.count, 0);
        assert_int_equal(values.preset, cases[c].values.preset);
        assert_int_equal(values.kernel, cases[c].values.kernel);
        assert_int_equal(values.n, cases[c].values.n);
        assert_float_equal(values.alpha, cases[c].values.alpha, 0);
        scene_free(scene);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_presets),
        cmocka_unit_test(test_good), cmocka_unit_test(test_messages), cmocka_unit_test(test_together),
        cmocka_unit_test(test_path),
        cmocka_unit_test(test_default_with_unit), cmocka_unit_test(test_round_trip), cmocka_unit_test(test_describe),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
