/* SPDX-License-Identifier: GPL-3.0-or-later
 * Every column of every table, once. Allocation, permutation, exchange between ranks, files and
 * the manual follow from these two lists.
 *
 * COLUMN(name, element type, dimensions, lifetime, unit, file name, text)
 *   lifetime  KEEP: travels between ranks and is saved in checkpoints; STEP: scratch of one step
 *   unit      dimensions as powers of length, mass, velocity: "L^1", "M^1 L^-3", "V^2", "1"
 *   file name data set in snapshots; "" = not written there
 * A column is a typed pointer of struct species, NULL unless a module of the scene asked for it. */
#ifndef TEPHRA_COLUMNS_H
#define TEPHRA_COLUMNS_H
#include <stdint.h>

#define SPECIES_COLUMNS(COLUMN) \
    COLUMN(pos,      double,   [3], KEEP, "L",        "Coordinates",     "position at the row's own time") \
    COLUMN(vel,      double,   [3], KEEP, "V",        "Velocities",      "velocity at the row's own time") \
    COLUMN(mass,     double,      , KEEP, "M",        "Masses",          "mass") \
    COLUMN(id,       uint64_t,    , KEEP, "1",        "ParticleIDs",     "identity, unique over all species") \
    COLUMN(acc,      float,    [3], KEEP, "V^2 L^-1", "Acceleration",    "acceleration at the row's own time, all forces") \
    COLUMN(rung,     uint8_t,     , KEEP, "1",        "",                "step of 2^rung ticks: the row is active when it divides the tick") \
    COLUMN(rung0,    uint8_t,     , KEEP, "1",        "",                "rung with which the present step began (see timeline.h)") \
    COLUMN(u,        float,       , KEEP, "V^2",      "InternalEnergy",  "specific internal energy") \
    COLUMN(du,       float,       , KEEP, "V^3 L^-1", "",                "rate of change of u by hydrodynamics, or what stands for it without u") \
    COLUMN(h,        float,       , KEEP, "L",        "SmoothingLength", "smoothing length; the kernel ends at 2h (files hold 2h)") \
    COLUMN(rho,      float,       , KEEP, "M L^-3",   "Density",         "density") \
    COLUMN(balsara,  float,       , KEEP, "1",        "",                "factor of the artificial viscosity, 0 in pure shear") \
    COLUMN(omega,    float,       , KEEP, "1",        "",                "1 + (h/3 rho) d rho/dh, of the terms of grad h") \
    COLUMN(strength, float,       , KEEP, "1",        "",                "of the artificial viscosity, over sph.alpha") \
    COLUMN(grav,     float,       , KEEP, "V^2 L^-1", "",                "size of the gravitational acceleration when last computed") \
    COLUMN(metals,   double,      , KEEP, "M",        "Metallicity",     "mass fraction of metals (the column itself: their mass)") \
    COLUMN(mass_o,   double,      , KEEP, "M",        "OxygenFraction",  "mass fraction of oxygen (the column itself: its mass)") \
    COLUMN(mass_fe,  double,      , KEEP, "M",        "IronFraction",    "mass fraction of iron (the column itself: its mass)") \
    COLUMN(mass_c,   double,      , KEEP, "M",        "CarbonFraction",  "mass fraction of carbon (the column itself: its mass)") \
    COLUMN(mass_n,   double,      , KEEP, "M",        "NitrogenFraction", "mass fraction of nitrogen (the column itself: its mass)") \
    COLUMN(mass_ne,  double,      , KEEP, "M",        "NeonFraction",    "mass fraction of neon (the column itself: its mass)") \
    COLUMN(mass_mg,  double,      , KEEP, "M",        "MagnesiumFraction", "mass fraction of magnesium (the column itself: its mass)") \
    COLUMN(mass_si,  double,      , KEEP, "M",        "SiliconFraction", "mass fraction of silicon (the column itself: its mass)") \
    COLUMN(mass_s,   double,      , KEEP, "M",        "SulfurFraction",  "mass fraction of sulfur (the column itself: its mass)") \
    COLUMN(mass_ca,  double,      , KEEP, "M",        "CalciumFraction", "mass fraction of calcium (the column itself: its mass)") \
    COLUMN(birth,    double,      , KEEP, "L V^-1",   "StellarFormationTime", "time at which the stars formed") \
    COLUMN(mass_born,double,      , KEEP, "M",        "InitialMass",     "mass of the stars when they formed") \
    COLUMN(age_paid, double,      , KEEP, "L V^-1",   "",                "age up to which the stars have returned what was due") \
    COLUMN(hole,     uint8_t,     , KEEP, "1",        "BlackHole",       "1: a black hole, 0: stars") \
    COLUMN(sink,     uint8_t,     , KEEP, "1",        "Sink",            "1: a sink that swallows gas, 0: stars") \
    COLUMN(spin,     double,   [3], KEEP, "M L V",    "Spin",            "angular momentum that a sink has taken in, about its centre") \
    COLUMN(children, uint8_t,     , KEEP, "1",        "Children",        "rows that this one has given birth to") \
    COLUMN(collapse, float,       , KEEP, "L V^-1",   "",                "time for which the gas has been collapsing, or has waited for a draw") \
    COLUMN(ready,    double,      , KEEP, "L V^-1",   "",                "time at which a cloud forms its next stars; 0: not known yet") \
    COLUMN(rested,   double,      , KEEP, "L V^-1",   "",                "time from which on a cloud that has bounced may do so again") \
    COLUMN(advance,  double,      , KEEP, "M V^2",    "",                "energy that its cloud has had of what a star's supernovae yield") \
    COLUMN(acc_exact,double,   [3], KEEP, "V^2 L^-1", "",                "acceleration at the row's own time, in double, for Hermite's schemes") \
    COLUMN(jerk,     double,   [3], KEEP, "V^3 L^-2", "",                "its first derivative in time") \
    COLUMN(snap,     double,   [3], KEEP, "V^4 L^-3", "",                "its second derivative") \
    COLUMN(crackle,  double,   [3], KEEP, "V^5 L^-4", "",                "its third derivative") \
    COLUMN(pop,      double,   [3], KEEP, "V^6 L^-5", "",                "its fourth derivative") \
    COLUMN(lock,     double,   [3], KEEP, "V^7 L^-6", "",                "its fifth derivative") \
    COLUMN(acc_old,  float,    [3], STEP, "V^2 L^-1", "",                "acceleration at the start of the step") \
    COLUMN(du_old,   float,       , STEP, "V^3 L^-1", "",                "du at the start of the step") \
    COLUMN(dt,       float,       , STEP, "L V^-1",   "",                "longest step that every module allows") \
    COLUMN(next_rung,uint8_t,     , STEP, "1",        "",                "rung that the row is about to have, while neighbours' are evened out") \
    COLUMN(pot,      float,       , STEP, "V^2",      "Potential",       "potential of all other rows, own softened term left out") \
    COLUMN(div_v,    float,       , KEEP, "V L^-1",   "",                "divergence of the velocity") \
    COLUMN(curl_v,   float,       , STEP, "V L^-1",   "",                "magnitude of the curl of the velocity") \
    COLUMN(signal,   float,       , STEP, "V",        "",                "largest signal velocity towards a neighbour")

