/* SPDX-License-Identifier: GPL-3.0-or-later
 * The module `phase_diagram`: at every snapshot the mass of the gas by density and temperature, as a table and as a
 * picture (doc/manual/cooling.md, section 7). */
#include "comm.h"
#include "constants.h"
#include "cooling.h"
#include "draw/canvas.h"
#include "file/layout.h"
#include "file/text_file.h"
#include "mem.h"
#include "module.h"
#include "output.h"
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

struct phase_diagram { double hydrogen; struct param_list axis[2]; };

static const struct param params[] = {
    {"hydrogen", PARAM_REAL, "", "none", 0.01, 1, NULL, "mass fraction of hydrogen, for n_H; default: cooling.hydrogen, or 0.76", true,
     offsetof(struct phase_diagram, hydrogen)},
    {"log_density", PARAM_LIST, "", "-6, 6", -60, 60, NULL, "from and to: log10 of n_H in cm^-3, in whole decades", true,
     offsetof(struct phase_diagram, axis[0])},
    {"log_temperature", PARAM_LIST, "", "1, 9", -60, 60, NULL, "from and to: log10 of T in K, in whole decades", true,
     offsetof(struct phase_diagram, axis[1])},
    {0}
};
static const char *const needed[] = {"sph", NULL};

enum { CELLS = 10 };                        /* a decade */
enum { SIDE = 704, LEFT = 120, TOP = 84, WIDTH = LEFT + SIDE + 150, HEIGHT = TOP + SIDE + 90 };
static const uint32_t background = 0x000000, ink = 0xe6e6e6;

static void declare(struct sim *sim, void *state)
{
    struct phase_diagram *phase = state;
    if (isnan(phase->hydrogen)) phase->hydrogen = cooling_hydrogen(sim);
    const char *const names[2] = {"log_density", "log_temperature"};
    for (int k = 0; k < 2; k++) {
        const double *end = phase->axis[k].value;
        if (phase->axis[k].n != 2 || !(end[0] < end[1]) || end[0] != rint(end[0]) || end[1] != rint(end[1]))
            problems_add(&sim->problems, "phase_diagram.%s: two whole numbers, the lesser first, such as \"-3, 4\"", names[k]);
    }
    if (!sim->units.physical) problems_add(&sim->problems, "phase_diagram needs physical units: this scene is dimensionless");
}

/* --- the table --- */

/* log10 of n_H [cm^-3] and of T [K] of every gas row. */
static float (*find_places(const struct sim *sim, const struct phase_diagram *phase))[2]
{
    const struct species *gas = &sim->species[GAS];
    const double n_h = phase->hydrogen * units_cgs(&sim->units, "density") / CONST_M_PROTON;
    float (*at)[2] = mem_alloc("phase_diagram", (size_t)gas->n * sizeof *at), *kelvin = mem_array("phase_diagram", float, gas->n);
    bool known = layout_temperatures(sim, kelvin);
    for (int64_t i = 0; i < gas->n; i++) {
        at[i][0] = (float)log10(n_h * (double)gas->rho[i]);
        at[i][1] = known ? log10f(kelvin[i]) : NAN;
    }
    mem_free(kelvin);
    return at;
}

struct map { int n[2]; double *mass; };     /* cell i + n[0] j, Msun; rows beyond an end are in the cells there */

static struct map make_map(const struct sim *sim, const struct phase_diagram *phase, const float (*at)[2])
{
    const struct species *gas = &sim->species[GAS];
    struct map map = {{0}, NULL};
    for (int k = 0; k < 2; k++) map.n[k] = (int)lround(phase->axis[k].value[1] - phase->axis[k].value[0]) * CELLS;
    map.mass = mem_array("phase_diagram", double, (int64_t)map.n[0] * map.n[1]);
    for (int64_t i = 0; i < gas->n; i++) {
        int cell[2];
        if (!isfinite(at[i][0] + at[i][1])) continue;
        for (int k = 0; k < 2; k++)
            cell[k] = (int)fmin(fmax(((double)at[i][k] - phase->axis[k].value[0]) * CELLS, 0), map.n[k] - 1);
        map.mass[cell[0] + (int64_t)map.n[0] * cell[1]] += gas->mass[i] * sim->units.mass / CONST_M_SUN;
    }
    return map;
}

/* A row for each cell that holds gas. */
static void write_table(const struct phase_diagram *phase, const struct map *map, const char *path)
{
    struct text_file whole = text_file_open(path);
    FILE *file = whole.stream;
    if (!file) fail(STATUS_ENVIRONMENT, "%s: cannot be written: %s", path, strerror(errno));
    fprintf(file, "log_n_H [cm^-3],log_T [K],mass [Msun]\n");
    for (int j = 0; j < map->n[1]; j++)
        for (int i = 0; i < map->n[0]; i++) {
            double mass = map->mass[i + (int64_t)map->n[0] * j];
            if (mass > 0)
                fprintf(file, "%.2f,%.2f,%.9g\n", phase->axis[0].value[0] + (i + 0.5) / CELLS,
                        phase->axis[1].value[0] + (j + 0.5) / CELLS, mass);
        }
    if (!text_file_close(&whole)) fail(STATUS_ENVIRONMENT, "%s: cannot be written: %s", path, strerror(errno));
}

