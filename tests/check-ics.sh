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
grep -q sph. out_text && fail 'params gravity prints another block'
expect_status 0 tephra params --roff
expect_text '^.SH PARAMETERS' out_text
expect_status 2 tephra params gravty;                   expect_text 'did you mean "gravity"' err
finish
