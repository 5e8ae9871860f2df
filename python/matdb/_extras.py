"""Objects of other libraries, each imported when one is asked for."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np


def _needed(name: str, package: str) -> Any:
    """A module, or the error that says how to get it."""
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        # A module that is there and lacks another one says so itself.
        if error.name is None or not f"{name}.".startswith(f"{error.name}."):
            raise
        raise ModuleNotFoundError(f"this needs {package}; pip install {package}", name=error.name) from None


def to_arrow(table: Any) -> Any:
    """A table of pyarrow."""
    return _needed("pyarrow", "pyarrow").table(table)


def _colours(power_dbm: Any) -> Any:
    """Red, green and blue, 0 to 1, from the weakest, blue, over white to the strongest, red: float32 (n, 3)."""
    low, high = (float(power_dbm.min()), float(power_dbm.max())) if len(power_dbm) else (0.0, 1.0)
    share = (np.asarray(power_dbm, float) - low) / (high - low or 1.0)
    stops = np.array([[0.02, 0.19, 0.38], [0.26, 0.58, 0.76], [0.97, 0.97, 0.97], [0.84, 0.38, 0.30], [0.40, 0.00, 0.12]])
    places = np.linspace(0, 1, len(stops))
    return np.stack([np.interp(share, places, stops[:, one]) for one in range(3)], 1).astype(np.float32)


def to_open3d(scan: Any) -> Any:
    """A point cloud of Open3D."""
    o3d = _needed("open3d", "open3d")
    cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor(np.ascontiguousarray(scan.xyz_m)))
    cloud.point["colors"] = o3d.core.Tensor(_colours(scan.points_dbm))
    for name in ["power_dbm", "range_m", "chirp"]:
        cloud.point[name] = o3d.core.Tensor(np.array(scan.cloud[name])[:, None])
    return cloud


def to_rerun(scan: Any, entity: str) -> None:
    """Points and image in the open recording of rerun."""
    rr = _needed("rerun", "rerun-sdk")
    if rr.get_global_data_recording() is None:
        raise RuntimeError("no recording of rerun is open; call rerun.init(...) first")
    points = rr.Points3D(scan.xyz_m, colors=np.round(255 * _colours(scan.points_dbm)).astype(np.uint8))
    rr.log(f"{entity}/points", points)
    image, seen = np.zeros((*scan.power_dbm.shape, 3), np.uint8), np.isfinite(scan.power_dbm)
    image[seen] = np.round(255 * _colours(scan.power_dbm[seen]))
    rr.log(f"{entity}/power_dbm", rr.Image(image))
