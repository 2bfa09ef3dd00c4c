/* SPDX-License-Identifier: GPL-3.0-or-later
 * The module `external`: fixed potentials that act on all rows and feel nothing. Those whose mass or velocity a
 * scene gives are added up. Formulas: Binney & Tremaine (2008), sections 2.2 and 2.3. */
#include "contact.h"
#include "module.h"
#include <math.h>

/* Rows below which a loop is not worth waking threads for. */
enum { FEW = 128 };

struct external {
    double point_mass, plummer_mass, plummer_radius, hernquist_mass, hernquist_radius;
    double nfw_mass, nfw_radius, nfw_within, log_velocity, log_radius, log_flattening;
    double disc_mass, disc_length, disc_height, centre[3], time_step;
    double nfw_strength;    /* nfw_mass over ln(1 + c) - c/(1 + c) */
};

#define VALUE(name, unit, fallback, low, field, text) \
    {name, PARAM_REAL, unit, fallback, low, 1e300, NULL, text, false, offsetof(struct external, field)},

static const struct param params[] = {
    VALUE("point_mass", "mass", "0", 0, point_mass, "a point: -G M/r")
    VALUE("plummer_mass", "mass", "0", 0, plummer_mass, "Plummer's sphere: -G M/sqrt(r^2 + a^2)")
    VALUE("plummer_radius", "length", "none", 1e-300, plummer_radius, "its radius a")
    VALUE("hernquist_mass", "mass", "0", 0, hernquist_mass, "Hernquist's sphere: -G M/(r + a)")
    VALUE("hernquist_radius", "length", "none", 1e-300, hernquist_radius, "its radius a")
    VALUE("nfw_mass", "mass", "0", 0, nfw_mass, "the sphere of Navarro, Frenk & White: its mass within nfw_within")
    VALUE("nfw_radius", "length", "none", 1e-300, nfw_radius, "its scale radius")
    VALUE("nfw_within", "length", "none", 1e-300, nfw_within, "radius that holds nfw_mass; the density goes on beyond")
    VALUE("logarithmic_velocity", "velocity", "0", 0, log_velocity, "logarithmic: v^2/2 ln(c^2 + R^2 + z^2/q^2)")
    VALUE("logarithmic_radius", "length", "0", 0, log_radius, "its core c")
    VALUE("logarithmic_flattening", "", "1", 0.1, log_flattening, "its q; below 0.7 the density is negative on the axis")
    VALUE("disc_mass", "mass", "0", 0, disc_mass, "Miyamoto & Nagai's disc: -G M/sqrt(R^2 + (a + sqrt(z^2 + b^2))^2)")
    VALUE("disc_length", "length", "none", 0, disc_length, "its a")
    VALUE("disc_height", "length", "none", 1e-300, disc_height, "its b")
    VALUE("x", "length", "0", -1e300, centre[0], "centre of all of them")
    VALUE("y", "length", "0", -1e300, centre[1], "")
    VALUE("z", "length", "0", -1e300, centre[2], "")
    {"time_step", PARAM_REAL, "", "0.03", 1e-6, 1, NULL,
     "eta of the longest step eta sqrt(r/|a|), a being this field's, r at least the softening or h but with a point: 2 pi/eta "
     "steps a circular orbit", true,
     offsetof(struct external, time_step)},
    {0}
};

/* Acceleration and potential in parts. */
struct field { double acc[3], pot; };

/* A spherical part with mass `within` r and the potential pot. */
static void add_sphere(struct field *field, const double x[3], double r, double within, double pot)
{
    double pull = r > 0 ? within / (r * r * r) : 0;
    for (int k = 0; k < 3; k++) field->acc[k] -= pull * x[k];
    field->pot += pot;
}

static void add_spheres(struct field *field, const struct external *e, const double x[3], double r)
{
    if (e->point_mass > 0) add_sphere(field, x, r, e->point_mass, -e->point_mass / r);
    if (e->plummer_mass > 0) {
        double s = sqrt(r * r + e->plummer_radius * e->plummer_radius), part = r / s;
        add_sphere(field, x, r, e->plummer_mass * part * part * part, -e->plummer_mass / s);
    }
    if (e->hernquist_mass > 0) {
        double s = r + e->hernquist_radius;
        add_sphere(field, x, r, e->hernquist_mass * (r / s) * (r / s), -e->hernquist_mass / s);
    }
    if (e->nfw_mass > 0) {
        double y = r / e->nfw_radius, log_y = log1p(y);
        double deep = y > 0 ? log_y / y : 1;
        add_sphere(field, x, r, e->nfw_strength * (log_y - y / (1 + y)), -e->nfw_strength / e->nfw_radius * deep);
    }
}

static void add_disc(struct field *field, const struct external *e, const double x[3])
{
    double flat = sqrt(x[2] * x[2] + e->disc_height * e->disc_height), s = e->disc_length + flat;
    double d = sqrt(x[0] * x[0] + x[1] * x[1] + s * s), pull = e->disc_mass / (d * d * d);
    for (int k = 0; k < 2; k++) field->acc[k] -= pull * x[k];
    field->acc[2] -= pull * x[2] * s / flat;
    field->pot -= e->disc_mass / d;
}

