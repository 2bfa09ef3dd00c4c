/* SPDX-License-Identifier: GPL-3.0-or-later
 * The module `profiles`: how matter lies and moves about its densest place, while the run goes on. lagrange.csv has the radii
 * that hold given parts of each species, rings.csv surface density, rotation and height of each in rings about an axis,
 * separation.csv how far the two objects of an encounter are apart (doc/manual/analysis.md). */
#include "comm.h"
#include "file/layout.h"
#include "file/series.h"
#include "log.h"
#include "mem.h"
#include "module.h"
#include "output.h"
#include "ranks.h"
#include <math.h>
#include <string.h>

struct profiles {
    struct param_list parts;
    int centre, axis;
    double outer, within;
    int64_t rings, split;
    int64_t species;        /* bit (1 << kind): has columns; saved */
};
enum { CENTRE_DENSE, CENTRE_ORIGIN };
enum { AXIS_Z, AXIS_SPIN };
enum { MOST_RINGS = 1000 };

static const struct param params[] = {
    {"parts", PARAM_LIST, "", "10, 30, 50, 70, 90", 1e-6, 100, NULL, "per cent of each species' mass whose radii are written",
     false, offsetof(struct profiles, parts)},
    {"centre", PARAM_CHOICE, "", "dense", 0, 0, "dense|origin", "of radii and rings: the densest place, or the origin", true,
     offsetof(struct profiles, centre)},
    {"outer", PARAM_REAL, "length", "none", 1e-300, 1e300, NULL, "outer radius of the rings; default: there are none", true,
     offsetof(struct profiles, outer)},
    {"rings", PARAM_COUNT, "", "20", 1, MOST_RINGS, NULL, "how many, evenly wide", true, offsetof(struct profiles, rings)},
    {"axis", PARAM_CHOICE, "", "z", 0, 0, "z|spin", "of the rings: z, or the angular momentum of what is not dark within outer", true,
     offsetof(struct profiles, axis)},
    {"within", PARAM_REAL, "length", "none", 1e-300, 1e300, NULL,
     "rows farther from the plane of the rings do not count; default: all do", true, offsetof(struct profiles, within)},
    {"split", PARAM_COUNT, "", "none", 1, 281474976710655, NULL,
     "rows up to this id, and what is born of them, are one object, the others a second (merger gives it)", false,
     offsetof(struct profiles, split)},
    {0}
};

static const struct saved saved[] = {{"species", offsetof(struct profiles, species), sizeof(int64_t)}, {0}};

/* A place and its motion: by centre_of. */
struct centre { double pos[3], vel[3]; };

/* Rows of one object of an encounter: 0 up to the id `split`, 1 beyond it; -1: all rows. Births leave the lower bits alone
 * (species_child); only heirs of heirs do not (species_heir). */
static bool is_of(uint64_t id, int64_t split, int object)
{
    return object < 0 || ((id & ((UINT64_C(1) << 48) - 1)) > (uint64_t)split) == (object == 1);
}

static void check_split(struct sim *sim, int64_t split)
{
    double rows[2] = {0};
    for_species(sim, s)
        for (int64_t i = species_from(s); i < species_to(s); i++) rows[is_of(s->id[i], split, 1)]++;
    ranks_sum(sim, rows, 2);
    for (int o = 0; o < 2; o++)
        if (rows[o] == 0)
            problems_add(&sim->problems, "%s: %lld leaves the %s object without rows", scene_place(sim->scene, "profiles", "split"),
                         (long long)split, o ? "second" : "first");
    if (sim_state(sim, "cloud_stars"))
        log_warning("profiles.split: ids of fragments and stars of the third generation on do not tell whose they are; "
                    "separation.csv counts them with the second object");
}

static void begin(struct sim *sim, void *state)
{
    struct profiles *profiles = state;
    if (profiles->species != 0) return;     /* from a checkpoint: the files have their columns */
    for (int s = 0; s < N_SPECIES; s++)
        if (sim->species[s].n > 0 || sim->species[s].grows) profiles->species |= (int64_t)1 << s;
    if (profiles->split > 0) check_split(sim, profiles->split);
}

