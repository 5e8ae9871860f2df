"""Writes the detections of a cloud.ply of `matdb render` as a CSV of what a radar would have measured.

    python3 ply_to_csv.py cloud.ply cloud.csv
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

with open(sys.argv[2], "w") as file:
    print(*COLUMNS.values(), sep=",", file=file)
    for values in row.iter_unpack(rows[: count * row.size]):
        point = dict(zip((name for _, name in properties), values))
        print(*(f"{point[name]:.8g}" for name in COLUMNS), sep=",", file=file)
