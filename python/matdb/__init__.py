"""Materials and renderings for 300 GHz imaging radar.

>>> import matdb as md
>>> scan = md.render(md.load_scene("builtin:calibration-plate"))
>>> scan.power_dbm.shape == scan.range_m.shape
True
"""

import sys

from ._matdb import (
    Cloud,
    Comparison,
    Database,
    Diagnosis,
    Error,
    FileError,
    Fit,
    Material,
    MaterialError,
    Measurement,
    Page,
    RenderError,
    Scan,
    Scene,
    SceneError,
    StoreError,
    UsageError,
    View,
    __version__,
    calibrate,
    compare,
    diagnose,
    fit,
    load_scene,
    measure,
    open,
    render,
)
from ._matdb import _run

__all__ = [
    "Cloud",
    "Comparison",
    "Database",
    "Diagnosis",
    "Error",
    "FileError",
    "Fit",
    "Material",
    "MaterialError",
    "Measurement",
    "Page",
    "RenderError",
    "Scan",
    "Scene",
    "SceneError",
    "StoreError",
    "UsageError",
    "View",
    "__version__",
    "calibrate",
    "compare",
    "diagnose",
    "fit",
    "load_scene",
    "measure",
    "open",
    "render",
]


def _main() -> int:
    """The command line."""
    return _run(["matdb", *sys.argv[1:]])
