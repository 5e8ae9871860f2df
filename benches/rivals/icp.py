"""Times registrations by matdb, Open3D and small_gicp from one wrong pose; see README.md beside this file."""

import json
import sys
import tempfile
from pathlib import Path

import numpy as np

from programs import alternate, build, end, example, start
from spread import spread

HERE = Path(__file__).resolve().parent
OURS = "matdb, whole"


def rivals(folder, threads):
    python = lambda script, *words: [sys.executable, str(HERE / "registrars" / script), *words, str(folder)]
    gicp = lambda kind: python("small_gicp_icp.py", kind, str(threads))
    return {
        "Open3D point to point": python("open3d_icp.py", "Point"),
        "Open3D point to plane": python("open3d_icp.py", "Plane"),
        "small_gicp ICP": gicp("ICP"),
        "small_gicp plane ICP": gicp("PLANE_ICP"),
        "small_gicp GICP": gicp("GICP"),
    }


def measure(folder, quick):
    """Rows, one for each number of threads and program; and versions."""
    rows, versions = [], {}
    for threads in [1, 2]:
        # The clouds are there once it is ready.
        running, _, missing = start({OURS: example("icp_speed", folder)}, threads)
        if missing:
            rows.append({"threads": threads, "program": OURS, "missing": missing[OURS]})
            continue
        others, about, absent = start(rivals(folder, threads), threads)
        running, missing = running | others, missing | absent
        answers = alternate(running, missing, 3 if quick else 11, 30)
        end(running, missing)
        versions |= {name.split()[0]: of["version"] for name, of in about.items()}
        for name, why in missing.items():
            rows.append({"threads": threads, "program": name, "missing": why})
        rows += [{"threads": threads, "program": name} | row(answers[name], folder) for name in running]
    return rows, versions


def row(answers, folder):
    last = answers[-1]
    if "pose" in last:
        shift_mm, turn_deg = error(np.array(last["pose"]), Path(folder))
    else:
        shift_mm, turn_deg = last["shift_mm"], last["turn_deg"]
    found = {"ms": spread([answer["ms"] for answer in answers]), "shift_mm": shift_mm, "turn_deg": turn_deg}
    return found | {"points": last["points"]} if "points" in last else found


def error(transformation, folder):
    """What is left of the push after the measured points were moved back onto the pushed mesh."""
    push = json.loads((folder / "push.json").read_text())
    middle = np.loadtxt(folder / "measured.xyz").mean(0)
    wanted = np.eye(4)
    wanted[:3, :3], wanted[:3, 3] = push["rotation"], push["shift_m"]
    left = transformation @ np.linalg.inv(wanted)
    pushed = wanted[:3, :3] @ middle + wanted[:3, 3]
    shift_mm = 1e3 * np.linalg.norm(left[:3, :3] @ pushed + left[:3, 3] - pushed)
    cos = np.clip((np.trace(left[:3, :3]) - 1) / 2, -1, 1)
    return float(shift_mm), float(np.degrees(np.arccos(cos)))


def main():
    build("icp_speed")
    with tempfile.TemporaryDirectory() as folder:
        for found in measure(folder, quick=False)[0]:
            print(found)


if __name__ == "__main__":
    main()
