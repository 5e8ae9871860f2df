"""Labelled scans by matdb beside Embree and numpy doing the same, each on one core: `labelled.py --matdb matdb --scans 8`. With
`--json` matdb makes them on two cores, too.

Both make scans of `examples/datasets/torso.toml` with 64 rays a spot: they place the meshes, build a hierarchy, trace 18 529 spots to the
first surface and on behind the cloth, evaluate a law for each hit and the loss of the cloth, add up, draw speckle, label each chirp, and
write a table of points as Parquet and images as OpenEXR and PNG. The other one is what a user of numpy would write: it has one return a
chirp, a law of two lobes with few instructions for every material, and neither effects, waves nor checks.
"""

import argparse
import json
import os
import re
import resource
import subprocess
import tempfile
import time
from pathlib import Path

for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "RAYON_NUM_THREADS"):
    os.environ[name] = "1"

import numpy as np  # noqa: E402
import OpenEXR  # noqa: E402
import pyarrow as pa  # noqa: E402
import pyarrow.parquet as parquet  # noqa: E402
import trimesh  # noqa: E402
from embreex import rtcore_scene  # noqa: E402
from embreex.mesh_construction import TriangleMesh  # noqa: E402
from PIL import Image  # noqa: E402

EXAMPLES = Path(__file__).parents[2] / "examples" / "datasets"
RADAR = np.array([0.0, 1.1, 8.0])
RAYS, WAIST_M, PIXEL_M, LOOKS = 64, 0.0136, 0.005, 1
BODY, PLATE, SHIRT = range(3)


def specification(folder, scans):
    """The example with so many scans, of 64 rays a spot."""
    for name in ("torso.toml", "concealed.toml"):
        text = re.sub(r"^scans = .*", f"scans = {scans}\nscans_per_shard = {max(scans // 4, 1)}", (EXAMPLES / name).read_text(), flags=re.M)
        text = re.sub(r"^split = .*", "split = { train = 1.0 }", text, flags=re.M)
        (folder / name).write_text(re.sub(r"^rays = .*", f"rays = {RAYS}", text, flags=re.M))
    return folder / "concealed.toml"


def by_matdb(matdb, folder, scans, cores=1):
    """CPU seconds and seconds for each scan, without the plan."""
    made = folder / f"ds-{cores}"
    subprocess.run([matdb, "-q", "dataset", "plan", specification(folder, scans), "-o", made], check=True)
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    subprocess.run([matdb, "-q", "dataset", "run", made], check=True, env=os.environ | {"RAYON_NUM_THREADS": str(cores)})
    after, took_s = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic() - began
    # The first scan is made once more, to compare its bytes with those of the plan.
    cpu_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return [of_all / (scans + 1) for of_all in (cpu_s, took_s)]


def meshes(matdb, folder):
    """Body, plate and shirt, as vertices and facets."""
    scene = EXAMPLES / "torso.toml"
    subprocess.run([matdb, "-q", "render", scene, "--set", "spot.rays=1", "--set", "mesh.plate.translation_m=[0, 1.13, 0.14]",
                    "--glb", "-o", folder / "look"], check=True)
    found = trimesh.load(folder / "look" / "cloud.glb").geometry
    return [(np.array(found[name].vertices), np.array(found[name].faces)) for name in ("skin", "plate", "shirt")]


