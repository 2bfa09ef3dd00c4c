/* SPDX-License-Identifier: GPL-3.0-or-later
 * src/surface.c, src/canvas.c, src/picture.c: maps conserve mass and follow the kernel whatever its
 * width, text leaves ink where it should, pictures are PNG files with a frame that stays. */
#include "draw/canvas.h"
#include "draw/picture.h"
#include "draw/surface.h"
#include "fail.h"
#include "log.h"
#include "mem.h"
#include <math.h>
#include <omp.h>
#include <png.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>
#include <cmocka.h>

#define PATH "test_picture.png"

static double sum(const float (*cell)[2], int k)
{
    double total = 0;
    for (int i = 0; i < SURFACE_SIZE * SURFACE_SIZE; i++) total += (double)cell[i][k];
    return total;
}

/* One row. */
static void lay(struct surface *surface, double x, double y, double h, double mass, float value)
{
    const double at[1][2] = {{x, y}};
    surface_add(surface, &(struct surface_rows){.n = 1, .at = at, .h = (const float[]){1}, .h_unit = h, .mass = &mass, .value = &value});
}

/* From far below a pixel to a third of the map: the mass stays, on whichever level it is laid. */
static void test_mass_is_kept(void **state)
{
    (void)state;
    for (double h = 0.1; h < SURFACE_SIZE / 5.0; h *= 1.7) {
        struct surface *surface = surface_new();
        const int rows = 50;
        srand48(1);
        for (int i = 0; i < rows; i++)
            lay(surface, 352 + 20 * drand48(), 352 + 20 * drand48(), h, 2, 3);
        const float (*cell)[2] = surface_finish(surface);
        double mass = sum(cell, 0), value = sum(cell, 1);
        if (fabs(mass - 2 * rows) > 0.02 * 2 * rows) fail_msg("h = %g pixels: mass %g of %d", h, mass, 2 * rows);
        assert_true(fabs(value - 3 * mass) < 1e-4 * value);
        surface_free(surface);
    }
}

/* An even lattice in a box that closes on itself is even up to the edges of the picture, and beyond those of the box. */
static void test_closed_box(void **state)
{
    (void)state;
    enum { SIDE = 16 };
    static double at[SIDE * SIDE][2], mass[SIDE * SIDE];
    static float h[SIDE * SIDE];
    for (double part = 0.5; part <= 1; part += 0.5) {
        const double side = part * SURFACE_SIZE;
        for (int i = 0; i < SIDE * SIDE; i++) {
            at[i][0] = 100 + (i % SIDE + 0.5) / SIDE * side;
            at[i][1] = 37 + (i / SIDE + 0.5) / SIDE * side;
            mass[i] = 1;
            h[i] = (float)(2.5 * side / SIDE);
        }
        struct surface *surface = surface_new();
        surface_add(surface, &(struct surface_rows){.n = SIDE * SIDE, .at = (const double (*)[2])at, .h = h, .h_unit = 1,
                                                    .mass = mass, .side = {side, side}});
        const float (*cell)[2] = surface_finish(surface);
        const double even = SIDE * SIDE / (side * side);
        for (int i = 0; i < SURFACE_SIZE * SURFACE_SIZE; i++)
            if (fabs((double)cell[i][0] / even - 1) > 0.03) fail_msg("pixel %d holds %g of %g", i, (double)cell[i][0], even);
        surface_free(surface);
    }
}

/* The column density of the cubic spline at the centre is 3/(2 pi) / h^2 and vanishes at 2h. */
static void test_kernel_shape(void **state)
{
    (void)state;
    static const double widths[] = {3, 11, 40, 100};
    for (int w = 0; w < 4; w++) {
        struct surface *surface = surface_new();
        lay(surface, 352.5, 352.5, widths[w], 1, 0);
        const float (*cell)[2] = surface_finish(surface);
        double centre = (double)cell[352 * SURFACE_SIZE + 352][0] * widths[w] * widths[w];
        int outside = 352 + (int)(2.5 * widths[w]);
        if (fabs(centre - 1.5 / M_PI) > 0.05) fail_msg("h = %g pixels: %g at the centre", widths[w], centre);
        assert_true(cell[352 * SURFACE_SIZE + outside][0] == 0);
        surface_free(surface);
    }
}

static void test_rows_outside(void **state)
{
    (void)state;
    struct surface *surface = surface_new();
    lay(surface, -1e9, 5, 1, 1, 0);
    lay(surface, 1e300, -1e300, 1e5, 1, 0);
    lay(surface, NAN, 352, 4, 1, 0);
    lay(surface, -3, 352, 4, 1, 0);     /* reaches in */
    double mass = sum(surface_finish(surface), 0);
    assert_true(mass > 0.05 && mass < 0.5);
    surface_free(surface);
}

