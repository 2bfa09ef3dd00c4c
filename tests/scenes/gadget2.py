#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes and reads GADGET-2 binary files with nothing but `struct`, for tests/check-formats.sh.

gadget2.py write FILE --format 1|2 --order '<'|'>' --float f|d --id I|Q
gadget2.py read FILE: the numbers of each block, one row a line"""
import argparse
import struct

GAS, HALO = 3, 2      # rows; those of the halo have their mass in the header


def rows():
    """Position, velocity, id, mass, u of each: all different."""
    for i in range(GAS + HALO):
        yield ([i + 0.25, -2.0 * i, 0.5], [10.0 + i, 0.125 * i, -3.0], 100 - i, 0.5 + i, 1000.0 + i)


def record(order, label, form, data):
    mark = struct.pack(order + "I", len(data))
    head = b""
    if form == 2:
        eight = struct.pack(order + "I", 8)
        head = eight + label + struct.pack(order + "I", len(data) + 8) + eight
    return head + mark + data + mark


def write(a):
    o, f = a.order, a.float
    count = [GAS, HALO, 0, 0, 0, 0]
    head = struct.pack(o + "6i6ddd2i6I2i4d", *count, 0, 7.5, 0, 0, 0, 0, 0.125, 0, 0, 0, *count, 0, 1, 0, 0, a.lam, a.h)
    head += bytes(256 - len(head))
    all_rows = list(rows())
    flat = lambda k: [x for r in all_rows for x in r[k]]
    blocks = [
        (b"HEAD", head), (b"POS ", struct.pack(f"{o}{3 * len(all_rows)}{f}", *flat(0))),
        (b"VEL ", struct.pack(f"{o}{3 * len(all_rows)}{f}", *flat(1))),
        (b"ID  ", struct.pack(f"{o}{len(all_rows)}{a.id}", *[r[2] for r in all_rows])),
        (b"MASS", struct.pack(f"{o}{GAS}{f}", *[r[3] for r in all_rows[:GAS]])),
        (b"U   ", struct.pack(f"{o}{GAS}{f}", *[r[4] for r in all_rows[:GAS]]))]
    if a.format == 2:   # of no use to the program, and in the middle
        blocks.insert(4, (b"POT ", struct.pack(f"{o}{len(all_rows)}{f}", *range(len(all_rows)))))
    with open(a.file, "wb") as out:
        for label, data in blocks:
            out.write(record(o, label, a.format, data))


def read(a):
    data = open(a.file, "rb").read()
    at, label, names = 0, None, iter(["HEAD", "POS", "VEL", "ID", "MASS", "U", "RHO", "HSML"])
    while at < len(data):
        n, = struct.unpack_from("<I", data, at)
        body = data[at + 4:at + 4 + n]
        assert struct.unpack_from("<I", data, at + 4 + n)[0] == n
        at += n + 8
        if n == 8 and body[:4].strip().isalpha():
            label = body[:4].decode().strip()
            continue
        name = label or next(names)
        label = None
        if name == "HEAD":
            print("HEAD", *struct.unpack_from("<6i", body), struct.unpack_from("<d", body, 72)[0])
        else:
            print(name, *struct.unpack("<%d%s" % (n // 4, "I" if name == "ID" else "f"), body))


p = argparse.ArgumentParser()
p.add_argument("what", choices=["write", "read"])
p.add_argument("file")
p.add_argument("--format", type=int, default=1)
p.add_argument("--order", default="<")
p.add_argument("--float", default="f")
p.add_argument("--id", default="I")
p.add_argument("--lam", type=float, default=0)
p.add_argument("--h", type=float, default=1)
args = p.parse_args()
(write if args.what == "write" else read)(args)
