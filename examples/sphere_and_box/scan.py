"""A scan of a sphere and a box, and a curve, from the equations of docs/model.md with no code of the program."""

import os

import numpy as np

HERE = os.path.dirname(os.path.realpath(__file__))
LAW, K = {"m": 0.08, "alpha": 4.0, "R": 0.0016, "S": 0.054}, 0.1  # R = k r_s and S = (1 - k) f_lambda
POWER_DBM, LOSS_DB, THRESHOLD_DBM, NOISE_DBM, LOOKS, RANGE_SD_M = 7.0, 12.5, -77.0, -88.0, 4, 0.001
WAVELENGTH_M, WAIST_M, FOCUS_M = 299_792_458.0 / 300e9, 0.016 / np.sqrt(2 * np.log(2)), 8.0
EDGE_GROWTH, EDGE_M = 1.5, 0.5
RADAR, BOX_M = np.array([0.0, 1.1, 8.0]), np.array([0.40, 0.34, 0.30])
LINES, PER_LINE, WIDTH_M, HEIGHT_M, DURATION_S = 92, 50, 0.5, 0.9, 3.7
# A curve as in docs/own-cloud.md, of a ball; its law is uniform in ln.
BALL_M, BALL_DEG, CURVE_CHIRPS, CURVE_NOISE_DBM, CURVE_BEAM_RAD = 0.25, (0.2, 75.9), 6300, -100.0, 0.0106
CURVE_LAWS = {"m": (0.02, 0.4), "alpha": (0.3, 60), "R": (1e-4, 0.03), "S": (2e-3, 0.5)}


def mw(dbm):
    return 10 ** (np.asarray(dbm) / 10)


def sigma0(law, theta, delta):
    """4 pi f cos2 of (12) to (15), monostatic. The beam widens Beckmann's m to sqrt(m2 + delta2) in D; G keeps m."""
    m2, t = law["m"] ** 2 + delta**2, np.tan(theta)
    a = 1 / np.maximum(law["m"] * t, 1e-9)
    g1 = np.where(a < 1.6, (3.535 * a + 2.181 * a**2) / (1 + 2.276 * a + 2.577 * a**2), 1.0)
    lobe = np.exp(-(t**2) / m2) / (m2 * np.cos(theta) ** 4) * g1**2
    return law["S"] * lobe + 2 * law["R"] * (law["alpha"] + 2) * np.cos(theta) ** (law["alpha"] + 2)


def power_mw(sigma, waist, range_m):
    """(11) with the paper's footprint: P_t L Omega f cos2, Omega = lambda2 / (pi w2)."""
    w2 = waist**2 * (1 + ((range_m - FOCUS_M) / (np.pi * waist**2 / WAVELENGTH_M)) ** 2)
    return mw(POWER_DBM - LOSS_DB) * WAVELENGTH_M**2 / (np.pi * w2) * sigma / (4 * np.pi)


def received_dbm(rng, mean_mw, noise_dbm):
    """The mean of LOOKS powers of echo and noise, each exponential, drawn anew for every chirp."""
    return 10 * np.log10((mean_mw + mw(noise_dbm)) * rng.exponential(size=(LOOKS, len(mean_mw))).mean(0))


def rays():
    """Directions of the chirps, line by line and upwards."""
    y, x = np.meshgrid(*((np.arange(n) + 0.5) / n - 0.5 for n in (LINES, PER_LINE)), indexing="ij")
    d = np.stack([WIDTH_M * x.ravel(), HEIGHT_M * y.ravel(), np.full(x.size, -FOCUS_M)], 1)
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def draw_target(rng):
    """Two faces of the box return echoes: with one, nothing would tell a turn about its normal through the sphere."""
    return {"radius": rng.uniform(0.16, 0.19), "sphere": rng.uniform(-0.02, 0.02, 3) + (0, 1.32, 0),
            "box": rng.uniform(-0.02, 0.02, 3) + (0, 0.90, 0), "yaw": rng.uniform(32, 45) * rng.choice([-1, 1])}


def hits(target, d):
    """(range, incidence angle) of the nearest intersection; the range is infinite where a ray meets nothing."""
    to = target["sphere"] - RADAR
    root = target["radius"] ** 2 - to @ to + (d @ to) ** 2
    r_sphere = np.where(root > 0, d @ to - np.sqrt(np.maximum(root, 0)), np.inf)
    cos_sphere = np.sqrt(np.maximum(root, 0)) / target["radius"]
    c, s = np.cos(np.radians(target["yaw"])), np.sin(np.radians(target["yaw"]))
    turn = np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])  # from the global axes to those of the box
    origin, local = turn @ (RADAR - target["box"]), d @ turn.T
    near, far = ((side * np.sign(local) * BOX_M / 2 - origin) / local for side in (-1, 1))
    r_box = np.where(near.max(1) < far.min(1), near.max(1), np.inf)
    cos_box = np.abs(local[np.arange(len(d)), near.argmax(1)])  # of the face by which the ray enters last
    return np.minimum(r_sphere, r_box), np.arccos(np.where(r_sphere < r_box, cos_sphere, cos_box))


