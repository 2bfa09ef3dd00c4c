/* SPDX-License-Identifier: GPL-3.0-or-later
 * Draws the pictures of a run (picture.h). */
#include "picture.h"
#include "canvas.h"
#include "comm.h"
#include "constants.h"
#include "file/layout.h"
#include "mem.h"
#include "surface.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { WIDTH = 1600, HEIGHT = 900, TOP = 84, BAR = 14, PIXELS = SURFACE_SIZE * SURFACE_SIZE };
static const int panel_left[2] = {64, WIDTH - 64 - SURFACE_SIZE};
static const uint32_t background = 0x000000, ink = 0xe6e6e6;

/* One map: rows of a species seen along an axis; the second of gas shows its temperature. */
struct panel {
    const struct species *table;
    int axis[2];                /* across and up */
    char title[64];
    float *shown;               /* log10, pixel i + SURFACE_SIZE * j, j upwards; -INFINITY = nothing */
    float *mass;                /* log10 of mass per pixel */
};

/* --- the frame --- */

struct sample { double at, mass; };

static int by_place(const void *a, const void *b)
{
    const struct sample *left = a, *right = b;
    return (left->at > right->at) - (left->at < right->at);
}

/* Where the sum of the masses, in order of place, reaches that part of the whole. */
static double quantile(struct sample *sample, int64_t n, double part)
{
    double total = 0, sum = 0;
    qsort(sample, (size_t)n, sizeof *sample, by_place);
    for (int64_t i = 0; i < n; i++) total += sample[i].mass;
    for (int64_t i = 0; i < n; i++)
        if ((sum += sample[i].mass) >= part * total) return sample[i].at;
    return n > 0 ? sample[n - 1].at : 0;
}

/* A box that is closed on all sides, as it is: the picture is as wide as its longest side. */
static bool frame_box(struct picture *picture, const struct box *box)
{
    for (int k = 0; k < 3; k++)
        if (!(box->side[k] > 0)) return false;
    for (int k = 0; k < 3; k++) {
        picture->centre[k] = 0.5 * box->side[k];
        picture->half = fmax(picture->half, 0.5 * box->side[k]);
    }
    return picture->set = true;
}

/* One row in so many of all ranks: where it is and what it weighs. */
struct sampled { double pos[3], mass; };

/* The same rows on any number of ranks, in their order; for mem_free. */
static struct sampled *take_sample(const struct species *table, int64_t *n)
{
    const int64_t most = 100000, stride = 1 + table->n / most, from = species_from(table), to = species_to(table);
    const int64_t first = (from + stride - 1) / stride * stride, own = to > first ? (to - first + stride - 1) / stride : 0;
    int64_t *bytes = mem_array("pictures", int64_t, comm_size()), before = 0, total = own;
    if (table->spread) {
        comm_gather_counts(own * (int64_t)sizeof(struct sampled), bytes);
        total = 0;
        for (int r = 0; r < comm_size(); r++) {
            before += r < comm_rank() ? bytes[r] / (int64_t)sizeof(struct sampled) : 0;
            total += bytes[r] / (int64_t)sizeof(struct sampled);
        }
    }
    struct sampled *all = mem_array("pictures", struct sampled, total);
    for (int64_t k = 0, i = first; k < own; k++, i += stride) {
        memcpy(all[before + k].pos, table->pos[i], sizeof all->pos);
        all[before + k].mass = table->mass[i];
    }
    if (table->spread) comm_gather_all(all, bytes);
    mem_free(bytes);
    *n = total;
    return all;
}

/* Centre: the medians. The square that holds 98 % of the mass in each view, and a third more. */
static void choose_frame(struct picture *picture, const struct species *table, const struct panel panel[2])
{
    const double part = 0.98, margin = 1.35;
    int64_t n;
    struct sampled *row = take_sample(table, &n);
    struct sample *sample = mem_array("pictures", struct sample, n);
    for (int k = 0; k < 3; k++) {
        for (int64_t i = 0; i < n; i++) sample[i] = (struct sample){row[i].pos[k], row[i].mass};
        picture->centre[k] = quantile(sample, n, 0.5);
    }
    for (int p = 0; p < 2; p++) {
        const int *axis = panel[p].axis;
        for (int64_t i = 0; i < n; i++) {
            double across = fabs(row[i].pos[axis[0]] - picture->centre[axis[0]]);
            double up = fabs(row[i].pos[axis[1]] - picture->centre[axis[1]]);
            sample[i] = (struct sample){fmax(across, up), row[i].mass};
        }
        picture->half = fmax(picture->half, margin * quantile(sample, n, part));
    }
    if (!(picture->half > 0)) picture->half = 1;
    picture->set = true;
    mem_free(sample);
    mem_free(row);
}

