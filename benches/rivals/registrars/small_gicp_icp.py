"""small_gicp: small_gicp_icp.py ICP|PLANE_ICP|GICP THREADS FOLDER."""

import sys
from importlib.metadata import version
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import small_gicp

from registrars import clouds
from serve import serve, timed

kind, threads, folder = sys.argv[1:]
measured, virtual = clouds.read(folder)


def register():
    return small_gicp.align(
        virtual[:, :3], measured, registration_type=kind, downsampling_resolution=1e-4,
        max_correspondence_distance=clouds.REACH_M, max_iterations=clouds.STEPS, num_threads=int(threads),
    )


def turn():
    ms, found = timed(register)
    return {"ms": ms, "pose": found.T_target_source.tolist()}


serve({"version": version("small_gicp")}, turn)
