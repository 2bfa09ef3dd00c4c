/* SPDX-License-Identifier: GPL-3.0-or-later
 * The module `phases`: how a medium of gas and cold clouds divides: masses and volumes of hot and warm gas within a cylinder
 * about the z axis, the slope of the clouds' mass spectrum, and at every snapshot the spectrum (doc/manual/dwarf.md, section 3). */
#include "clouds.h"
#include "comm.h"
#include "constants.h"
#include "file/layout.h"
#include "file/text_file.h"
#include "mem.h"
#include "module.h"
#include "output.h"
#include <errno.h>
#include <math.h>
#include <stdio.h>

struct phases { double radius, height, hot, light; };

static const struct param params[] = {
    {"radius", PARAM_REAL, "length", "3 kpc", 1e-300, 1e300, NULL, "of the cylinder about the z axis", true,
     offsetof(struct phases, radius)},
    {"height", PARAM_REAL, "length", "1 kpc", 1e-300, 1e300, NULL, "of it, to each side of the plane z = 0", true,
     offsetof(struct phases, height)},
    {"hot", PARAM_REAL, "temperature", "1e5 K", 1, 1e12, NULL, "gas is hot above, warm below", true, offsetof(struct phases, hot)},
    {"light", PARAM_REAL, "mass", "1e5 Msun", 1e-300, 1e300, NULL, "the slope is that of heavier clouds", true,
     offsetof(struct phases, light)},
    {0}
};

static const char *const requires[] = {"sph", "clouds", NULL};

struct sums { double mass[2], volume[2], clouds, filled, heavy, logs; };    /* warm, hot */

static bool is_inside(const struct phases *phases, const double x[3])
{
    return x[0] * x[0] + x[1] * x[1] < phases->radius * phases->radius && fabs(x[2]) < phases->height;
}

/* Each rank holds all rows. A row of gas fills m/rho. */
static void add_up(const struct sim *sim, const struct phases *phases, struct sums *sums)
{
    const struct species *gas = &sim->species[GAS], *cloud = &sim->species[CLOUD];
    float *kelvin = mem_array("phases", float, gas->n);
    bool known = layout_temperatures(sim, kelvin);
    for (int64_t i = 0; i < gas->n; i++) {
        if (!(gas->rho[i] > 0) || !is_inside(phases, gas->pos[i])) continue;
        int hot = known && (double)kelvin[i] > phases->hot;
        sums->mass[hot] += gas->mass[i];
        sums->volume[hot] += gas->mass[i] / (double)gas->rho[i];
    }
    for (int64_t i = 0; i < cloud->n; i++) {
        if (!(cloud->mass[i] > 0)) continue;
        if (is_inside(phases, cloud->pos[i])) {
            sums->clouds += cloud->mass[i];
            sums->filled += 4 * acos(-1) / 3 * pow(clouds_radius(sim, cloud->mass[i]), 3);
        }
        if (cloud->mass[i] <= phases->light) continue;
        sums->heavy++;
        sums->logs += log(cloud->mass[i] / phases->light);
    }
    mem_free(kelvin);
}

/* The slope a of dN/dm ~ m^a that makes the masses above the limit most likely: a = -1 - n/sum ln(m/limit). */
static void budget(struct sim *sim, void *state, struct energy_sink *sink)
{
    const struct phases *phases = state;
    const double one = comm_rank() == 0, sun = sim->units.mass / CONST_M_SUN;
    const double cylinder = 2 * acos(-1) * phases->radius * phases->radius * phases->height;
    struct sums s = {{0}, {0}, 0, 0, 0, 0};
    add_up(sim, phases, &s);
    double volume = s.volume[0] + s.volume[1];
    sink->add(sink, "warm_gas [Msun]", one * s.mass[0] * sun);
    sink->add(sink, "hot_gas [Msun]", one * s.mass[1] * sun);
    sink->add(sink, "clouds_inside [Msun]", one * s.clouds * sun);
    sink->add(sink, "hot_filling [1]", volume > 0 ? one * s.volume[1] / volume : 0);
    sink->add(sink, "cloud_filling [1]", one * s.filled / cylinder);
    sink->add(sink, "cloud_slope [1]", s.logs > 0 ? one * (-1 - s.heavy / s.logs) : 0);
}

enum { BINS = 40 };
static const double lowest = 2, width = 0.2;       /* decades of Msun */

static void record(struct sim *sim, void *state)
{
    const struct species *cloud = &sim->species[CLOUD];
    double number[BINS] = {0}, mass[BINS] = {0};
    (void)state;
    if (comm_rank() != 0 || !output_wrote_snapshot(sim)) return;
    for (int64_t i = 0; i < cloud->n; i++) {
        const double suns = cloud->mass[i] * sim->units.mass / CONST_M_SUN, at = (log10(suns) - lowest) / width;
        if (!(suns > 0) || at < 0 || at >= BINS) continue;
        number[(int)at]++;
        mass[(int)at] += suns;
    }
    char *path = output_companion(sim, "phases", "csv");
    struct text_file whole = text_file_open(path);
    FILE *file = whole.stream;
    if (!file) fail(STATUS_ENVIRONMENT, "%s: cannot be written: %s", path, strerror(errno));
    fprintf(file, "from [Msun],to [Msun],clouds,mass [Msun]\n");
    for (int b = 0; b < BINS; b++)
        fprintf(file, "%.6g,%.6g,%.0f,%.9g\n", pow(10, lowest + b * width), pow(10, lowest + (b + 1) * width), number[b], mass[b]);
    if (!text_file_close(&whole)) fail(STATUS_ENVIRONMENT, "%s: cannot be written: %s", path, strerror(errno));
    mem_free(path);
}

const struct module phases_module = {
    .name = "phases", .whole = true, .doc = "masses and volumes of hot gas, warm gas and clouds; the clouds' mass spectrum",
    .companion = "cloud_masses", .kind = MODULE_BLOCK, .params = params, .requires = requires,
    .state_bytes = sizeof(struct phases), .budget = budget, .hook = {[HOOK_RECORD] = record},
};
