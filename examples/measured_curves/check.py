"""Compare the formulas with closed forms and with another search. Prints what was compared, and fails where it differs."""

import numpy as np
from scipy.optimize import least_squares

import generate
from surfaces import DB, LAWS, Refit, cosine, db, film, fringes, kirchhoff, lobe, profiles


def check(what, error, most):
    print(f"{what}: {error:.2g}, at most {most:g}")
    assert error <= most, what


def facets():
    """σ⁰/π is the density of slopes of facets, whose projection ∫D·cos θ dω is 1, times shadowing, which is small here."""
    theta = np.linspace(0, np.pi / 2, 200001)[:-1]
    for kind, most in ("go", 1e-6), ("beckmann", 1e-6), ("ggx", 2e-3):
        density = lobe(kind, theta, 0.02) / np.pi
        total = np.trapezoid(density * np.cos(theta) * 2 * np.pi * np.sin(theta), theta)
        check(f"projected area of {kind}", abs(total - 1), most)


def rough():
    """Heights far beyond the wavelength: exp(-a·r) has the spectrum 2πa/(a² + q²)^1.5, a = q²s²/l."""
    theta, ks, kl = np.radians(np.arange(0, 70, 5.0)), 6.0, 400.0
    a, q = (2 * ks * np.cos(theta)) ** 2 / kl, 2 * np.sin(theta)
    check("Kirchhoff's series, dB", np.abs(
        db(kirchhoff(theta, ks, kl)) - db(2 * a / (a**2 + q**2) ** 1.5 / np.cos(theta) ** 2)).max(), 0.2)
    theta = np.radians(np.arange(0, 36, 3.0))
    level = profiles(np.random.default_rng(1), theta, 3.0, 15.0, "gaussian", 3000)
    slope = np.sqrt(2) * 3 / 15
    difference = db(level) - db(np.exp(-((np.tan(theta) / slope) ** 2) / 2) / np.cos(theta) ** 3)
    check("profiles against their geometric limit, dB", np.std(difference), 0.3)


def coating():
    """Airy's sum against the sum of all paths through the film, and its mean over the phase."""
    theta, visibility, r1 = np.linspace(0, 1.4, 5001), 0.7, 0.2
    r2 = r1 * (1 - np.sqrt(1 - visibility**2)) / visibility
    turn = np.exp(2j * np.pi * fringes(theta, 3.0))
    paths = r1 + sum((1 - r1**2) * r2 * turn * (-r1 * r2 * turn) ** n for n in range(20))
    ratio = np.abs(paths) ** 2 / film(theta, visibility, 3.0)
    check("film against its paths", np.ptp(ratio) / ratio.mean(), 1e-9)
    full = film(np.arcsin(1.5 * np.sqrt(1 - (1 - np.linspace(0, 0.25, 4001)) ** 2)), visibility, 2.0)  # one fringe
    check("mean of a film over its phase", abs(full[:-1].mean() - 1), 1e-9)


def refits(seed=8, count=144):
    """What the best refit leaves, against searches of scipy from random starts; no case depends on how many there are."""
    rng, worst, compared = np.random.default_rng(1), 0, 0
    cases = generate.missing(seed, count)
    same = all(str(a) == str(b) for (a, _), (b, _) in zip(cases, generate.missing(seed, 24)))
    check("cases that depend on the count", not same, 0)
    for k, (truth, table) in enumerate(cases):
        if not truth["reached"]:
            continue
        drawn = (generate.Missing(seed, k, attempt) for attempt in range(generate.TRIES))
        case = next(c for c in drawn if c.base.lobes == truth["lobes"] and c.base.diffuse == truth["diffuse"])
        level, theta, (kind, power, free) = db(case.level(truth["size"])), case.theta, LAWS[case.declared]
        check_noise = np.std(table["sigma0_db"] - level) / truth["noise_db"]
        assert 0.5 < check_noise < 1.6, truth["id"]

        def residual(p):
            flat = cosine(theta, None if power is None else p[3] * free)
            return level - db(np.exp(p[0]) * lobe(kind, theta, np.exp(p[1])) + np.exp(p[2]) * flat)

        ends = []
        for _ in range(20):
            m = rng.uniform(np.log(0.01), np.log(1.9))
            start = [level.max() / DB + 2 * m, m, level.mean() / DB + rng.normal(0, 2), rng.uniform(0, 20)]
            bounds = [-40, np.log(0.001), -40, -1e-9], [20, np.log(2), 20, 1000]
            fit = least_squares(residual, start, bounds=bounds, max_nfev=60)
            ends.append(np.sqrt(2 * fit.cost / len(theta)))
        worst, compared = max(worst, truth["left_db"] / min(ends) - 1), compared + 1
    check(f"excess of {compared} refits over scipy's", worst, generate.TOLERANCE)
    theta = np.radians(np.linspace(0, 60, 61))
    own = db(0.1 * lobe("ggx", theta, 0.2) + 0.05 * cosine(theta, 0))
    check("a law that is refitted to itself, dB", Refit(None, [theta]).left([own])[0], 1e-3)


if __name__ == "__main__":
    facets()
    rough()
    coating()
    refits()
