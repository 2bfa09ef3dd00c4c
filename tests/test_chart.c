/* SPDX-License-Identifier: GPL-3.0-or-later
 * src/chart.c, chart_draw.c: rows become CSV as they are, pictures show series where they lie; several
 * simulations in one process leave no memory behind, and each is as if it were alone. */
#include "draw/canvas.h"
#include "draw/chart_sheet.h"
#include "mem.h"
#include "output.h"
#include <math.h>
#include <png.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

static const struct chart empty = {"empty", "nothing", NULL, 0, NULL};

static void test_rows(void **state)
{
    (void)state;
    size_t before = mem_now();
    struct chart_sheet *sheet = chart_sheet_new(&empty);
    chart_columns(sheet, "n,scheme,cpu [s]");
    chart_row(sheet, "%d,%s,%g", 3, "one", 0.25);
    chart_cited(sheet, "Somebody 2008", "%d,%s,%g", 4, "two", 0.5);
    chart_note(sheet, "a %s", "remark");
    assert_int_equal(chart_sheet_column(sheet, "cpu"), 2);
    char *text = NULL;
    size_t size;
    FILE *stream = open_memstream(&text, &size);
    chart_sheet_write(sheet, stream);
    fclose(stream);
    assert_non_null(strstr(text, "# tephra chart empty: nothing\n"));
    assert_non_null(strstr(text, "# a remark\nn,scheme,cpu [s],source\n3,one,0.25,measured\n4,two,0.5,Somebody 2008\n"));
    free(text);
    chart_sheet_free(sheet);
    assert_int_equal(mem_now(), before);
}

/* Reads a picture; pixel i of row j is at 3 (i + width j). */
static unsigned char *read_picture(const char *path, int *width, int *height)
{
    png_image image = {.version = PNG_IMAGE_VERSION};
    assert_true(png_image_begin_read_from_file(&image, path));
    image.format = PNG_FORMAT_RGB;
    unsigned char *rgb = malloc(PNG_IMAGE_SIZE(image));
    assert_true(png_image_finish_read(&image, NULL, rgb, 0, NULL));
    *width = (int)image.width;
    *height = (int)image.height;
    return rgb;
}

/* How many pixels have a colour, and where their middle is. */
static int find_colour(const unsigned char *rgb, int width, int height, uint32_t colour, double middle[2])
{
    int n = 0;
    middle[0] = middle[1] = 0;
    for (int j = 0; j < height; j++)
        for (int i = 0; i < width; i++) {
            const unsigned char *p = rgb + 3 * (i + width * j);
            if ((uint32_t)(p[0] << 16 | p[1] << 8 | p[2]) != colour) continue;
            middle[0] += i;
            middle[1] += j;
            n++;
        }
    for (int k = 0; k < 2; k++) middle[k] /= n;
    return n;
}

/* Two series of one row each: marks and legend in two colours, the larger value above and right. The front
 * is drawn, a row that is beaten by another is off it, and rows that are not positive are left out. */
static void test_picture(void **state)
{
    (void)state;
    const char path[] = "test_chart.png";
    size_t before = mem_now();
    struct chart_sheet *sheet = chart_sheet_new(&empty);
    chart_columns(sheet, "error,cpu [s],scheme");
    chart_row(sheet, "1e-3,1,first");
    chart_row(sheet, "1e-1,100,second");
    chart_row(sheet, "0,5,second");
    chart_row(sheet, "nan,5,second");
    chart_panel(sheet, &(struct chart_panel){.title = "t", .x = "error", .y = "cpu", .series = "scheme", .front = true});
    chart_sheet_draw(sheet, path);
    int width, height;
    double first[2], second[2], front[2];
    unsigned char *rgb = read_picture(path, &width, &height);
    int n_first = find_colour(rgb, width, height, 0x0072b2, first), n_second = find_colour(rgb, width, height, 0xd55e00, second);
    assert_true(n_first > 60 && abs(n_first - n_second) <= 12);
    assert_true(second[0] > first[0] + 50 && second[1] < first[1] - 50);
    assert_true(find_colour(rgb, width, height, 0xc8c8c8, front) > 0);
    assert_true(front[0] > 0.8 * width);    /* one row is the front: nothing to join, the legend alone */
    free(rgb);
    remove(path);
    chart_sheet_free(sheet);
    assert_int_equal(mem_now(), before);
}

static void test_line(void **state)
{
    (void)state;
    struct canvas *canvas = canvas_new(40, 20, 0);
    canvas_line(canvas, (double[2]){5, 5}, (double[2]){30, 15}, 3, 0xff0000);
    double sum = 0;
    for (int k = 0; k < 40 * 20; k++) sum += canvas->rgb[3 * k] / 255.0;
    double area = 3 * hypot(25, 10) + M_PI * 2.25;
    assert_true(fabs(sum / area - 1) < 0.03);
    canvas_free(canvas);
}

/* The same run twice with another between: the same bits, and no memory kept. */
static void test_runs(void **state)
{
    (void)state;
    const char *const orbit[] = {"time.end=6.3", NULL};
    const char *const gas[] = {"start.n=200", "time.end=0.1", NULL};
    double error[2];
    size_t before = mem_now();
    for (int k = 0; k < 2; k++) {
        struct sim *sim = chart_sim("ics/kepler.yml", orbit);
        assert_true(chart_run(sim) > 0);
        const struct output *output = sim_state(sim, "output");
        error[k] = output->energy.error;
        sim_free(sim);
        sim = chart_sim("ics/evrard.yml", gas);
        assert_true(chart_run(sim) > 0);
        sim_free(sim);
    }
    assert_true(error[0] == error[1] && error[0] != 0);
    assert_int_equal(mem_now(), before);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rows), cmocka_unit_test(test_picture), cmocka_unit_test(test_line), cmocka_unit_test(test_runs),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
