"""SciPy: scipy_fit.py least_squares|curve_fit CURVE."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import scipy
from scipy.optimize import curve_fit, least_squares

from fitters import curve
from serve import serve, timed

which, path = sys.argv[1:]
theta, level = curve.read(path)


def residuals(beta):
    return (curve.sigma0_db(theta, beta) - level) / curve.LEVEL_SD_DB


def model(theta, *beta):
    return curve.sigma0_db(theta, beta)


FITS = {
    "least_squares": lambda: least_squares(residuals, curve.START, method="lm").x,
    "curve_fit": lambda: curve_fit(model, theta, level, curve.START)[0],
}


def turn():
    ms, beta = timed(FITS[which])
    return {"ms": ms, "values": curve.values(beta)}


serve({"version": scipy.__version__}, turn)
