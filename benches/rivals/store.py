"""Rows of `cargo bench --bench store`."""

import json
import subprocess

from programs import ROOT

MATERIALS, QUICK_MATERIALS = 100_000, 1000


def measure(quick):
    number = QUICK_MATERIALS if quick else MATERIALS
    command = ["cargo", "bench", "--quiet", "--bench", "store", "--", str(number), "json"]
    told = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout
    return [json.loads(line) for line in told.splitlines() if line.startswith("{")]
