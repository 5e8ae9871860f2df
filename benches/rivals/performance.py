"""Measures matdb beside its rivals and writes docs/performance.md; see README.md beside this file.

    performance.py [--quick] [--only PART ...] [--page-only] [--results FILE] [--page FILE]
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
import traceback
from pathlib import Path

import machine
from page import page
from programs import ROOT, build, cargo

HERE = Path(__file__).resolve().parent
PARTS = ["trace", "reshade", "registration", "fits", "render", "formats", "diagnosis", "datasets", "store", "gpu"]


def main():
    options = arguments()
    if not options.page_only:
        measured = measure(options)
        options.results.write_text(json.dumps(measured, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    results = json.loads(options.results.read_text(encoding="utf-8"))
    options.page.write_text(page(results), encoding="utf-8")


def arguments():
    parser = argparse.ArgumentParser(description="Measures matdb beside its rivals.")
    parser.add_argument("--quick", action="store_true", help="few turns and small sizes, to see that all runs")
    parser.add_argument("--only", nargs="+", choices=PARTS, help="parts to measure; others stay as stored")
    parser.add_argument("--page-only", action="store_true", help="write the page from the stored results")
    parser.add_argument("--results", type=Path, default=HERE / "results.json")
    parser.add_argument("--page", type=Path, default=ROOT / "docs/performance.md")
    return parser.parse_args()


def measure(options):
    say("build")
    build("trace_speed", "file_speed", "fit_speed", "icp_speed")
    cargo("bench", "--no-run", "--bench", "store", "--bench", "reshade", "--bench", "diagnose")
    found = {"schema": 1, "quick": options.quick, "machine": machine.describe()}
    found |= {"versions": {}, "failed": {}, "parts": {}} | kept(options)
    run = {key: found["machine"][key] for key in machine.RUN}
    began = time.monotonic()
    for part in options.only or PARTS:
        say(part)
        found["failed"].pop(part, None)
        part_began = time.monotonic()
        with tempfile.TemporaryDirectory(prefix="rivals-") as folder:
            try:
                found[part], versions = measured(part, folder, options.quick)
                found["versions"] |= versions
            except Exception as reason:  # one part's failure leaves the others
                traceback.print_exc()
                found.pop(part, None)
                found["failed"][part] = said(reason)
        found["parts"][part] = run | {"minutes": minutes_since(part_began)}
    return found | {"minutes": minutes_since(began)}


def kept(options):
    """What stays of the stored results."""
    if not options.only or not options.results.exists():
        return {}
    stored = json.loads(options.results.read_text(encoding="utf-8"))
    kept = {key: stored[key] for key in ["versions", "failed", "parts", *PARTS] if key in stored}
    return kept | {"quick": options.quick or stored["quick"]}


def minutes_since(began):
    return round((time.monotonic() - began) / 60, 1)


def measured(part, folder, quick):
    """The results of a part, and versions of what took part."""
    # Modules need packages that writing the page alone does not.
    if part == "trace":
        import tracing

        return tracing.measure(folder, quick, say)
    if part == "reshade":
        import reshade

        return reshade.measure(), {}
    if part == "registration":
        import icp

        return icp.measure(folder, quick)
    if part == "fits":
        import fits

        return fits.measure(folder, quick)
    if part == "render":
        import rendering

        return rendering.measure(folder, quick), {}
    if part == "formats":
        import formats

        return formats.measure(folder, quick), {}
    if part == "diagnosis":
        import diagnosis

        return diagnosis.measure(), {}
    if part == "datasets":
        import datasets

        return datasets.measure(quick), {}
    if part == "gpu":
        import gpu

        return gpu.measure(quick), {}
    import store

    return store.measure(quick), {}


def said(reason):
    """Without the paths of this machine."""
    if isinstance(reason, subprocess.CalledProcessError):
        return f"`{Path(reason.cmd[0]).name} {reason.cmd[1]}` failed"
    return f"{type(reason).__name__}: {reason}"


def say(what):
    print(time.strftime("%H:%M:%S"), what, file=sys.stderr, flush=True)


if __name__ == "__main__":
    main()
