"""Times of reading a binary PLY mesh of a million triangles and of writing an OpenEXR picture."""

import sys
from pathlib import Path

import numpy as np

from programs import alternate, end, example, start
from spread import spread
from workloads import ball

HERE = Path(__file__).resolve().parent
SIDE, CHANNELS = 1024, 7
FACETS = 10**6
THREADS = 2


def measure(folder, quick):
    """Rows, one for each file and program."""
    folder = Path(folder)
    ply, floats = folder / "ball.ply", folder / "picture.f32"
    write_ply(ply, *ball(FACETS))
    picture().tofile(floats)
    python = lambda script, *words: [sys.executable, *map(str, [HERE / "fileio" / script, *words])]
    works = {
        "read PLY": {
            "matdb": example("file_speed", "ply", ply),
            "Open3D": python("open3d_ply.py", ply),
        },
        "write EXR": {
            "matdb": example("file_speed", "exr", floats, folder / "ours.exr"),
            "Mitsuba": python("mitsuba_exr.py", floats, folder / "theirs.exr"),
        },
        "write EXR, uncompressed": {
            "matdb": example("file_speed", "exr", floats, folder / "plain.exr", "uncompressed"),
        },
    }
    rows = []
    for work, commands in works.items():
        running, _, missing = start(commands, THREADS)
        answers = alternate(running, missing, 3 if quick else 15, 20)
        end(running, missing)
        for name in commands:
            row = {"work": work, "program": name, "threads": THREADS}
            if name in missing:
                rows.append(row | {"missing": missing[name]})
                continue
            row["ms"] = spread([answer["ms"] for answer in answers[name]])
            rows.append(row | {key: value for key, value in answers[name][-1].items() if key != "ms"})
    return rows


def write_ply(path, vertices, facets):
    rows = np.empty(len(facets), [("corners", "u1"), ("corner", "<i4", 3)])
    rows["corners"], rows["corner"] = 3, facets
    with open(path, "wb") as file:
        file.write(
            b"ply\nformat binary_little_endian 1.0\n"
            b"element vertex %d\nproperty float x\nproperty float y\nproperty float z\n"
            b"element face %d\nproperty list uchar int vertex_indices\nend_header\n" % (len(vertices), len(facets))
        )
        vertices.astype("<f4").tofile(file)
        rows.tofile(file)


def picture():
    """As power images are: smooth, with noise, and nothing beside the target."""
    random = np.random.default_rng(3)
    y, x = np.mgrid[-1:1:SIDE * 1j, -1:1:SIDE * 1j]
    channels = np.empty((CHANNELS, SIDE, SIDE), "<f4")
    for number in range(CHANNELS):
        smooth = -60 - 20 * np.hypot(x, y) + np.sin((number + 3) * x) * np.cos((number + 5) * y)
        channels[number] = smooth + 0.5 * random.standard_normal((SIDE, SIDE))
    channels[:, np.hypot(x, y) > 0.6] = np.nan
    return channels
