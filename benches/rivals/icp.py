"""Times registrations by matdb, Open3D and small_gicp from one wrong pose; see README.md beside this file."""

import json
import subprocess
import tempfile
import time
from pathlib import Path
from statistics import median

import numpy as np
import open3d
import small_gicp

REPEATS = 11
REACH_M = 0.1
STEPS = 60


def crate(folder):
    command = ["cargo", "run", "--release", "--quiet", "--example", "icp_speed", "--", str(folder)]
    root = Path(__file__).resolve().parents[2]
    return json.loads(subprocess.run(command, check=True, capture_output=True, cwd=root).stdout)


def cloud(points, normals=None):
    made = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
    if normals is not None:
        made.normals = open3d.utility.Vector3dVector(normals)
    return made


def by_open3d(measured, virtual, method):
    """The measured cloud onto the virtual one; times what a user repeats for each pose."""
    target = cloud(virtual[:, :3], virtual[:, 3:])
    criteria = open3d.pipelines.registration.ICPConvergenceCriteria(1e-9, 1e-9, STEPS)
    found = open3d.pipelines.registration.registration_icp(
        cloud(measured), target, REACH_M, np.eye(4), method, criteria
    )
    return found.transformation


def by_small_gicp(measured, virtual, kind, threads):
    found = small_gicp.align(
        virtual[:, :3], measured, registration_type=kind, downsampling_resolution=1e-4,
        max_correspondence_distance=REACH_M, max_iterations=STEPS, num_threads=threads,
    )
    return found.T_target_source


def error(transformation, push, middle):
    """What is left of the push after the measured points were moved back onto the pushed mesh."""
    wanted = np.eye(4)
    wanted[:3, :3], wanted[:3, 3] = push["rotation"], push["shift_m"]
    left = transformation @ np.linalg.inv(wanted)
    pushed = wanted[:3, :3] @ middle + wanted[:3, 3]
    shift_mm = 1e3 * np.linalg.norm(left[:3, :3] @ pushed + left[:3, 3] - pushed)
    cos = np.clip((np.trace(left[:3, :3]) - 1) / 2, -1, 1)
    return shift_mm, np.degrees(np.arccos(cos))


def main():
    with tempfile.TemporaryDirectory() as folder:
        own = crate(folder)
        measured = np.loadtxt(Path(folder) / "measured.xyz")
        virtual = np.loadtxt(Path(folder) / "virtual.xyz")
        push = json.loads((Path(folder) / "push.json").read_text())
        again = crate(folder)
    icp = open3d.pipelines.registration
    rivals = {
        "Open3D point to point": lambda: by_open3d(
            measured, virtual, icp.TransformationEstimationPointToPoint()
        ),
        "Open3D point to plane": lambda: by_open3d(
            measured, virtual, icp.TransformationEstimationPointToPlane()
        ),
        "small_gicp ICP": lambda: by_small_gicp(measured, virtual, "ICP", own["threads"]),
        "small_gicp plane ICP": lambda: by_small_gicp(measured, virtual, "PLANE_ICP", own["threads"]),
        "small_gicp GICP": lambda: by_small_gicp(measured, virtual, "GICP", own["threads"]),
    }
    times_ms = {name: [] for name in rivals}
    found = {}
    for _ in range(REPEATS):
        for name, run in rivals.items():
            began = time.perf_counter()
            found[name] = run()
            times_ms[name].append(1e3 * (time.perf_counter() - began))
    own_ms = 0.5 * (own["ms"] + again["ms"])
    print(f"{own['points']} measured points, {len(virtual)} virtual, {own['threads']} threads")
    print(f"{'':24} {'ms':>8} {'ratio':>6} {'mm off':>8} {'deg off':>8}")
    print(f"{'matdb, whole':24} {own_ms:8.1f} {1:6.2f} {own['shift_mm']:8.3f} {own['turn_deg']:8.4f}")
    for name, times in times_ms.items():
        shift_mm, turn_deg = error(found[name], push, measured.mean(0))
        print(f"{name:24} {median(times):8.1f} {median(times) / own_ms:6.2f} {shift_mm:8.3f} {turn_deg:8.4f}")


if __name__ == "__main__":
    main()
