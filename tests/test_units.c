/* SPDX-License-Identifier: GPL-3.0-or-later
 * Units: factors against independent figures, compound units, dimensions that do not fit, the
 * constant of gravity, the block `units`. */
#include "units.h"
#include "constants.h"
#include "fail.h"
#include "mem.h"
#include "scene.h"
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

static const struct units plain = {false, 1, 1, 1, 1};
static const struct units cgs = {true, 1, 1, 1, CONST_G};

static struct units read_block(const char *assignment, struct problems *problems)
{
    struct units units;
    struct scene *scene = scene_new("/");
    scene_set(scene, assignment, problems);
    units_read(&units, scene, problems);
    scene_free(scene);
    return units;
}

static struct units galactic(void)
{
    struct problems none = {0, NULL};
    struct units units = read_block("units={length: kpc, mass: 1e10 Msun, velocity: km/s}", &none);
    assert_int_equal(none.count, 0);
    return units;
}

static void assert_near(double value, double wanted, double tolerance)
{
    if (!(fabs(value - wanted) <= tolerance * fabs(wanted))) fail_msg("%.17g is not %.17g", value, wanted);
}

static double parsed(const struct units *units, const char *text, const char *dimension)
{
    double value = NAN;
    char *why = units_parse(units, text, dimension, &value);
    if (why) fail_msg("%s: %s", text, why);
    return value;
}

static void test_factors(void **state)
{
    (void)state;
    static const struct { const char *text, *dimension; double cgs; } table[] = {
        {"3kpc", "length", 9.257032744474102e21}, {"1 au", "length", 1.495978707e13},
        {"2.5e-3 Mpc", "length", 7.714193953728418e21}, {"-1 km", "length", -1e5},
        {"1 Msun", "mass", 1.98841e33}, {"1e10Msun", "mass", 1.98841e43}, {"2 kg", "mass", 2000},
        {"1 Gyr", "time", 3.15576e16}, {"90 min", "time", 5400}, {"3 h", "time", 10800},
        {"2 d", "time", 172800}, {"10 km/s", "velocity", 1e6}, {"10 km s^-1", "velocity", 1e6},
        {"10 km*s**-1", "velocity", 1e6}, {"10 km s-1", "velocity", 1e6},
        {"1 km/s/kpc", "frequency", 3.2407792894443648e-17}, {"1 kpc/Gyr", "velocity", 97779.22216807891},
        {"20 K", "temperature", 20}, {"1e51 erg", "energy", 1e51}, {"1 J", "energy", 1e7},
        {"1 keV", "energy", 1.602176634e-9}, {"4 erg/g", "specific_energy", 4},
        {"9 km^2/s^2", "specific_energy", 9e10}, {"9 (km/s)^2", "specific_energy", 9e10},
        {"1 g/cm^3", "density", 1}, {"1 Msun/pc^3", "density", 6.76790e-23},
        {"1 Msun pc^-3", "density", 6.76790e-23}, {"0.1 cm^-3", "number_density", 0.1},
        {"0.1 1/cm^3", "number_density", 0.1}, {"0.1 / cm3", "number_density", 0.1},
        {"10 Msun/pc^2", "column_density", 2.08836e-3}, {"1e-9 cm/s^2", "acceleration", 1e-9},
        {"1 Pa", "pressure", 10}, {"1 erg/cm^3", "pressure", 1}, {"1 Lsun", "power", 3.828e33},
        {"1e-23 erg cm^3/s", "cooling_function", 1e-23}, {"180 deg", "angle", 3.14159265358979},
        {"1 Msun/yr", "mass_rate", 6.30089e25}, {"5 %", "", 0.05}, {"3", "", 3}, {"2 pc/kpc", "", 0.002},
        {"1e5", "length", 1e5}, {" 7 ", "length", 7}, {".5", "", 0.5}, {"+5.", "", 5},
        {"1E3 cm", "length", 1000}, {"1 (kpc/(Gyr (s/min)))", "velocity", 60 * 97779.22216807891},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++)
        assert_near(parsed(&cgs, table[i].text, table[i].dimension), table[i].cgs, 3e-6);
}

