/* SPDX-License-Identifier: GPL-3.0-or-later
 * src/snapshot.c, src/start_file.c, src/layout.c: the layout and units of snapshots, and that what is
 * read is what was written; every fault of a start file is named. */
#include "comm.h"
#include "constants.h"
#include "fail.h"
#include "file/h5.h"
#include "file/layout.h"
#include "file/snapshot.h"
#include "file/start_file.h"
#include "log.h"
#include "mem.h"
#include "module.h"
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>

#define PATH "test_snapshot.hdf5"
enum { ROWS = 1000 };

static struct units pc_units(void)
{
    return (struct units){true, CONST_PC, CONST_M_SUN, 1e5, 1};
}

/* A gas that is hotter by the id, so that a temperature cannot be u in disguise. */
static void temperature(const struct sim *sim, const void *state, float *kelvin)
{
    (void)state;
    for (int64_t i = 0; i < sim->species[GAS].n; i++) kelvin[i] = (float)sim->species[GAS].id[i] - 900000;
}

static const struct module warm = {.name = "warm", .temperature = temperature};
static struct use warm_use = {&warm, NULL};

static void declare(struct sim *sim, struct units units)
{
    memset(sim, 0, sizeof *sim);
    sim->use = &warm_use;
    sim->n_use = 1;
    sim->units = units;
    sim->time = (struct timeline){.dt_max = 1, .tick = 3 * ((int64_t)1 << RUNG_TOP), .tick_end = INT64_MAX};
    for (int s = 0; s < N_SPECIES; s++) {
        sim->species[s].kind = s;
        for (enum column c = COLUMN_pos; c <= COLUMN_rung0; c++) species_need(&sim->species[s], c);
    }
    for (enum column c = COLUMN_u; c <= COLUMN_rho; c++) species_need(&sim->species[GAS], c);
}

/* n rows of a species with distinct numbers and ids that descend. */
static void fill(struct species *table, int64_t n, uint64_t last_id)
{
    species_reserve(table, n);
    table->n = table->n_own = n;
    for (int64_t i = 0; i < n; i++) {
        for (int k = 0; k < 3; k++) {
            table->pos[i][k] = sin((double)(3 * i + k));
            table->vel[i][k] = cos((double)(3 * i + k));
            table->acc[i][k] = 1;
        }
        table->mass[i] = 1 + 1e-12 * (double)i;
        table->id[i] = last_id - (uint64_t)i;
        if (table->u) table->u[i] = 100 + (float)i;
        if (table->h) table->h[i] = 0.1f + (float)i;
        if (table->rho) table->rho[i] = 1 + (float)i;
    }
}

static void sample(struct sim *sim, struct units units)
{
    declare(sim, units);
    fill(&sim->species[GAS], ROWS, 1000000);
    fill(&sim->species[CLOUD], 5, 2000);
    fill(&sim->species[STAR], 7, 200);
}

static void release(struct sim *sim)
{
    for (int s = 0; s < N_SPECIES; s++) species_free(&sim->species[s]);
    mem_free(sim->problems.text);
}

static double number(struct h5 *file, const char *object, const char *name)
{
    double value = NAN;
    assert_true(h5_read_attr(file, object, name, &value, 1));
    return value;
}

static void close_to(double value, double expected)
{
    if (!(fabs(value - expected) <= 1e-12 * fabs(expected))) fail_msg("%.17g is not %.17g", value, expected);
}