/* Threads share the lines, not the rows: any number of them sums in the same order. */
static void test_threads(void **state)
{
    (void)state;
    enum { N = 3000 };
    double (*at)[2] = mem_alloc("test", N * sizeof *at), *mass = mem_array("test", double, N);
    float *h = mem_array("test", float, N);
    srand48(5);
    for (int i = 0; i < N; i++) {
        for (int k = 0; k < 2; k++) at[i][k] = SURFACE_SIZE * (1.2 * drand48() - 0.1);
        h[i] = (float)exp(5 * drand48());
        mass[i] = drand48();
    }
    const struct surface_rows rows = {.n = N, .at = (const double (*)[2])at, .h = h, .h_unit = 1, .mass = mass, .value = h};
    const int before = omp_get_max_threads();
    struct surface *surface[3];
    const float (*map[3])[2];
    for (int t = 0; t < 3; t++) {
        omp_set_num_threads(1 + 2 * t);
        surface[t] = surface_new();
        surface_add(surface[t], &rows);
        map[t] = surface_finish(surface[t]);
        assert_memory_equal(map[0], map[t], SURFACE_SIZE * SURFACE_SIZE * sizeof *map[0]);
    }
    omp_set_num_threads(before);
    for (int t = 0; t < 3; t++) surface_free(surface[t]);
    mem_free(at);
    mem_free(mass);
    mem_free(h);
}

/* A uniform sheet: 64 rows within 2h. */
static void test_smoothing(void **state)
{
    (void)state;
    enum { N = 20000 };
    double (*at)[2] = mem_alloc("test", N * sizeof *at);
    float *h = mem_array("test", float, N);
    srand48(3);
    for (int i = 0; i < N; i++)
        for (int k = 0; k < 2; k++) at[i][k] = SURFACE_SIZE * drand48();
    surface_smoothing((const double (*)[2])at, N, false, h);
    double mean = 0;
    for (int i = 0; i < N; i++) mean += (double)h[i] / N;
    double expected = sqrt(64.0 * SURFACE_SIZE * SURFACE_SIZE / N / (4 * M_PI));
    if (fabs(mean / expected - 1) > 0.1) fail_msg("h = %g, expected %g", mean, expected);
    mem_free(at);
    mem_free(h);
}

static int ink(const struct canvas *canvas, int x0, int x1)
{
    int dots = 0;
    for (int y = 0; y < canvas->height; y++)
        for (int x = x0; x < x1; x++) dots += canvas->rgb[3 * (y * canvas->width + x)] > 128;
    return dots;
}

static void test_text(void **state)
{
    (void)state;
    struct canvas *canvas = canvas_new(300, 60, 0);
    canvas_text(canvas, (double[2]){150, 40}, 18, CANVAS_RIGHT, 0xffffff, "t = 0.8 Gyr");
    double width = canvas_text_width(18, "t = 0.8 Gyr");
    assert_int_equal(ink(canvas, 153, 300), 0);
    assert_int_equal(ink(canvas, 0, (int)(150 - width - 3)), 0);
    assert_true(ink(canvas, (int)(150 - width), 150) > 200);
    canvas_free(canvas);
    /* Each letter differs from each other one. */
    for (char a = '!'; a <= '~'; a++)
        for (char b = (char)(a + 1); b <= '~'; b++) {
            if (a == '^' || b == '^') continue;
            struct canvas *left = canvas_new(24, 30, 0), *right = canvas_new(24, 30, 0);
            canvas_text(left, (double[2]){4, 20}, 12, CANVAS_LEFT, 0xffffff, (char[]){a, 0});
            canvas_text(right, (double[2]){4, 20}, 12, CANVAS_LEFT, 0xffffff, (char[]){b, 0});
            if (memcmp(left->rgb, right->rgb, 3 * 24 * 30) == 0) fail_msg("%c and %c look alike", a, b);
            canvas_free(left);
            canvas_free(right);
        }
}

static void test_colours(void **state)
{
    (void)state;
    assert_int_equal(canvas_colour(CANVAS_VIRIDIS, -1), 0x440154);
    assert_int_equal(canvas_colour(CANVAS_VIRIDIS, 2), 0xfde725);
    assert_int_equal(canvas_colour(CANVAS_INFERNO, 0.5), 0xbc3754);
}

