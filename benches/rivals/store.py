"""Rows of `cargo bench --bench store -- 100000 publish`."""

import json

from programs import cargo

MATERIALS, QUICK_MATERIALS = 100_000, 1000


def measure(quick):
    number = QUICK_MATERIALS if quick else MATERIALS
    told = cargo("bench", "--bench", "store", "--", str(number), "publish", "json")
    return [json.loads(line) for line in told.splitlines() if line.startswith("{")]