static void test_layout(void **state)
{
    (void)state;
    char text[80];
    struct units units = pc_units();
    close_to(layout_factor(&units, "L"), 1e-3);
    close_to(layout_factor(&units, "M L^-3"), 0.1);
    close_to(layout_factor(&units, "V^2 L^-1"), 1e3);
    layout_unit_text(true, "M L^-3", text, sizeof text);
    assert_string_equal(text, "1e10 Msun kpc^-3");
    layout_unit_text(true, "V^2 L^-1", text, sizeof text);
    assert_string_equal(text, "(km/s)^2 kpc^-1");
    layout_unit_text(true, "K", text, sizeof text);
    assert_string_equal(text, "K");
    layout_unit_text(false, "L V^-1", text, sizeof text);
    assert_string_equal(text, "L V^-1");
    /* One kpc / (km/s) is 0.97779 Gyr. */
    assert_true(fabs(layout_gyr(&units, 1000) - 0.9777922) < 1e-7);
}

static void test_header(void **state)
{
    (void)state;
    struct sim sim;
    double counts[6];
    sample(&sim, pc_units());
    snapshot_write(&sim, PATH, SNAPSHOT_DOUBLE);
    struct h5 *file = h5_open(PATH);
    assert_true(h5_read_attr(file, "Header", "NumPart_ThisFile", counts, 6));
    assert_true(counts[0] == ROWS && counts[1] == 0 && counts[3] == 5 && counts[4] == 7);
    assert_false(h5_exists(file, "PartType1"));
    close_to(number(file, "Header", "Time"), 3e-3);
    assert_true(fabs(number(file, "Parameters", "Time_GYR") - 3e-3 * 0.9777922) < 1e-9);
    close_to(number(file, "Units", "UnitLength_in_cm"), 3.0856775814913673e21);
    close_to(number(file, "PartType0/Density", "to_cgs"), 1.98841e43 / pow(3.0856775814913673e21, 3) * (CONST_M_SUN / 1.98841e33));
    char *text = h5_read_attr_text(file, "PartType3", "species");
    assert_string_equal(text, "cloud");
    mem_free(text);
    h5_close(file);
    release(&sim);
}

/* Ordered by id, in kpc, with the radius of the support, and a temperature. */
static void test_values(void **state)
{
    (void)state;
    struct sim sim;
    sample(&sim, pc_units());
    snapshot_write(&sim, PATH, SNAPSHOT_DOUBLE);
    struct h5 *file = h5_open(PATH);
    double pos[ROWS][3], mass[ROWS], rho[ROWS], length[ROWS], kelvin[ROWS];
    uint64_t id[ROWS];
    assert_true(h5_read(file, "PartType0/Coordinates", 'd', ROWS, 3, pos));
    assert_true(h5_read(file, "PartType0/Masses", 'd', ROWS, 1, mass));
    assert_true(h5_read(file, "PartType0/Density", 'd', ROWS, 1, rho));
    assert_true(h5_read(file, "PartType0/SmoothingLength", 'd', ROWS, 1, length));
    assert_true(h5_read(file, "PartType0/Temperature", 'd', ROWS, 1, kelvin));
    assert_true(h5_read(file, "PartType0/ParticleIDs", 'u', ROWS, 1, id));
    assert_false(h5_exists(file, "PartType0/Potential"));
    for (int i = 0; i < ROWS; i++) {
        int row = ROWS - 1 - i;
        assert_true(id[i] == 1000000 - (uint64_t)row);
        close_to(pos[i][1], 1e-3 * sin(3 * row + 1));
        close_to(mass[i], 1e-10 * (1 + 1e-12 * row));
        assert_true(fabs(rho[i] - 0.1 * (1 + row)) <= 1e-7 * rho[i]);
        assert_true(fabs(length[i] - 2e-3 * (0.1 + row)) <= 1e-6 * length[i]);
        assert_true(kelvin[i] == 100000 - row);
    }
    h5_close(file);
    release(&sim);
}