/* Sums over the rows within a reach of a place: mass, mass times offset and velocity, rows; greatest distance of one. */
struct within { double mass, offset[3], flow[3], rows, far; };

static struct within sum_within(const struct sim *sim, int64_t split, int object, const double pos[3], double reach)
{
    struct within sum = {0};
    for (int s = 0; s < N_SPECIES; s++) {
        const struct species *t = &sim->species[s];
        for (int64_t i = t->own; i < t->own + t->n_own; i++) {
            if (species_gone(t, i) || !is_of(t->id[i], split, object)) continue;
            const double d[3] = {t->pos[i][0] - pos[0], t->pos[i][1] - pos[1], t->pos[i][2] - pos[2]};
            const double r2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
            if (r2 > reach * reach) continue;
            sum.mass += t->mass[i];
            for (int k = 0; k < 3; k++) {
                sum.offset[k] += t->mass[i] * d[k];
                sum.flow[k] += t->mass[i] * t->vel[i][k];
            }
            sum.rows++;
            sum.far = fmax(sum.far, sqrt(r2));
        }
    }
    comm_sum((double *)&sum, 8);
    comm_max(&sum.far, 1);
    return sum;
}

/* The densest place, by a sphere that shrinks about the centre of mass of what it holds (Power et al. 2003, MNRAS 338, 14), until
 * a hundredth of the rows or 1000 are left. Its velocity is theirs. */
static struct centre centre_of(const struct sim *sim, const struct profiles *profiles, int object)
{
    enum { ROUNDS = 400 };      /* from 1e12 radii */
    const double shrink = 0.9, least = 50;
    struct centre c = {{0}, {0}};
    double reach = INFINITY, enough = least;
    for (int round = 0; round < ROUNDS; round++) {
        const struct within sum = sum_within(sim, profiles->split, object, c.pos, reach);
        if (round == 0) enough = fmax(least, fmin(1000, 0.01 * sum.rows));
        if (!(sum.mass > 0) || (round > 0 && sum.rows < enough)) break;
        for (int k = 0; k < 3; k++) {
            c.pos[k] += sum.offset[k] / sum.mass;
            c.vel[k] = sum.flow[k] / sum.mass;
        }
        reach = shrink * fmin(reach, sum.far);
    }
    return c;
}

static double length(const double x[3]) { return sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]); }

static double distance(const struct species *t, int64_t i, const struct centre *c)
{
    return length((double[3]){t->pos[i][0] - c->pos[0], t->pos[i][1] - c->pos[1], t->pos[i][2] - c->pos[2]});
}

enum { BINS = 1024 };

/* mass[b] in the b-th of BINS even intervals of ln r from `low` to `high`, beside what lies below. */
static double bin_masses(const struct species *t, const struct centre *c, double low, double high, double mass[BINS])
{
    double below = 0;
    memset(mass, 0, BINS * sizeof *mass);
    for (int64_t i = t->own; i < t->own + t->n_own; i++) {
        if (species_gone(t, i)) continue;
        const double at = (log(fmax(distance(t, i, c), 1e-300)) - low) / (high - low) * BINS;
        if (at < 0) below += t->mass[i];
        else if (at < BINS) mass[(int)at] += t->mass[i];
    }
    comm_sum(mass, BINS);
    comm_sum(&below, 1);
    return below;
}