static void test_refusals(void **state)
{
    (void)state;
    static const struct { const char *text, *dimension, *says; } table[] = {
        {"3 Msun", "length", "expects a length, not a mass (Msun)"},
        {"3 km/s", "time", "expects a time, not a velocity (km/s)"},
        {"3 erg", "specific_energy", "expects a specific energy, not an energy (erg)"},
        {"3 Msun^2", "length", "expects a length, not Msun^2"},
        {"20 K", "specific_energy", "expects a specific energy, not a temperature (K)"},
        {"3 kpc", "", "expects a pure number, not a length (kpc)"}, {"abc", "", "is not a number"},
        {"", "", "has no value"}, {"  ", "length", "has no value"}, {"kpc", "length", "is not a number"},
        {"nan", "", "is not a number"}, {"inf", "length", "is not a number"}, {"-inf", "", "is not a number"},
        {"0x10", "", "is not a number"}, {"1e999", "", "too large"}, {"0.7abc", "", "unknown unit \"abc\""},
        {"3 kps", "length", "unknown unit \"kps\" (did you mean \"kpc\"?)"}, {"1e", "", "unknown unit \"e\""},
        {"3 4 kpc", "length", "expects a unit"}, {"3,5", "", "expects a unit"},
        {"3 kpc,", "length", "expects a unit"}, {"3 kpc)", "length", "expects a unit"},
        {"3 (kpc", "length", "bracket"}, {"3 ()", "length", "expects a unit"}, {"3 kpc^", "length", "power"},
        {"3 kpc^2.5", "area", ""}, {"3 kpc^99", "length", "power"}, {"3 /", "length", "expects a unit"},
        {"3 kpc//s", "length", "expects a unit"}, {"3 ((((((kpc))))))", "length", "expects a unit"},
        {"1.2.3", "", "expects a unit"}, {"--3", "", "is not a number"}, {"3 -kpc", "length", "expects a unit"},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        double value = 42.0;
        char *why = units_parse(&cgs, table[i].text, table[i].dimension, &value);
        if (!why || !strstr(why, table[i].says)) fail_msg("\"%s\": %s", table[i].text, why ? why : "accepted");
        assert_true(value == 42.0);
        mem_free(why);
    }
}

static void test_dimensionless(void **state)
{
    (void)state;
    assert_true(parsed(&plain, "0.1", "length") == 0.1);
    assert_true(parsed(&plain, "20 K", "temperature") == 20.0);
    assert_near(parsed(&plain, "90 deg", "angle"), 1.5707963267948966, 1e-15);
    assert_true(parsed(&plain, "5 %", "") == 0.05);
    double value;
    char *why = units_parse(&plain, "3 kpc", "length", &value);
    assert_non_null(strstr(why, "has a unit (kpc), but the scene is dimensionless (units: {G: 1})"));
    mem_free(why);
    why = units_parse(&plain, "20 K", "length", &value);
    assert_non_null(strstr(why, "expects a length, not a temperature (K)"));
    mem_free(why);
}

static void test_gravity_constant(void **state)
{
    (void)state;
    struct units units = galactic();
    assert_near(units.G, 43009.17, 1e-7);
    assert_true(parsed(&units, "3 kpc", "length") == 3.0 && parsed(&units, "7 km/s", "velocity") == 7.0);
    assert_near(parsed(&units, "1 Gyr", "time"), 1.0 / 0.97779222, 1e-8);
    assert_near(parsed(&units, "1 Msun", "mass"), 1e-10, 1e-15);
    assert_near(units_cgs(&units, "time"), 0.97779222 * 3.15576e16, 1e-8);
    assert_near(units_cgs(&units, "density"), 6.76790e-22, 1e-5);
    assert_true(units_cgs(&units, "temperature") == 1.0);
    struct problems none = {0, NULL};
    units = read_block("units={length: pc, mass: Msun, velocity: km/s}", &none);
    assert_near(units.G, 4.30091e-3, 2e-6);
    units = read_block("units={length: cm, mass: g, velocity: cm/s}", &none);
    assert_near(units.G, CONST_G, 1e-15);
    units = read_block("units={length: kpc, mass: 1e10 Msun, velocity: km/s, G: 43007.1}", &none);
    assert_true(units.physical && units.G == 43007.1);
    units = read_block("units={G: 2}", &none);
    assert_true(!units.physical && units.G == 2.0 && units.length == 1.0);
    units = read_block("units={}", &none);
    assert_true(!units.physical && units.G == 1.0);
    assert_int_equal(none.count, 0);
}

