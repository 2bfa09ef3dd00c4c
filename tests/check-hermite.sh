#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Hermite's schemes in whole runs: order of convergence, bound pairs, the same bits on threads, ranks and after a
# restart, block steps, and what they refuse.
. "$TEPHRA_SOURCE/tests/lib.sh"
cluster=$TEPHRA_SOURCE/ics/cluster.yml
last() { tail -n 1 "$1/energy.csv" | awk -F, "{ print \$8 < 0 ? -\$8 : \$8 }"; }     # |E - E(0)|/|E(0)| at the end
# slope A B FACTOR: log(A/B)/log(FACTOR)
slope() { awk -v a="$1" -v b="$2" -v f="$3" 'BEGIN { print log(a / b) / log(f) }'; }
between() { awk -v x="$1" -v a="$2" -v b="$3" 'BEGIN { exit !(x >= a && x <= b) }' || fail "$4: $1 is not between $2 and $3"; }

# Common steps of a softened cluster: the largest energy error goes as dt^order.
largest() { awk -F, 'NR > 1 { e = $8 < 0 ? -$8 : $8; if (e > most) most = e } END { print most }' "$1/energy.csv"; }
run_fixed() {
    expect_status 0 tephra run "$cluster" --set start.n=64 --set gravity.softening=0.5 --set time.integrator=hermite$1 \
        --set "hermite$1={eta: 10}" --set time.steps=common --set time.end=4 --set output.snapshot_every=0.25 \
        --set output.picture_every=4 --set time.dt_max=$2 --out $3 --threads 1
}
for case in "4 0.03125 0.0078125" "6 0.125 0.03125" "8 0.125 0.03125"; do
    set -- $case
    run_fixed $1 $2 coarse$1; run_fixed $1 $3 fine$1
    got=$(slope "$(largest coarse$1)" "$(largest fine$1)" 4)
    echo "order $1: energy errors $(largest coarse$1), $(largest fine$1): slope $got"
    between "$got" "$(awk -v p=$1 'BEGIN { print p - 0.3 }')" "$(awk -v p=$1 'BEGIN { print p + 0.5 }')" "order $1"
done

# Common steps push rows by pairs that are equal and opposite: momentum and angular momentum to the rounding of the sums.
for order in 4 6 8; do
    awk -F, 'NR == 1 { for (i = 1; i <= NF; i++) if ($i ~ /^(angular_)?momentum/) column[i] }
        NR == 2 { for (i in column) start[i] = $i }
        NR > 2 { for (i in column) { d = $i - start[i]; if (d > 1e-14 || d < -1e-14) { print $0; exit 1 } } }' fine$order/energy.csv ||
        fail "momentum of order $order"
done

# On a bound pair the error is secular: orders 5 and 7 (ten orbits of eccentricity 0.3, 128 and 256 steps each).
pair_fixed() {
    expect_status 0 tephra run "$TEPHRA_SOURCE/ics/kepler.yml" --set start.eccentricity=0.3 --set gravity.softening=0 \
        --set time.integrator=hermite$1 --set "hermite$1={eta: 10}" --set time.steps=common --set time.dt_max=$2 \
        --set output.picture_every=1e3 --out fixed$1-$2 --threads 1
}
for order in 4 6; do
    pair_fixed $order 0.049087385212340517; pair_fixed $order 0.024543692606170259
    got=$(slope "$(last fixed$order-0.049087385212340517)" "$(last fixed$order-0.024543692606170259)" 2)
    echo "order $order on a bound pair: slope $got"
    between "$got" "$(awk -v p=$order 'BEGIN { print p + 0.7 }')" "$(awk -v p=$order 'BEGIN { print p + 1.3 }')" "bound pair, order $order"
done

# A bound pair, 10 orbits of eccentricity 0.9: doc/manual/hermite.md has the boundaries.
for case in "4 0.005 3e-6" "4 0.01 3e-5" "6 0.5 1e-4" "8 0.75 1e-4"; do
    set -- $case
    expect_status 0 tephra run "$TEPHRA_SOURCE/ics/kepler.yml" --set start.eccentricity=0.9 --set gravity.softening=0 \
        --set time.integrator=hermite$1 --set "hermite$1={eta: $2}" --out pair$1-$2 --threads 1
    echo "pair, order $1, eta $2: $(last pair$1-$2)"
    between "$(last pair$1-$2)" 0 "$3" "pair of order $1, eta $2"
done

# Beyond the boundary: a warning, and the loss it speaks of. A step that dt_min holds is counted.
far="--set start.eccentricity=0.99 --set gravity.softening=0 --set time.integrator=hermite4"
expect_status 0 tephra run "$TEPHRA_SOURCE/ics/kepler.yml" $far --set 'hermite4={eta: 0.16}' \
    --set output.energy_limit=1e300 --out beyond --threads 1
