"""The curve that is fitted, its model and what is known of its errors; the same for all programs."""

import numpy as np

POINTS = 5000
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


def write(path):
    """A synthetic curve, in digits that all programs read alike."""
    random = np.random.default_rng(7)
    theta = np.radians(random.uniform(2.0, 65.0, POINTS))
    level = sigma0_db(theta, TRUTH) + LEVEL_SD_DB * random.standard_normal(POINTS)
    measured = np.abs(theta + THETA_SD_RAD * random.standard_normal(POINTS))
    rows = [f"{np.degrees(t):.6f},{y:.6f}" for t, y in zip(measured, level)]
    path.write_text("theta_deg,sigma0_db\n" + "\n".join(rows) + "\n", encoding="ascii")


def read(path):
    """Angles, rad, and levels, dB."""
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    return np.radians(table[:, 0]), table[:, 1]


def values(beta):
    """The parameters m, alpha, S, R."""
    m, alpha, ln_s, ln_r = map(float, beta)
    return [m, alpha, float(np.exp(ln_s)), float(np.exp(ln_r))]
