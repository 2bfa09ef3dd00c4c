/* SPDX-License-Identifier: GPL-3.0-or-later
 * A small image (canvas.h). Letters are 5 by 7 dots that are joined by round, antialiased strokes:
 * legible at any size. Colour maps: viridis and inferno of S. van der Walt and N. Smith (2015,
 * public domain by CC0), every eighth of their 256 colours. */
#include "canvas.h"
#include "fail.h"
#include "mem.h"
#include <errno.h>
#include <math.h>
#include <png.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

enum { COLUMNS = 5, ROWS = 7, FIRST = ' ', LAST = '~', STOPS = 33 };

/* Seven rows a letter from the top, bit 4 at the left; from blank to tilde. Those that reach below
 * the line are drawn two dots lower. */
static const char low_letters[] = "gjpqy";
static const char letters[LAST - FIRST + 1][ROWS + 1] = {
    "\x00\x00\x00\x00\x00\x00\x00", "\x04\x04\x04\x04\x04\x00\x04", "\x0a\x0a\x00\x00\x00\x00\x00",
    "\x0a\x0a\x1f\x0a\x1f\x0a\x0a", "\x04\x0f\x14\x0e\x05\x1e\x04", "\x18\x19\x02\x04\x08\x13\x03",
    "\x0c\x12\x14\x08\x15\x12\x0d", "\x04\x04\x00\x00\x00\x00\x00", "\x02\x04\x08\x08\x08\x04\x02",
    "\x08\x04\x02\x02\x02\x04\x08", "\x00\x15\x0e\x1f\x0e\x15\x00", "\x00\x04\x04\x1f\x04\x04\x00",
    "\x00\x00\x00\x00\x04\x04\x08", "\x00\x00\x00\x1f\x00\x00\x00", "\x00\x00\x00\x00\x00\x00\x04",
    "\x01\x01\x02\x04\x08\x10\x10", "\x06\x09\x09\x09\x09\x09\x06", "\x04\x0c\x04\x04\x04\x04\x0e",
    "\x0e\x11\x01\x02\x04\x08\x1f", "\x0e\x11\x01\x06\x01\x11\x0e", "\x02\x06\x0a\x12\x1f\x02\x02",
    "\x1f\x10\x1e\x01\x01\x11\x0e", "\x06\x08\x10\x1e\x11\x11\x0e", "\x1f\x01\x02\x04\x04\x08\x08",
    "\x0e\x11\x11\x0e\x11\x11\x0e", "\x0e\x11\x11\x0f\x01\x02\x0c", "\x00\x00\x04\x00\x00\x04\x00",
    "\x00\x00\x04\x00\x00\x04\x08", "\x02\x04\x08\x10\x08\x04\x02", "\x00\x00\x1f\x00\x1f\x00\x00",
    "\x08\x04\x02\x01\x02\x04\x08", "\x0e\x11\x01\x02\x04\x00\x04", "\x0e\x11\x17\x15\x17\x10\x0f",
    "\x04\x0a\x11\x11\x1f\x11\x11", "\x1e\x11\x11\x1e\x11\x11\x1e", "\x0e\x11\x10\x10\x10\x11\x0e",
    "\x1c\x12\x11\x11\x11\x12\x1c", "\x1f\x10\x10\x1e\x10\x10\x1f", "\x1f\x10\x10\x1e\x10\x10\x10",
    "\x0e\x11\x10\x13\x11\x11\x0e", "\x11\x11\x11\x1f\x11\x11\x11", "\x0e\x04\x04\x04\x04\x04\x0e",
    "\x01\x01\x01\x01\x01\x11\x0e", "\x11\x12\x14\x18\x14\x12\x11", "\x10\x10\x10\x10\x10\x10\x1f",
    "\x11\x1b\x15\x15\x11\x11\x11", "\x11\x19\x15\x15\x13\x11\x11", "\x0e\x11\x11\x11\x11\x11\x0e",
    "\x1e\x11\x11\x1e\x10\x10\x10", "\x0e\x11\x11\x11\x15\x12\x0d", "\x1e\x11\x11\x1e\x14\x12\x11",
    "\x0f\x10\x10\x0e\x01\x01\x1e", "\x1f\x04\x04\x04\x04\x04\x04", "\x11\x11\x11\x11\x11\x11\x0e",
    "\x11\x11\x11\x11\x11\x0a\x04", "\x11\x11\x11\x15\x15\x1b\x11", "\x11\x11\x0a\x04\x0a\x11\x11",
    "\x11\x11\x0a\x04\x04\x04\x04", "\x1f\x01\x02\x04\x08\x10\x1f", "\x0e\x08\x08\x08\x08\x08\x0e",
    "\x10\x10\x08\x04\x02\x01\x01", "\x0e\x02\x02\x02\x02\x02\x0e", "\x04\x0a\x11\x00\x00\x00\x00",
    "\x00\x00\x00\x00\x00\x00\x1f", "\x08\x04\x00\x00\x00\x00\x00", "\x00\x00\x0e\x01\x0f\x11\x0f",
    "\x10\x10\x1e\x11\x11\x11\x1e", "\x00\x00\x0e\x10\x10\x10\x0e", "\x01\x01\x0f\x11\x11\x11\x0f",
    "\x00\x00\x0e\x11\x1f\x10\x0e", "\x06\x08\x1c\x08\x08\x08\x08", "\x0f\x11\x11\x11\x0f\x01\x0e",
    "\x10\x10\x1e\x11\x11\x11\x11", "\x04\x00\x04\x04\x04\x04\x04", "\x04\x00\x04\x04\x04\x04\x18",
    "\x10\x10\x12\x14\x18\x14\x12", "\x08\x08\x08\x08\x08\x08\x04", "\x00\x00\x1a\x15\x15\x15\x15",
    "\x00\x00\x1e\x11\x11\x11\x11", "\x00\x00\x0e\x11\x11\x11\x0e", "\x1e\x11\x11\x11\x1e\x10\x10",
    "\x0f\x11\x11\x11\x0f\x01\x01", "\x00\x00\x16\x18\x10\x10\x10", "\x00\x00\x0f\x10\x0e\x01\x1e",
    "\x08\x08\x1c\x08\x08\x08\x04", "\x00\x00\x11\x11\x11\x11\x0f", "\x00\x00\x11\x11\x11\x0a\x04",
    "\x00\x00\x11\x11\x15\x15\x0a", "\x00\x00\x11\x0a\x04\x0a\x11", "\x11\x11\x11\x11\x0f\x01\x0e",
    "\x00\x00\x1f\x02\x04\x08\x1f", "\x02\x04\x04\x08\x04\x04\x02", "\x04\x04\x04\x04\x04\x04\x04",
    "\x08\x04\x04\x02\x04\x04\x08", "\x00\x00\x00\x08\x15\x02\x00",
};

