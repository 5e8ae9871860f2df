"""The clouds that are registered, as the example `icp_speed` writes them into a folder."""

from pathlib import Path

import numpy as np

REACH_M = 0.1
STEPS = 60


def read(folder):
    """The measured points, and what a scan of the pushed mesh sees with its normals."""
    return tuple(np.loadtxt(Path(folder) / f"{name}.xyz") for name in ("measured", "virtual"))
