/* SPDX-License-Identifier: GPL-3.0-or-later
 * Powers of a and h of start_cosmology.h: as the data sets tell (GADGET-4, AREPO: a_scaling, h_scaling; SWIFT: a-scale exponent),
 * else GADGET-2's convention: lengths in 1/h and comoving, masses in 1/h, velocities over sqrt(a) (Springel 2005, user guide). */
#include "start_cosmology.h"
#include "layout.h"
#include "log.h"
#include "start.h"
#include <math.h>
#include <string.h>

bool start_header_number(struct h5 *file, const char *name, double *value)
{
    static const char *const groups[] = {"Units", "Parameters", "Header", "Cosmology"};
    for (int g = 0; g < 4; g++)
        if (h5_read_attr(file, groups[g], name, value, 1)) return true;
    return false;
}

struct start_cosmology start_cosmology_read(struct sim *sim, struct h5 *file, const char *path)
{
    static const struct { const char *name; double allowed; } number[] = {
        {"OmegaLambda", 0}, {"HubbleParam", 1}, {"ComovingIntegrationOn", 0}, {"Cosmological run", 0}, {"Scale-factor", 1},
        {"Redshift", 0}};
    struct start_cosmology c = {.on = sim->start && sim->start->strip_h, .a = 1, .h = 1};
    double value;
    for (size_t i = 0; i < sizeof number / sizeof *number; i++) {
        if (!start_header_number(file, number[i].name, &value) || value == number[i].allowed) continue;
        if (strcmp(number[i].name, "HubbleParam") == 0 && value == 0) continue;    /* left empty */
        c.comoving |= strcmp(number[i].name, "HubbleParam") != 0;
        if (!c.on)
            problems_add(&sim->problems, "%s is cosmological (%s = %g): start.strip_h: on takes its rows in physical units "
                         "of its redshift", path, number[i].name, value);
    }
    c.swift = h5_exists(file, "Units") && h5_read_attr(file, "Units", "Unit length in cgs (U_L)", &value, 1);
    if (!c.on) return c;
    if (start_header_number(file, "HubbleParam", &value) && value > 0 && !c.swift) c.h = value;     /* 0: left empty */
    if (c.comoving && start_header_number(file, "Scale-factor", &value)) c.a = value;
    else if (c.comoving && start_header_number(file, "Redshift", &value)) c.a = 1 / (1 + value);
    if (!(isfinite(c.a) && c.a > 0 && isfinite(c.h)))
        problems_add(&sim->problems, "%s: its scale factor is %g, its h %g: must be above 0", path, c.a, c.h);
    log_line("%s: start.strip_h: scale factor %g, h %g: where a data set does not say otherwise, lengths are multiplied by %g, "
             "masses by %g, velocities by %g", path, c.a, c.h, start_cosmology_factor(&c, file, NULL, "L"),
             start_cosmology_factor(&c, file, NULL, "M"), start_cosmology_factor(&c, file, NULL, "V"));
    return c;
}

double start_cosmology_factor(const struct start_cosmology *c, struct h5 *file, const char *data_set, const char *unit)
{
    double a = 0, h = 0;
    int power[3];
    if (!c->on) return 1;
    if (data_set && h5_read_attr(file, data_set, "a_scaling", &a, 1) && h5_read_attr(file, data_set, "h_scaling", &h, 1))
        return pow(c->a, a) * pow(c->h, h);
    if (data_set && h5_read_attr(file, data_set, "a-scale exponent", &a, 1)) return pow(c->a, a);
    layout_powers(unit, power);
    const double velocity = strcmp(unit, "V") == 0 && !c->swift ? sqrt(c->a) : 1;   /* SWIFT's are peculiar, and so is u of all */
    return pow(c->a / c->h, power[0]) * pow(c->h, -power[1]) * velocity;
}
