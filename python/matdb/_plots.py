"""Plots of matplotlib, which is imported when one is asked for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from ._matdb import Fit, Material, Measurement, Scan


def _axes(ax: Any) -> Any:
    if ax is not None:
        return ax
    import matplotlib.pyplot as plt

    return plt.subplots()[1]


def scan(scan: Scan, ax: Any = None) -> Any:
    """The power image over the target plane."""
    ax = _axes(ax)
    half = abs(float(scan.x_m[1] - scan.x_m[0])) / 2 if len(scan.x_m) > 1 else 0.5
    extent = (scan.x_m[0] - half, scan.x_m[-1] + half, scan.y_m[-1] - half, scan.y_m[0] + half)
    image = ax.imshow(scan.power_dbm, extent=extent, interpolation="nearest")
    ax.figure.colorbar(image, ax=ax, label="received power, dBm")
    ax.set(title=scan.name, xlabel="x in the target plane, m", ylabel="y in the target plane, m")
    return ax


def measurement(measured: Measurement, ax: Any = None) -> Any:
    """The levels of a curve over the angle of incidence."""
    ax = _axes(ax)
    ax.set_title("Measured levels")
    ax.plot(measured.theta_deg, measured.sigma0_db, ".", markersize=2, label="detected")
    silent = np.isnan(measured.sigma0_db)
    if silent.any():
        ax.plot(measured.theta_deg[silent], measured.threshold_db[silent], "v", markersize=2, color="0.6",
                label="not detected, below")
    ax.set(xlabel="incidence, °", ylabel="σ⁰, dB")
    ax.legend()
    return ax


def material(material: Material, ax: Any = None) -> Any:
    """The backscatter of a material over the angle of incidence."""
    ax = _axes(ax)
    theta_deg = np.linspace(0, 89, 500)
    ax.plot(theta_deg, material.sigma0_db(theta_deg), label=material.name)
    ax.set(title="Backscatter", xlabel="incidence, °", ylabel="σ⁰, dB")
    ax.legend()
    return ax


def fit(fitted: Fit, ax: Any = None) -> Any:
    """The levels of a curve, and the fitted law over them."""
    ax = _axes(ax)
    # A law over one angle is backscatter.
    retro = fitted.is_retro
    theta_deg = np.linspace(float(np.nanmin(fitted.theta_deg)), float(np.nanmax(fitted.theta_deg)), 300)
    ax.plot(fitted.theta_deg[retro], fitted.levels_db[retro], ".", markersize=2, color="0.6", label="detected")
    ax.plot(theta_deg, fitted.sigma0_db(theta_deg), label="fit")
    ax.set(title=fitted.name, xlabel="incidence, °", ylabel="σ⁰, dB")
    ax.legend()
    return ax