/* Floats hold the same to their rounding, and are read back. */
static void test_floats(void **state)
{
    (void)state;
    struct sim sim, again;
    sample(&sim, pc_units());
    snapshot_write(&sim, PATH, SNAPSHOT_FLOAT);
    struct h5 *file = h5_open(PATH);
    const char *const narrow[] = {"PartType0/Coordinates", "PartType0/Velocities", "PartType0/Masses"};
    for (int i = 0; i < 3; i++) assert_int_equal(h5_kind(file, narrow[i]), 'f');
    assert_int_equal(h5_kind(file, "PartType0/ParticleIDs"), 'u');
    close_to(number(file, "Header", "Flag_DoublePrecision"), 0);
    h5_close(file);
    declare(&again, pc_units());
    start_file_read(&again, PATH);
    for (int i = 0; i < ROWS; i++)
        for (int k = 0; k < 3; k++) {
            double there = sim.species[GAS].pos[ROWS - 1 - i][k];
            assert_true(fabs(again.species[GAS].pos[i][k] - there) <= 1e-7 * fabs(there));
        }
    release(&sim);
    release(&again);
}

/* Between full synchronisations rows are brought to the present. */
static void test_rows_in_mid_step(void **state)
{
    (void)state;
    struct sim sim;
    double pos[7][3], vel[7][3];
    sample(&sim, (struct units){false, 1, 1, 1, 1});
    sim.time.tick += (int64_t)1 << (RUNG_TOP - 1);
    for (int i = 0; i < 7; i++) sim.species[STAR].rung[i] = sim.species[STAR].rung0[i] = RUNG_TOP;
    snapshot_write(&sim, PATH, SNAPSHOT_DOUBLE);
    struct h5 *file = h5_open(PATH);
    assert_true(h5_read(file, "PartType4/Coordinates", 'd', 7, 3, pos));
    assert_true(h5_read(file, "PartType4/Velocities", 'd', 7, 3, vel));
    close_to(pos[6][0], sin(0) + 0.5 * cos(0) + 0.125);
    close_to(vel[6][0], cos(0) + 0.5);
    h5_close(file);
    release(&sim);
}

static void test_read_back(void **state)
{
    (void)state;
    const struct units units[2] = {pc_units(), {false, 1, 1, 1, 1}};
    for (int u = 0; u < 2; u++) {
        struct sim sim, again;
        sample(&sim, units[u]);
        snapshot_write(&sim, PATH, SNAPSHOT_DOUBLE);
        declare(&again, units[u]);
        start_file_read(&again, PATH);
        if (again.problems.count) fail_msg("%s", again.problems.text);
        assert_true(again.species[CLOUD].n == 5 && again.species[STAR].n == 7 && again.species[DARK].n == 0);
        close_to(again.time.start, 3);
        const struct species *gas = &again.species[GAS];
        assert_int_equal(gas->n, ROWS);
        for (int i = 0; i < ROWS; i++) {
            int row = ROWS - 1 - i;
            assert_true(gas->id[i] == sim.species[GAS].id[row]);
            close_to(gas->pos[i][2], sim.species[GAS].pos[row][2]);
            close_to(gas->mass[i], sim.species[GAS].mass[row]);
            assert_true(fabsf(gas->h[i] - sim.species[GAS].h[row]) <= 2e-7f * gas->h[i]);
            assert_true(fabsf(gas->u[i] - sim.species[GAS].u[row]) <= 2e-7f * gas->u[i]);
        }
        release(&sim);
        release(&again);
    }
}

