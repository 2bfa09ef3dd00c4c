#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Files that others made: GADGET-2's binary formats in either byte order and precision, phi-GRAPE's text, named and plain
# columns; what is truncated, damaged or foreign is refused with one clear error. `tephra convert` there and back.
. "$TEPHRA_SOURCE/tests/lib.sh"
for python in "${PYTHON:-/usr/bin/python3}" python3; do "$python" -c 'import struct' 2>/dev/null && break; python=; done
[ "$python" ] || { echo "python3 is not installed"; exit 77; }
gadget2() { "$python" "$TEPHRA_SOURCE/tests/scenes/gadget2.py" "$@" || fail "gadget2.py $*"; }
# refused FILE TEXT...: exit 2, one line of error that names the file and says each text; nothing is written.
refused() {
    file=$1; shift
    expect_status 2 tephra convert "$file" no.hdf5
    [ "$(grep -c '^tephra: error' err)" = 1 ] || fail "$file: not one error: $(cat err)"
    for text in "$file" "$@"; do expect_text "$text" err; done
    [ ! -e no.hdf5 ] || fail "$file: written all the same"
}

# The same rows in eight ways, and as text.
cat >known.csv <<'TEXT'
species,id,x [kpc],y [kpc],z [kpc],vx [km/s],vy [km/s],vz [km/s],m [1e10 Msun],u [(km/s)^2]
gas,100,0.25,0,0.5,10,0,-3,0.5,1000
gas,99,1.25,-2,0.5,11,0.125,-3,1.5,1001
gas,98,2.25,-4,0.5,12,0.25,-3,2.5,1002
dark,97,3.25,-6,0.5,13,0.375,-3,7.5,
dark,96,4.25,-8,0.5,14,0.5,-3,7.5,
TEXT
for format in 1 2; do for order in '<' '>'; do for float in f d; do
    gadget2 write g.dat --format $format --order $order --float $float --id "$([ $float = d ] && echo Q || echo I)"
    expect_status 0 tephra convert g.dat g.csv --force
    sed 's/,-0,/,0,/' g.csv | cmp -s - known.csv || fail "format $format $order $float: $(cat g.csv)"
done; done; done
expect_status 0 tephra convert g.dat time.hdf5
tephra info time.hdf5 | grep -q 'time  *0.125$' || fail "time: $(tephra info time.hdf5 | grep time)"
expect_status 0 tephra info g.dat
expect_text 'thermal energy *4506.5' out_text

# A run starts from it as from its HDF5 file.
cat >run.yml <<'TEXT'
units: {length: kpc, mass: 1e10 Msun, velocity: km/s}
start: {file: g.dat}
time: {end: 0.126}
output: {snapshot_every: 0.001}
gravity: {softening: 0.1}
TEXT
expect_status 0 tephra run run.yml --out binary
expect_status 0 tephra run run.yml --set start.file=time.hdf5 --out hdf5
same binary/snapshot_001.hdf5 hdf5/snapshot_001.hdf5

# What is written is read by other means, and comes back: floats here, every bit in CSV.
for out in w.gadget w.gadget2; do
    expect_status 0 tephra convert known.csv $out
    gadget2 read $out >blocks
    [ "$(wc -l <blocks)" = 6 ] || fail "$out: $(cat blocks)"
    grep -q '^HEAD 3 2 0 0 0 0 ' blocks && grep -q '^ID 100 99 98 97 96$' blocks && grep -q '^MASS 0.5 1.5 2.5 7.5 7.5$' blocks ||
        fail "$out: $(cat blocks)"
    expect_status 0 tephra convert $out w.csv --force
    cmp -s w.csv known.csv || fail "$out: $(cat w.csv)"
done
expect_status 0 tephra ics plummer n=100 -o p.hdf5
expect_status 0 tephra convert p.hdf5 p.csv
[ "$(head -n 1 p.csv)" = 'species,id,x,y,z,vx,vy,vz,m' ] || fail "names: $(head -n 1 p.csv)"
sed 's/.*/start: {file: p.csv}/; 1!d' run.yml >start.yml
printf 'units: {G: 1}\ntime: {end: 0.01}\noutput: {snapshot_every: 0.01}\ngravity: {softening: 0.1}\n' >>start.yml
expect_status 0 tephra run start.yml --out csv
expect_status 0 tephra run start.yml --set start.file=p.hdf5 --out ours
expect_status 0 tephra compare csv/snapshot_001.hdf5 ours/snapshot_001.hdf5
expect_status 2 tephra convert p.hdf5 p.csv;        expect_text 'exists already' err
expect_status 2 tephra convert p.hdf5 p.txt;        expect_text 'tells no format' err

# phi-GRAPE's data.inp, seven columns, names behind a #, other delimiters.
printf '0\n3\n2.5\n1 0.5 1 2 3 4 5 6\n2 0.25 -1 -2 -3 -4 -5 -6\n7 0.25 0 0 0 1 0 0\n' >data.inp
expect_status 0 tephra convert data.inp phi.csv
grep -q '^star,7,0,0,0,1,0,0,0.25$' phi.csv && grep -q '^star,1,1,2,3,4,5,6,0.5$' phi.csv || fail "phi-GRAPE: $(cat phi.csv)"
tephra info data.inp | grep -q 'time  *2.5$' || fail 'time of phi-GRAPE'
printf '0.5 1 2 3 4 5 6\n0.25 -1 -2 -3 -4 -5 -6\n' >seven.txt
expect_status 0 tephra convert seven.txt seven.csv
grep -q '^star,2,-1,-2,-3,-4,-5,-6,0.25$' seven.csv || fail "seven columns: $(cat seven.csv)"
printf '# x y z   m type colour\n1 2 3 4 1 9\n5;6;7;8;0;9\n' >named.txt
expect_status 0 tephra convert named.txt named.csv
grep -q '^dark,2,1,2,3,0,0,0,4$' named.csv && grep -q '^gas,1,5,6,7,0,0,0,8$' named.csv || fail "named: $(cat named.csv)"