static const uint32_t maps[2][STOPS] = {
    {0x440154, 0x470d60, 0x48186a, 0x482374, 0x472d7b, 0x453781, 0x424086, 0x3e4989, 0x3b528b, 0x375b8d, 0x33638d,
     0x2f6b8e, 0x2c728e, 0x297a8e, 0x26828e, 0x23898e, 0x21918c, 0x1f988b, 0x1fa088, 0x22a785, 0x28ae80, 0x32b67a,
     0x3fbc73, 0x4ec36b, 0x5ec962, 0x70cf57, 0x84d44b, 0x98d83e, 0xaddc30, 0xc2df23, 0xd8e219, 0xece51b, 0xfde725},
    {0x000004, 0x040312, 0x0b0724, 0x150b37, 0x210c4a, 0x2f0a5b, 0x3d0965, 0x4a0c6b, 0x57106e, 0x64156e, 0x71196e,
     0x7d1e6d, 0x8a226a, 0x972766, 0xa32c61, 0xb0315b, 0xbc3754, 0xc73e4c, 0xd24644, 0xdb503b, 0xe45a31, 0xeb6628,
     0xf1731d, 0xf68013, 0xf98e09, 0xfb9d07, 0xfcac11, 0xfbbc21, 0xf9cb35, 0xf5db4c, 0xf2ea69, 0xf3f68a, 0xfcffa4},
};

