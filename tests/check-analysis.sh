#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The block profiles: radii against sorted ones and the model, rings against an exponential disc and a point mass, ranks, restart.
. "$TEPHRA_SOURCE/tests/lib.sh"

# Plummer's sphere: M(r) = (1 + a^2/r^2)^(-3/2), a = 3 pi/16; and the same radii by sorting the rows of the snapshot.
scene=$TEPHRA_SOURCE/ics/plummer.yml
short="--set time.end=0.01 --set output.snapshot_every=0.01 --set gravity.accuracy=0.1"
expect_status 0 tephra run "$scene" --set start.n=20000 $short --set profiles={} --set profiles.centre=origin \
    --set "profiles.parts=10, 50, 90" --out sphere
expect_status 0 tephra convert sphere/snapshot_000.hdf5 sphere.csv
awk -F, 'NR == 1 { for (i = 1; i <= NF; i++) c[$i] = i } NR > 1 { print sqrt($c["x"] ^ 2 + $c["y"] ^ 2 + $c["z"] ^ 2) }' sphere.csv |
    sort -g >sorted
sed -n 2p sphere/lagrange.csv | tr , '\n' | tail -n 3 >found
for part in 10 50 90; do sed -n $((part * 200))p sorted; done | paste found - | awk '{ n++; x = (n == 1 ? 10 : n == 2 ? 50 : 90) / 100
    model = 0.58904862 / sqrt(x ^ (-2 / 3) - 1)
    if (($1 / $2 - 1) ^ 2 > 4e-10 || ($1 / model - 1) ^ 2 > 9e-4) { print n, $1, $2, model; bad = 1 } } END { exit bad || n != 3 }' ||
    fail "radii of a Plummer sphere"

# About a point mass of 1000 rows without weight: circular = sqrt(G M/R) where R is not much less than r.
expect_status 0 tephra run "$scene" --set start.n=1000 --set start.mass=1e-9 $short --set external={} --set external.point_mass=1 \
    --set profiles={} --set profiles.centre=origin --set profiles.outer=1 --set profiles.rings=50 --set profiles.within=0.02 --out point
awk -F, 'NR > 1 && $1 == 0 && $2 > 0.3 && $4 > 0 { n++; R = 0.5 * ($2 + $3)
    if (($9 / sqrt(1 / R) - 1) ^ 2 > 4e-4) { print; bad = 1 } } END { exit bad || n < 8 }' point/rings.csv || fail "circular speed about a point mass"

# Stars of exp(-R/3 kpc), 4.5e10 Msun, sech^2(z/0.3 kpc), no bulge: surface density with the noise of its rows, height; the gas
# turns as fast as forces and its pressure say.
expect_status 0 tephra run "$TEPHRA_SOURCE/ics/disc.yml" --set start.n=12000 --set start.bulge_mass=0 --set time.end='1 Myr' \
    --set sph.stiff_density='0.03 Msun/pc^3' \
    --set output.snapshot_every='1 Myr' --set profiles.rings=15 --out disc
awk -F, 'NR == 1 { for (i = 1; i <= NF; i++) { split($i, w, " "); c[w[1]] = i } next }
    $1 == 0 && $2 < 9 { R = 0.5 * ($2 + $3); n++
        sigma = $c["star_surface_density"] / (4.5 / (2 * 3.14159265 * 9) * exp(-R / 3)) - 1
        if (sigma ^ 2 * $c["star_rows"] > 16 || ($c["star_height"] / 0.3 - 1) ^ 2 * $c["star_rows"] > 16) { print; bad = 1 }
        turn = $c["gas_rotation"] / $c["gas_circular"] - 1
        if (n > 2 && turn ^ 2 > 4e-3) { print "turn", turn; bad = 1 } }
    END { exit bad || n != 9 }' disc/rings.csv || fail "rings of an exponential disc"

# Two compact galaxies on a wide parabola pass as points would: p = 2 r_p = r at the start, so that the time to pericentre is
# 4/3 sqrt(2 r_p^3/(G M)); half way between the times at which they are 50 kpc apart.
compact="--set start.dark_radius=2 --set start.dark_cut=6 --set start.bulge_mass=0 --set start.disc_radius=1"
expect_status 0 tephra run "$TEPHRA_SOURCE/ics/merger.yml" --set start.n=4000 --set sph=off --set start.gas_mass=0 --set gravity.softening=1 \
    $compact --set start.pericentre=40 --set start.separation=80 --set start.eccentricity=1 --set time.end=0.3Gyr \
    --set output.snapshot_every=60Myr --set output.picture_every=1Gyr --out pass
column() { awk -F, -v name="$1" 'NR == 1 { for (i = 1; i <= NF; i++) { split($i, w, " "); if (w[1] == name) c = i } next } { print $c }' "$2"; }
mass=$(for name in mass_star mass_dark; do column $name pass/energy.csv | head -n 1; done | awk '{ m += $1 } END { print m }')
awk -F, -v mass="$mass" 'NR > 2 && ($2 - 50) * (before - 50) < 0 { n++; middle += 0.5 * (t + ($1 - t) * (50 - before) / ($2 - before)) }
    NR > 1 { before = $2; t = $1; if (NR == 2 || $2 < least) least = $2 }
    END { time = 4 / 3 * sqrt(2 * 40 ^ 3 / (43009.17 * mass)); print "distance", least, "of 40, time", middle, "of", time
          if (n != 2 || (least / 40 - 1) ^ 2 > 9e-4 || (middle / time - 1) ^ 2 > 4e-4) exit 1 }' pass/separation.csv >passage ||
    fail "two compact galaxies"
cat passage

# Two galaxies where the orbit says; threads, ranks, restart.
small="--set start.n=2500 --set sph=off --set start.gas_mass=0 --set gravity.softening=1 --set output.snapshot_every=5Myr"
merger=$TEPHRA_SOURCE/ics/merger.yml
expect_status 0 tephra run "$merger" $small --set time.end=20Myr --out one --threads 1
awk -F, 'NR == 2 && ($2 < 69 || $2 > 71 || $3 < 90 || $3 > 210) { print; exit 1 }' one/separation.csv || fail "two galaxies at the start"
expect_status 0 tephra run "$merger" $small --set time.end=10Myr --out half --threads 1
for name in lagrange separation rings; do printf '9,1,2\n9.1,1' >>half/$name.csv; done
expect_status 0 tephra run --restart half --set time.end=20Myr --threads 1
for name in lagrange separation rings; do
    cmp -s one/$name.csv half/$name.csv || fail "$name.csv differs after a restart: $(diff one/$name.csv half/$name.csv | head -n 4)"
done
if command -v mpirun >/dev/null && ! tephra --version | grep -q 'MPI *no'; then
    expect_status 0 mpirun -n 3 --oversubscribe tephra run "$merger" $small --set time.end=20Myr --out three --threads 1
    for name in lagrange separation rings; do
        paste -d, one/$name.csv three/$name.csv | awk -F, 'NR > 1 { for (i = 1; i <= NF / 2; i++) { d = $i - $(i + NF / 2)
            if (d * d > 1e-12 * ($i * $i + 1)) { print NR, i, $i, $(i + NF / 2); exit 1 } } }' || fail "$name.csv differs on three ranks"
    done
fi
finish
