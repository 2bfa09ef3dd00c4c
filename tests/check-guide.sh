#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The module of doc/hacking.md compiles against the frame as it stands.
. "$TEPHRA_SOURCE/tests/lib.sh"
awk '/^```c$/ { on = 1; next } /^```$/ { on = 0 } on' "$TEPHRA_SOURCE/doc/hacking.md" >module.c
lines=$(wc -l <module.c)
[ "$lines" -gt 20 ] || fail "no module found in doc/hacking.md"
${CC:-cc} -std=gnu17 -Wall -Wextra -Werror -I"$TEPHRA_SOURCE/src" -c module.c -o module.o || fail "it does not compile"
finish
