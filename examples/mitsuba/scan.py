"""The scan: a spinning ellipse that a slow tilt carries upwards, as (1) and Sec. II-B of the paper describe it."""

import numpy as np

from targets import CENTRE

CHIRPS, TURNS, DURATION_S = 4600, 40, 3.7
ORIGIN = CENTRE + np.array([0, 0, 8.0])  # centre of the main reflector


def aims(chirps=CHIRPS, turns=TURNS):
    """x_t and y_t of every chirp, m, and its time, s."""
    share = (np.arange(chirps) + 0.5) / chirps
    phase = 2 * np.pi * turns * share
    x = 0.25 * np.cos(phase)
    y = 0.20 * np.sin(phase) + 0.50 * (share - 0.5)
    return np.stack([x, y], -1), share * DURATION_S


def grid(step=0.005):
    """Axes of the raster in the target plane that effects of shape and motion look up."""
    return np.arange(-0.29, 0.2901, step), np.arange(-0.49, 0.4901, step)


def directions(aim):
    """Unit directions from the main reflector through points of the target plane."""
    point = np.concatenate([aim, np.zeros((len(aim), 1))], 1) + CENTRE
    d = point - ORIGIN
    return d / np.linalg.norm(d, axis=1, keepdims=True)
