"""Writes the detections of a cloud.ply of `matdb render` as what a radar would have measured: a CSV with our names, or
places and powers alone, as `numpy.savetxt` of somebody else's script writes them.

    python3 ply_to_csv.py cloud.ply cloud.csv
    python3 ply_to_csv.py cloud.ply scan.xyz
"""

import struct
import sys

TYPES = {"char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I", "float": "f", "double": "d"}
COLUMNS = {"chirp": "chirp", "x": "x_m", "y": "y_m", "z": "z_m", "range_m": "range_m", "power_dbm": "power_dbm"}

header, rows = open(sys.argv[1], "rb").read().split(b"end_header\n", 1)
lines = [line.split() for line in header.decode().splitlines()]
count = next(int(words[2]) for words in lines if words[:2] == ["element", "vertex"])
properties = [words[1:] for words in lines if words[0] == "property"]
row = struct.Struct("<" + "".join(TYPES[kind] for kind, _ in properties))

THEIRS = {"x": "X", "y": "Y", "z": "Z", "power_dbm": "Intensity"}
columns, form, mark = (THEIRS, ".18e", " ") if sys.argv[2].endswith(".xyz") else (COLUMNS, ".8g", ",")

with open(sys.argv[2], "w") as file:
    print(*columns.values(), sep=mark, file=file)
    for values in row.iter_unpack(rows[: count * row.size]):
        point = dict(zip((name for _, name in properties), values))
        print(*(format(point[name], form) for name in columns), sep=mark, file=file)
