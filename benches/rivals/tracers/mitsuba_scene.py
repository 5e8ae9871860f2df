"""Mitsuba 3, LLVM variant, hits only: mitsuba_scene.py coherent|mixed THREADS MESH RAYS HITS."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import drjit as dr
import mitsuba as mi
import numpy as np

from files import NONE, read_mesh, read_rays, write_hits
from serve import serve, timed

order, threads, mesh, rays, hits = sys.argv[1:]
mi.set_variant("llvm_ad_rgb")
dr.set_thread_count(int(threads))
vertices, facets = read_mesh(mesh)
body = mi.Mesh("body", len(vertices), len(facets))
parameters = mi.traverse(body)
parameters["vertex_positions"] = vertices.astype(np.float32).ravel()
parameters["faces"] = facets.ravel()
parameters.update()
rays = read_rays(rays).astype(np.float32)
origins, directions = (mi.Vector3f(np.ascontiguousarray(part.T)) for part in (rays[:, :3], rays[:, 3:]))
rays = mi.Ray3f(mi.Point3f(origins), directions)
dr.eval(rays)
dr.sync_thread()
found = None


def build():
    # One body: there is nothing to load side by side or to merge.
    scene = mi.load_dict({"type": "scene", "body": body}, parallel=False, optimize=False)
    dr.sync_thread()
    return scene


def trace(scene):
    met = scene.ray_intersect_preliminary(rays, coherent=order == "coherent")
    dr.eval(met.t, met.prim_index)
    dr.sync_thread()
    return met


def turn():
    global found
    found = None
    build_ms, scene = timed(build)
    trace_ms, found = timed(lambda: trace(scene))
    return {"build": build_ms, "trace": trace_ms}


serve({"version": mi.__version__}, turn)
if found is not None:
    ranges_m = np.array(found.t)
    write_hits(hits, np.where(np.isfinite(ranges_m), np.array(found.prim_index), NONE), ranges_m)