/* NODE(name, element type, dimensions, unit, text): columns of the tree's cells beyond its frame.
 * `moment` and others of run-time width state their width where they are asked for. */
#define NODE_COLUMNS(NODE) \
    NODE(moment, float,  , "", "multipole moments about the cell's centre; the layout is gravity's") \
    NODE(cell,   uint8_t, , "", "what a walk for gravity sees of the cell; the layout is gravity's") \
    NODE(least,  float,  , "V^2 L^-1", "least gravitational acceleration of its rows, bounded below") \
    NODE(h_max,  float,  , "L", "largest smoothing length among the gas rows") \
    NODE(cloud_radius, float, , "L", "largest radius among the cold clouds")

enum lifetime { KEEP, STEP };

#define COLUMN(name, ...) COLUMN_##name,
enum column { SPECIES_COLUMNS(COLUMN) N_COLUMNS };
#undef COLUMN

#define NODE(name, ...) NODE_##name,
enum node_column { NODE_COLUMNS(NODE) N_NODE_COLUMNS };
#undef NODE

/* Masses of elements, contiguous; snapshots and starting files hold them as fractions of the row's mass. */
enum { FIRST_ELEMENT = COLUMN_metals, END_ELEMENTS = COLUMN_mass_ca + 1 };
static inline int column_is_element(int c) { return c >= FIRST_ELEMENT && c < END_ELEMENTS; }

struct column_info {
    const char *name;
    int element_bytes;      /* size of one component */
    int components;         /* 1 or 3 */
    char kind;              /* 'd' double, 'f' float, 'u' unsigned integer */
    enum lifetime lifetime;
    const char *unit, *file_name, *text;
};
extern const struct column_info column_table[N_COLUMNS];

struct node_column_info { const char *name; int element_bytes; const char *unit, *text; };
extern const struct node_column_info node_column_table[N_NODE_COLUMNS];
#endif