/* Radii that hold the parts: bins in ln r, then again in the bin where the part ends; 1e-5 of the radius. */
static void lagrange(const struct profiles *profiles, const struct species *t, const struct centre *c, double *radius)
{
    double limit[2] = {-INFINITY, -INFINITY}, total = 0, bins[BINS];    /* minus the least ln r, the greatest */
    for (int64_t i = t->own; i < t->own + t->n_own; i++) {
        if (species_gone(t, i)) continue;
        const double at = log(fmax(distance(t, i, c), 1e-300));
        limit[0] = fmax(limit[0], -at);
        limit[1] = fmax(limit[1], at);
        total += t->mass[i];
    }
    comm_max(limit, 2);
    comm_sum(&total, 1);
    for (int p = 0; p < profiles->parts.n; p++) {
        const double wanted = (1 - 1e-12) * profiles->parts.value[p] / 100 * total;
        double low = fmax(-limit[0], limit[1] - 60), high = limit[1] + 1e-9;   /* a row on the centre has no ln r */
        radius[p] = NAN;
        for (int level = 0; level < 2 && total > 0; level++) {
            double within = bin_masses(t, c, low, high, bins), wide = (high - low) / BINS;
            int b = 0;
            while (b < BINS - 1 && within + bins[b] < wanted) within += bins[b++];
            const double part = bins[b] > 0 ? fmin(1, fmax(0, (wanted - within) / bins[b])) : 0;
            radius[p] = exp(low + (b + part) * wide);
            low += b * wide;
            high = low + wide;
        }
    }
}

static void lagrange_header(FILE *file, const void *context)
{
    const struct sim *sim = context;
    const struct profiles *profiles = sim_state(sim, "profiles");
    char unit[64];
    layout_unit_text(sim->units.physical, "L", unit, sizeof unit);
    for (int k = 0; k < 3; k++) fprintf(file, ",centre_%c [%s]", 'x' + k, unit);
    for (int s = 0; s < N_SPECIES; s++)
        for (int p = 0; p < profiles->parts.n && profiles->species >> s & 1; p++)
            fprintf(file, ",%s_%g [%s]", species_names[s], profiles->parts.value[p], unit);
}

static void write_number(FILE *file, double value)
{
    fprintf(file, isfinite(value) ? ",%.8g" : ",nan", value);
}

static void record_lagrange(const struct sim *sim, const struct profiles *profiles, const struct centre *c)
{
    const double l = layout_factor(&sim->units, "L");
    double radius[N_SPECIES][PARAM_LIST_MAX];
    for (int s = 0; s < N_SPECIES; s++)
        if (profiles->species >> s & 1) lagrange(profiles, &sim->species[s], c, radius[s]);
    if (comm_rank() != 0) return;
    FILE *file = series_open(sim, "lagrange.csv", lagrange_header, sim);
    series_time(sim, file);
    for (int k = 0; k < 3; k++) write_number(file, l * c->pos[k]);
    for (int s = 0; s < N_SPECIES; s++)
        for (int p = 0; p < profiles->parts.n && profiles->species >> s & 1; p++) write_number(file, l * radius[s][p]);
    fprintf(file, "\n");
    series_close(sim, "lagrange.csv", file);
}

static void separation_header(FILE *file, const void *context)
{
    const struct sim *sim = context;
    char l[64], v[64];
    layout_unit_text(sim->units.physical, "L", l, sizeof l);
    layout_unit_text(sim->units.physical, "V", v, sizeof v);
    fprintf(file, ",separation [%s],speed [%s]", l, v);
    for (int k = 0; k < 6; k++) fprintf(file, ",%c_%d [%s]", 'x' + k % 3, 1 + k / 3, l);
}

/* Of the densest places of the two objects, with the relative speed of what is there. */
static void record_separation(const struct sim *sim, const struct profiles *profiles)
{
    const struct centre c[2] = {centre_of(sim, profiles, 0), centre_of(sim, profiles, 1)};
    const double l = layout_factor(&sim->units, "L"), v = layout_factor(&sim->units, "V");
    double d[3], w[3];
    for (int k = 0; k < 3; k++) {
        d[k] = c[1].pos[k] - c[0].pos[k];
        w[k] = c[1].vel[k] - c[0].vel[k];
    }
    if (comm_rank() != 0) return;
    FILE *file = series_open(sim, "separation.csv", separation_header, sim);
    series_time(sim, file);
    write_number(file, l * length(d));
    write_number(file, v * length(w));
    for (int k = 0; k < 6; k++) write_number(file, l * c[k / 3].pos[k % 3]);
    fprintf(file, "\n");
    series_close(sim, "separation.csv", file);
}