def write_shared(folder):
    """rays.csv, and sphere.obj of radius 1: its facets are 4 mrad wide up to 0.4 rad off the z axis, where the lobe is
    seen, and 12 mrad beyond, so that a normal is at most 2 and 6 mrad off the sphere's."""
    os.makedirs(folder, exist_ok=True)
    d, chirp = rays(), np.arange(LINES * PER_LINE)
    np.savetxt(f"{folder}/rays.csv", np.column_stack([chirp, DURATION_S * chirp / len(d), d]), comments="",
               header="chirp,time_s,ox_m,oy_m,oz_m,dx,dy,dz", fmt="%d,%.9f,0,1.1,8,%.15f,%.15f,%.15f")
    polar = np.concatenate([np.arange(0.0002, 0.4, 0.004), np.arange(0.4, 1.65, 0.012)])
    p, a = np.meshgrid(polar, np.linspace(0, 2 * np.pi, 600, endpoint=False), indexing="ij")
    index = np.arange(p.size).reshape(p.shape) + 1
    turned = np.roll(index, -1, 1)
    with open(f"{folder}/sphere.obj", "w") as file:
        for line, columns in (("v %.9f %.9f %.9f", [np.sin(p) * np.cos(a), np.sin(p) * np.sin(a), np.cos(p)]),
                              ("f %d %d %d %d", [index[1:], turned[1:], turned[:-1], index[:-1]])):
            np.savetxt(file, np.stack([c.ravel() for c in columns], 1), line)


def write_scan(folder, rng, target, stored, echo_db=0.0, scale_db=0.0):
    """cloud.ply, scene.toml and material/ with the law `stored`. Echoes are `echo_db` above what the scene says; all
    dBm, those of noise and threshold included, are `scale_db` above it."""
    os.makedirs(f"{folder}/material", exist_ok=True)
    d = rays()
    distance, theta = hits(target, d)
    chirp = np.flatnonzero(np.isfinite(distance))
    d, distance, theta = d[chirp], distance[chirp], theta[chirp]
    waist = WAIST_M * (1 + (EDGE_GROWTH - 1) * (FOCUS_M * np.hypot(d[:, 0], d[:, 1]) / EDGE_M) ** 2)
    mean = power_mw(sigma0(LAW, theta, WAVELENGTH_M / (2 * np.pi * waist)), waist, distance)
    power = received_dbm(rng, mean * mw(echo_db), NOISE_DBM)
    measured = distance + rng.normal(0, RANGE_SD_M, len(distance))
    rows = np.column_stack([RADAR + measured[:, None] * d, measured, power + scale_db, chirp])[power >= THRESHOLD_DBM]
    header = "".join(f"property double {n}\n" for n in ("x", "y", "z", "range_m", "power_dbm"))
    np.savetxt(f"{folder}/cloud.ply", rows, fmt="%.7f %.7f %.7f %.7f %.4f %d", comments="",
               header=f"ply\nformat ascii 1.0\nelement vertex {len(rows)}\n{header}property int chirp\nend_header")
    values = {name: value.tolist() if name in ("sphere", "box") else value for name, value in target.items()}
    values.update(here=HERE, threshold_dbm=THRESHOLD_DBM + scale_db, noise_dbm=NOISE_DBM + scale_db, looks=LOOKS, k=K,
                  range_sd_m=RANGE_SD_M, f_lambda=stored["S"] / (1 - K), r_s=stored["R"] / K, **stored)
    for form, path in (("scene.toml", "scene.toml"), ("material.toml", "material/material.toml")):
        with open(f"{HERE}/{form}") as source, open(f"{folder}/{path}", "w") as file:
            file.write(source.read().format(**values))


def write_curve(path, rng):
    """A curve as `matdb measure` writes it; returns its law. At least half of the chirps are detected."""
    seen = np.zeros(1)
    while seen.mean() < 0.5:
        law = {n: float(np.exp(rng.uniform(*np.log(limits)))) for n, limits in CURVE_LAWS.items()}
        theta = np.arcsin(np.sqrt(rng.uniform(*np.sin(np.radians(BALL_DEG)) ** 2, CURVE_CHIRPS)))
        turn, distance = rng.uniform(0, 2 * np.pi, CURVE_CHIRPS), FOCUS_M - BALL_M * np.cos(theta)
        unit = power_mw(1.0, WAIST_M, distance)
        power = received_dbm(rng, sigma0(law, theta, CURVE_BEAM_RAD) * unit, CURVE_NOISE_DBM)
        seen = power >= THRESHOLD_DBM
    power, across = np.maximum(power, THRESHOLD_DBM), BALL_M * np.sin(theta)
    rows = [np.degrees(theta), power, power - 10 * np.log10(unit), distance, np.arange(CURVE_CHIRPS), ~seen,
            across * np.cos(turn), across * np.sin(turn)]
    names = "theta_deg,theta_sd_deg,power_dbm,sigma0_db,range_m,chirp,censored,xt_m,yt_m,footprint,beam_rad"
    line = f"%.6f,0,%.5f,%.5f,%.5f,%d,%d,%.5f,%.5f,paper,{CURVE_BEAM_RAD}"
    np.savetxt(path, np.column_stack(rows), line, header=names, comments="")
    return law
