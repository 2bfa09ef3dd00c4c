/* SPDX-License-Identifier: GPL-3.0-or-later
 * src/checkpoint.c: a simulation comes back bit for bit, and what does not fit is refused by name. */
#include "file/checkpoint.h"
#include "file/h5.h"
#include "log.h"
#include "mem.h"
#include "module.h"
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>

#define PATH "test_checkpoint.hdf5"
#define PREVIOUS "test_checkpoint.previous.hdf5"
enum { ROWS = 5000 };
static const int64_t longest = (int64_t)1 << RUNG_TOP;

struct opening { double scale; int32_t scratch; float history[3]; };
static const struct saved opening_saved[] = {
    {"scale", offsetof(struct opening, scale), sizeof(double)},
    {"history", offsetof(struct opening, history), sizeof(float[3])}, {0}};
static const struct module opening = {.name = "opening", .saved = opening_saved, .state_bytes = sizeof(struct opening)};
static const struct module plain = {.name = "plain"};

struct run { struct sim sim; struct opening state; struct use use[2]; };

static struct run *new_run(double dt_max)
{
    struct run *run = mem_alloc("test", sizeof *run);
    struct sim *sim = &run->sim;
    run->use[0] = (struct use){&opening, &run->state};
    run->use[1] = (struct use){&plain, NULL};
    sim->use = run->use;
    sim->n_use = 2;
    sim->time = (struct timeline){.dt_max = dt_max, .tick_end = INT64_MAX, .snapshot = 2 * longest, .energy = longest,
                                  .picture = 3 * longest};
    for (int s = 0; s < N_SPECIES; s++) {
        sim->species[s].kind = s;
        for (enum column c = COLUMN_pos; c <= COLUMN_rung0; c++) species_need(&sim->species[s], c);
        species_need(&sim->species[s], COLUMN_dt);
    }
    species_need(&sim->species[GAS], COLUMN_u);
    return run;
}

static void free_run(struct run *run)
{
    for (int s = 0; s < N_SPECIES; s++) species_free(&run->sim.species[s]);
    mem_free(run->sim.problems.text);
    mem_free(run);
}

/* Every byte of every column different. */
static struct run *sample(void)
{
    struct run *run = new_run(0.1);
    struct sim *sim = &run->sim;
    unsigned byte = 1;
    for (int s = 0; s < N_SPECIES; s++) {
        struct species *table = &sim->species[s];
        int64_t n = s == CLOUD ? 0 : ROWS + s;
        species_reserve(table, n);
        table->n = table->n_own = n;
        for (int c = 0; c < N_COLUMNS; c++) {
            unsigned char *data = species_column(table, c);
            for (size_t i = 0; data && i < (size_t)n * species_row_bytes(c); i++)
                data[i] = (unsigned char)((byte = byte * 1664525 + 1013904223) >> 24);
        }
    }
    sim->time.start = 0.5;
    sim->time.tick = 12345678901234567;     /* more than a double holds */
    sim->seed = 0xfedcba9876543210;
    sim->steps = 42;
    sim->updates = 4242;
    run->state = (struct opening){0.7, 99, {1, 2, 3}};
    return run;
}

static void test_round_trip(void **state)
{
    (void)state;
    struct run *a = sample(), *b = new_run(0.1);
    checkpoint_write(&a->sim, PATH);
    checkpoint_read(&b->sim, PATH);
    if (b->sim.problems.count) fail_msg("%s", b->sim.problems.text);
    for (int s = 0; s < N_SPECIES; s++) {
        assert_int_equal(b->sim.species[s].n, a->sim.species[s].n);
        assert_int_equal(b->sim.species[s].n_own, a->sim.species[s].n);
        for (int c = 0; c < N_COLUMNS; c++)
            if (species_has(&a->sim.species[s], c) && column_table[c].lifetime == KEEP && a->sim.species[s].n > 0)
                assert_memory_equal(species_column(&a->sim.species[s], c), species_column(&b->sim.species[s], c),
                                    (size_t)a->sim.species[s].n * species_row_bytes(c));
    }
    assert_true(b->sim.time.tick == 12345678901234567 && b->sim.time.start == 0.5);
    assert_true(b->sim.seed == 0xfedcba9876543210 && b->sim.steps == 42 && b->sim.updates == 4242);
    assert_true(b->sim.time.snapshot == 2 * longest);
    assert_true(b->state.scale == 0.7 && b->state.history[2] == 3 && b->state.scratch == 0);
    free_run(a);
    free_run(b);
}

