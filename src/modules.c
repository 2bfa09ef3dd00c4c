/* SPDX-License-Identifier: GPL-3.0-or-later
 * The one list: what the program consists of. Nothing else in src/ names a physics. The order of the
 * modules is their order within a hook. */
#include "draw/chart.h"
#include "module.h"

#define MODULES(X) \
    X(output) X(time) X(box) X(tree) X(leapfrog) X(pec) X(hermite4) X(hermite6) X(hermite8) \
    X(black_holes) X(gravity) X(external) X(sph) X(exchange) X(clouds) X(star_formation) X(cloud_stars) X(sinks) X(feedback) X(cooling) \
    X(jeans) X(clumps) X(phases) X(phase_diagram) X(profiles) X(ranks) X(steps)

#define GENERATORS(X) \
    X(cloud_box) X(clouds) X(clumped) X(collapse) X(combine) X(dwarf) X(evrard) X(exchange_box) X(galaxy) X(kepler) X(medium) X(merger) X(noh) \
    X(plummer) X(sedov) X(spheres) X(ssp) X(tube) X(uniform) X(wave)

#define COMMANDS(X) \
    X(run) X(check) X(ics) X(force_test) X(info) X(compare) X(convert) X(params) X(chart)

#define CHARTS(X) X(blocks) X(cooling) X(gravity) X(group) X(hermite) X(ranks) X(sph) X(stars) X(step) X(supernova) X(time)

#define DECLARE(name) extern const struct module name##_module;
MODULES(DECLARE)
#undef DECLARE
#define DECLARE(name) extern const struct generator name##_generator;
GENERATORS(DECLARE)
#undef DECLARE
#define DECLARE(name) extern const struct command name##_command;
COMMANDS(DECLARE)
#undef DECLARE
#define DECLARE(name) extern const struct chart name##_chart;
CHARTS(DECLARE)
#undef DECLARE

#define ENTRY(name) &name##_module,
const struct module *const module_list[] = {MODULES(ENTRY) NULL};
#undef ENTRY
#define ENTRY(name) &name##_generator,
const struct generator *const generator_list[] = {GENERATORS(ENTRY) NULL};
#undef ENTRY
#define ENTRY(name) &name##_command,
const struct command *const command_list[] = {COMMANDS(ENTRY) NULL};
#undef ENTRY
#define ENTRY(name) &name##_chart,
const struct chart *const chart_list[] = {CHARTS(ENTRY) NULL};
#undef ENTRY