/* --- maps --- */

static bool has_kernel(const struct species *table) { return table->kind == GAS && table->h; }
static bool has_heat(const struct species *table) { return has_kernel(table) && table->u; }

static int64_t count_here(const struct species *table) { return species_to(table) - species_from(table); }

/* Positions, in pixels, of the rows here. */
static double (*project(const struct picture *picture, const struct panel *panel))[2]
{
    const struct species *table = panel->table;
    const double scale = SURFACE_SIZE / (2 * picture->half);
    const int64_t n = count_here(table), from = species_from(table);
    double (*at)[2] = mem_alloc("pictures", (size_t)n * sizeof *at);
    for (int64_t i = 0; i < n; i++)
        for (int k = 0; k < 2; k++) {
            int axis = panel->axis[k];
            at[i][k] = (table->pos[from + i][axis] - picture->centre[axis]) * scale + 0.5 * SURFACE_SIZE;
        }
    return at;
}

static float *pixel_row(void) { return mem_array("pictures", float, PIXELS); }

/* Msun pc^-2 per mass of code units and length^2. */
static double surface_unit(const struct units *units)
{
    if (!units->physical) return 1;
    double length = units->length / CONST_PC;
    return units->mass / CONST_M_SUN / (length * length);
}

/* Fills `panel->shown` with the mass per area, and `average`, if given, with the mean of a value of each row. */
static void fill_map(const struct picture *picture, const struct sim *sim, struct panel *panel, const float *value, float *average)
{
    const struct species *table = panel->table;
    const double scale = SURFACE_SIZE / (2 * picture->half);
    double (*at)[2] = project(picture, panel);
    const int64_t n = count_here(table), from = species_from(table);
    float *h = has_kernel(table) ? NULL : mem_array("pictures", float, n + 1);      /* never NULL */
    if (h) surface_smoothing((const double (*)[2])at, n, table->spread, h);
    const struct surface_rows rows = {
        .n = n, .at = (const double (*)[2])at, .h = h ? h : table->h + from, .h_unit = h ? 1 : scale, .mass = table->mass + from,
        .value = value, .side = {sim->box.side[panel->axis[0]] * scale, sim->box.side[panel->axis[1]] * scale}};
    struct surface *surface = surface_new();
    surface_add(surface, &rows);
    if (table->spread) surface_sum_ranks(surface);
    const float (*cell)[2] = surface_finish(surface);
    const float per_area = (float)(surface_unit(&sim->units) * scale * scale);
    panel->shown = pixel_row();
#pragma omp parallel for
    for (int i = 0; i < PIXELS; i++) {
        panel->shown[i] = log10f(cell[i][0] * per_area);
        if (average) average[i] = log10f(cell[i][1] / cell[i][0]);
    }
    mem_free(h);
    mem_free(at);
    surface_free(surface);
}

static void choose_panels(const struct sim *sim, struct panel panel[2])
{
    static const enum species_kind order[] = {STAR, CLOUD, DARK, GAS};
    const struct species *gas = &sim->species[GAS];
    const char *unit = sim->units.physical ? " [Msun pc^-2]" : "", *what = "surface density";
    int count = 0;
    memset(panel, 0, 2 * sizeof *panel);
    for (int p = 0; p < 2; p++) panel[p].axis[1] = 1;
    if (gas->n > 0 && has_heat(gas)) {
        panel[0].table = panel[1].table = gas;
        snprintf(panel[0].title, sizeof panel[0].title, "column density%s", unit);
        snprintf(panel[1].title, sizeof panel[1].title, "%s",
                 sim->units.physical ? "temperature [K]" : "specific internal energy");
        return;
    }
    if (gas->n > 0 && has_kernel(gas)) {
        what = "column density";
        panel[count++].table = gas;
    }
    for (int s = 0; s < N_SPECIES && count < 2 && panel[0].table != gas; s++)
        if (sim->species[order[s]].n > 0) panel[count++].table = &sim->species[order[s]];
    for (int p = 0; p < count; p++)
        snprintf(panel[p].title, sizeof panel[p].title, "surface density, %s%s",
                 species_names[panel[p].table->kind], unit);
    if (count != 1) return;
    panel[1] = panel[0];
    panel[1].axis[1] = 2;
    for (int p = 0; p < 2; p++)
        snprintf(panel[p].title, sizeof panel[p].title, "%s along %c%s", what, p ? 'y' : 'z', unit);
}