struct canvas *canvas_new(int width, int height, uint32_t background)
{
    struct canvas *canvas = mem_alloc("pictures", sizeof *canvas);
    *canvas = (struct canvas){width, height, mem_alloc("pictures", (size_t)(3 * width * height))};
    canvas_fill(canvas, 0, 0, width, height, background);
    return canvas;
}

void canvas_free(struct canvas *canvas)
{
    mem_free(canvas->rgb);
    mem_free(canvas);
}

void canvas_write(const struct canvas *canvas, const char *path)
{
    png_image image = {.version = PNG_IMAGE_VERSION, .width = (png_uint_32)canvas->width,
                       .height = (png_uint_32)canvas->height, .format = PNG_FORMAT_RGB};
    char temporary[4096];
    snprintf(temporary, sizeof temporary, "%s.tmp", path);
    FILE *stream = fopen(temporary, "wb");
    bool done = stream && png_image_write_to_stdio(&image, stream, 0, canvas->rgb, 0, NULL)
             && fflush(stream) == 0 && fsync(fileno(stream)) == 0;
    int reason = errno;
    if (stream && fclose(stream) != 0 && done) {
        done = false;
        reason = errno;
    }
    if (done && rename(temporary, path) == 0) return;
    if (done) reason = errno;
    unlink(temporary);
    fail(STATUS_ENVIRONMENT, "cannot write %s: %s", path, strerror(reason));
}

void canvas_mix(struct canvas *canvas, int x, int y, uint32_t colour, double share)
{
    if (x < 0 || y < 0 || x >= canvas->width || y >= canvas->height || !(share > 0)) return;
    unsigned char *pixel = canvas->rgb + 3 * ((size_t)y * (size_t)canvas->width + (size_t)x);
    for (int k = 0; k < 3; k++) {
        double target = colour >> (16 - 8 * k) & 255;
        pixel[k] = (unsigned char)(pixel[k] + (target - pixel[k]) * fmin(share, 1) + 0.5);
    }
}

void canvas_fill(struct canvas *canvas, int x, int y, int width, int height, uint32_t colour)
{
    for (int j = y; j < y + height; j++)
        for (int i = x; i < x + width; i++) canvas_mix(canvas, i, j, colour, 1);
}

uint32_t canvas_colour(enum canvas_map map, double value)
{
    double place = fmin(fmax(value, 0), 1) * (STOPS - 1);
    int stop = (int)fmin(place, STOPS - 2);
    uint32_t colour = 0;
    for (int shift = 0; shift <= 16; shift += 8) {
        double low = maps[map][stop] >> shift & 255, high = maps[map][stop + 1] >> shift & 255;
        colour |= (uint32_t)(low + (high - low) * (place - stop) + 0.5) << shift;
    }
    return colour;
}

/* --- lines --- */

struct stroke { double from[2], to[2]; };

static double distance(const struct stroke *s, double x, double y)
{
    double dx = s->to[0] - s->from[0], dy = s->to[1] - s->from[1], length2 = dx * dx + dy * dy;
    double along = length2 > 0 ? ((x - s->from[0]) * dx + (y - s->from[1]) * dy) / length2 : 0;
    along = fmin(fmax(along, 0), 1);
    return hypot(x - s->from[0] - along * dx, y - s->from[1] - along * dy);
}

void canvas_line(struct canvas *canvas, const double from[2], const double to[2], double width, uint32_t colour)
{
    const struct stroke stroke = {{from[0], from[1]}, {to[0], to[1]}};
    const double margin = 0.5 * width + 1;
    for (int y = (int)(fmin(from[1], to[1]) - margin); y <= (int)(fmax(from[1], to[1]) + margin) + 1; y++)
        for (int x = (int)(fmin(from[0], to[0]) - margin); x <= (int)(fmax(from[0], to[0]) + margin) + 1; x++)
            canvas_mix(canvas, x, y, colour, 0.5 * width - distance(&stroke, x, y) + 0.5);
}

/* --- text --- */

static bool dot(const char *letter, int row, int column)
{
    return row >= 0 && row < ROWS && column >= 0 && column < COLUMNS && letter[row] >> (COLUMNS - 1 - column) & 1;
}

