"""Draw random curves of every law that `matdb fit` fits, with their truth in a folder of its own."""

import argparse
import json
import os
import zlib

import numpy as np

from laws import MODELS

SCAN = "scan"  # single chirps of the paper's law
OTHER = {"lambert": "blinn-phong", "blinn-phong": "mixture", "cook-torrance": "cook-torrance-ggx",
         "cook-torrance-ggx": "mixture", "mixture": "mixture-ggx", "mixture-ggx": "mixture", "fresnel": "mixture",
         "kirchhoff-go": "kirchhoff", "kirchhoff": "mixture-ggx", "directive": "mixture"}
RANGES = {  # ln-uniform; every tenth shape is drawn from the full range of the documentation instead
    "alpha": (0.3, 60), "diffuse.alpha": (0.3, 60), "m": (0.02, 0.6), "specular.m": (0.02, 0.4),
    "lobe_rad": (0.01, 0.4), "rms_slope": (0.02, 0.5), "rms_height_m": (5e-6, 5e-4),
    "correlation_length_m": (1e-4, 1e-2), "alpha_r": (1.5, 100), "alpha_i": (1.5, 100), "1 - lambda": (1e-4, 0.9),
}
LEVELS = {"R": (1e-4, 0.03), "S": (2e-3, 0.5)}  # others 0.001 to 0.9


def between(rng, low, high):
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def angles(rng):
    """(theta in degrees, sorted): random or in even steps, once or several times each."""
    count = int(between(rng, 14, 160))
    low = 0.0 if rng.random() < 0.7 else rng.uniform(0, 20)
    high = low + rng.uniform(15, 80 - low)
    if rng.random() < 0.5:
        return np.sort(rng.uniform(low, high, count))
    repeats = int(rng.choice([1, 1, 2, 5]))
    return np.repeat(np.linspace(low, high, max(7, count // repeats)), repeats)


def draw_shape(rng, model):
    wide = rng.random() < 0.1
    shape = []
    for name, low, high, _ in model.shape:
        low, high = (max(low, high * 1e-4), high) if wide else RANGES[name]
        shape.append(between(rng, low, high))
    return shape


def curve(rng, law, scan):
    """theta, sigma0 in dB, which are missed, the limit in dB, and the truth; None where too few are seen."""
    model = MODELS[law]
    shape = draw_shape(rng, model)
    levels = [between(rng, *LEVELS.get(n, (1e-3, 0.9))) for n in model.levels]
    theta = np.sort(rng.uniform(0, 70, 1000)) if scan else angles(rng)
    mean = model.sigma0(shape, levels, np.radians(theta))
    mean = np.maximum(mean, 1e-250)
    looks = 1.0 if scan else float(rng.choice([1, 1, 2, 4, 8, 30, between(rng, 0.5, 200)]))
    x = mean * rng.gamma(looks, 1 / looks, len(theta))
    share = 0.0 if rng.random() < 0.2 and not scan else rng.uniform(0, 0.6)
    limit = 10 * np.log10(max(np.quantile(x, share), 1e-9 * x.max())) * np.ones(len(theta))
    if rng.random() < 0.3:  # ranges differ, and so do limits
        limit += rng.normal(0, 2, len(theta))
    db = 10 * np.log10(np.maximum(x, 1e-300))
    truth = {"law": law, "shape": dict(zip([s[0] for s in model.shape], shape)),
             "levels": dict(zip(model.levels, levels)), "looks": looks}
    missed = db < limit
    return (theta, db, missed, limit, truth) if np.sum(~missed) >= 12 and db.max() > -120 else None


def write(path, theta, db, missed, limit):
    with open(path, "w") as file:
        file.write("theta_deg,sigma0_db,censor,threshold_db\n")
        for t, v, m, l in zip(theta, db, missed, limit):
            file.write(f"{t:.6f},,left,{l:.6f}\n" if m else f"{t:.6f},{v:.6f},none,{l:.6f}\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", default="out")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=30, help="curves of each model")
    parser.add_argument("--scans", type=int, default=200)
    a = parser.parse_args()
    os.makedirs(f"{a.out}/truth", exist_ok=True)
    for model in [*MODELS, SCAN]:
        os.makedirs(f"{a.out}/{model}", exist_ok=True)
        for i in range(a.scans if model == SCAN else a.count):
            rng = np.random.default_rng([a.seed, zlib.crc32(model.encode()), i])
            own = "mixture" if model == SCAN else model
            law = OTHER[own] if i % 5 == 4 and model != SCAN else own
            drawn = None
            while drawn is None:
                drawn = curve(rng, law, model == SCAN)
            write(f"{a.out}/{model}/{i:03}.csv", *drawn[:4])
            with open(f"{a.out}/truth/{model}-{i:03}.json", "w") as file:
                json.dump({**drawn[4], "fitted": own}, file, indent=1)


if __name__ == "__main__":
    main()
