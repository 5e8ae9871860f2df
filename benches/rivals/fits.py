"""Times fits of matdb, scipy and odrpack on one synthetic curve; see README.md beside this file."""

import json
import subprocess
import tempfile
import time
from pathlib import Path
from statistics import median

import numpy as np
from odrpack import odr_fit
from scipy.optimize import curve_fit, least_squares

POINTS = 5000
REPEATS = 11
THETA_SD_RAD = np.radians(1.0)
LEVEL_SD_DB = 2.0
TRUTH = np.array([0.12, 3.0, np.log(0.05), np.log(0.004)])
START = np.array([0.1, 2.0, np.log(0.07), np.log(0.006)])


def sigma0_db(theta, beta):
    """4 pi f cos^2 of Cook-Torrance (Beckmann, separable) plus Blinn-Phong, both by their levels."""
    m, alpha, ln_s, ln_r = beta
    cos, tan = np.cos(theta), np.abs(np.tan(theta))
    d = np.exp(-((tan / m) ** 2)) / (np.pi * m**2 * cos**4)
    a = 1 / np.maximum(m * tan, 1e-12)
    rational = (3.535 * a + 2.181 * a**2) / (1 + 2.276 * a + 2.577 * a**2)
    g1 = np.where(a >= 1.6, 1.0, rational)
    specular = np.exp(ln_s) * d * g1**2 / (4 * cos**2)
    diffuse = np.exp(ln_r) * (alpha + 2) / (2 * np.pi) * np.abs(cos) ** alpha
    return 10 * np.log10(4 * np.pi * (specular + diffuse) * cos**2)


def write_curve(path):
    """A synthetic curve; returns it as written, so that all programs see the same digits."""
    random = np.random.default_rng(7)
    theta = np.radians(random.uniform(2.0, 65.0, POINTS))
    level = sigma0_db(theta, TRUTH) + LEVEL_SD_DB * random.standard_normal(POINTS)
    measured = np.abs(theta + THETA_SD_RAD * random.standard_normal(POINTS))
    rows = [f"{np.degrees(t):.6f},{y:.6f}" for t, y in zip(measured, level)]
    path.write_text("theta_deg,sigma0_db\n" + "\n".join(rows) + "\n", encoding="ascii")
    table = np.array([[float(x) for x in row.split(",")] for row in rows])
    return np.radians(table[:, 0]), table[:, 1]


def timed(fit):
    """Median milliseconds and the parameters m, alpha, S, R."""
    times = []
    for _ in range(REPEATS):
        began = time.perf_counter()
        m, alpha, ln_s, ln_r = fit()
        times.append(1e3 * (time.perf_counter() - began))
    return median(times), [m, alpha, np.exp(ln_s), np.exp(ln_r)]


def rivals(theta, level):
    residuals = lambda beta: (sigma0_db(theta, beta) - level) / LEVEL_SD_DB
    model = lambda theta, *beta: sigma0_db(theta, beta)
    odr = lambda: odr_fit(
        sigma0_db, theta, level, START, weight_x=1 / THETA_SD_RAD**2, weight_y=1 / LEVEL_SD_DB**2
    )
    return {
        "least squares": {
            "scipy least_squares": timed(lambda: least_squares(residuals, START, method="lm").x),
            "scipy curve_fit": timed(lambda: curve_fit(model, theta, level, START)[0]),
        },
        "orthogonal distance": {"odrpack": timed(lambda: odr().beta)},
    }


def main():
    root = Path(__file__).resolve().parents[2]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "curve.csv"
        theta, level = write_curve(path)
        theirs = rivals(theta, level)
        command = ["cargo", "run", "--release", "--quiet", "--example", "fit_speed", "--", str(path)]
        ours = json.loads(subprocess.run(command, cwd=root, check=True, capture_output=True).stdout)
    print("| fit | program | ms | times matdb | largest relative gap of a parameter |")
    print("|---|---|--:|--:|--:|")
    for name, mine in ours.items():
        print(f"| {name} | matdb | {mine['ms']:.2f} | 1 | |")
        for program, (ms, values) in theirs.get(name, {}).items():
            gap = max(abs(a / b - 1) for a, b in zip(mine["values"], values))
            print(f"| {name} | {program} | {ms:.2f} | {ms / mine['ms']:.2f} | {gap:.1e} |")


if __name__ == "__main__":
    main()
