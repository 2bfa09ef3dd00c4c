#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The physical scenes, small: they run, and keep what each of them promises.
. "$TEPHRA_SOURCE/tests/lib.sh"

# column NAME FILE: the values of a column of energy.csv, whatever its unit.
column() { awk -F, -v name="$1" 'NR == 1 { for (i = 1; i <= NF; i++) { split($i, w, " "); if (w[1] == name) c = i } next }
                                 { print $c }' "$2"; }

# A halo in equilibrium stays so: (2 K + 2 U)/-W over a third of a dynamical time of its half-mass radius.
expect_status 0 tephra run "$TEPHRA_SOURCE/ics/halo.yml" --set start.n=4000 --set time.end=0.2 --set output.snapshot_every=0.1 \
    --set output.energy_every=0.05 --out halo
for name in kinetic thermal potential error; do column $name halo/energy.csv >$name; done
paste kinetic thermal potential error | awk '{ ratio = 2 * ($1 + $2) / -$3
    if (ratio < 0.96 || ratio > 1.04 || $4 * $4 > 1e-6) { print "virial ratio", ratio, "energy error", $4; exit 1 } }' ||
    fail "the halo is not in equilibrium"
expect_status 2 tephra check "$TEPHRA_SOURCE/ics/halo.yml" --set start.dark_cut=none; expect_text 'start.dark_cut' err
expect_status 2 tephra check "$TEPHRA_SOURCE/ics/halo.yml" --set start.star_profile=plummer; expect_text 'steeper profile' err

# Stars in a fixed potential; what it does not say is refused.
expect_status 0 tephra run "$TEPHRA_SOURCE/ics/plummer.yml" --set start.n=500 --set time.end=1 --set external={} \
    --set external.point_mass=0.5 --out fixed
head -n 1 fixed/energy.csv | grep -q 'external' || fail "no column for the external potential"
column error fixed/energy.csv | awk '$1 * $1 > 1e-6 { exit 1 }' || fail "energy is lost in an external potential"
expect_status 2 tephra check "$TEPHRA_SOURCE/ics/plummer.yml" --set external={}; expect_text 'give the mass' err
expect_status 2 tephra check "$TEPHRA_SOURCE/ics/plummer.yml" --set external.point_mass=1; expect_text 'external' err
expect_status 2 tephra check "$TEPHRA_SOURCE/ics/plummer.yml" --set external={} --set external.disc_mass=1
expect_text 'external.disc_height' err

# Colliding clouds: the gas resists from the density on that so many rows resolve (two kernels a Jeans mass; ten times
# the mean at least), on two ranks of threads alike; momentum stays zero; the log says what is resolved.
scene=$TEPHRA_SOURCE/ics/cloud_collision.yml
expect_status 0 tephra check "$scene" --set start.n=131072;             expect_text 'stiff_density = 28[0-9][0-9][.]' err
expect_text 'the least Jeans mass is .*: resolved' err
expect_status 0 tephra run "$scene" --set start.n=2000 --set time.end='1 Myr' --out clouds
expect_text 'stiff_density = 176.8' err
expect_text 'jeans: t = 1.02.* % of the gas' clouds/log.txt
grep -q 'stiff_density: 176.8' clouds/used.yml || fail "used.yml does not hold what the generator advised"
for name in momentum_x momentum_y momentum_z; do column $name clouds/energy.csv; done |
    awk '{ if ($1 * $1 > 1e-14) { print "momentum", $1; exit 1 } }' || fail "clouds do not keep their momentum"
expect_status 0 tephra run clouds/used.yml --out again
same clouds/snapshot_004.hdf5 again/snapshot_004.hdf5
expect_status 0 tephra check "$scene" --set start.n=500 --set sph.stiff_density=1000 --set start.rotation=0.02 \
    --set "start.turbulence=0.5 km/s";                                  expect_text 'NOT resolved' err
expect_status 2 tephra check "$scene" --set sph.eos=adiabatic --set sph.stiff_density=3; expect_text 'barotropic' err

# With sinks: two of them, made where the rows still resolve a Jeans mass; mass closes, the books within 1 % of what they hold.
expect_status 0 tephra run "$scene" --set sph.eos=isothermal --set sinks={} --set start.n=1024 --set time.end='1.5 Myr' --out sinks
expect_text 'sinks.radius = 0.3599' err
for name in potential total mass_gas mass_star; do column $name sinks/energy.csv >$name; done
paste potential total mass_gas mass_star | awk 'NR == 1 { first = $2; mass = $3 + $4 }
    { off = ($2 - first) / $1; if (off * off > 1e-4 || ($3 + $4 - mass) ^ 2 > 1e-24 * mass ^ 2) { print NR, off, $3 + $4 - mass; bad = 1 } }
    END { print "in sinks:", $4 / mass; exit bad || NR < 10 || !($4 > 0.3 * mass) }' || fail "sinks: the books do not close"
expect_status 2 tephra check "$scene" --set sinks={}; expect_text 'sinks.density' err
expect_status 0 tephra check "$scene" --set sph.eos=isothermal --set sinks={} --set "sinks.radius=0.01 pc"; expect_text 'is noise' err