expect_text 'hermite4.eta = 0.16: above 0.02 close pairs lose' err
between "$(last beyond)" 0.01 1e9 "pair beyond the boundary"
expect_status 0 tephra check "$cluster" --set time.integrator=hermite6 --set 'hermite6={eta: 1}';    expect_text 'above 0.75' err
expect_status 0 tephra check "$cluster" --set time.integrator=hermite8 --set 'hermite8={eta: 1.4}';  expect_text 'above 1 close' err
expect_status 0 tephra check "$cluster";    grep -q 'hermite4.eta' err && fail "the default eta is warned of"
expect_status 0 tephra run "$TEPHRA_SOURCE/ics/kepler.yml" $far --set 'hermite4={dt_min: 0.001}' --set output.energy_limit=1e300 \
    --out held --threads 1
expect_text '[1-9][0-9]* steps were held at dt_min = 0.001' held/log.txt

# A hole 1e6 times as heavy as a star, which stars fall upon from near rest; a cold collapse.
for case in "4 1e-3" "6 2e-2" "8 1e-4"; do
    set -- $case
    order=$1
    expect_status 0 tephra run "$TEPHRA_SOURCE/ics/cluster_bh.yml" --set start.n=50 --set start.holes=1 --set start.hole_mass=20000 \
        --set gravity.softening=1e-3 --set time.end=0.0625 --set output.snapshot_every=0.0625 --set time.integrator=hermite$order \
        --out heavy$order --threads 1
    between "$(last heavy$order)" 0 $2 "heavy hole, order $order"
    expect_status 0 tephra run "$cluster" --set start.n=200 --set start.virial=0 --set time.end=2 --set output.snapshot_every=1 \
        --set time.integrator=hermite$order --out cold$order --threads 1
    between "$(largest cold$order)" 0 1e-4 "cold collapse, order $order"
    echo "order $order: heavy hole $(last heavy$order), cold collapse $(largest cold$order)"
done

# Steps grow again after a close passage, whatever the longest step is.
expect_status 0 tephra run "$TEPHRA_SOURCE/ics/kepler.yml" --set start.eccentricity=0.9 --set gravity.softening=0 \
    --set time.integrator=hermite4 --set output.snapshot_every=62.831853071795862 --set output.picture_every=1e3 --out grow
steps=$(sed -n 's/^\([0-9]*\) steps, .*/\1/p' grow/log.txt)
between "$steps" 3000 6000 "steps of ten orbits"

# Defaults, steps of their own.
small="--set start.n=500 --set time.end=0.25"
for order in 4 6 8; do
    expect_status 0 tephra run "$cluster" $small --set time.integrator=hermite$order --out own$order --threads 1
    between "$(last own$order)" 0 1e-7 "defaults of order $order"
done
# Order 6 is better with less: its pair costs up to 1.9 times one of order 4. Errors below 1e-9 are to be had.
updates() { sed -n 's/^[0-9]* steps, \([0-9]*\) updates.*/\1/p' $1/log.txt; }
awk -v e4="$(largest own4)" -v e6="$(largest own6)" -v u4="$(updates own4)" -v u6="$(updates own6)" 'BEGIN { exit !(e6 < 1e-7 && u4 > 1.9 * u6) }' ||
    fail "order 6 does not beat order 4: $(largest own4) $(largest own6) $(updates own4) $(updates own6)"
expect_status 0 tephra run "$cluster" $small --set time.integrator=hermite6 --set 'hermite6={eta: 0.25}' --out exact6 --threads 1
between "$(largest exact6)" 0 1e-9 "errors below 1e-9"
echo "500 stars to t = 0.25, orders 4, 6, 8 by default: $(largest own4) $(largest own6) $(largest own8); order 6, eta 0.25: $(largest exact6)"
floats="--set time.integrator=hermite4 --set hermite4={} --set hermite4.precision=float"
expect_status 0 tephra run "$cluster" $small $floats --out float --threads 1
between "$(last float)" 0 1e-7 "floats"
cmp -s own4/snapshot_002.hdf5 float/snapshot_002.hdf5 && fail "precision changes nothing"
expect_status 0 tephra run "$cluster" $small $floats --out float_two --threads 2
same float/snapshot_002.hdf5 float_two/snapshot_002.hdf5
# Of order 6 too, however short the steps: rounded derivatives do not shorten them without end.
expect_status 0 tephra run "$cluster" --set start.n=1000 --set time.end=0.0625 --set output.snapshot_every=0.0625 \
    --set time.integrator=hermite6 --set 'hermite6={precision: float, eta: 0.15}' --out float6 --threads 1
