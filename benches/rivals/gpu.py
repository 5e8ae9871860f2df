"""Rows of `cargo bench --features gpu --bench trace`: none where there is no GPU."""

import json

from programs import cargo

# A driver in software, as Vulkan names it.
SOFTWARE = "llvmpipe"


def measure(quick):
    found = rows("paper")
    if not found or found[0]["adapter"].startswith(SOFTWARE):
        return []
    return found if quick else rows()


def rows(*words):
    told = cargo("bench", "--features", "gpu", "--bench", "trace", "--", "json", *words)
    return [json.loads(line) for line in told.splitlines() if line.startswith("{")]
