/* SPDX-License-Identifier: GPL-3.0-or-later
 * src/h5.c: what is written is read back; damage, absence and a full disk each give one sentence. */
#include "fail.h"
#include "file/h5.h"
#include "mem.h"
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include <cmocka.h>

#define PATH "test_h5.hdf5"
enum { ROWS = 100000 };

static bool file_exists(const char *path) { return access(path, F_OK) == 0; }

static void write_sample(const char *path, int level)
{
    double *pos = mem_array("test", double, 3 * ROWS);
    uint64_t *id = mem_array("test", uint64_t, ROWS);
    for (int i = 0; i < 3 * ROWS; i++) pos[i] = 0.1 * i;
    for (int i = 0; i < ROWS; i++) id[i] = UINT64_MAX - (uint64_t)i;
    struct h5 *file = h5_create(path);
    h5_compress(file, level);
    h5_group(file, "PartType0");
    h5_write(file, "PartType0/Coordinates", 'd', ROWS, 3, pos);
    h5_write(file, "deep/er/ParticleIDs", 'u', ROWS, 1, id);
    h5_write(file, "empty", 'f', 0, 1, NULL);
    h5_attr_double(file, "/", "Time", 0.25);
    h5_attr_int(file, "PartType0", "count", -3);
    h5_attr_doubles(file, "PartType0/Coordinates", "box", (double[]){1, 2, 3}, 3);
    h5_attr_uints(file, "/", "NumPart", (uint64_t[]){5, 6}, 2);
    h5_attr_text(file, "/", "title", "Evrard’s collapse");
    h5_close(file);
    mem_free(pos);
    mem_free(id);
}

static void test_round_trip(void **state)
{
    (void)state;
    for (int level = 0; level <= 4; level += 4) {
        write_sample(PATH, level);
        assert_false(file_exists(PATH ".tmp"));
        struct h5 *file = h5_open(PATH);
        assert_null(h5_error(file));
        double *pos = mem_array("test", double, 3 * ROWS);
        float *narrow = mem_array("test", float, 3 * ROWS);
        uint64_t *id = mem_array("test", uint64_t, ROWS);
        assert_true(h5_read(file, "PartType0/Coordinates", 'd', ROWS, 3, pos));
        assert_true(h5_read(file, "PartType0/Coordinates", 'f', ROWS, 3, narrow));
        assert_true(h5_read(file, "deep/er/ParticleIDs", 'u', ROWS, 1, id));
        assert_true(h5_read(file, "empty", 'f', 0, 1, NULL));
        for (int i = 0; i < 3 * ROWS; i++) assert_true(pos[i] == 0.1 * i && narrow[i] == (float)(0.1 * i));
        for (int i = 0; i < ROWS; i++) assert_true(id[i] == UINT64_MAX - (uint64_t)i);
        mem_free(pos);
        mem_free(narrow);
        mem_free(id);
        h5_close(file);
    }
}

static void test_attributes(void **state)
{
    (void)state;
    write_sample(PATH, 0);
    struct h5 *file = h5_open(PATH);
    double v[3] = {0};
    assert_true(h5_read_attr(file, "/", "Time", v, 1) && v[0] == 0.25);
    assert_true(h5_read_attr(file, "PartType0", "count", v, 1) && v[0] == -3);
    assert_true(h5_read_attr(file, "PartType0/Coordinates", "box", v, 3) && v[2] == 3);
    assert_true(h5_read_attr(file, "/", "NumPart", v, 2) && v[1] == 6);
    assert_false(h5_read_attr(file, "/", "NumPart", v, 3));
    assert_false(h5_read_attr(file, "/", "title", v, 1));
    assert_false(h5_read_attr(file, "no/such", "thing", v, 1));
    char *title = h5_read_attr_text(file, "/", "title");
    assert_string_equal(title, "Evrard’s collapse");
    mem_free(title);
    assert_null(h5_read_attr_text(file, "/", "Time"));
    h5_close(file);
}

static void collect(const char *name, void *context)
{
    strcat(context, name);
    strcat(context, " ");
}