static void add_logarithmic(struct field *field, const struct external *e, const double x[3])
{
    double q2 = e->log_flattening * e->log_flattening, v2 = e->log_velocity * e->log_velocity;
    double s = e->log_radius * e->log_radius + x[0] * x[0] + x[1] * x[1] + x[2] * x[2] / q2;
    for (int k = 0; k < 3; k++) field->acc[k] -= v2 * x[k] / s / (k == 2 ? q2 : 1);
    field->pot += 0.5 * v2 * log(s);
}

/* At a place relative to the centre. Masses act with G; the logarithmic potential has its strength in v. */
static struct field field_at(const struct external *e, double G, const double x[3])
{
    struct field field = {{0}, 0};
    add_spheres(&field, e, x, sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]));
    if (e->disc_mass > 0) add_disc(&field, e, x);
    for (int k = 0; k < 3; k++) field.acc[k] *= G;
    field.pot *= G;
    if (e->log_velocity > 0) add_logarithmic(&field, e, x);
    return field;
}

static struct field field_of(const struct sim *sim, const struct external *e, const double pos[3])
{
    const double x[3] = {pos[0] - e->centre[0], pos[1] - e->centre[1], pos[2] - e->centre[2]};
    return field_at(e, sim->units.G, x);
}

static void need(struct sim *sim, double strength, double value, const char *name)
{
    if (strength > 0 && isnan(value)) problems_add(&sim->problems, "external.%s: must be given with its mass", name);
}

static void declare(struct sim *sim, void *state)
{
    struct external *e = state;
    need(sim, e->plummer_mass, e->plummer_radius, "plummer_radius");
    need(sim, e->hernquist_mass, e->hernquist_radius, "hernquist_radius");
    need(sim, e->nfw_mass, e->nfw_radius, "nfw_radius");
    need(sim, e->nfw_mass, e->nfw_within, "nfw_within");
    need(sim, e->disc_mass, e->disc_length, "disc_length");
    need(sim, e->disc_mass, e->disc_height, "disc_height");
    if (!(e->point_mass + e->plummer_mass + e->hernquist_mass + e->nfw_mass + e->disc_mass + e->log_velocity > 0))
        problems_add(&sim->problems, "external: give the mass of a potential, or logarithmic_velocity");
    double c = e->nfw_within / e->nfw_radius;
    e->nfw_strength = e->nfw_mass / (log1p(c) - c / (1 + c));
}

static void force(struct sim *sim, void *state)
{
    const struct external *e = state;
    for_species(sim, s) {
#pragma omp parallel for if (s->n_active > FEW)
        for (int64_t a = 0; a < s->n_active; a++) {
            int64_t i = s->active[a];
            struct field field = field_of(sim, e, s->pos[i]);
            for (int k = 0; k < 3; k++) s->acc[i][k] += (float)field.acc[k];
        }
    }
}

/* Plummer's softening of a species. In the middle of a cusp, where |a| has a limit but no direction, steps would vanish with r:
 * within the softening, or within h of gas that has come to rest there, they do not follow it. A point's |a| has no limit. */
static double softening_of(const struct sim *sim, enum species_kind kind)
{
    const double contact = gravity_contact(sim, kind, kind);
    return contact < 0 ? -sim->units.G / contact : 0;
}

static void limit(struct sim *sim, void *state)
{
    const struct external *e = state;
    for_species(sim, s) {
        const double softening = softening_of(sim, s->kind);
#pragma omp parallel for if (s->n_active > FEW)
        for (int64_t a = 0; a < s->n_active; a++) {
            int64_t i = s->active[a];
            struct field field = field_of(sim, e, s->pos[i]);
            double r2 = 0, a2 = 0;
            for (int k = 0; k < 3; k++) {
                r2 += (s->pos[i][k] - e->centre[k]) * (s->pos[i][k] - e->centre[k]);
                a2 += field.acc[k] * field.acc[k];
            }
            const double least = e->point_mass > 0 ? 0 : s->kind == GAS && s->h ? (double)s->h[i] : softening;
            r2 = fmax(r2, least * least);
            if (a2 > 0 && r2 > 0) s->dt[i] = fminf(s->dt[i], (float)(e->time_step * sqrt(sqrt(r2 / a2))));
        }
    }
}

static void energy(struct sim *sim, void *state, struct energy_sink *sink)
{
    double sum = 0;
    for_species(sim, s)
        for (int64_t i = s->own; i < s->own + s->n_own; i++) sum += s->mass[i] * field_of(sim, state, s->pos[i]).pot;
    sink->add(sink, "external", sum);
}

const struct module external_module = {
    .name = "external", .open_space = true, .doc = "fixed potentials: point, Plummer, Hernquist, NFW, logarithmic, disc",
    .params = params, .state_bytes = sizeof(struct external), .declare = declare,
    .hook = {[HOOK_FORCE] = force, [HOOK_LIMIT] = limit}, .energy = energy,
};
