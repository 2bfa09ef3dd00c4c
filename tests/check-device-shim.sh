#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# --device, with the program linked to the host shim instead of the CUDA runtime: a whole run on the
# device agrees with the CPU; without a device `auto` says one line and goes on, `cuda` ends with 2.
. "$TEPHRA_SOURCE/tests/lib.sh"
program=$TEPHRA_BUILD/tests/shim_tephra
[ -x "$program" ] || { echo "no C++ compiler for the shim"; exit 77; }
unset SHIM_DEVICES
scene=$TEPHRA_SOURCE/ics/evrard.yml
small="--set start.n=300 --set gravity.solver=direct --set time.end=0.1 --set output.snapshot_every=0.05 --set output.picture_every=0.1"

expect_status 0 "$program" run "$scene" $small --device cpu --out cpu
grep -q 'device' err && fail "--device cpu speaks of devices"
expect_status 0 "$program" run "$scene" $small --device cuda --out device
expect_text 'device: host shim' err
# The energies of the last row agree to the rounding of forces.
for run in cpu device; do
    awk -F, 'NR == 1 { for (i = 1; i <= NF; i++) if ($i ~ /^total/) c = i } END { printf "%.5f\n", $c }' $run/energy.csv
done | uniq | wc -l | grep -qx 1 || fail "energies on the device and on the CPU differ"

# The tree and the gas likewise: groups, lists, block steps.
tree="--set start.n=1500 --set gravity.solver=tree --set time.end=0.02 --set output.snapshot_every=0.02 --set output.picture_every=0.02"
for run in cpu cuda; do
    expect_status 0 "$program" run "$scene" $tree --device $run --set gravity.group_size=64 --out tree-$run
    awk -F, 'NR == 1 { for (i = 1; i <= NF; i++) if ($i ~ /^total/) c = i } END { printf "%.5f\n", $c }' tree-$run/energy.csv
done | uniq | wc -l | grep -qx 1 || fail "energies with the tree on the device and on the CPU differ"

# profile.csv tells what crosses, hook by hook, and what kernels and copies take.
for name in sph_search_rows sph_density_rows sph_force_rows integrate_rows 'copies to the device' 'copies from the device'; do
    awk -F, -v name="$name" '$1 == "DEVICE" && $2 == name && $3 > 0 && $5 > 0 { found = 1 } END { exit !found }' tree-cuda/profile.csv ||
        fail "profile.csv does not tell of $name"
done
awk -F, '$1 == "DENSITY" && $2 == "sph" && $7 > 0 { found = 1 } END { exit !found }' tree-cuda/profile.csv || fail "no bytes in profile.csv"

# Star clusters: sums in floats where nothing else is asked, rows predicted there; a restart goes on bit for bit.
cluster=$TEPHRA_SOURCE/ics/cluster.yml
stars="--set start.n=200 --set output.snapshot_every=0.0625 --set output.picture_every=1"
for order in 4 6; do
    expect_status 0 "$program" run "$cluster" $stars --set time.end=0.125 --set time.integrator=hermite$order --device cuda --out stars$order
    expect_status 0 "$program" run "$cluster" $stars --set time.end=0.125 --set time.integrator=hermite$order --device cpu --out cpu$order
    cmp -s stars$order/energy.csv cpu$order/energy.csv && fail "order $order: the device has not been used"
    for run in stars cpu; do
        awk -F, 'END { exit !($8 < 1e-7 && $8 > -1e-7) }' $run$order/energy.csv || fail "$run$order: $(tail -n 1 $run$order/energy.csv)"
    done
    expect_status 0 "$program" run "$cluster" $stars --set time.end=0.0625 --set time.integrator=hermite$order --device cuda --out half$order
    expect_status 0 "$program" run --restart half$order --set time.end=0.125 --device cuda
    same stars$order/snapshot_002.hdf5 half$order/snapshot_002.hdf5
done
expect_status 0 "$program" run "$cluster" $stars --set time.end=0.125 --set time.integrator=hermite4 \
    --set hermite4={} --set hermite4.precision=double --device cuda --out double4
expect_text "sums in doubles are the CPU's" err
same double4/snapshot_002.hdf5 cpu4/snapshot_002.hdf5
expect_status 0 env SHIM_BYTES=1000 "$program" run "$cluster" $stars --set time.end=0.125 --set time.integrator=hermite4 --device auto --out full4
expect_text 'tree: rows needs .* GB are free; the CPU goes on' full4/log.txt
same full4/snapshot_002.hdf5 cpu4/snapshot_002.hdf5

# Too small a device: auto goes on on the CPU, bit for bit what it gives from the start; cuda ends with 5.
export SHIM_BYTES=1000
expect_status 0 "$program" run "$scene" $small --device auto --out small
expect_text 'tree: rows needs .* GB are free; the CPU goes on' err
cmp cpu/energy.csv small/energy.csv || fail "the CPU after a full device is not the CPU"
expect_status 5 "$program" run "$scene" $small --device cuda --out small2
expect_text 'error: tree: rows needs' err
expect_status 5 "$program" run --restart cpu --set time.end=0.15 --device cuda
expect_text 'the last checkpoint, of t = 0.1, is whole: tephra run --restart cpu' err
unset SHIM_BYTES

export SHIM_DEVICES=0
expect_status 2 "$program" run "$scene" $small --device cuda --out none
expect_text 'device cuda: no NVIDIA device' err
[ -e none ] && fail "a refused run left a directory"
expect_status 0 "$program" run "$scene" $small --set time.end=0.05 --device auto --out auto
expect_text 'device: the CPU (no NVIDIA device' err
export SHIM_DEVICES=-1
expect_status 2 "$program" run "$scene" $small --device cuda --out none
expect_text 'no NVIDIA driver' err
expect_status 2 "$program" run "$scene" $small --device gpu --out none
expect_text 'expects auto, cpu or cuda' err
finish
