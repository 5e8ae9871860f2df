"""What a page says of the machine, the day and the state of the crate."""

import datetime
import os
import platform
import subprocess
from pathlib import Path

from programs import ROOT

# What may be another for parts that were measured in another run.
RUN = ["cpu", "date", "commit", "load_before"]
FEATURES = ["avx512f", "avx2", "fma", "neon", "asimd"]


def describe():
    about = cpu()
    return {
        "cpu": about.get("model name", platform.processor() or platform.machine()),
        "family": " ".join(about[key] for key in ("cpu family", "model") if key in about),
        "architecture": platform.machine(),
        "cores": len(os.sched_getaffinity(0)),
        "features": [feature for feature in FEATURES if feature in about.get("flags", "").split()],
        "memory_gb": round(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e9),
        "system": f"{platform.system()} {platform.release().split('-')[0]}",
        "date": datetime.date.today().isoformat(),
        "commit": said("git", "rev-parse", "--short=12", "HEAD") + "+" * bool(changes()),
        "rustc": said("rustc", "--version"),
        "load_before": round(os.getloadavg()[0], 2),
    }


def changes():
    """Whether the sources differ from the commit."""
    sources = ["src", "benches", "examples", "Cargo.toml", "Cargo.lock", ":!benches/rivals/results.json"]
    return said("git", "status", "--porcelain", "--", *sources)


def cpu():
    try:
        lines = Path("/proc/cpuinfo").read_text().split("\n\n")[0].splitlines()
    except OSError:
        return {}
    pairs = (line.split(":", 1) for line in lines if ":" in line)
    return {key.strip(): value.strip() for key, value in pairs}


def said(*command):
    try:
        return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return ""
