#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# `tephra ics` and `tephra params`: files that runs can start from, and tables of what may be said.
. "$TEPHRA_SOURCE/tests/lib.sh"

expect_status 0 tephra ics
for word in evrard plummer uniform start.seed units.length; do expect_text "$word" out_text; done

# The same seed makes the same rows, another one others; a run from the file starts from the same rows.
expect_status 0 tephra ics plummer n=500 -o a.hdf5
expect_status 0 tephra ics plummer n=500 seed=1 --out b.hdf5
expect_status 0 tephra ics plummer n=500 seed=2 -o c.hdf5
same a.hdf5 b.hdf5
tephra compare a.hdf5 c.hdf5 >out_text 2>&1 && fail 'another seed makes the same rows'
expect_status 0 tephra ics evrard n=1e3 mass='2000 Msun' radius=3pc \
    units.length=pc units.mass=Msun units.velocity=km/s -o cloud.hdf5
printf 'units: {length: kpc, mass: 1e10 Msun, velocity: km/s}\nstart: {file: cloud.hdf5}\ntime: {end: 1 kyr}\n' >cloud.yml
printf 'output: {snapshot_every: 1 kyr}\ngravity: {softening: 0.1 pc}\nsph:\n' >>cloud.yml
expect_status 0 tephra check cloud.yml
expect_text '1000 rows' out_text

# What gas it is, is said as in a scene: u and temperature go by sph.mu and sph.gamma.
expect_status 0 tephra ics medium n=500 n_h='1 cm^-3' temperature='100 K' sph.mu=2 sph.gamma=1.4 box.x=1 box.y=1 box.z=1 \
    units.length=pc units.mass=Msun units.velocity=km/s -o cold.hdf5
tephra info cold.hdf5 >out_text
expect_text 'Temperature .* 100 \.\.\. 100 ' out_text
expect_text 'InternalEnergy .* 1\.03[01][0-9]* \.\.\.' out_text    # k 100 K/(0.4 2 m_p) in (km/s)^2

# wrong STATUS-2 command lines: the words that the message must have, then the command.
wrong() { text=$1; shift; expect_status 2 tephra ics "$@" -o no.hdf5; expect_text "$text" err; }
wrong 'did you mean "plummer"' plumer n=10
wrong 'start.radus: unknown key (did you mean "radius"?)' plummer n=10 radus=3
wrong 'start.n' plummer
wrong 'sph.gama: unknown key (did you mean "gamma"?)' plummer n=10 sph.gama=1.4
wrong 'whole number' plummer n=1.5
wrong 'dimensionless' plummer n=10 radius=3pc
wrong 'expects a length, not a mass' plummer n=10 radius=3Msun units.length=pc units.mass=Msun units.velocity=km/s
wrong 'expects key=value' plummer n=10 radius
wrong 'not understood' plummer n=10 --radius=3
expect_status 2 tephra ics plummer n=10;                expect_text '-o FILE' err
[ ! -e no.hdf5 ] || fail 'a file was written'
expect_status 2 tephra ics plummer n=10 -o nowhere/a.hdf5; expect_text 'nowhere' err

expect_status 0 tephra params
for word in units.length start.n start.cut time.end output.snapshot_every gravity.softening sph.neighbours; do
    expect_text "$word" out_text
done
expect_status 0 tephra params gravity
expect_text gravity.accuracy out_text
grep -q '^  sph[.]' out_text && fail 'params gravity prints another block'
expect_status 0 tephra params --roff
expect_text '^.SH PARAMETERS' out_text
expect_status 2 tephra params gravty;                   expect_text 'did you mean "gravity"' err

# Two objects on a parabola: M = 3, r_p = 1, r = 8, so that v_t = sqrt(2 M r_p)/r, v^2 = 2 M/r. Each is a pair of rows; the
# spin of the first, along z in its file, is tilted by 90 degrees to where azimuth 90 points, +y; ids stay apart.
printf '# id x y z vx vy vz m\n1 5 3 2 7 1 0 1\n2 3 3 2 7 -1 0 1\n' >two.txt
printf '# id x y z vx vy vz m\n1 0 0.5 0 0 0 0 0.5\n2 0 -0.5 0 0 0 0 0.5\n' >one.txt
expect_status 0 tephra ics combine first=two.txt second=one.txt pericentre=1 separation=8 "inclination_1=90 deg" "azimuth_1=90 deg" -o pair.hdf5
expect_status 0 tephra convert pair.hdf5 pair.csv
awk -F, 'function near(a, b) { return (a - b) * (a - b) < 1e-20 }
    NR > 1 { b = $2 > 2; m[b] += $9; for (k = 0; k < 6; k++) { s[b, k] += $9 * $(3 + k); x[$2, k] = $(3 + k) } }
    END { for (k = 0; k < 6; k++) { a[k] = s[0, k] / m[0]; c[k] = s[1, k] / m[1]; if (!near(a[k] * m[0] + c[k] * m[1], 0)) bad = 1
              d[k] = c[k] - a[k] }
        r = sqrt(d[0] ^ 2 + d[1] ^ 2 + d[2] ^ 2); v2 = d[3] ^ 2 + d[4] ^ 2 + d[5] ^ 2; l = d[0] * d[4] - d[1] * d[3]
        if (!near(r, 8) || !near(v2, 6 / 8) || !near(l, sqrt(6)) || !(d[0] * d[3] + d[1] * d[4] < 0) || !near(d[2], 0)) bad = 2
        for (k = 0; k < 6; k++) y[k] = x[1, k] - a[k]
        spin_x = y[1] * y[5] - y[2] * y[4]; spin_y = y[2] * y[3] - y[0] * y[5]; spin_z = y[0] * y[4] - y[1] * y[3]
        if (!near(spin_x, 0) || !near(spin_y, 1) || !near(spin_z, 0)) bad = 3
        if (NR != 5 || !((3, 0) in x) || !((4, 0) in x)) bad = 4
        if (bad) print "bad", bad, r, v2, l, spin_x, spin_y, spin_z
        exit bad }' pair.csv || fail "combine: $(cat pair.csv)"
expect_status 2 tephra ics combine first=two.txt second=one.txt pericentre=1 separation=8 n=4 -o no.hdf5
expect_text 'start.n: has no meaning with combine' err
expect_status 2 tephra ics combine first=two.txt second=one.txt pericentre=1 separation=8 eccentricity=0.5 -o no.hdf5
expect_text 'distances from 1 to 3' err
finish
