"""The sets of cases of the two studies. A seed draws cases of its own, and so does each set."""

import numpy as np

import effects
import generate
from generate import Plan

SPECKLES = ("independent", "8", "13.6", "19.2")
# A spot has a mean power of its own, which only these effects change as they should.
BESIDE_A_SPOT = {"drift", "fov-gain", "noise-floor", "speckle"}
# Only one of a pair can move the target; and the second surface of a bounce stays where it is.
MOVING = {"motion", "multi-bounce", "pose"}


def half(n):
    """Independent and shared speckle by turns, on every target alike, of which there are six."""
    return ("independent", "13.6")[(n + n // 6) % 2]


def complete(speckle):
    return lambda n, number, seed: Plan(number, seed, speckle=speckle)


def twice(n, number, seed):
    """The same places again: at once, ellipse by ellipse, or in a second scan."""
    return Plan(number, seed, speckle="13.6", scan=("ellipses-twice", "scan-twice")[n // 6 % 2])


def long(n, number, seed):
    return Plan(number, seed, speckle="13.6", scan="long")


def single(strength):
    """Three cases of each effect in a row."""
    return lambda n, number, seed: Plan(number, seed, (effects.KNOWN[n // 3 % len(effects.KNOWN)],), strength, half(n))


def pair(n, number, seed):
    """Two different effects that both get strong on one target, drawn at random."""
    rng = np.random.default_rng([seed, number, 76])
    while True:
        both = generate.in_order(rng.choice(effects.KNOWN, 2, replace=False).tolist())
        plan = Plan(number, seed, both)
        spoilt = MOVING.issuperset(both) or ("finite-spot" in both and not BESIDE_A_SPOT.intersection(both))
        if not spoilt and any(generate.reaches(name, plan) for name in generate.allowed(plan)):
            return plan


def unknown(n, number, seed):
    """Six of a kind in a row, one on each target."""
    return Plan(number, seed, generate.labels_of("unknown", n // 6), speckle=half(n))


# Part, set, number of cases, and what makes the plan of one from its place in the set, its number and the seed.
SETS = [
    *(("alarms", f"alarms-{s}", 120, complete(s)) for s in SPECKLES),
    ("alarms", "alarms-twice", 120, twice),
    ("alarms", "alarms-long", 24, long),
    *(("mitsuba", s, 3 * len(effects.KNOWN), single(s)) for s in ("strong", "moderate", "weak")),
    ("mitsuba", "pairs", 24, pair),
    ("mitsuba", "unknown", 24, unknown),
    *(("mitsuba", f"complete-{s}", 12, complete(s)) for s in SPECKLES),
]


def cases(index, count):
    """Place in the set and number of each of its first cases. No two sets share a number, and thus no draws."""
    return [(n, 1000 * index + n) for n in range(min(count, SETS[index][2]))]
