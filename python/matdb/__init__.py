"""Materials and renderings for 300 GHz imaging radar.

>>> import matdb as md
>>> scan = md.render(md.load_scene("builtin:calibration-plate"))
>>> scan.power_dbm.shape == scan.range_m.shape
True
"""

import signal
import sys
from collections.abc import Mapping

from ._errors import UnknownMaterialError
from ._matdb import (
    CatalogueError,
    Cloud,
    CloudError,
    Comparison,
    Database,
    Dataset,
    DiagnoseError,
    Diagnosis,
    Effect,
    Error,
    FileError,
    Fit,
    FitError,
    Material,
    MaterialError,
    Measurement,
    Page,
    Radar,
    RenderError,
    Scan,
    Scene,
    SceneError,
    Shots,
    StoreError,
    Table,
    UsageError,
    View,
    __version__,
    calibrate,
    compare,
    dataset,
    diagnose,
    diagnose_curve,
    effects,
    fit,
    load_scene,
    measure,
    new_material,
    new_scene,
    open,
    radar,
    render,
    verify,
)
from ._matdb import _run

__all__ = [
    "CatalogueError",
    "Cloud",
    "CloudError",
    "Comparison",
    "Database",
    "Dataset",
    "DiagnoseError",
    "Diagnosis",
    "Effect",
    "Error",
    "FileError",
    "Fit",
    "FitError",
    "Material",
    "MaterialError",
    "Measurement",
    "Page",
    "Radar",
    "RenderError",
    "Scan",
    "Scene",
    "SceneError",
    "Shots",
    "StoreError",
    "Table",
    "UnknownMaterialError",
    "UsageError",
    "View",
    "__version__",
    "calibrate",
    "compare",
    "dataset",
    "diagnose",
    "diagnose_curve",
    "effects",
    "fit",
    "load_scene",
    "measure",
    "new_material",
    "new_scene",
    "open",
    "radar",
    "render",
    "verify",
]

Mapping.register(Table)


def _main() -> int:
    """The command line."""
    # As any other program, it ends at once on Ctrl-C.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _run(["matdb", *sys.argv[1:]])