/* The rings' axes: the last is their normal. */
static void find_axes(const struct sim *sim, const struct profiles *profiles, const struct centre *c, double axis[3][3])
{
    double spin[3] = {0, 0, 0};
    for (int s = 0; s < N_SPECIES && profiles->axis == AXIS_SPIN; s++) {
        const struct species *t = &sim->species[s];
        for (int64_t i = t->own; i < t->own + t->n_own && s != DARK; i++) {
            if (species_gone(t, i) || distance(t, i, c) > profiles->outer) continue;
            for (int k = 0; k < 3; k++) {
                const int a = (k + 1) % 3, b = (k + 2) % 3;
                spin[k] += t->mass[i] * ((t->pos[i][a] - c->pos[a]) * (t->vel[i][b] - c->vel[b])
                                         - (t->pos[i][b] - c->pos[b]) * (t->vel[i][a] - c->vel[a]));
            }
        }
    }
    comm_sum(spin, 3);
    const double size = length(spin);
    for (int k = 0; k < 3; k++) axis[2][k] = size > 0 ? spin[k] / size : k == 2;
    const int least = fabs(axis[2][0]) < 0.7 ? 0 : 1;       /* a direction that is not along the normal */
    double along = axis[2][least], norm = sqrt(1 - along * along);
    for (int k = 0; k < 3; k++) axis[0][k] = ((k == least) - along * axis[2][k]) / norm;
    for (int k = 0; k < 3; k++) {
        const int a = (k + 1) % 3, b = (k + 2) % 3;
        axis[1][k] = axis[2][a] * axis[0][b] - axis[2][b] * axis[0][a];
    }
}

/* Sums over the rows of a ring: mass; mass times v_phi, v_R, v_R^2, |z|, -R a_R; rows. */
enum { SUM_MASS, SUM_TURN, SUM_OUT, SUM_OUT2, SUM_HEIGHT, SUM_PULL, SUM_ROWS, SUMS };
enum { RING_COLUMNS = 6 };

static void sum_rings(const struct profiles *profiles, const struct species *t, const struct centre *c, double axis[3][3],
                      double (*sum)[SUMS])
{
    for (int64_t i = t->own; i < t->own + t->n_own; i++) {
        if (species_gone(t, i)) continue;
        double x[3] = {0}, v[3] = {0}, a[3] = {0};
        for (int k = 0; k < 3; k++)
            for (int j = 0; j < 3; j++) {
                x[k] += axis[k][j] * (t->pos[i][j] - c->pos[j]);
                v[k] += axis[k][j] * (t->vel[i][j] - c->vel[j]);
                a[k] += axis[k][j] * (double)t->acc[i][j];
            }
        const double R = hypot(x[0], x[1]), at = R / profiles->outer * (double)profiles->rings;
        if (!(at < (double)profiles->rings) || R == 0 || fabs(x[2]) > profiles->within) continue;   /* NAN: no limit */
        const double turn = (x[0] * v[1] - x[1] * v[0]) / R, out = (x[0] * v[0] + x[1] * v[1]) / R, m = t->mass[i];
        double *s = sum[(int64_t)at];
        s[SUM_MASS] += m;
        s[SUM_TURN] += m * turn;
        s[SUM_OUT] += m * out;
        s[SUM_OUT2] += m * out * out;
        s[SUM_HEIGHT] += m * fabs(x[2]);
        s[SUM_PULL] -= m * (x[0] * a[0] + x[1] * a[1]);
        s[SUM_ROWS]++;
    }
}