static void test_contents(void **state)
{
    (void)state;
    write_sample(PATH, 0);
    struct h5 *file = h5_open(PATH);
    char names[100] = "";
    int64_t rows;
    int components;
    h5_list(file, "/", collect, names);
    assert_string_equal(names, "PartType0 deep empty ");
    assert_true(h5_exists(file, "deep/er/ParticleIDs"));
    assert_false(h5_exists(file, "deep/sea/ParticleIDs"));
    assert_true(h5_shape(file, "PartType0/Coordinates", &rows, &components));
    assert_true(rows == ROWS && components == 3);
    assert_false(h5_shape(file, "PartType0", &rows, &components));
    assert_int_equal(h5_kind(file, "PartType0/Coordinates"), 'd');
    assert_int_equal(h5_kind(file, "deep/er/ParticleIDs"), 'u');
    assert_int_equal(h5_kind(file, "empty"), 'f');
    h5_close(file);
}

static void test_first_error_is_kept(void **state)
{
    (void)state;
    write_sample(PATH, 0);
    struct h5 *file = h5_open(PATH);
    double v[3];
    assert_false(h5_read(file, "PartType0/Coordinates", 'd', 1, 3, v));
    assert_false(h5_read(file, "nothing", 'd', 1, 3, v));
    assert_string_equal(h5_error(file), "has a data set PartType0/Coordinates of 100000 x 3 values where 1 x 3 belong");
    h5_close(file);
}

static void expect_refused(const char *path, const char *words)
{
    struct h5 *file = h5_open(path);
    assert_non_null(h5_error(file));
    assert_non_null(strstr(h5_error(file), words));
    h5_close(file);
}

static void test_foreign_files(void **state)
{
    (void)state;
    expect_refused("test_h5_none.hdf5", "No such file");
    expect_refused(".", "is a folder");
    FILE *stream = fopen(PATH, "w");
    fputs("POS VEL ID MASS U", stream);
    fclose(stream);
    expect_refused(PATH, "is not an HDF5 file");
    write_sample(PATH, 0);
    assert_int_equal(truncate(PATH, 100000), 0);
    expect_refused(PATH, "is truncated or damaged");
}

/* One flipped bit in the data is found by the checksum. */
static void test_damage(void **state)
{
    (void)state;
    write_sample(PATH, 0);
    FILE *stream = fopen(PATH, "r+");
    fseek(stream, 600000, SEEK_SET);
    int byte = fgetc(stream);
    fseek(stream, 600000, SEEK_SET);
    fputc(byte ^ 1, stream);
    fclose(stream);
    struct h5 *file = h5_open(PATH);
    double *pos = mem_array("test", double, 3 * ROWS);
    assert_null(h5_error(file));
    assert_false(h5_read(file, "PartType0/Coordinates", 'd', ROWS, 3, pos));
    assert_non_null(strstr(h5_error(file), "is damaged: PartType0/Coordinates cannot be read"));
    mem_free(pos);
    h5_close(file);
}

static int child_status(const char *path, rlim_t file_size)
{
    fflush(NULL);
    pid_t child = fork();
    if (child == 0) {
        fclose(stderr);
        signal(SIGXFSZ, SIG_IGN);
        setrlimit(RLIMIT_FSIZE, &(struct rlimit){file_size, file_size});
        write_sample(path, 0);
        _exit(0);
    }
    int status = 0;
    waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

/* A disk that fills up: status 5, no temporary file, and the file of before is still whole. */
static void test_disk_full(void **state)
{
    (void)state;
    write_sample(PATH, 0);
    for (rlim_t size = 0; size <= 3000000; size += 600000) {
        assert_int_equal(child_status(PATH, size), STATUS_ENVIRONMENT);
        assert_false(file_exists(PATH ".tmp"));
    }
    assert_int_equal(child_status("no/such/folder/a.hdf5", RLIM_INFINITY), STATUS_ENVIRONMENT);
    struct h5 *file = h5_open(PATH);
    assert_null(h5_error(file));
    h5_close(file);
}

static int remove_files(void **state)
{
    (void)state;
    return remove(PATH);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trip),   cmocka_unit_test(test_attributes),
        cmocka_unit_test(test_contents),     cmocka_unit_test(test_first_error_is_kept),
        cmocka_unit_test(test_foreign_files), cmocka_unit_test(test_damage),
        cmocka_unit_test(test_disk_full),
    };
    return cmocka_run_group_tests_name("h5", tests, NULL, remove_files);
}