class Other:
    """The other program."""

    def __init__(self, parts, aims):
        self.parts, self.aims = parts, aims
        axes = np.append(aims, np.zeros((len(aims), 1)), axis=1) - RADAR
        self.axes = axes / np.linalg.norm(axes, axis=1, keepdims=True)
        share = (np.arange(RAYS) + 0.5) / RAYS
        turn = 2 * np.pi * ((np.arange(RAYS) * 0.618034) % 1)
        radius = 0.5 * WAIST_M * np.sqrt(-np.log1p(-share))
        self.spot = radius[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        theta = np.linspace(0, np.pi / 2, 361)
        self.passed_db = np.stack([theta, -0.6 / np.maximum(np.cos(theta), 0.1)])

    def make(self, number, folder):
        rng = np.random.default_rng(number)
        yaw = np.radians(rng.uniform(-15, 15))
        turn = np.array([[np.cos(yaw), 0, np.sin(yaw)], [0, 1, 0], [-np.sin(yaw), 0, np.cos(yaw)]])
        placed = [(points @ turn.T, facets) for points, facets in self.parts]
        starts = np.cumsum([0, *(len(points) for points, _ in placed)])
        points = np.concatenate([points for points, _ in placed])
        facets = np.concatenate([facets + start for (_, facets), start in zip(placed, starts)])
        part_of_facet = np.repeat(np.arange(3), [len(facets) for _, facets in placed])
        corners = points[facets].astype(np.float32)
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
        scene = rtcore_scene.EmbreeScene()
        TriangleMesh(scene, corners)

        right = np.cross(self.axes, [0.0, 1.0, 0.0])
        right /= np.linalg.norm(right, axis=1, keepdims=True)
        up = np.cross(right, self.axes)
        to = 8 * self.axes[:, None] + self.spot[:, :1] * right[:, None] + self.spot[:, 1:] * up[:, None]
        ways = (to / np.linalg.norm(to, axis=2, keepdims=True)).reshape(-1, 3).astype(np.float32)
        origins = np.broadcast_to(RADAR.astype(np.float32), ways.shape).copy()

        power, weighted, passed_db = np.zeros(len(ways)), np.zeros(len(ways)), np.zeros(len(ways))
        seen, deepest, depth = np.arange(len(ways)), np.full(len(ways), -1), np.full(len(ways), np.nan)
        gone = np.zeros(len(ways))
        for _ in range(2):
            hit = scene.run(origins, ways[seen], output=True)
            met = hit["geomID"] >= 0
            seen, facet, way = seen[met], hit["primID"][met], hit["tfar"][met].astype(float)
            gone[seen] += way
            cosine = np.abs(np.einsum("ij,ij->i", normals[facet], ways[seen]))
            f = 0.02 + 0.3 * np.exp(-(1 / np.maximum(cosine, 1e-3) ** 2 - 1) / 0.09) / np.maximum(cosine, 1e-3) ** 4
            echo = f * cosine * 10 ** (passed_db[seen] / 5) / gone[seen] ** 2
            power[seen] += echo
            weighted[seen] += echo * gone[seen]
            part = part_of_facet[facet]
            deepest[seen], depth[seen] = part, gone[seen]
            through = part == SHIRT
            passed_db[seen[through]] += np.interp(np.arccos(cosine[through]), *self.passed_db)
            origins = (RADAR + (gone[seen] + 1e-4)[:, None] * ways[seen])[through].astype(np.float32)
            seen = seen[through]
            gone[seen] += 1e-4

        spots = len(self.axes)
        mean = power.reshape(spots, RAYS).mean(axis=1)
        range_m = weighted.reshape(spots, RAYS).mean(axis=1) / np.maximum(mean, 1e-300) + 0.002 * rng.standard_normal(spots)
        measured = mean * rng.gamma(LOOKS, 1 / LOOKS, spots)
        instance, threat = deepest.reshape(spots, RAYS)[:, 0], (deepest.reshape(spots, RAYS) == PLATE).mean(axis=1)
        place = RADAR + range_m[:, None] * self.axes
        db = 10 * np.log10(np.maximum(measured, 1e-30))
        columns = {"chirp": np.arange(spots, dtype=np.int32), "xt_m": self.aims[:, 0], "yt_m": self.aims[:, 1], "x_m": place[:, 0],
                   "y_m": place[:, 1], "z_m": place[:, 2], "range_m": range_m, "power_dbm": db, "mean_power_dbm": 10 * np.log10(
                       np.maximum(mean, 1e-30)), "depth_m": depth.reshape(spots, RAYS)[:, 0], "threat_share": threat}
        table = pa.table({name: value.astype(np.float32) if value.dtype == float else value for name, value in columns.items()}
                         | {"instance": instance.astype(np.int16), "threat": instance == PLATE})
        parquet.write_table(table, folder / f"{number}.parquet", compression="zstd")
        self.images(number, folder, db, range_m, depth.reshape(spots, RAYS)[:, 0], instance)

    def images(self, number, folder, db, range_m, depth, instance):
        """Each pixel shows the nearest chirp within half a spot."""
        low = self.aims.min(axis=0)
        width, height = (np.ceil((self.aims.max(axis=0) - low) / PIXEL_M).astype(int) + 1)
        nearest, shown = np.full(width * height, np.inf), np.full(width * height, -1)
        column, row = ((self.aims - low) / PIXEL_M).round().astype(int).T
        for dx in range(-1, 2):
            for dy in range(-1, 2):
                at = [np.clip(column + dx, 0, width - 1), np.clip(row + dy, 0, height - 1)]
                away = np.hypot(low[0] + at[0] * PIXEL_M - self.aims[:, 0], low[1] + at[1] * PIXEL_M - self.aims[:, 1])
                pixel = at[1] * width + at[0]
                order = np.argsort(-away)
                pixel, away = pixel[order], away[order]
                closer = away < nearest[pixel]
                nearest[pixel[closer]], shown[pixel[closer]] = away[closer], order[closer]
        picture = lambda values: np.where(shown >= 0, values[shown], np.nan).reshape(height, width).astype(np.float32)  # noqa: E731
        header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
        for name, values in (("power", db), ("range", range_m), ("depth", depth)):
            with OpenEXR.File(header, {"Y": picture(values)}) as file:
                file.write(str(folder / f"{number}.{name}.exr"))
        mask = np.where(shown >= 0, instance[shown] + 1, 0).reshape(height, width).astype(np.uint16)
        Image.fromarray(mask).save(folder / f"{number}.instance.png")
        boxes = [np.argwhere(mask == one + 1) for one in (BODY, PLATE, SHIRT)]
        text = [[int(x) for x in (*box.min(axis=0), *box.max(axis=0))] if len(box) else None for box in boxes]
        (folder / f"{number}.json").write_text(json.dumps(text))


def by_other(matdb, folder, scans):
    """CPU seconds for each scan."""
    rows = parquet.read_table(min((folder / "ds-1" / "points").glob("*.parquet")), columns=["scan", "chirp", "xt_m", "yt_m"])
    rows = rows.to_pandas().query("scan == 0").drop_duplicates("chirp")
    other = Other(meshes(matdb, folder), rows[["xt_m", "yt_m"]].to_numpy(float))
    other.make(0, folder)
    start = time.process_time()
    for number in range(scans):
        other.make(number, folder)
    return (time.process_time() - start) / scans


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--matdb", default="matdb")
    parser.add_argument("--scans", type=int, default=8)
    parser.add_argument("--json", action="store_true", help="one line of JSON, with the time on two cores")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        matdb = os.path.abspath(options.matdb)
        own, took_s = by_matdb(matdb, folder, options.scans)
        other = by_other(matdb, folder, options.scans)
        if options.json:
            of_two_s = by_matdb(matdb, folder, options.scans, cores=2)[1]
            print(json.dumps({"scans": options.scans, "rays": RAYS, "matdb_cpu_s": own, "other_cpu_s": other, "s": [took_s, of_two_s]}))
            return
    print(f"matdb {own:.3f} CPU-s a scan, Embree and numpy {other:.3f}: x {other / own:.2f}")


if __name__ == "__main__":
    main()