static void rings_header(FILE *file, const void *context)
{
    static const char *const name[RING_COLUMNS] = {"rows", "surface_density", "rotation", "dispersion", "height", "circular"};
    static const char *const unit[RING_COLUMNS] = {"", "M L^-2", "V", "V", "L", "V"};
    const struct sim *sim = context;
    const struct profiles *profiles = sim_state(sim, "profiles");
    char text[64];
    layout_unit_text(sim->units.physical, "L", text, sizeof text);
    fprintf(file, ",from [%s],to [%s]", text, text);
    for (int s = 0; s < N_SPECIES; s++)
        for (int k = 0; k < RING_COLUMNS && profiles->species >> s & 1; k++) {
            layout_unit_text(sim->units.physical, unit[k], text, sizeof text);
            fprintf(file, *text ? ",%s_%s [%s]" : ",%s_%s", species_names[s], name[k], text);
        }
}

/* 0 where rounding, or a pull that points outwards, leaves less; what is no number stays none. */
static double root(double square) { return square < 0 ? 0 : sqrt(square); }

static void write_ring(const struct sim *sim, FILE *file, const double s[SUMS], double area)
{
    const struct units *units = &sim->units;
    const double l = layout_factor(units, "L"), v = layout_factor(units, "V"), m = s[SUM_MASS], out = s[SUM_OUT] / m;
    fprintf(file, ",%.0f", s[SUM_ROWS]);
    write_number(file, layout_factor(units, "M L^-2") * m / area);
    write_number(file, v * s[SUM_TURN] / m);
    write_number(file, v * root(s[SUM_OUT2] / m - out * out));
    write_number(file, l * s[SUM_HEIGHT] / m / log(2));     /* sech^2(z/z0) has the mean |z| = z0 ln 2 */
    write_number(file, v * root(s[SUM_PULL] / m));
}

static void record_rings(const struct sim *sim, const struct profiles *profiles, const struct centre *c)
{
    const double l = layout_factor(&sim->units, "L"), wide = profiles->outer / (double)profiles->rings, pi = 3.14159265358979323846;
    double axis[3][3], (*sum)[SUMS] = mem_alloc("profiles", sizeof *sum * (size_t)profiles->rings * N_SPECIES);
    find_axes(sim, profiles, c, axis);
    for (int s = 0; s < N_SPECIES; s++) sum_rings(profiles, &sim->species[s], c, axis, sum + s * profiles->rings);
    comm_sum(*sum, (int)profiles->rings * N_SPECIES * SUMS);
    if (comm_rank() == 0) {
        FILE *file = series_open(sim, "rings.csv", rings_header, sim);
        for (int64_t k = 0; k < profiles->rings; k++) {
            const double from = wide * (double)k, to = wide * (double)(k + 1);
            series_time(sim, file);
            write_number(file, l * from);
            write_number(file, l * to);
            for (int s = 0; s < N_SPECIES; s++)
                if (profiles->species >> s & 1)
                    write_ring(sim, file, sum[s * profiles->rings + k], pi * (to * to - from * from));
            fprintf(file, "\n");
        }
        series_close(sim, "rings.csv", file);
    }
    mem_free(sum);
}

/* Radii and separation with every row of energy.csv, rings with every snapshot. */
static void record(struct sim *sim, void *state)
{
    const struct profiles *profiles = state;
    const struct output *output = sim_state(sim, "output");
    if (!sim->synchronous || output->recorded != sim->time.tick || !sim->folder) return;
    const struct centre origin = {{0}, {0}};
    const struct centre c = profiles->centre == CENTRE_ORIGIN ? origin : centre_of(sim, profiles, -1);
    record_lagrange(sim, profiles, &c);
    if (profiles->split > 0) record_separation(sim, profiles);
    if (output_wrote_snapshot(sim) && !isnan(profiles->outer)) record_rings(sim, profiles, &c);
}

const struct module profiles_module = {
    .name = "profiles", .open_space = true, .doc = "Lagrangian radii, surface density, rotation, distance of two objects, as CSV",
    .params = params, .state_bytes = sizeof(struct profiles), .saved = saved, .begin = begin, .hook = {[HOOK_RECORD] = record},
};
