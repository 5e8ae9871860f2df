"""Materials and renderings for 300 GHz imaging radar.

>>> import matdb as md
>>> scan = md.render(md.load_scene("builtin:calibration-plate"))
>>> scan.power_dbm.shape == scan.range_m.shape
True
"""

import signal
import sys

from ._errors import UnknownMaterialError
from ._matdb import (
    CatalogueError,
    Cloud,
    CloudError,
    Comparison,
    Database,
    DiagnoseError,
    Diagnosis,
    Error,
    FileError,
    Fit,
    FitError,
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
    "CatalogueError",
    "Cloud",
    "CloudError",
    "Comparison",
    "Database",
    "DiagnoseError",
    "Diagnosis",
    "Error",
    "FileError",
    "Fit",
    "FitError",
    "Material",
    "MaterialError",
    "Measurement",
    "Page",
    "RenderError",
    "Scan",
    "Scene",
    "SceneError",
    "StoreError",
    "UnknownMaterialError",
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
    # As any other program, it ends at once on Ctrl-C.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _run(["matdb", *sys.argv[1:]])
