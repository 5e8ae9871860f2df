"""Commands that start a tracer on the files of a workload; one function for each program."""

import subprocess
import sys
from pathlib import Path

from programs import Missing, example

HERE = Path(__file__).resolve().parent


def matdb(files, workload, threads):
    """The pinhole, where rays share their origin, and the hierarchy; rays in the order of the scan."""
    ways = ["pinhole", "bvh"] if workload.is_coherent else ["bvh"]
    names = {"pinhole": "matdb pinhole", "bvh": "matdb hierarchy"}
    command = lambda way: example("trace_speed", way, files.mesh, files.rays, files.hits(names[way]))
    return {names[way]: command(way) for way in ways}


def embree(files, workload, threads):
    """Compiled once for each run."""
    program = files.folder / "embree"
    flags = ["-O3", "-march=native", "-fopenmp"]
    command = ["cc", *flags, str(HERE / "embree.c"), "-o", str(program), "-lembree3", "-lm"]
    kinds = [("low", "plain"), ("medium", "plain")] + [("medium", "robust")] * workload.robust
    name = lambda quality, flag: f"Embree, {quality} build" + ", robust" * (flag == "robust")
    if not program.exists():
        try:
            subprocess.run(command, check=True, capture_output=True)
        except (OSError, subprocess.CalledProcessError):
            missing = Missing("not installed: embree.c needs a C compiler with OpenMP and libembree-dev")
            return {name(*kind): missing for kind in kinds}
    rays = "coherent" if workload.is_coherent else "mixed"
    start = lambda kind: [
        str(program), *kind, rays, str(threads), str(files.mesh), str(files.sorted), str(files.hits(name(*kind)))
    ]
    return {name(*kind): start(kind) for kind in kinds}


def open3d(files, workload, threads):
    name = "Open3D"
    words = [threads, files.mesh, files.sorted, files.hits(name)]
    return {name: [sys.executable, *map(str, [HERE / "open3d_scene.py", *words])]}


def mitsuba(files, workload, threads):
    name = "Mitsuba, LLVM"
    rays = "coherent" if workload.is_coherent else "mixed"
    words = [rays, threads, files.mesh, files.sorted, files.hits(name)]
    return {name: [sys.executable, *map(str, [HERE / "mitsuba_scene.py", *words])]}


ALL = [matdb, embree, open3d, mitsuba]