static void fill_maps(const struct sim *sim, const struct picture *picture, struct panel panel[2])
{
    bool heat = has_heat(panel[0].table);
    float *average = heat ? pixel_row() : NULL, *kelvin = heat ? mem_array("pictures", float, count_here(panel[0].table)) : NULL;
    bool known = heat && layout_temperatures(sim, kelvin);
    fill_map(picture, sim, &panel[0], known ? kelvin : heat ? panel[0].table->u + species_from(panel[0].table) : NULL, average);
    if (heat) panel[1].shown = average;
    else fill_map(picture, sim, &panel[1], NULL, NULL);
    mem_free(kelvin);
    for (int p = 0; p < 2; p++) panel[p].mass = panel[heat ? 0 : p].shown;
}

/* --- colour ranges --- */

/* Half decades, from HALVES/2 of them below 1: the logarithm of any float has a place. */
enum { HALVES = 256 };

/* The half decade in which the sum of these parts, from below, reaches `share` of the whole. */
static double half_decade(const double part[HALVES], double share)
{
    double total = 0, sum = 0;
    for (int k = 0; k < HALVES; k++) total += part[k];
    for (int k = 0; k < HALVES; k++)
        if ((sum += part[k]) >= share * total && sum > 0) return 0.5 * (k - HALVES / 2);
    return 0;
}

/* Whole half decades about what is seen: of the mass all but its thinnest 0.2 %, of the other map all but its lowest
 * hundredth, of either five decades at most. The range of a run holds those of all its pictures so far. */
static void widen_range(struct picture *picture, int p, const struct panel *panel)
{
    const double decades = 5, thin = 0.002, lowest = 0.01;
    const bool is_mass = panel->mass == panel->shown;
    double part[HALVES] = {0}, high = -INFINITY;
    for (int i = 0; i < PIXELS; i++) {
        const double value = (double)panel->shown[i];
        if (!isfinite(value) || !(is_mass || (double)panel->mass[i] > picture->range[0].low)) continue;
        part[HALVES / 2 + (int)floor(2 * value)] += is_mass ? pow(10, value) : 1;
        high = fmax(high, value);
    }
    double low = half_decade(part, is_mass ? thin : lowest);
    high = isfinite(high) ? fmax(ceil(2 * high) / 2, low + 0.5) : low + 0.5;
    low = fmax(low, high - decades);
    const bool first = picture->range[p].high <= picture->range[p].low;
    picture->range[p].high = first ? high : fmax(high, picture->range[p].high);
    picture->range[p].low = first ? low : fmin(low, picture->range[p].low);
}

/* Two views of the same rows have the same colours. */
static void share_range(struct picture *picture)
{
    const double high = fmax(picture->range[0].high, picture->range[1].high);
    const double low = fmin(picture->range[0].low, picture->range[1].low);
    for (int p = 0; p < 2; p++) {
        picture->range[p].high = high;
        picture->range[p].low = low;
    }
}

/* --- drawing --- */

static void draw_map(struct canvas *canvas, int p, const struct picture *picture, const struct panel *panel,
                     enum canvas_map map)
{
    const bool is_mass = panel->mass == panel->shown;
    const double low = picture->range[p].low, high = picture->range[p].high;
    const double faintest = picture->range[is_mass ? p : 0].low;
#pragma omp parallel for
    for (int j = 0; j < SURFACE_SIZE; j++)
        for (int i = 0; i < SURFACE_SIZE; i++) {
            const int pixel = i + SURFACE_SIZE * (SURFACE_SIZE - 1 - j);
            double share = 1 + (double)panel->mass[pixel] - faintest; /* fades over the decade below the range */
            uint32_t colour = canvas_colour(map, ((double)panel->shown[pixel] - low) / (high - low));
            if (isfinite(panel->shown[pixel])) canvas_mix(canvas, panel_left[p] + i, TOP + j, colour, share);
        }
}

static void draw_bar(struct canvas *canvas, int p, const struct picture *picture, const char *title,
                     enum canvas_map map)
{
    const double low = picture->range[p].low, high = picture->range[p].high;
    const int top = TOP + SURFACE_SIZE + 18, left = panel_left[p];
    for (int i = 0; i < SURFACE_SIZE; i++)
        canvas_fill(canvas, left + i, top, 1, BAR, canvas_colour(map, (i + 0.5) / SURFACE_SIZE));
    const int between = high - low > 6 ? 2 : 1;
    for (int decade = (int)ceil(low); decade <= high; decade += between) {
        char text[32];
        int x = left + (int)lround((decade - low) / (high - low) * (SURFACE_SIZE - 1));
        snprintf(text, sizeof text, "10^%d", decade);
        canvas_fill(canvas, x, top + BAR, 1, 6, ink);
        canvas_text(canvas, (double[2]){x, top + BAR + 24}, 12, CANVAS_MIDDLE, ink, text);
    }
    canvas_text(canvas, (double[2]){left + SURFACE_SIZE / 2.0, top + BAR + 52}, 14, CANVAS_MIDDLE, ink, title);
}

