"""Open3D reads a mesh: open3d_ply.py FILE."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import open3d as o3d

from serve import serve, timed


def turn():
    ms, mesh = timed(lambda: o3d.io.read_triangle_mesh(sys.argv[1]))
    return {"ms": ms, "facets": len(mesh.triangles)}


serve({"version": o3d.__version__}, turn)