static void test_block_problems(void **state)
{
    (void)state;
    static const struct { const char *assignment; int count; const char *says; } table[] = {
        {"units={length: kpc}", 2, "units.mass: must be given with the other units"},
        {"units={length: kpc, mass: 1e10 Msn, velocity: km/s}", 1, "units.mass = 1e10 Msn: unknown unit \"Msn\" (did"},
        {"units={length: kpc, mass: km, velocity: km/s}", 1, "units.mass = km: expects a mass, not a length"},
        {"units={length: 3.1e21, mass: g, velocity: cm/s}", 1, "units.length = 3.1e21: expects a unit, such as kpc"},
        {"units={length: -1 kpc, mass: g, velocity: cm/s}", 1, "units.length = -1 kpc: must be positive"},
        {"units={length: 0 kpc, mass: g, velocity: cm/s}", 1, "must be positive"},
        {"units={g: 1}", 1, "units.g: unknown key (did you mean \"G\"?)"},
        {"units={G: -1}", 1, "units.G = -1: must lie in 0 ... 1e30"},
        {"gravity={}", 1, "has no block \"units\""},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        struct problems problems = {0, NULL};
        read_block(table[i].assignment, &problems);
        if (problems.count != table[i].count || !strstr(problems.text, table[i].says))
            fail_msg("case %zu: %d problems:\n%s", i, problems.count, problems.text ? problems.text : "");
        mem_free(problems.text);
    }
}

static void test_round_trip(void **state)
{
    (void)state;
    static const char *const table[] = {
        "units={G: 1}", "units={G: 0.1234567890123456789}", "units={length: kpc, mass: 1e10 Msun, velocity: km/s}",
        "units={length: 3.7 pc, mass: 17.3 Msun, velocity: 0.3 km/s}",
        "units={length: kpc, mass: 1e10 Msun, velocity: km/s, G: 43007.1}",
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        struct problems none = {0, NULL};
        struct units first = read_block(table[i], &none), second;
        char path[] = "/tmp/tephra-test-XXXXXX";
        FILE *file = fdopen(mkstemp(path), "w");
        units_write(file, &first);
        fclose(file);
        struct scene *scene = scene_read(path, &none);
        units_read(&second, scene, &none);
        remove(path);
        scene_free(scene);
        assert_int_equal(none.count, 0);
        assert_true(first.physical == second.physical && first.length == second.length && first.mass == second.mass);
        assert_true(first.velocity == second.velocity && first.G == second.G);
    }
}

static void test_wall(void **state)
{
    (void)state;
    static const struct { const char *text; double seconds; } table[] = {
        { "3h", 10800 }, { "90m", 5400 }, { "90 min", 5400 }, { "1800", 1800 }, { "0.5d", 43200 }, { "2 s", 2 },
        { "", -1 }, { "h", -1 }, { "-3h", -1 }, { "3 hours", -1 }, { "nan", -1 }, { "3kpc", -1 },
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        double seconds = 0.0;
        char *why = units_parse_wall(table[i].text, &seconds);
        if (table[i].seconds < 0.0) assert_non_null(why);
        else assert_true(!why && seconds == table[i].seconds);
        mem_free(why);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_factors), cmocka_unit_test(test_refusals), cmocka_unit_test(test_dimensionless),
        cmocka_unit_test(test_gravity_constant), cmocka_unit_test(test_block_problems),
        cmocka_unit_test(test_round_trip), cmocka_unit_test(test_wall),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