static void new_sim(struct sim *sim, enum species_kind kind, int64_t n)
{
    memset(sim, 0, sizeof *sim);
    sim->units = (struct units){false, 1, 1, 1, 1};
    sim->time = (struct timeline){.dt_max = 1, .tick_end = INT64_MAX};
    for (int s = 0; s < N_SPECIES; s++) sim->species[s].kind = s;
    struct species *table = &sim->species[kind];
    static const enum column needed[] = {COLUMN_pos, COLUMN_mass, COLUMN_u, COLUMN_h};
    for (int c = 0; c < (kind == GAS ? 4 : 2); c++) species_need(table, needed[c]);
    species_reserve(table, n);
    table->n = table->n_own = n;
    srand48(4);
    for (int64_t i = 0; i < n; i++) {
        for (int k = 0; k < 3; k++) table->pos[i][k] = 10 + drand48();
        table->mass[i] = 1.0 / (double)n;
        if (kind != GAS) continue;
        table->u[i] = 1;
        table->h[i] = 0.05f;
    }
}

static void free_sim(struct sim *sim)
{
    for (int s = 0; s < N_SPECIES; s++) species_free(&sim->species[s]);
}

static void test_pictures(void **state)
{
    (void)state;
    for (int kind = 0; kind < N_SPECIES; kind++) {
        struct sim sim;
        struct picture picture = {0};
        new_sim(&sim, kind, 5000);
        picture_write(&sim, PATH, &picture);
        assert_true(picture.set && fabs(picture.centre[0] - 10.5) < 0.03);
        assert_true(picture.half > 0.5 && picture.half < 0.7);
        /* The mass is 1 and so is the column density. */
        assert_true(picture.range[0].low <= 0 && picture.range[0].high >= 0 && picture.range[0].high <= 1);
        png_image image = {.version = PNG_IMAGE_VERSION};
        assert_true(png_image_begin_read_from_file(&image, PATH));
        assert_true(image.width == 1600 && image.height == 900);
        png_image_free(&image);
        /* Everything moves away and gets denser: the frame stays, the range grows. */
        const struct picture before = picture;
        for (int64_t i = 0; i < sim.species[kind].n && kind == GAS; i++) sim.species[kind].h[i] *= 0.001f;
        for (int64_t i = 0; i < sim.species[kind].n; i++)
            for (int k = 0; k < 3; k++) sim.species[kind].pos[i][k] = 10.5 + 0.001 * (sim.species[kind].pos[i][k] - 10.5);
        picture_write(&sim, PATH, &picture);
        assert_memory_equal(before.centre, picture.centre, sizeof before.centre);
        assert_true(before.half == picture.half);
        assert_true(picture.range[0].high > before.range[0].low + 5);   /* more than a first picture shows */
        assert_true(picture.range[0].low == before.range[0].low);
        free_sim(&sim);
    }
}

/* Isothermal gas has no energy to show: two views with the same colours. */
static void test_isothermal(void **state)
{
    (void)state;
    struct sim sim;
    struct picture picture = {0};
    new_sim(&sim, GAS, 5000);
    struct species *gas = &sim.species[GAS];
    float *u = gas->u;
    gas->u = NULL;
    for (int64_t i = 0; i < gas->n; i++) gas->pos[i][2] *= 0.1;
    picture_write(&sim, PATH, &picture);
    assert_true(picture.range[0].high >= 0.5 && picture.range[0].high == picture.range[1].high);
    gas->u = u;
    free_sim(&sim);
}

static void test_nothing_to_show(void **state)
{
    (void)state;
    struct sim sim;
    struct picture picture = {0};
    remove(PATH);
    new_sim(&sim, DARK, 0);
    picture_write(&sim, PATH, &picture);
    assert_int_not_equal(access(PATH, F_OK), 0);
    free_sim(&sim);
    /* One row, or all at one place. */
    new_sim(&sim, GAS, 1);
    picture_write(&sim, PATH, &picture);
    assert_int_equal(access(PATH, F_OK), 0);
    free_sim(&sim);
}

static void test_cannot_write(void **state)
{
    (void)state;
    pid_t child = fork();
    if (child == 0) {
        fclose(stderr);
        struct canvas *canvas = canvas_new(10, 10, 0);
        canvas_write(canvas, "no/such/folder/a.png");
        _exit(0);
    }
    int status = 0;
    waitpid(child, &status, 0);
    assert_true(WIFEXITED(status) && WEXITSTATUS(status) == STATUS_ENVIRONMENT);
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
        cmocka_unit_test(test_mass_is_kept), cmocka_unit_test(test_closed_box), cmocka_unit_test(test_kernel_shape),    cmocka_unit_test(test_rows_outside),
        cmocka_unit_test(test_threads), cmocka_unit_test(test_smoothing),    cmocka_unit_test(test_text),            cmocka_unit_test(test_colours),
        cmocka_unit_test(test_pictures),     cmocka_unit_test(test_isothermal),      cmocka_unit_test(test_nothing_to_show),
        cmocka_unit_test(test_cannot_write),
    };
    log_silence(true);
    return cmocka_run_group_tests_name("picture", tests, NULL, remove_files);
}