/* --- the picture --- */

/* Colour: log10 of the mass, five decades below the largest. */
static void draw_cells(struct canvas *canvas, const struct map *map, double most)
{
    const double decades = 5;
    for (int j = 0; j < map->n[1]; j++)
        for (int i = 0; i < map->n[0]; i++) {
            double mass = map->mass[i + (int64_t)map->n[0] * j];
            int left = i * SIDE / map->n[0], right = (i + 1) * SIDE / map->n[0];
            int low = j * SIDE / map->n[1], high = (j + 1) * SIDE / map->n[1];
            if (mass > 0)
                canvas_fill(canvas, LEFT + left, TOP + SIDE - high, right - left, high - low,
                            canvas_colour(CANVAS_VIRIDIS, 1 + log10(mass / most) / decades));
        }
    for (int y = 0; y < SIDE; y++)
        canvas_fill(canvas, LEFT + SIDE + 30, TOP + y, 14, 1, canvas_colour(CANVAS_VIRIDIS, 1 - (y + 0.5) / SIDE));
    for (int k = 0; k <= (int)decades; k++) {
        char text[32];
        snprintf(text, sizeof text, "10^%d", -k);
        canvas_text(canvas, (double[2]){LEFT + SIDE + 52, TOP + 6 + k / decades * SIDE}, 12, CANVAS_LEFT, ink, text);
    }
}

static void draw_axes(struct canvas *canvas, const struct phase_diagram *phase)
{
    for (int k = 0; k < 2; k++) {
        const int low = (int)lround(phase->axis[k].value[0]), decades = (int)lround(phase->axis[k].value[1]) - low;
        const int stride = 1 + decades / 12;
        for (int d = 0; d <= decades; d += stride) {
            char text[32];
            int at = (int)lround((double)d / decades * SIDE);
            snprintf(text, sizeof text, "10^%d", low + d);
            if (k == 0) canvas_text(canvas, (double[2]){LEFT + at, TOP + SIDE + 30}, 12, CANVAS_MIDDLE, ink, text);
            else canvas_text(canvas, (double[2]){LEFT - 14, TOP + SIDE - at + 6}, 12, CANVAS_RIGHT, ink, text);
            if (k == 0) canvas_fill(canvas, LEFT + at, TOP + SIDE, 1, 8, ink);
            else canvas_fill(canvas, LEFT - 8, TOP + SIDE - at, 8, 1, ink);
        }
    }
    canvas_fill(canvas, LEFT, TOP, 1, SIDE, ink);
    canvas_fill(canvas, LEFT, TOP + SIDE, SIDE, 1, ink);
    canvas_text(canvas, (double[2]){LEFT + SIDE / 2.0, TOP + SIDE + 66}, 14, CANVAS_MIDDLE, ink, "n_H [cm^-3]");
    canvas_text(canvas, (double[2]){20, TOP - 24}, 14, CANVAS_LEFT, ink, "T [K]");
    canvas_text(canvas, (double[2]){WIDTH - 20, TOP - 24}, 14, CANVAS_RIGHT, ink, "mass/largest");
}

static void draw(const struct sim *sim, const struct phase_diagram *phase, const struct map *map, const char *path)
{
    struct canvas *canvas = canvas_new(WIDTH, HEIGHT, background);
    double most = 0;
    char text[64];
    for (int64_t c = 0; c < (int64_t)map->n[0] * map->n[1]; c++) most = fmax(most, map->mass[c]);
    snprintf(text, sizeof text, "t = %.4g Myr", timeline_now(&sim->time) * units_cgs(&sim->units, "time") / (1e6 * CONST_YEAR));
    draw_cells(canvas, map, most);
    draw_axes(canvas, phase);
    canvas_text(canvas, (double[2]){LEFT + SIDE / 2.0, 44}, 18, CANVAS_MIDDLE, ink, text);
    canvas_write(canvas, path);
    canvas_free(canvas);
}

/* After the snapshot of this tick (module output comes first), on the one rank that writes: each holds all rows. */
static void record(struct sim *sim, void *state)
{
    const struct phase_diagram *phase = state;
    const struct species *gas = &sim->species[GAS];
    if (comm_rank() != 0 || gas->n == 0 || !output_wrote_snapshot(sim)) return;
    float (*at)[2] = find_places(sim, phase);
    struct map map = make_map(sim, phase, (const float (*)[2])at);
    char *table = output_companion(sim, "phase_diagram", "csv"), *picture = output_companion(sim, "phase_diagram", "png");
    write_table(phase, &map, table);
    draw(sim, phase, &map, picture);
    mem_free(table);
    mem_free(picture);
    mem_free(map.mass);
    mem_free(at);
}

const struct module phase_diagram_module = {
    .name = "phase_diagram", .whole = true, .doc = "the gas by density and temperature, at every snapshot", .kind = MODULE_BLOCK,
    .companion = "phase", .params = params, .requires = needed, .state_bytes = sizeof(struct phase_diagram),
    .declare = declare, .hook = {[HOOK_RECORD] = record},
};