/* A unit of lengths or times, and the least for which it is used. */
struct scale_unit { double size, least; const char *name; };

static const struct scale_unit *suitable(const struct scale_unit *unit, double size)
{
    while (unit[1].name && size >= unit[1].least * (1 - 1e-9)) unit++;
    return unit;
}

/* A white bar of 1, 2 or 5 times a power of ten, about a quarter of the frame. */
static void draw_scale(struct canvas *canvas, int p, const struct sim *sim, const struct picture *picture)
{
    static const struct scale_unit lengths[] = {
        {CONST_AU, 0, "au"}, {CONST_PC, 0.01 * CONST_PC, "pc"}, {1e3 * CONST_PC, 1e3 * CONST_PC, "kpc"},
        {1e6 * CONST_PC, 1e6 * CONST_PC, "Mpc"}, {0, 0, NULL}};
    static const struct scale_unit none = {1, 0, ""};
    const double frame = 2 * picture->half * sim->units.length;
    const struct scale_unit *unit = sim->units.physical ? suitable(lengths, 0.25 * frame) : &none;
    const double wish = 0.25 * frame / unit->size, power = pow(10, floor(log10(wish)));
    const double length = wish >= 5 * power ? 5 * power : wish >= 2 * power ? 2 * power : power;
    const int pixels = (int)lround(length * unit->size / frame * SURFACE_SIZE);
    const int x = panel_left[p] + 20, y = TOP + SURFACE_SIZE - 26;
    char text[64];
    snprintf(text, sizeof text, "%g %s", length, unit->name);
    canvas_fill(canvas, x, y, pixels, 3, ink);
    canvas_text(canvas, (double[2]){x + pixels / 2.0, y - 11}, 12, CANVAS_MIDDLE, ink, text);
}

/* The unit is that of the end of the run, so that it stays. */
static void write_time(const struct sim *sim, char *text, size_t size)
{
    static const struct scale_unit times[] = {
        {1, 0, "yr"}, {1e3, 1e3, "kyr"}, {1e6, 1e6, "Myr"}, {1e9, 1e9, "Gyr"}, {0, 0, NULL}};
    double now = timeline_now(&sim->time), end = now;
    if (sim->time.tick_end < INT64_MAX) end = sim->time.start + timeline_seconds(&sim->time, sim->time.tick_end);
    if (!sim->units.physical) {
        snprintf(text, size, "t = %.3f", now);
        return;
    }
    const double year = sim->units.length / sim->units.velocity / CONST_YEAR;
    const struct scale_unit *unit = suitable(times, end * year);
    snprintf(text, size, "t = %.2f %s", now * year / unit->size, unit->name);
}

static void draw_heading(struct canvas *canvas, const struct sim *sim)
{
    const double size = 22, line = 52, left = panel_left[0], right = panel_left[1] + SURFACE_SIZE;
    char text[64];
    write_time(sim, text, sizeof text);
    canvas_text(canvas, (double[2]){right, line}, size, CANVAS_RIGHT, ink, text);
    if (!sim->scene || !sim->scene->title) return;
    double room = right - left - canvas_text_width(size, text) - 2 * size;
    double fits = fmin(1, room / canvas_text_width(size, sim->scene->title));
    canvas_text(canvas, (double[2]){left, line}, size * fits, CANVAS_LEFT, ink, sim->scene->title);
}

static void draw(const struct sim *sim, const struct picture *picture, const struct panel panel[2], const char *path)
{
    struct canvas *canvas = canvas_new(WIDTH, HEIGHT, background);
    const bool heat = panel[1].mass != panel[1].shown;
    for (int p = 0; p < 2; p++) {
        enum canvas_map map = heat && p == 1 ? CANVAS_INFERNO : CANVAS_VIRIDIS;
        draw_map(canvas, p, picture, &panel[p], map);
        draw_bar(canvas, p, picture, panel[p].title, map);
        draw_scale(canvas, p, sim, picture);
    }
    draw_heading(canvas, sim);
    canvas_write(canvas, path);
    canvas_free(canvas);
}

void picture_write(const struct sim *sim, const char *path, struct picture *picture)
{
    struct panel panel[2];
    if (comm_rank() != 0 && !sim->spread) return;
    choose_panels(sim, panel);
    if (!panel[0].table) return;
    if (!picture->set && !frame_box(picture, &sim->box)) choose_frame(picture, panel[0].table, panel);
    fill_maps(sim, picture, panel);
    for (int p = 0; p < 2; p++) widen_range(picture, p, &panel[p]);
    if (panel[0].table == panel[1].table && !has_heat(panel[0].table)) share_range(picture);
    if (comm_rank() == 0) draw(sim, picture, panel, path);
    for (int p = 0; p < 2; p++) mem_free(panel[p].shown);
}
