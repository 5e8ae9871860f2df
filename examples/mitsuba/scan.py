"""The scan: a spinning ellipse that a slow tilt carries upwards, as (1) and Sec. II-B of the paper describe it."""

from typing import NamedTuple

import numpy as np

from targets import CENTRE

DURATION_S = 3.7
ORIGIN = CENTRE + np.array([0, 0, 8.0])  # centre of the main reflector


class Pattern(NamedTuple):
    chirps: int
    turns: int
    twice: str = ""  # what is run twice, so that the same places are met again: an "ellipse" or the "scan"


PATTERNS = {
    "once": Pattern(4600, 40),
    "ellipses-twice": Pattern(4600, 40, "ellipse"),
    "scan-twice": Pattern(4600, 40, "scan"),
    "long": Pattern(18_529, 80),  # the paper's number of chirps
}


def aims(pattern="once"):
    """x_t and y_t of every chirp, m, and its time, s."""
    chirps, turns, twice = PATTERNS[pattern]
    share = (np.arange(chirps) + 0.5) / chirps
    phase = 2 * np.pi * turns * share
    tilt = share
    if twice == "ellipse":  # the tilt waits for every other turn
        tilt = (np.floor(turns / 2 * share) + 0.5) / (turns / 2)
    elif twice == "scan":
        tilt = 2 * share % 1
    x = 0.25 * np.cos(phase)
    y = 0.20 * np.sin(phase) + 0.50 * (tilt - 0.5)
    return np.stack([x, y], -1), share * DURATION_S


def grid(step=0.005):
    """Axes of the raster in the target plane that effects of shape and motion look up."""
    return np.arange(-0.29, 0.2901, step), np.arange(-0.49, 0.4901, step)


def directions(aim):
    """Unit directions from the main reflector through points of the target plane."""
    point = np.concatenate([aim, np.zeros((len(aim), 1))], 1) + CENTRE
    d = point - ORIGIN
    return d / np.linalg.norm(d, axis=1, keepdims=True)
