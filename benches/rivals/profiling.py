"""Where the time goes: functions by their share of all samples, by `perf record` on one thread.

    profiling.py [WORK ...]

What the compiler put into its callers counts as these. Linux with `perf`; see README.md beside this file.
"""

import argparse
import os
import subprocess
import tempfile
from pathlib import Path

from fitters import curve
from programs import ROOT, TARGET, build, example
from words import table
from workloads import Files, Workload

LEAST_PERCENT = 1
PROGRAM = TARGET / "matdb"
# One run is over before there are many samples.
TEN_TIMES = ["sh", "-c", 'for turn in 0 1 2 3 4 5 6 7 8 9; do "$0" "$@"; done']


def main():
    wanted = arguments()
    build("trace_speed", "fit_speed", "icp_speed")
    for name in wanted:
        with tempfile.TemporaryDirectory(prefix="profile-") as folder:
            command, turns = WORKS[name](Path(folder))
            print(f"## {name}\n\n{table(['%', 'function'], shares(command, turns, folder), right='%')}")


def arguments():
    parser = argparse.ArgumentParser(description="Tells where the time goes.")
    parser.add_argument("works", nargs="*", metavar="WORK", help=", ".join(WORKS))
    wanted = parser.parse_args().works
    unknown = [name for name in wanted if name not in WORKS]
    if unknown:
        parser.error(f"there is no {unknown[0]}; there are {', '.join(WORKS)}")
    return wanted or list(WORKS)


def trace(way, rays, turns):
    def of(folder):
        files = Files(folder, Workload(rays, "body", rays, turns, 0))
        return example("trace_speed", way, files.mesh, files.rays, files.hits("ours")), turns

    return of


def fits(folder):
    curve.write(folder / "curve.csv")
    return example("fit_speed", folder / "curve.csv"), 50


def render(folder):
    return [*TEN_TIMES, str(PROGRAM), "--quiet", "render", str(ROOT / "scenes/mannequin.toml"), "-o", str(folder / "out")], 0


WORKS = {
    "scan": trace("pinhole", "paper", 500),
    "power": lambda folder: (example("trace_speed", "power"), 500),
    "million": trace("pinhole", 10**6, 20),
    "hierarchy": trace("bvh", "paper", 100),
    "second": trace("bvh", "second", 40),
    "render": render,
    "registration": lambda folder: (example("icp_speed", folder), 50),
    "fits": fits,
}


def shares(command, turns, folder):
    """Percent and name, the largest first."""
    data = f"{folder}/perf.data"
    environment = {name: value for name, value in os.environ.items() if name != "MATDB"} | {"RAYON_NUM_THREADS": "1"}
    subprocess.run(
        ["perf", "record", "--quiet", "--output", data, "--", *command], check=True, cwd=folder, env=environment,
        input="\n" * turns, text=True, stdout=subprocess.DEVNULL,
    )
    report = ["perf", "report", "--stdio", "--fields", "overhead,symbol", "--percent-limit", str(LEAST_PERCENT)]
    told = subprocess.run([*report, "--input", data], check=True, capture_output=True, text=True).stdout
    for line in told.splitlines():
        if line.strip() and not line.startswith("#"):
            percent, _, function = line.split(maxsplit=2)
            yield [percent.rstrip("%"), f"`{function.strip()}`"]


if __name__ == "__main__":
    main()
