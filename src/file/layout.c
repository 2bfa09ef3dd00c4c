/* SPDX-License-Identifier: GPL-3.0-or-later
 * Groups and units of snapshots (layout.h). */
#include "layout.h"
#include "constants.h"
#include "module.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const int layout_type[N_SPECIES] = {[GAS] = 0, [DARK] = 1, [CLOUD] = 3, [STAR] = 4};

int layout_type_of(const struct species *table, int64_t row)
{
    const bool hole = table->hole && table->hole[row], sink = table->sink && table->sink[row];
    return hole || sink ? LAYOUT_HOLES : layout_type[table->kind];
}

bool layout_holds(int type, enum column column)
{
    return type == LAYOUT_HOLES || (column != COLUMN_hole && column != COLUMN_sink && column != COLUMN_spin);
}

static const char letters[] = "LMV";
static const char *const kpc_names[3] = {"kpc", "1e10 Msun", "km/s"};

struct layout_unit layout_unit(bool physical)
{
    if (!physical) return (struct layout_unit){1, 1, 1, "none"};
    return (struct layout_unit){1e3 * CONST_PC, 1e10 * CONST_M_SUN, 1e5, "kpc, 1e10 Msun, km/s"};
}

void layout_powers(const char *unit, int power[3])
{
    for (int k = 0; k < 3; k++) {
        const char *at = strchr(unit, letters[k]);
        power[k] = !at ? 0 : at[1] == '^' ? atoi(at + 2) : 1;
    }
}

double layout_cgs(const struct layout_unit *unit, const int power[3])
{
    return pow(unit->length, power[0]) * pow(unit->mass, power[1]) * pow(unit->velocity, power[2]);
}

void layout_scale(char kind, void *values, int64_t count, double factor)
{
    double *wide = values;
    float *narrow = values;
    for (int64_t i = 0; i < count && factor != 1; i++) {
        if (kind == 'd') wide[i] *= factor;
        else if (kind == 'f') narrow[i] = (float)(factor * (double)narrow[i]);
    }
}

double layout_factor(const struct units *code, const char *unit)
{
    if (!code->physical) return 1;
    struct layout_unit file = layout_unit(true);
    /* Ratios first: a code unit that is the file's gives exactly 1. */
    struct layout_unit ratio = {code->length / file.length, code->mass / file.mass,
                                code->velocity / file.velocity, ""};
    int power[3];
    layout_powers(unit, power);
    return layout_cgs(&ratio, power);
}

void layout_unit_text(bool physical, const char *unit, char *text, size_t size)
{
    snprintf(text, size, "%s", unit);
    int power[3];
    layout_powers(unit, power);
    if (!physical || !(power[0] || power[1] || power[2])) return;
    size_t used = 0;
    text[0] = 0;
    for (int k = 0; k < 3; k++) {
        int j = (k + 1) % 3;    /* masses first: "1e10 Msun kpc^-3" */
        if (power[j] == 0 || used >= size) continue;
        const char *space = used > 0 ? " " : "", *name = kpc_names[j];
        const char *form = power[j] == 1 ? "%s%s" : j == 0 ? "%s%s^%d" : "%s(%s)^%d";
        used += (size_t)snprintf(text + used, size - used, form, space, name, power[j]);
    }
}

double layout_kelvin(const struct sim *sim)
{
    for (int u = 0; u < sim->n_use && sim->units.physical; u++)
        if (sim->use[u].module->kelvin) return sim->use[u].module->kelvin(sim, sim->use[u].state);
    return 0;
}

bool layout_temperatures(const struct sim *sim, float *kelvin)
{
    bool known = false;
    for (int u = 0; u < sim->n_use && sim->units.physical; u++) {
        if (!sim->use[u].module->temperature) continue;
        sim->use[u].module->temperature(sim, sim->use[u].state, kelvin);
        known = true;
    }
    return known;
}

double layout_gyr(const struct units *code, double time)
{
    return code->physical ? time * (code->length / code->velocity / (1e9 * CONST_YEAR)) : time;
}