/* The cadences may change, but not below the longest step of the checkpoint. */
static void test_other_cadences(void **state)
{
    (void)state;
    struct run *a = sample(), *b = new_run(0.2), *c = new_run(0.05), *d = new_run(0.3);
    checkpoint_write(&a->sim, PATH);
    checkpoint_read(&b->sim, PATH);
    assert_int_equal(b->sim.problems.count, 0);
    assert_true(b->sim.time.dt_max == 0.1 && b->sim.time.snapshot == 4 * longest && b->sim.time.picture == 6 * longest);
    checkpoint_read(&c->sim, PATH);
    assert_int_equal(c->sim.problems.count, 1);
    checkpoint_read(&d->sim, PATH);
    assert_non_null(strstr(d->sim.problems.text, "has a longest step of 0.1"));
    free_run(a);
    free_run(b);
    free_run(c);
    free_run(d);
}

static void expect_problem(struct run *run, const char *words)
{
    checkpoint_read(&run->sim, PATH);
    assert_int_equal(run->sim.problems.count, 1);
    if (!strstr(run->sim.problems.text, words)) fail_msg("\"%s\" lacks \"%s\"", run->sim.problems.text, words);
    free_run(run);
}

static void test_refusals(void **state)
{
    (void)state;
    struct run *a = sample();
    checkpoint_write(&a->sim, PATH);
    struct run *fewer = new_run(0.1), *other = new_run(0.1);
    fewer->sim.n_use = 1;
    expect_problem(fewer, "was written with the modules \"opening plain\"; this run has \"opening\"");
    species_need(&other->sim.species[GAS], COLUMN_rho);
    expect_problem(other, "was written with the columns \"pos vel mass id acc rung rung0 u\"; "
                   "this run has \"pos vel mass id acc rung rung0 u rho\"");
    assert_int_equal(truncate(PATH, 200000), 0);
    expect_problem(new_run(0.1), "is truncated or damaged");
    struct h5 *file = h5_create(PATH);
    h5_close(file);
    expect_problem(new_run(0.1), "is not a checkpoint of tephra");
    file = h5_create(PATH);
    h5_group(file, "Checkpoint");
    h5_attr_int(file, "Checkpoint", "format", 99);
    h5_close(file);
    expect_problem(new_run(0.1), "has checkpoint format 99; this program reads format ");
    free_run(a);
}

/* A flipped bit anywhere in the rows is found. */
static void test_damage(void **state)
{
    (void)state;
    struct run *a = sample();
    checkpoint_write(&a->sim, PATH);
    FILE *stream = fopen(PATH, "r+");
    fseek(stream, 300000, SEEK_SET);
    int byte = fgetc(stream);
    fseek(stream, 300000, SEEK_SET);
    fputc(byte ^ 4, stream);
    fclose(stream);
    expect_problem(new_run(0.1), "is damaged: Rows/");
    free_run(a);
}

static void test_previous(void **state)
{
    (void)state;
    struct run *a = sample();
    remove(PATH);
    remove(PREVIOUS);
    for (a->sim.steps = 1; a->sim.steps <= 3; a->sim.steps++) {
        checkpoint_write(&a->sim, PATH);
        assert_int_equal(access(PREVIOUS, F_OK) == 0, a->sim.steps > 1);
    }
    const char *const paths[] = {PREVIOUS, PATH};
    for (int i = 0; i < 2; i++) {
        struct run *b = new_run(0.1);
        checkpoint_read(&b->sim, paths[i]);
        assert_int_equal(b->sim.problems.count, 0);
        assert_int_equal(b->sim.steps, 2 + i);
        free_run(b);
    }
    free_run(a);
}

static int remove_files(void **state)
{
    (void)state;
    remove(PATH);
    remove(PREVIOUS);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trip), cmocka_unit_test(test_other_cadences), cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_damage),     cmocka_unit_test(test_previous),
    };
    log_silence(true);
    return cmocka_run_group_tests_name("checkpoint", tests, NULL, remove_files);
}
