"""Compare the formulas with closed forms and with another search. Prints what was compared, and fails where it differs."""

from math import comb

import numpy as np
from scipy.integrate import quad
from scipy.optimize import least_squares, nnls
from scipy.special import j0

import generate
from surfaces import DB, LAWS, PARTS, Refit, cosine, db, film, fringes, hemisphere, kirchhoff, lobe, profiles


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
    theta, ks, kl = np.radians(np.arange(0, 50, 5.0)), 12.0, 40.0
    check("the same of Gaussian correlation against its geometric limit, dB", np.abs(
        db(kirchhoff(theta, ks, kl, "gaussian")) - db(lobe("go", theta, 2 * ks / kl))).max(), 0.1)
    correlations, worst = {"gaussian": lambda r: np.exp(-(r**2)), "exponential": lambda r: np.exp(-r)}, 0
    for ks, kl, t in (0.5, 6, 0.3), (1.5, 8, 0.0), (1.5, 8, 0.6), (3, 20, 0.4), (0.2, 0.5, 1.2):
        for name, rho in correlations.items():
            phase, wave = (2 * ks * np.cos(t)) ** 2, 2 * kl * np.sin(t)
            waves = lambda r: (np.exp(phase * (rho(r) - 1)) - np.exp(-phase)) * j0(wave * r) * r
            total = sum(quad(waves, a, a + 0.5)[0] for a in np.arange(0, 40, 0.5))
            series = kirchhoff(np.array([t]), ks, kl, name)[0]
            worst = max(worst, abs(2 * kl**2 * total / np.cos(t) ** 2 / series - 1))
    check("Kirchhoff's series against its integral over the correlation", worst, 1e-6)
    theta, ks, kl = np.linspace(0, np.pi / 2, 20001)[:-1], 0.5, 200.0
    density = kirchhoff(theta, ks, kl, "gaussian") / np.pi
    total = np.trapezoid(density * np.cos(theta) * 2 * np.pi * np.sin(theta), theta)
    check("what the mirror's part lacks, exp(-q²s²), is in the series", abs(total - 1 + np.exp(-((2 * ks) ** 2))), 1e-3)
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


def hemispheres():
    """The integral of ((1 + cos ψ)/2)^α over the hemisphere: for whole α the series of Degli-Esposti et al."""
    theta = np.radians(np.arange(0, 86, 5.0))
    for alpha in 1, 4, 30, 200:
        total = 0
        for j in range(alpha + 1):
            odd = np.cos(theta) * sum(comb(2 * w, w) * (np.sin(theta) / 2) ** (2 * w) for w in range((j + 1) // 2))
            total = total + comb(alpha, j) * 2 * np.pi / (j + 1) * (odd if j % 2 else 1) / 2**alpha
        error = np.abs(hemisphere().ev(np.log(alpha), theta) / total - 1).max()
        check(f"integral of a directive lobe, α = {alpha}", error, 1e-3)


def by_scipy(law, theta, level_db, rng, starts):
    """The rms that the best of scipy's searches from random numbers leaves. The levels start by least squares."""
    parts = [PARTS[name] for name in LAWS[law] if name]
    free, low, high = (np.concatenate([getattr(part, name) for part in parts]) for name in ("free", "low", "high"))
    low, high = np.where(free, low, 0) - 1e-9, np.where(free, high, 0) + 1e-9
    first = np.cumsum([0, *(len(part.free) for part in parts)])

    def shapes(p):
        numbers = [p[i + 1: i + len(part.free), None, None] for part, i in zip(parts, first)]
        return np.stack([part.shape(theta[None], *(n if part.plain else np.exp(n)))[0] for part, n in zip(parts, numbers)])

    ends = []
    for _ in range(starts):
        p = rng.uniform(low, np.minimum(high, 20))
        ratios = (shapes(p) / np.exp(level_db / DB)).T
        most = ratios.max(0) + 1e-300
        p[first[:-1]] = np.clip(np.log(nnls(ratios / most, np.ones(len(theta)))[0] / most + 1e-12), -30, 19)
        fit = least_squares(lambda p: level_db - db(np.exp(p[first[:-1]]) @ shapes(p)), p, bounds=(low, high), max_nfev=60)
        ends.append(np.sqrt(2 * fit.cost / len(theta)))
    return min(ends)


def refits(seed=8, count=144):
    """What the best refit leaves, against searches of scipy from random starts; no case depends on how many there are."""
    rng, worst, compared, curves = np.random.default_rng(1), 0, 0, []
    cases = generate.missing(seed, count)
    same = all(str(a) == str(b) for (a, _), (b, _) in zip(cases, generate.missing(seed, 24)))
    check("cases that depend on the count", not same, 0)
    for k, (truth, table) in enumerate(cases):
        if not truth["reached"]:
            continue
        drawn = (generate.Missing(seed, k, attempt) for attempt in range(generate.TRIES))
        case = next(c for c in drawn if c.base.lobes == truth["lobes"] and c.base.diffuse == truth["diffuse"])
        level = db(case.level(truth["size"]))
        assert 0.5 < np.std(table["sigma0_db"] - level) / truth["noise_db"] < 1.6, truth["id"]
        worst = max(worst, truth["left_db"] / by_scipy(case.declared, case.theta, level, rng, 20) - 1)
        compared += 1
        if truth["others_leave"] > generate.DUE:
            curves.append((case.theta, level, case.noise))
    check(f"excess of {compared} refits over scipy's", worst, generate.TOLERANCE)
    thetas, levels_db, noises = zip(*curves[:10])
    declared = set().union(*generate.EFFECTS.values())
    for law in (law for law in LAWS if law not in declared):
        left = generate.left_by(law, thetas, levels_db)
        best = np.array([by_scipy(law, theta, level, rng, 12) for theta, level in zip(thetas, levels_db)])
        excess = np.minimum(left / best - 1, (left - best) / noises).max()
        check(f"excess of {len(left)} refits of {law} over scipy's, of its rest or of the noise", excess, 0.02)
    theta = np.radians(np.linspace(0, 60, 61))
    own = db(0.1 * lobe("ggx", theta, 0.2) + 0.05 * cosine(theta, 0))
    check("a law that is refitted to itself, dB", Refit(None, [theta]).left([own])[0], 1e-3)


if __name__ == "__main__":
    facets()
    rough()
    coating()
    hemispheres()
    refits()