/* Joins each dot to its neighbours at the right and below; at a slant only where there is no other way. */
static int letter_strokes(const char *letter, struct stroke stroke[5 * ROWS * COLUMNS])
{
    static const int step[4][2] = {{0, 1}, {1, 0}, {1, 1}, {1, -1}};
    int count = 0;
    for (int r = 0; r < ROWS; r++)
        for (int c = 0; c < COLUMNS; c++) {
            if (!dot(letter, r, c)) continue;
            stroke[count++] = (struct stroke){{c, r}, {c, r}};
            for (int s = 0; s < 4; s++) {
                int row = r + step[s][0], column = c + step[s][1];
                bool joined = s >= 2 && (dot(letter, r, column) || dot(letter, row, c));
                if (dot(letter, row, column) && !joined)
                    stroke[count++] = (struct stroke){{c, r}, {column, row}};
            }
        }
    return count;
}

static const char *letter_dots(char character)
{
    int code = character < FIRST || character > LAST ? '?' : character;
    return letters[code - FIRST];
}

/* First and last column in use; a blank is three wide, digits are as wide as each other. */
static void letter_columns(char character, int column[2])
{
    int used = 0;
    for (int r = 0; r < ROWS; r++) used |= letter_dots(character)[r];
    column[0] = 0;
    column[1] = used == 0 ? 1 : COLUMNS - 1;
    if (used == 0 || strchr("0123456789", character)) return;
    while (!(used >> (COLUMNS - 1 - column[0]) & 1)) column[0]++;
    while (!(used >> (COLUMNS - 1 - column[1]) & 1)) column[1]--;
}

/* One letter, the lower left dot of its square at `at`; unit: pixels between dots. */
static void draw_letter(struct canvas *canvas, char character, const double at[2], double unit, uint32_t colour)
{
    struct stroke stroke[5 * ROWS * COLUMNS];
    const double half = 0.4 * unit, margin = half + 1;      /* half a stroke's width */
    const int count = letter_strokes(letter_dots(character), stroke);
    const double base = at[1] + (strchr(low_letters, character) ? 2 * unit : 0), top = base - (ROWS - 1) * unit;
    for (int y = (int)(top - margin); y <= (int)(base + margin) + 1; y++)
        for (int x = (int)(at[0] - margin); x <= (int)(at[0] + (COLUMNS - 1) * unit + margin) + 1; x++) {
            double nearest = INFINITY;
            for (int s = 0; s < count; s++)
                nearest = fmin(nearest, distance(&stroke[s], (x - at[0]) / unit, (y - top) / unit));
            canvas_mix(canvas, x, y, colour, half - nearest * unit + 0.5);
        }
}

/* Draws, or with no canvas only measures; returns the width. */
static double lay_text(struct canvas *canvas, const double at[2], double size, uint32_t colour, const char *text)
{
    const double between = 2;   /* dots from letter to letter */
    double x = at[0], unit = size / (ROWS - 1), raise = 0;
    for (const char *c = text; *c; c++) {
        if (*c == '^') {
            unit = 0.75 * size / (ROWS - 1);
            raise = 0.5 * size;
            continue;
        }
        if (strchr(" ,])", *c)) {
            unit = size / (ROWS - 1);
            raise = 0;
        }
        int column[2];
        letter_columns(*c, column);
        if (canvas) draw_letter(canvas, *c, (double[2]){x - column[0] * unit, at[1] - raise}, unit, colour);
        x += (column[1] - column[0] + between) * unit;
    }
    return x - at[0] - between * unit;
}

double canvas_text_width(double size, const char *text)
{
    return lay_text(NULL, (double[2]){0, 0}, size, 0, text);
}

void canvas_text(struct canvas *canvas, const double at[2], double size, enum canvas_align align,
                 uint32_t colour, const char *text)
{
    double width = canvas_text_width(size, text);
    double left = align == CANVAS_LEFT ? at[0] : align == CANVAS_MIDDLE ? at[0] - width / 2 : at[0] - width;
    lay_text(canvas, (double[2]){left, at[1]}, size, colour, text);
}
