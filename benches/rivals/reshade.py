"""Rows of `cargo bench --bench reshade`."""

import json

from programs import cargo


def measure():
    told = cargo("bench", "--bench", "reshade", "--", "json")
    return [json.loads(line) for line in told.splitlines() if line.startswith("{")]
