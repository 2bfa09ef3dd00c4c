/* SPDX-License-Identifier: GPL-3.0-or-later
 * Units and dimensions. A unit is a factor in cgs and the powers of five base dimensions; compound
 * units (products, quotients, integer powers) are parsed, and a quantity is accepted where the powers
 * agree. G in code units follows from GM_sun, which is known far better than G (IAU 2015 B3). */
#include "units.h"
#include "constants.h"
#include "fail.h"
#include "mem.h"
#include "scene.h"
#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define DEGREE      (3.14159265358979323846 / 180.0)
#define ERG_PER_EV  1.602176634e-12     /* the charge of CODATA 2018, exact in the SI */
#define LIGHT_SPEED 2.99792458e10       /* cm/s, exact in the SI */
#define L_SUN       3.828e33            /* erg/s: nominal, IAU 2015 B3 */
#define R_SUN       6.957e10            /* cm: nominal, IAU 2015 B3 */

enum base { LENGTH, MASS, TIME, TEMPERATURE, ANGLE, N_BASES };
enum { MAX_POWER = 9, MAX_DEPTH = 4 };

struct named { const char *name; double factor; int power[N_BASES]; };

/* `unit` is the rest of the text behind the number, NULL if there is none. */
struct quantity { double number, factor; const char *unit; int power[N_BASES]; };

/* Dimensions; the first of several with the same powers gives its name to error messages. */
static const struct named dimension_table[] = {
    {"pure_number", 1, {0}},
    {"length", 1, {1}},
    {"area", 1, {2}},
    {"volume", 1, {3}},
    {"number_density", 1, {-3}},
    {"number_column_density", 1, {-2}},
    {"mass", 1, {0, 1}},
    {"density", 1, {-3, 1}},
    {"column_density", 1, {-2, 1}},
    {"line_density", 1, {-1, 1}},
    {"time", 1, {0, 0, 1}},
    {"frequency", 1, {0, 0, -1}},
    {"rate", 1, {0, 0, -1}},
    {"mass_rate", 1, {0, 1, -1}},
    {"velocity", 1, {1, 0, -1}},
    {"acceleration", 1, {1, 0, -2}},
    {"specific_angular_momentum", 1, {2, 0, -1}},
    {"momentum", 1, {1, 1, -1}},
    {"angular_momentum", 1, {2, 1, -1}},
    {"energy", 1, {2, 1, -2}},
    {"specific_energy", 1, {2, 0, -2}},
    {"power", 1, {2, 1, -3}},
    {"specific_power", 1, {2, 0, -3}},
    {"pressure", 1, {-1, 1, -2}},
    {"cooling_function", 1, {5, 1, -3}},
    {"temperature", 1, {0, 0, 0, 1}},
    {"angle", 1, {0, 0, 0, 0, 1}},
    {"angular_velocity", 1, {0, 0, -1, 0, 1}},
};

static const struct named unit_table[] = {
    {"%",      0.01,                    {0}},
    {"cm",     1,                       {1}},
    {"m",      1e2,                     {1}},
    {"km",     1e5,                     {1}},
    {"au",     CONST_AU,                {1}},
    {"AU",     CONST_AU,                {1}},
    {"ly",     LIGHT_SPEED * CONST_YEAR, {1}},
    {"pc",     CONST_PC,                {1}},
    {"kpc",    1e3 * CONST_PC,          {1}},
    {"Mpc",    1e6 * CONST_PC,          {1}},
    {"Rsun",   R_SUN,                   {1}},
    {"g",      1,                       {0, 1}},
    {"kg",     1e3,                     {0, 1}},
    {"Msun",   CONST_M_SUN,             {0, 1}},
    {"M_sun",  CONST_M_SUN,             {0, 1}},
    {"s",      1,                       {0, 0, 1}},
    {"min",    60,                      {0, 0, 1}},
    {"h",      3600,                    {0, 0, 1}},
    {"d",      86400,                   {0, 0, 1}},
    {"day",    86400,                   {0, 0, 1}},
    {"yr",     CONST_YEAR,              {0, 0, 1}},
    {"kyr",    1e3 * CONST_YEAR,        {0, 0, 1}},
    {"Myr",    1e6 * CONST_YEAR,        {0, 0, 1}},
    {"Gyr",    1e9 * CONST_YEAR,        {0, 0, 1}},
    {"Hz",     1,                       {0, 0, -1}},
    {"K",      1,                       {0, 0, 0, 1}},
    {"erg",    1,                       {2, 1, -2}},
    {"J",      1e7,                     {2, 1, -2}},
    {"eV",     ERG_PER_EV,              {2, 1, -2}},
    {"keV",    1e3 * ERG_PER_EV,        {2, 1, -2}},
    {"W",      1e7,                     {2, 1, -3}},
    {"Lsun",   L_SUN,                   {2, 1, -3}},
    {"dyn",    1,                       {1, 1, -2}},
    {"N",      1e5,                     {1, 1, -2}},
    {"Pa",     10,                      {-1, 1, -2}},
    {"rad",    1,                       {0, 0, 0, 0, 1}},
    {"deg",    DEGREE,                  {0, 0, 0, 0, 1}},
    {"arcmin", DEGREE / 60,             {0, 0, 0, 0, 1}},
    {"arcsec", DEGREE / 3600,           {0, 0, 0, 0, 1}},
};