# Clumps at the start: where the density exceeds 50 Msun/pc^3, each cloud within 0.71 pc, 111 Msun (M(r) ~ r^2); with
# friends as far apart as the clouds they are one, and every dense row is in it.
cores="--set start.n=4000 --set time.end=1kyr --set output.snapshot_every=1kyr --set clumps.density=50 --set clumps.linking=2"
expect_status 0 tephra run "$scene" $cores --out cores
awk -F, 'NR > 1 { n++; if ($3 < 105e-10 || $3 > 117e-10 || $5 * $5 < 4e-6) exit 1 } END { if (n != 2) exit 1 }' cores/clumps_000.csv ||
    fail "two cores of 111 Msun are not found: $(cat cores/clumps_000.csv)"
expect_status 0 tephra run "$scene" $cores --set clumps.linking=20 --out one-core
awk -F, -v rows="$(awk -F, 'NR > 1 { n += $2 } END { print n }' cores/clumps_000.csv)" \
    'NR == 2 && $2 != rows || NR > 2 { exit 1 }' one-core/clumps_000.csv || fail "distant friends are not one clump"

# A disc galaxy and a merger of two: in equilibrium, momentum and energy kept; what is impossible is refused.
expect_status 0 tephra run "$TEPHRA_SOURCE/ics/disc.yml" --set start.n=2500 --set time.end='25 Myr' --set output.snapshot_every='12.5 Myr' \
    --set start.bulge_mass=0 --out disc
for name in kinetic potential; do column $name disc/energy.csv >$name; done
awk 'NR == 1 { first = $1 } $1 < 0.97 * first || $1 > 1.03 * first { print; exit 1 }' kinetic || fail "the disc is not in equilibrium"
column mass_dark disc/energy.csv | awk '$1 != 0 { exit 1 }' || fail "a fixed halo has rows"
grep -q 'nfw_mass: 136' disc/used.yml || fail "the fixed halo is not in used.yml"
grep -q 'hernquist_mass: 1.1' disc/used.yml && fail "a bulge of no mass is in used.yml"
expect_status 2 tephra check "$TEPHRA_SOURCE/ics/disc.yml" --set external=off; expect_text 'a bulge without rows needs' err
expect_status 2 tephra check "$TEPHRA_SOURCE/ics/disc.yml" --set start.dark_profile=hernquist
expect_text 'one Hernquist sphere' err
expect_status 2 tephra check "$TEPHRA_SOURCE/ics/merger.yml" --set start.bulge_fixed=on --set external={}; expect_text 'of rows' err
expect_status 0 tephra run "$TEPHRA_SOURCE/ics/merger.yml" --set start.n=2000 --set time.end='20 Myr' --set output.snapshot_every='20 Myr' \
    --set gravity.softening=1 --set sph=off --set start.gas_mass=0 --out merger
column error merger/energy.csv | awk '$1 * $1 > 1e-6 { exit 1 }' || fail "the merger loses energy"
expect_status 2 tephra check "$TEPHRA_SOURCE/ics/merger.yml" --set start.eccentricity=0.5; expect_text 'start.separation' err
expect_status 2 tephra check "$TEPHRA_SOURCE/ics/disc.yml" --set start.gas_share=none; expect_text 'share' err
expect_status 0 tephra check "$TEPHRA_SOURCE/ics/disc.yml" --set start.n=3000 --set start.disc_q=0.9; expect_text 'disc_q = 0.9: below 1' err

# With four times the rows gas resists from sixteen times the density on, where a row's mass decides it (J1).
for n in 16000 64000; do
    expect_status 0 tephra check "$TEPHRA_SOURCE/ics/disc.yml" --set start.n=$n
    sed -n 's/^sph.stiff_density = \([^ ]*\) .*/\1/p' err
done >stiff
awk 'NR == 1 { low = $1 } END { exit !(NR == 2 && ($1 / low - 16) ^ 2 < 1e-4) }' stiff || fail "stiff_density: $(cat stiff)"

# A protogalaxy: second moments of an ellipsoid of rho ~ 1/s, A^2/6 and so on; the angular momentum by mass of lambda = 0.08,
# 1630 kpc km/s by a quadrature of the energy; warm; no stars yet.
expect_status 0 tephra run "$TEPHRA_SOURCE/ics/collapse.yml" --set start.n=4000 --set time.end='4 Myr' --set output.snapshot_every='4 Myr' \
    --out collapse
expect_status 0 tephra convert collapse/snapshot_000.hdf5 protogalaxy.csv
awk -F, 'NR == 1 { for (i = 1; i <= NF; i++) { split($i, w, " "); c[w[1]] = i } next }
    { n++; for (k = 0; k < 3; k++) s[k] += $(c["x"] + k) ^ 2; j += $c["x"] * $c["vy"] - $c["y"] * $c["vx"] }
    END { a[0] = 100; a[1] = 75; a[2] = 50; for (k = 0; k < 3; k++) if ((6 * s[k] / n / a[k] ^ 2 - 1) ^ 2 > 1e-4) bad = 1
          if ((j / n / 1630 - 1) ^ 2 > 1e-4 || bad) { print s[0] / n, s[1] / n, s[2] / n, j / n; exit 1 } }' protogalaxy.csv ||
    fail "the protogalaxy is not what it should be"
tephra info collapse/snapshot_000.hdf5 >out_text; expect_text 'Temperature .* 10000 ... 10000 ' out_text
column error collapse/energy.csv | awk '$1 * $1 > 1e-6 { exit 1 }' || fail "the protogalaxy loses energy"
expect_status 2 tephra check "$TEPHRA_SOURCE/ics/collapse.yml" --set external=off; expect_text 'potential of the block external' err
finish
