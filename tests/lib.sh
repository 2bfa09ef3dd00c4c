# SPDX-License-Identifier: GPL-3.0-or-later
# For the tests of the command line: a scratch folder, and expectations with messages.
set -u
PATH=$TEPHRA_BUILD:$PATH
export OMPI_MCA_mpi_yield_when_idle=1   # ranks that wait leave the cores to those that work
scratch=$(mktemp -d "${TMPDIR:-/tmp}/tephra-test.XXXXXX") || exit 99
trap 'rm -rf "$scratch"' EXIT
cd "$scratch" || exit 99
failures=0

fail() { echo "FAIL: $*"; failures=$((failures + 1)); }
# expect_status STATUS COMMAND...: standard output and error are left in the files out_text and err.
expect_status() {
    wanted=$1; shift
    "$@" >out_text 2>err; got=$?
    [ "$got" -eq "$wanted" ] || { fail "exit status $got, not $wanted: $*"; tail -n 5 err; }
}
expect_text() { grep -q -e "$1" "$2" || { fail "\"$1\" is not said in: $(head -n 3 "$2")"; }; }
# same A B: two HDF5 files hold the same numbers, bit for bit.
same() { tephra compare "$1" "$2" >out_text 2>err || { fail "$1 and $2 differ"; head -n 12 out_text; }; }
finish() { [ "$failures" -eq 0 ] || exit 1; echo "all as expected"; exit 0; }