# Text as editors write it: a byte order mark first, and letters beyond ASCII.
printf '\357\273\277x,y,z,m,Gr\303\266\303\237e\n1,2,3,4,9\n5,6,7,8,9\n' >mark.csv
expect_status 0 tephra convert mark.csv marked.csv
grep -q '^star,2,5,6,7,0,0,0,8$' marked.csv || fail "UTF-8: $(cat marked.csv)"

# HDF5 of AREPO (pc, Msun, masses in the header) and SWIFT (Mpc, h in its own convention), made with h5py.
if "$python" -c 'import h5py' 2>/dev/null; then
    for code in arepo swift; do
        "$python" "$TEPHRA_SOURCE/tests/scenes/foreign_hdf5.py" $code $code.hdf5 || fail "foreign_hdf5.py $code"
        expect_status 0 tephra convert $code.hdf5 $code.csv
        awk -F, -v code=$code 'function near(a, b) { return (a - b) * (a - b) <= 1e-12 * b * b }
            NR > 1 { k = $2; if (!near($3, k) || !near($5, 3 * k) || !near($7, 20 * k) || !near($9, 0.5)) bad = 1
                if ((k <= 4) != ($1 == "gas") || (k <= 4 && !near($10, 100 * k))) bad = 1
                if (code == "swift" && k <= 4 && !near($11, 0.7 * 1.825742 / 2)) bad = 1 }
            END { exit bad || NR != 7 }' $code.csv || fail "$code: $(cat $code.csv)"
        expect_status 0 tephra convert $code.hdf5 $code-ours.hdf5
        tephra info $code-ours.hdf5 | grep -q 'time  *2$' || fail "$code: $(tephra info $code-ours.hdf5 | grep time)"
    done
fi

# Of cosmological runs at z = 1 with h = 1/2: refused with the remedy, or physical.
if "$python" -c 'import h5py' 2>/dev/null; then
    for code in comoving scaled swift-comoving; do
        "$python" "$TEPHRA_SOURCE/tests/scenes/foreign_hdf5.py" $code $code.hdf5 || fail "foreign_hdf5.py $code"
        refused $code.hdf5 'cosmological' 'start.strip_h'
        expect_status 0 tephra convert $code.hdf5 $code.csv --set start.strip_h=on
        expect_text 'scale factor 0.5, h' err
        awk -F, 'function near(a, b) { return (a - b) * (a - b) <= 1e-12 * b * b }
            NR > 1 { k = $2; if (!near($3, k) || !near($5, 3 * k) || !near($7, 20 * k) || !near($9, 0.5)) bad = 1
                if (k <= 4 && !near($10, 100 * k)) bad = 1
                if (k <= 4 && !near($11, ARGV[1] ~ /swift/ ? 0.7 * 1.825742 / 2 : 0.7)) bad = 1 }
            END { exit bad || NR != 7 }' $code.csv || fail "$code: $(cat $code.csv)"
    done
    gadget2 write hubble.dat --h 0.5
    expect_status 0 tephra convert hubble.dat hubble.csv --set start.strip_h=on
    grep -q '^gas,99,2.5,-4,1,11,0.125,-3,3,1001' hubble.csv || fail "lengths and masses over h: $(cat hubble.csv)"
fi

# Refused.
size=$(wc -c <g.dat)
for bytes in 20 200 270 300 "$((size / 2))" "$((size - 50))" "$((size - 1))"; do
    head -c "$bytes" g.dat >cut.dat
    refused cut.dat 'is truncated'
done
gadget2 write one.dat; head -c 640 one.dat | tail -c 380 >middle; { head -c 260 one.dat; printf 'xxxx'; tail -c +265 one.dat; } >marks.dat
refused marks.dat 'is damaged\|is truncated'
gadget2 write lambda.dat --lam 0.7;                 refused lambda.dat 'cosmological'
gadget2 write hubble.dat --h 0.7;                   refused hubble.dat 'cosmological'
refused middle 'HDF5'
printf '\211PNG\r\n\032\n\0\0\0\rIHDR' >picture.dat; refused picture.dat 'not an HDF5 file'
printf 'all that glitters\n' >words.txt;            refused words.txt 'x, y and z'
: >empty.txt;                                       refused empty.txt 'is empty'
mkdir folder.hdf5;                                  refused folder.hdf5 'is a folder'
printf '1 2 3\n' >three.txt;                        refused three.txt 'line 1' '3 columns'
printf '0.5 1 2 3 4 5 6\n0.5 1 2\n' >short.txt;     refused short.txt 'line 2'
printf '0.5 1 2 3 4 5 six\n' >word.txt;             refused word.txt 'line 1' 'six'
printf '0\n3\n0\n1 1 1 1 1 1 1 1\n' >less.inp;      refused less.inp 'promises 3 rows'
printf '0\n-3\n0\n1 1 1 1 1 1 1 1\n' >minus.inp;    refused minus.inp 'line 2: -3 is no number of rows'
printf 'abc\n1\n0\n1 1 1 1 1 1 1 1\n' >abc.inp;     refused abc.inp 'line 1'
printf 'id,x,y,z,m\n18446744073709551616,1,2,3,4\n' >large.csv; refused large.csv 'line 2' '64 bits'
printf 'x,y,z,species\n1,2,3,planet\n' >planet.csv; refused planet.csv 'planet'
printf 'x,y,z,m\n1,2,,3\n' >hole.csv;               refused hole.csv 'Coordinates'
finish
