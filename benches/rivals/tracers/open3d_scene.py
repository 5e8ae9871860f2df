"""Open3D's RaycastingScene: open3d_scene.py THREADS MESH RAYS HITS."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
import open3d as o3d

from files import NONE, read_mesh, read_rays, write_hits
from serve import serve, timed

threads, mesh, rays, hits = sys.argv[1:]
threads = int(threads)
vertices, facets = read_mesh(mesh)
vertices = o3d.core.Tensor(vertices.astype(np.float32))
facets = o3d.core.Tensor(facets)
rays = o3d.core.Tensor(read_rays(rays).astype(np.float32))
found = None


def build():
    scene = o3d.t.geometry.RaycastingScene(nthreads=threads)
    scene.add_triangles(vertices, facets)
    # It is built for the first ray.
    scene.cast_rays(rays[:1], nthreads=threads)
    return scene


def turn():
    global found
    found = None
    build_ms, scene = timed(build)
    trace_ms, found = timed(lambda: scene.cast_rays(rays, nthreads=threads))
    return {"build": build_ms, "trace": trace_ms}


serve({"version": o3d.__version__}, turn)
if found is not None:
    ranges_m, met = found["t_hit"].numpy(), found["primitive_ids"].numpy()
    write_hits(hits, np.where(np.isfinite(ranges_m), met, NONE), ranges_m)