/* A file as AREPO's users have it: floats, MassTable, 32-bit ids, negative too, no units, discs and bulges. */
static void test_foreign_file(void **state)
{
    (void)state;
    const float pos[2][3] = {{1, 2, 3}, {4, 5, 6}};
    const double table[6] = {0, 0, 0.5, 0, 0, 0};
    const int32_t ids[2] = {-7, -8};
    struct sim sim;
    struct h5 *file = h5_create(PATH);
    h5_group(file, "Header");
    h5_attr_doubles(file, "Header", "MassTable", table, 6);
    h5_attr_uints(file, "Header", "NumPart_ThisFile", (uint64_t[]){0, 0, 2, 0, 0, 0}, 6);
    h5_attr_double(file, "Header", "HubbleParam", 1);
    h5_write(file, "PartType2/Coordinates", 'f', 2, 3, pos);
    h5_write(file, "PartType2/Velocities", 'f', 2, 3, pos);
    h5_write(file, "PartType2/ParticleIDs", 'i', 2, 1, ids);
    h5_write(file, "PartType2/Age", 'i', 2, 1, ids);
    h5_close(file);
    declare(&sim, pc_units());
    start_file_read(&sim, PATH);
    if (sim.problems.count) fail_msg("%s", sim.problems.text);
    assert_int_equal(sim.species[STAR].n, 2);
    close_to(sim.species[STAR].pos[1][0], 4000);
    close_to(sim.species[STAR].vel[1][0], 4);
    close_to(sim.species[STAR].mass[0], 0.5e10);
    assert_true(sim.species[STAR].id[0] == (uint64_t)-7 && sim.species[STAR].id[1] == (uint64_t)-8);
    release(&sim);
}

static void expect_problem(const char *words)
{
    struct sim again;
    declare(&again, (struct units){false, 1, 1, 1, 1});
    start_file_read(&again, PATH);
    assert_int_equal(again.problems.count, 1);
    if (!strstr(again.problems.text, words)) fail_msg("\"%s\" lacks \"%s\"", again.problems.text, words);
    release(&again);
}

static void test_bad_numbers(void **state)
{
    (void)state;
    struct sim sim;
    sample(&sim, (struct units){false, 1, 1, 1, 1});
    struct species *gas = &sim.species[GAS];
    gas->mass[10] = -2;
    gas->mass[11] = -3;
    snapshot_write(&sim, PATH, SNAPSHOT_DOUBLE);
    expect_problem("gas particle 999989 has Masses = -3 (and 1 more)");
    gas->mass[10] = gas->mass[11] = 1;
    gas->pos[4][1] = NAN;
    snapshot_write(&sim, PATH, SNAPSHOT_DOUBLE);
    expect_problem("gas particle 999996 has Coordinates = nan");
    gas->pos[4][1] = 0;
    sim.species[STAR].id[0] = gas->id[3];
    snapshot_write(&sim, PATH, SNAPSHOT_DOUBLE);
    expect_problem("the id 999997 is used twice (gas and star), as are 0 more");
    release(&sim);
}

static void write_header(const char *attribute, double value)
{
    struct h5 *file = h5_create(PATH);
    h5_group(file, "Header");
    h5_attr_double(file, "Header", attribute, value);
    h5_close(file);
}

static void test_bad_files(void **state)
{
    (void)state;
    struct sim sim;
    write_header("OmegaLambda", 0.7);
    expect_problem("is cosmological (OmegaLambda = 0.7)");
    write_header("HubbleParam", 0.7);
    expect_problem("is cosmological (HubbleParam = 0.7)");
    write_header("NumFilesPerSnapshot", 4);
    expect_problem("is one of 4 files");
    write_header("Time", 0);
    expect_problem("holds no particles");
    sample(&sim, (struct units){false, 1, 1, 1, 1});
    snapshot_write(&sim, PATH, SNAPSHOT_DOUBLE);
    assert_int_equal(truncate(PATH, 60000), 0);
    expect_problem("is truncated or damaged");
    release(&sim);
    remove(PATH);
    expect_problem("cannot be read: No such file");
}

static int remove_files(void **state)
{
    (void)state;
    remove(PATH);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_layout),    cmocka_unit_test(test_header),       cmocka_unit_test(test_values),
        cmocka_unit_test(test_rows_in_mid_step), cmocka_unit_test(test_floats), cmocka_unit_test(test_read_back),
        cmocka_unit_test(test_foreign_file), cmocka_unit_test(test_bad_numbers), cmocka_unit_test(test_bad_files),
    };
    log_silence(true);
    return cmocka_run_group_tests_name("snapshot", tests, NULL, remove_files);
}
