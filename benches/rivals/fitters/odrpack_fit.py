"""odrpack: odrpack_fit.py CURVE."""

import sys
from importlib.metadata import version
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from odrpack import odr_fit

from fitters import curve
from serve import serve, timed

theta, level = curve.read(sys.argv[1])
weights = {"weight_x": 1 / curve.THETA_SD_RAD**2, "weight_y": 1 / curve.LEVEL_SD_DB**2}


def turn():
    ms, found = timed(lambda: odr_fit(curve.sigma0_db, theta, level, curve.START, **weights))
    return {"ms": ms, "values": curve.values(found.beta)}


serve({"version": version("odrpack")}, turn)
