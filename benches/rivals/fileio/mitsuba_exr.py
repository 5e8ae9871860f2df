"""Mitsuba writes a picture as OpenEXR: mitsuba_exr.py FLOATS FILE."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import mitsuba as mi
import numpy as np

from serve import serve, timed

SIDE = 1024
floats, file = sys.argv[1:]
mi.set_variant("scalar_rgb")
channels = np.fromfile(floats, "<f4").reshape(-1, SIDE, SIDE)
values = np.ascontiguousarray(np.moveaxis(channels, 0, -1))
names = [f"channel{number}" for number in range(len(channels))]
picture = mi.Bitmap(values, mi.Bitmap.PixelFormat.MultiChannel, names)


def turn():
    ms, _ = timed(lambda: picture.write(file))
    return {"ms": ms, "bytes": Path(file).stat().st_size}


serve({"version": mi.__version__}, turn)