enum {
    N_DIMENSIONS = sizeof dimension_table / sizeof *dimension_table,
    N_UNITS = sizeof unit_table / sizeof *unit_table
};

static const struct named *find_dimension(const char *name)
{
    if (!*name) return &dimension_table[0];
    for (int i = 0; i < N_DIMENSIONS; i++)
        if (strcmp(dimension_table[i].name, name) == 0) return &dimension_table[i];
    fail(STATUS_FAULT, "units: no dimension is called \"%s\"", name);
}

static bool same_powers(const int a[N_BASES], const int b[N_BASES])
{
    return memcmp(a, b, N_BASES * sizeof *a) == 0;
}

static char *message(const char *format, ...) __attribute__((format(printf, 1, 2)));
static char *message(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    char *text = mem_vformat("messages", format, arguments);
    va_end(arguments);
    return text;
}

/* "a length", "an energy", "a specific energy". */
static char *with_article(const char *name)
{
    char *text = message("%s %s", strchr("aeiou", *name) ? "an" : "a", name);
    for (char *c = text; *c; c++)
        if (*c == '_') *c = ' ';
    return text;
}

static char *wrong_dimension(const struct named *wanted, const struct quantity *found)
{
    const struct named *is = NULL;
    for (int i = N_DIMENSIONS - 1; i >= 0; i--)
        if (same_powers(dimension_table[i].power, found->power)) is = &dimension_table[i];
    char *want = with_article(wanted->name), *have = is ? with_article(is->name) : message("%s", found->unit);
    char *text = message(is ? "expects %s, not %s (%s)" : "expects %s, not %s", want, have, found->unit);
    mem_free(want);
    mem_free(have);
    return text;
}

static char *unknown_unit(const char *name, int length)
{
    const char *names[N_UNITS];
    for (int i = 0; i < N_UNITS; i++) names[i] = unit_table[i].name;
    char *word = message("%.*s", length, name);
    const char *near = fail_nearest(word, names, N_UNITS);
    char *text = near ? message("unknown unit \"%s\" (did you mean \"%s\"?)", word, near)
                      : message("unknown unit \"%s\"", word);
    mem_free(word);
    return text;
}

static const char *skip_spaces(const char *at)
{
    return at + strspn(at, " \t");
}

/* An exponent if one follows: ^2, **-3, 2, -3. False if it is malformed or absurdly large. */
static bool parse_power(const char **at, long *power)
{
    const char *start = *at;
    bool marked = *start == '^' || (start[0] == '*' && start[1] == '*');
    *power = 1;
    if (marked) start += *start == '^' ? 1 : 2;
    else if (!isdigit((unsigned char)start[*start == '+' || *start == '-'])) return true;
    char *end;
    *power = strtol(start, &end, 10);
    *at = end;
    return end > start && labs(*power) <= MAX_POWER;
}

static char *parse_product(const char **at, struct quantity *result, int depth);

