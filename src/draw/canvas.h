/* SPDX-License-Identifier: GPL-3.0-or-later
 * An RGB image with boxes, text and colour maps, written as PNG. */
#ifndef TEPHRA_CANVAS_H
#define TEPHRA_CANVAS_H
#include <stdint.h>

struct canvas { int width, height; unsigned char *rgb; };    /* rows from the top */
enum canvas_map { CANVAS_VIRIDIS, CANVAS_INFERNO };
enum canvas_align { CANVAS_LEFT, CANVAS_MIDDLE, CANVAS_RIGHT };

struct canvas *canvas_new(int width, int height, uint32_t background);
void canvas_free(struct canvas *canvas);
/* Writes by way of a temporary file; ends the program with STATUS_ENVIRONMENT if it cannot. */
void canvas_write(const struct canvas *canvas, const char *path);

/* Colours are 0xrrggbb. Mixes one into a pixel; outside of the image nothing happens. */
void canvas_mix(struct canvas *canvas, int x, int y, uint32_t colour, double share);
void canvas_fill(struct canvas *canvas, int x, int y, int width, int height, uint32_t colour);
/* Antialiased, with round ends; of no length: a dot. In pixels. */
void canvas_line(struct canvas *canvas, const double from[2], const double to[2], double width, uint32_t colour);
/* x is the left end, the middle or the right end of the base line; size is the height of capitals
 * in pixels. "^" raises what follows up to the next blank, comma or bracket: "Msun pc^-2". */
void canvas_text(struct canvas *canvas, const double at[2], double size, enum canvas_align align,
                 uint32_t colour, const char *text);
double canvas_text_width(double size, const char *text);
/* Colour of a value between 0 and 1, clipped. */
uint32_t canvas_colour(enum canvas_map map, double value);
#endif
