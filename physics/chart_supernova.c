/* SPDX-License-Identifier: GPL-3.0-or-later
 * `tephra chart supernova`: what is left of a supernova in gas that cools, against the density of the gas and the mass of its
 * rows: the radial momentum after five times the time at which the shell forms, and the energy that is still kinetic or in
 * hot gas (ics/supernova.yml in boxes of its size). */
#include "constants.h"
#include "draw/chart.h"
#include "file/layout.h"
#include "mem.h"
#include "supernova.h"
#include <math.h>
#include <stdio.h>

struct chart_supernova { struct param_list density, row; int64_t least; };

static const struct param params[] = {
    {"density", PARAM_LIST, "", "0.1, 1, 10", 1e-4, 1e4, NULL, "hydrogen nuclei per cm^3", false,
     offsetof(struct chart_supernova, density)},
    {"row", PARAM_LIST, "", "4, 8, 16, 32, 64, 128, 512", 0.01, 1e6, NULL, "mass of a row [Msun]", false,
     offsetof(struct chart_supernova, row)},
    {"least", PARAM_COUNT, "", "512", 100, 1e9, NULL, "rows, at least, in a larger box if need be", false,
     offsetof(struct chart_supernova, least)},
    {0}
};

/* What is left, over what Kim & Ostriker (2015, eq. 34) find in the end, and over 1e51 erg. */
struct left { double momentum, kinetic, hot; };

static struct left find_left(const struct sim *sim, double n_h)
{
    const struct species *gas = &sim->species[GAS];
    const double hot = 2e4, erg = units_cgs(&sim->units, "energy") / 1e51;
    float *kelvin = mem_array("charts", float, gas->n);
    struct left left = {0};
    layout_temperatures(sim, kelvin);
    for (int64_t i = 0; i < gas->n; i++) {
        double r2 = 0, out = 0, v2 = 0;
        for (int k = 0; k < 3; k++) {
            double d = gas->pos[i][k] - 0.5 * sim->box.side[k];
            d += box_shift(&sim->box, k, d);
            r2 += d * d;
            out += d * gas->vel[i][k];
            v2 += gas->vel[i][k] * gas->vel[i][k];
        }
        if (r2 > 0) left.momentum += gas->mass[i] * fmax(out, 0) / sqrt(r2);
        left.kinetic += 0.5 * gas->mass[i] * v2 * erg;
        if ((double)kelvin[i] > hot) left.hot += gas->mass[i] * (double)gas->u[i] * erg;
    }
    left.momentum *= sim->units.mass / CONST_M_SUN * (sim->units.velocity / 1e5) / supernova_momentum(n_h);
    mem_free(kelvin);
    return left;
}

enum { SETTINGS = 8, TEXT = 80 };

/* A box of three times the radius at which the shell forms to each side, or of enough rows. */
static void measure(struct chart_sheet *sheet, const struct chart_supernova *chart, double n_h, double row)
{
    const double pi = acos(-1), density = 0.03389 * n_h, radius = cbrt(supernova_shell_mass(n_h) / (4 * pi / 3 * density));
    const double end = 5 * supernova_shell_time(n_h);
    int64_t n = (int64_t)fmax((double)chart->least, density * pow(2 * 2 * radius, 3) / row);
    double side = cbrt((double)n * row / density);
    char text[SETTINGS][TEXT];
    const char *set[SETTINGS + 1] = {0};
    const char *const axis[3] = {"x", "y", "z"};
    for (int k = 0; k < 3; k++) snprintf(text[k], TEXT, "box.%s=%.9g pc", axis[k], side);
    snprintf(text[3], TEXT, "start.n=%lld", (long long)n);
    snprintf(text[4], TEXT, "start.density=%.9g Msun/pc^3", density);
    snprintf(text[5], TEXT, "time.end=%.9g yr", end);
    snprintf(text[6], TEXT, "output={snapshot_every: %.9g yr}", end);
    snprintf(text[7], TEXT, "time.dt_max=%.9g yr", end / 64);
    for (int k = 0; k < SETTINGS; k++) set[k] = text[k];
    struct sim *sim = chart_sim("ics/supernova.yml", set);
    double cpu = chart_run(sim);
    struct left left = find_left(sim, n_h);
    chart_row(sheet, "%g,%g,%.4g,%lld,%.4g,%.3e,%.3e,%.3e,%.3g", n_h, row, supernova_shell_mass(n_h) / row, (long long)n,
              left.momentum, fabs(log(left.momentum)), left.kinetic, left.hot, cpu);
    sim_free(sim);
}

static void make(struct chart_sheet *sheet, const void *state)
{
    const struct chart_supernova *chart = state;
    chart_columns(sheet, "density [cm^-3],row [Msun],shell_rows,rows,momentum [2.8e5 n^-0.17 Msun km/s],error,kinetic [1e51 erg],"
                  "hot [1e51 erg],cpu [s]");
    chart_note(sheet, "after five times the time at which the shell forms, which then holds shell_rows rows; "
               "error: of ln momentum; hot: above 2e4 K");
    for (int d = 0; d < chart->density.n; d++)
        for (int r = 0; r < chart->row.n; r++) measure(sheet, chart, chart->density.value[d], chart->row.value[r]);
    const struct chart_panel panels[] = {
        {.title = "radial momentum", .x = "row", .y = "momentum", .series = "density", .lines = true},
        {.title = "radial momentum", .x = "shell_rows", .y = "momentum", .series = "density", .lines = true},
        {.title = "energy in hot gas", .x = "shell_rows", .y = "hot", .series = "density", .lines = true},
        {.title = "error of the momentum", .x = "cpu", .y = "error", .series = "density", .front = true}};
    for (size_t p = 0; p < sizeof panels / sizeof *panels; p++) chart_panel(sheet, &panels[p]);
}

const struct chart supernova_chart = {"supernova", "what is left of a supernova, by density and mass of gas rows", params,
                                      sizeof(struct chart_supernova), make};