/* One of: 1, (product), name; each with an exponent. `sign` is -1 behind a slash. */
static char *parse_factor(const char **at, struct quantity *result, int sign, int depth)
{
    struct quantity part = {.factor = 1.0};
    const char *start = *at = skip_spaces(*at);
    size_t length = 0;
    while (isalpha((unsigned char)start[length]) || (start[length] && strchr("_%", start[length]))) length++;
    if (*start == '(' && depth < MAX_DEPTH) {
        (*at)++;
        char *why = parse_product(at, &part, depth + 1);
        if (why) return why;
        if (**at != ')') return message("a bracket is not closed in the unit");
        (*at)++;
    } else if (start[0] == '1' && !isalnum((unsigned char)start[1]) && start[1] != '.') {
        (*at)++;
    } else {
        const struct named *unit = NULL;
        for (int i = 0; i < N_UNITS && length > 0; i++)
            if (strlen(unit_table[i].name) == length && memcmp(unit_table[i].name, start, length) == 0)
                unit = &unit_table[i];
        if (!unit) return length > 0 ? unknown_unit(start, (int)length) : message("expects a unit, not \"%s\"", start);
        part.factor = unit->factor;
        memcpy(part.power, unit->power, sizeof part.power);
        *at += length;
    }
    long power;
    if (!parse_power(at, &power)) return message("a unit's power must be a whole number from -9 to 9");
    result->factor *= pow(part.factor, (double)(sign * power));
    for (int b = 0; b < N_BASES; b++) result->power[b] += sign * (int)power * part.power[b];
    return NULL;
}

/* Factors with *, a point or a space between, or / before a divisor: km/s/kpc, erg cm^-2 s^-1, /cm^3. */
static char *parse_product(const char **at, struct quantity *result, int depth)
{
    int sign = **at == '/' ? -1 : 1;
    *at += sign < 0;
    for (;;) {
        char *why = parse_factor(at, result, sign, depth);
        if (why) return why;
        *at = skip_spaces(*at);
        if (**at == '\0' || **at == ')') return NULL;
        sign = **at == '/' ? -1 : 1;
        if (strchr("/*.", **at)) (*at)++;
    }
}

/* A number, a unit, or both; powers and factor of the unit. NULL or why not. */
static char *parse_quantity(const char *text, bool number_needed, struct quantity *result)
{
    *result = (struct quantity){.number = 1.0, .factor = 1.0};
    const char *at = skip_spaces(text), *digit = at + (*at == '-' || *at == '+');
    bool number = isdigit((unsigned char)*digit) || (*digit == '.' && isdigit((unsigned char)digit[1]));
    if (!*at) return message("has no value");
    if ((!number && number_needed) || (*digit == '0' && (digit[1] | 32) == 'x')) return message("is not a number");
    if (number) {
        char *end;
        result->number = strtod(at, &end);
        if (!isfinite(result->number)) return message("is too large for a number");
        at = skip_spaces(end);
    }
    if (!*at) return NULL;
    result->unit = at;
    char *why = parse_product(&at, result, 0);
    if (why || !*at) return why;
    return message("expects a unit, not \"%s\"", at);
}

char *units_parse(const struct units *units, const char *text, const char *dimension, double *value)
{
    const struct named *wanted = find_dimension(dimension);
    struct quantity found;
    char *why = parse_quantity(text, true, &found);
    if (why) return why;
    bool measured = found.power[LENGTH] || found.power[MASS] || found.power[TIME];
    if (measured && !units->physical)
        return message("has a unit (%s), but the scene is dimensionless (units: {G: 1}); write a plain number",
                       found.unit);
    if (found.unit && !same_powers(found.power, wanted->power)) return wrong_dimension(wanted, &found);
    *value = found.unit ? found.number * (found.factor / units_cgs(units, dimension)) : found.number;
    if (!isfinite(*value)) return message("is too large for a number");
    return NULL;
}

char *units_parse_wall(const char *text, double *seconds)
{
    static const struct { const char *name; double factor; } table[] = {
        {"", 1}, {"s", 1}, {"m", 60}, {"min", 60}, {"h", 3600}, {"d", 86400},
    };
    char *end = NULL;
    *seconds = isdigit((unsigned char)*text) || *text == '.' ? strtod(text, &end) : 0.0;
    for (size_t i = 0; end && i < sizeof table / sizeof *table; i++)
        if (strcmp(skip_spaces(end), table[i].name) == 0) {
            *seconds *= table[i].factor;
            return NULL;
        }
    return message("expects a time such as 3h, 90m (minutes), 1800s or 2d");
}