between "$(last float6)" 0 1e-8 "floats, order 6"
# A common motion of 100 times the stars' velocities costs no digits.
if "${PYTHON:-/usr/bin/python3}" -c 'import h5py' 2>/dev/null; then
    tephra ics plummer n=500 species=star -o still.hdf5
    "${PYTHON:-/usr/bin/python3}" -c 'import h5py, shutil
shutil.copy("still.hdf5", "fast.hdf5")
with h5py.File("fast.hdf5", "r+") as f:
    f["PartType4/Velocities"][:, 0] += 64'
    for start in still fast; do
        printf 'units: {G: 1}\nstart: {file: %s.hdf5}\ntime: {end: 0.25, integrator: hermite4}\n' $start >$start.yml
        printf 'output: {snapshot_every: 0.25}\ngravity: {softening: 1e-4}\nhermite4: {precision: float}\n' >>$start.yml
        expect_status 0 tephra run $start.yml --out run_$start --threads 1
    done
    awk -F, 'FNR == 1 { next } { e = FILENAME ~ /fast/ ? $7 - 2048 : $7; off[FILENAME] = e }
        END { d = off["run_fast/energy.csv"] - off["run_still/energy.csv"]; exit !(d < 1e-6 && d > -1e-6) }' \
        run_still/energy.csv run_fast/energy.csv || fail "a moving cluster: $(tail -n 1 run_fast/energy.csv)"
fi
expect_status 0 tephra run "$cluster" $small --set time.integrator=hermite6 --out threads --threads 2
same own6/snapshot_002.hdf5 threads/snapshot_002.hdf5
if command -v mpirun >/dev/null && ! tephra --version | grep -q 'MPI *no'; then
    expect_status 0 tephra run "$cluster" $small --set time.integrator=hermite4 --set 'hermite4={iterations: 2}' --out one --threads 1
    expect_status 0 mpirun -n 3 --oversubscribe tephra run "$cluster" $small --set time.integrator=hermite4 \
        --set 'hermite4={iterations: 2}' --out three --threads 1
    same one/snapshot_002.hdf5 three/snapshot_002.hdf5
    # With sources shared out: 1700 stars are four chunks of them. The first steps of order 8 are iterated.
    many="--set start.n=1700 --set time.end=0.03125 --set output.snapshot_every=0.03125"
    for order in 4 8; do
        expect_status 0 tephra run "$cluster" $many --set time.integrator=hermite$order --out many$order --threads 1
        for ranks in 2 3; do
            expect_status 0 mpirun -n $ranks --oversubscribe tephra run "$cluster" $many --set time.integrator=hermite$order \
                --out shared$order-$ranks --threads 1
            same many$order/snapshot_001.hdf5 shared$order-$ranks/snapshot_001.hdf5
            grep -q 'shared out among the ranks in [1-9]' shared$order-$ranks/log.txt || fail "sources are not shared out"
        done
    done
fi
long="--set start.n=500 --set time.end=0.25 --set output.checkpoint_every=0.125 --set time.integrator=hermite8"
expect_status 0 tephra run "$cluster" $long --out whole --threads 1
expect_status 0 tephra run "$cluster" $long --set time.end=0.125 --out half --threads 1
expect_status 0 tephra run --restart half --set time.end=0.25 --threads 1
same whole/snapshot_002.hdf5 half/snapshot_002.hdf5

# Refused, and told why.
expect_status 2 tephra check "$cluster" --set gravity.solver=tree;               expect_text 'direct or auto' err
expect_status 2 tephra check "$cluster" --set gravity.softening_kernel=spline;   expect_text 'needs plummer' err
expect_status 2 tephra check "$cluster" --set 'hermite6={eta: 1}'
expect_text 'only with time.integrator: hermite6' err
expect_status 2 tephra check "$TEPHRA_SOURCE/ics/evrard.yml" --set time.integrator=hermite4
expect_text 'without derivatives' err
python=${PYTHON:-/usr/bin/python3}
if "$python" -c 'import h5py' 2>/dev/null; then
    tephra ics plummer n=20 -o twin.hdf5
    "$python" -c 'import h5py
with h5py.File("twin.hdf5", "r+") as f:
    x = f["PartType1/Coordinates"]
    x[7] = x[3]'
    printf 'start: {file: twin.hdf5}\nunits: {G: 1}\ntime: {end: 1, integrator: hermite4}\noutput: {snapshot_every: 1}\n' >twin.yml
    printf 'gravity: {softening: 0}\n' >>twin.yml
    expect_status 2 tephra check twin.yml;    expect_text 'particles 4 and 8 lie at one place' err
    expect_status 0 tephra check twin.yml --set gravity.softening=0.01
fi
expect_status 2 tephra check "$cluster" --set time.integrator=hermite5;          expect_text 'hermite4' err
finish
