"""Rows of `cargo bench --bench diagnose`."""

import json

from programs import cargo


def measure():
    told = cargo("bench", "--bench", "diagnose", "--", "json")
    return [json.loads(line) for line in told.splitlines() if line.startswith("{")]