double units_cgs(const struct units *units, const char *dimension)
{
    const int *power = find_dimension(dimension)->power;
    return pow(units->length, power[LENGTH] + power[TIME]) * pow(units->mass, power[MASS])
         * pow(units->velocity, -power[TIME]);
}

struct block { char *length, *mass, *velocity; double G; };

const struct param units_params[] = {
    {"length", PARAM_TEXT, "", "none", 0, 0, NULL, "unit of length, such as kpc; with mass and velocity",
     false, offsetof(struct block, length)},
    {"mass", PARAM_TEXT, "", "none", 0, 0, NULL, "unit of mass, such as 1e10 Msun",
     false, offsetof(struct block, mass)},
    {"velocity", PARAM_TEXT, "", "none", 0, 0, NULL, "unit of velocity, such as km/s",
     false, offsetof(struct block, velocity)},
    {"G", PARAM_REAL, "", "none", 0, 1e30, NULL,
      "constant of gravity in code units; alone it makes a scene dimensionless",
     false, offsetof(struct block, G)},
    {0}
};

/* One of the three units of a scene, as the block writes it. */
struct unit_key { const char *name, *example; char *text; double *value; };

static void read_unit(const struct scene *scene, const struct unit_key *key, struct problems *problems)
{
    if (!key->text) {
        problems_add(problems, "%s: units.%s: must be given with the other units, such as %s",
                     scene_place(scene, "units", NULL), key->name, key->example);
        return;
    }
    struct quantity found;
    const struct named *wanted = find_dimension(key->name);
    char *why = parse_quantity(key->text, false, &found);
    if (!why && !found.unit) why = message("expects a unit, such as %s", key->example);
    if (!why && !same_powers(found.power, wanted->power)) why = wrong_dimension(wanted, &found);
    if (!why && !(found.number > 0.0)) why = message("must be positive");
    *key->value = found.number * found.factor;
    if (why)
        problems_add(problems, "%s: units.%s = %s: %s", scene_place(scene, "units", key->name), key->name, key->text,
                     why);
    mem_free(why);
}

/* G M_sun is known to 1e-10, G to 2e-5: masses are counted in suns. */
static double natural_G(const struct units *units)
{
    return CONST_GM_SUN * (units->mass / CONST_M_SUN) / (units->length * units->velocity * units->velocity);
}

void units_read(struct units *units, const struct scene *scene, struct problems *problems)
{
    *units = (struct units){false, 1.0, 1.0, 1.0, 1.0};
    if (!scene_find(scene, "units")) {
        problems_add(problems, "%s: has no block \"units\": add units: {G: 1}, or "
                     "units: {length: kpc, mass: 1e10 Msun, velocity: km/s}", scene_place(scene, "units", NULL));
        return;
    }
    struct block block = {0};
    param_read(scene, "units", (const struct param_target[]){{units_params, &block}, {0}}, units, problems);
    const struct unit_key key[] = {
        {"length", "kpc", block.length, &units->length}, {"mass", "1e10 Msun", block.mass, &units->mass},
        {"velocity", "km/s", block.velocity, &units->velocity},
    };
    units->physical = block.length || block.mass || block.velocity;
    for (int i = 0; i < 3 && units->physical; i++) read_unit(scene, &key[i], problems);
    units->G = !isnan(block.G) ? block.G : units->physical ? natural_G(units) : 1.0;
    for (int i = 0; i < 3; i++) mem_free(key[i].text);
}

void units_write(FILE *stream, const struct units *units)
{
    fputs("units:\n", stream);
    if (units->physical)
        fprintf(stream, "  length: %.17g cm\n  mass: %.17g g\n  velocity: %.17g cm/s\n",
                units->length, units->mass, units->velocity);
    if (!units->physical || units->G != natural_G(units)) fprintf(stream, "  G: %.17g\n", units->G);
}
