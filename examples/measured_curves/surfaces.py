"""Backscatter of surfaces, σ⁰ = 4π·f·cos²θ with f in 1/sr, and the best refit of a law. Angles in rad, levels linear."""

import functools
import itertools

import numpy as np
from scipy.interpolate import RectBivariateSpline
from scipy.special import gammaln

DB = 10 / np.log(10)


def db(level):
    return DB * np.log(np.maximum(level, 1e-30))


def lobe(kind, theta, m):
    """σ⁰ = π·D·G1² of facets with reflectance 1. Walter et al., EGSR 2007, equations 25 to 27, 33 and 34.

    `go` is Kirchhoff's limit, exp(-tan²/2s²)/(2s²·cos⁴) with m² = 2s², without shadows. Barrick, IEEE Trans. AP 16 (1968) 449.
    """
    if kind is None:
        return np.zeros_like(theta)
    tan = np.tan(theta)
    facets = 1 / (m * np.cos(theta) ** 2) ** 2
    if kind == "ggx":
        return facets / (1 + (tan / m) ** 2) ** 2 * (2 / (1 + np.sqrt(1 + (m * tan) ** 2))) ** 2
    facets = facets * np.exp(-((tan / m) ** 2))
    if kind == "go":
        return facets
    a = 1 / np.maximum(m * tan, 1e-9)
    return facets * np.where(a < 1.6, (3.535 * a + 2.181 * a**2) / (1 + 2.276 * a + 2.577 * a**2), 1) ** 2


def cosine(theta, power):
    """σ⁰ of f ∝ cos^power, 1 at normal incidence. Lambert: power 0, and σ⁰ = 4·albedo·cosine."""
    return np.zeros_like(theta) if power is None else np.cos(theta) ** (power + 2)


def kirchhoff(theta, ks, kl, correlation="exponential"):
    """σ⁰ of Gaussian heights, reflectance 1, without the mirror's part. Ulaby, Moore & Fung, vol. 2 (1982), ch. 12: the
    series of exp(q²s²ρ), q = 2k·cos θ. With w = 2kl·sin θ, term n has the spectrum ∫ρⁿ·J0(w·r/l)·k²r dr, which is
    (kl/n)²/(1 + (w/n)²)^1.5 for `exponential`, ρ = exp(-r/l), and (kl)²/2n·exp(-w²/4n) for `gaussian`, ρ = exp(-r²/l²)."""
    phase, wave = (2 * ks * np.cos(theta)) ** 2, (2 * kl * np.sin(theta)) ** 2
    low, high = phase.min() - 8 * np.sqrt(phase.min()), phase.max() + 8 * np.sqrt(phase.max()) + 20
    n = np.arange(max(1, int(low)), int(high))
    row = n[:, None]
    weight = row * np.log(phase) - phase - gammaln(row + 1)
    if correlation == "gaussian":
        total = 0.5 / n @ np.exp(weight - wave / 4 / row)
    else:
        wide = 1 + wave / row**2
        total = 1 / n**2 @ (np.exp(weight) / (wide * np.sqrt(wide)))
    return 2 * kl**2 * total / np.cos(theta) ** 2


def kirchhoffs(correlation, theta, ks, kl, width=None):
    """`kirchhoff` of many curves: of one surface, interpolated in dB, or of one for each. With a width the mirror's part is
    added, exp(-q²s²) times a lobe (the same source)."""
    if np.ndim(ks):
        level = np.zeros_like(theta)
        for out, row, n, *numbers in zip(level, theta, theta.argmax(1) + 1, ks[:, 0], kl[:, 0]):
            out[:n] = series(row[:n].tobytes(), *numbers, correlation)  # beyond the last angle are zeros
    else:
        level = np.exp(np.interp(theta, SOME, db(series(SOME.tobytes(), ks, kl, correlation))) / DB)
    return level if width is None else level + np.exp(-((2 * ks * np.cos(theta)) ** 2)) * lobe("beckmann", theta, width)


@functools.lru_cache(2000)
def series(theta, ks, kl, correlation):
    return kirchhoff(np.frombuffer(theta), ks, kl, correlation)


def directive(theta, alpha_r, alpha_i, back):
    """σ⁰ of lobes ((1 + cos ψ)/2)^α, ψ from the mirror direction (α_r) and from the source (α_i), `back` = (1 - Λ)/Λ.
    Degli-Esposti et al., IEEE Trans. AP 55 (2007) 143: f is their sum over cos θ·F, F its integral over the hemisphere."""
    whole = hemisphere().ev(np.log(alpha_r), theta) + back * hemisphere().ev(np.log(alpha_i), theta)
    return 4 * np.pi * np.cos(theta) * (np.cos(theta) ** (2 * alpha_r) + back) / whole


@functools.cache
def hemisphere():
    """F of a lobe by ln α and θ. u = ((1 + cos ψ)/2)^(α + 1) is even over the sphere, so that F is 4π/(α + 1) times the mean
    over u of the part of the circle ψ about θ that is above the surface."""
    alpha, theta, u = np.geomspace(1, 200, 40), np.linspace(1e-6, np.pi / 2, 91), (np.arange(2000) + 0.5) / 2000
    psi = np.arccos(2 * u ** (1 / (alpha[:, None, None] + 1)) - 1)
    above = np.arccos(np.clip(-1 / (np.tan(theta)[:, None] * np.tan(psi)), -1, 1)) / np.pi
    return RectBivariateSpline(np.log(alpha), theta, 4 * np.pi / (alpha[:, None] + 1) * above.mean(2))


def film(theta, visibility, thickness, index=1.5):
    """Reflectance of a film over its mean over the phase. Born & Wolf, section 7.6: Airy's sum with constant amplitudes.

    `thickness` is optical, in wavelengths; `visibility` is 2·r1·r2/(r1² + r2²), r1 = (index - 1)/(index + 1).
    """
    r1 = (index - 1) / (index + 1)
    r2 = r1 * visibility / (1 + np.sqrt(1 - visibility**2))
    wave = 2 * r1 * r2 * np.cos(2 * np.pi * fringes(theta, thickness, index))
    mean = (r1**2 + r2**2 - 2 * (r1 * r2) ** 2) / (1 - (r1 * r2) ** 2)
    return (r1**2 + r2**2 + wave) / (1 + (r1 * r2) ** 2 + wave) / mean


def fringes(theta, thickness, index=1.5):
    """The path through a film and back, in wavelengths."""
    return 2 * thickness * np.sqrt(1 - (np.sin(theta) / index) ** 2)


def profiles(rng, theta, ks, kl, correlation, count):
    """Mean power of `count` random Gaussian profiles by Kirchhoff's integral: |∫exp(2jk(x·sin θ + z·cos θ))dx|²/cos²θ.

    Thorsos, J. Acoust. Soc. Am. 83 (1988) 78, integrated by parts; the illumination is Gaussian. λ = 1.
    """
    k, step, points = 2 * np.pi, 1 / 6, 576
    x = (np.arange(points) - points / 2) * step
    wave = (2 * np.pi * np.fft.rfftfreq(points, step) * kl / k) ** 2
    spectrum = np.exp(-wave / 4) if correlation == "gaussian" else 1 / (1 + wave)
    z = np.fft.irfft(np.fft.rfft(rng.standard_normal((count, points))) * np.sqrt(spectrum), points)
    z *= ks / k / np.sqrt(np.sum(np.fft.irfft(np.sqrt(spectrum), points) ** 2))
    x, z = x.astype(np.float32), z.astype(np.float32)
    beam = np.exp(-((4 * x / (points * step)) ** 2))
    power = []
    for t in theta.tolist():
        phase = 2 * k * (np.sin(t) * x + np.cos(t) * z).astype(np.float32)
        power.append(np.mean((np.cos(phase) @ beam) ** 2 + (np.sin(phase) @ beam) ** 2) / np.cos(t) ** 2)
    return np.array(power) / np.sum(beam**2)


class Part:
    """A term of a law: σ⁰ of level 1 by its numbers, their grid and bounds, and what is free, first the level.

    A search has the ln of a number, except of the power of a cosine.
    """

    def __init__(self, shape, grid, bounds, free=None):
        self.shape, self.grid, self.plain = shape, list(grid), shape is cosine
        self.free = [True] * (1 + len(bounds)) if free is None else free
        self.low, self.high = zip((-40, 20), *(bounds if self.plain else np.log(bounds)))
        self.step = [3] + [300 if self.plain else 1] * len(bounds)


WIDTHS, POWERS, POINTS = np.geomspace(0.01, 2, 16), (0, 1, 4, 20, 100, 500), 120
SOME = np.linspace(0, 1.45, 600)
ROUGH = list(itertools.product(np.geomspace(0.1, 12, 14), np.geomspace(0.3, 600, 17)))  # k·s, k·l
MIRROR = list(itertools.product(np.geomspace(0.1, 2.5, 6), np.geomspace(0.1, 300, 12), np.geomspace(0.005, 0.5, 6)))
DIRECTIVE = list(itertools.product(np.geomspace(1, 200, 8), (1, 14, 200), np.geomspace(1e-6, 10, 8)))
PARTS = {
    None: Part(lambda theta, m: np.zeros_like(theta), [(1,)], [(0.001, 2)], [False, False]),
    "flat": Part(cosine, [(0,)], [(0, 1000)], [True, False]),
    "power": Part(cosine, [(power,) for power in POWERS], [(0, 1000)]),
    "directive": Part(directive, DIRECTIVE, [(1, 200), (1, 200), (1e-9, 1e3)]),
}
for name in "ggx", "beckmann", "go":
    PARTS[name] = Part(functools.partial(lobe, name), [(m,) for m in WIDTHS], [(0.001, 2)])
for name in "gaussian", "exponential":  # above k·s = 2.5 the mirror's part is nothing
    PARTS[name] = Part(functools.partial(kirchhoffs, name), ROUGH, [(0.03, 12), (0.1, 600)])
    PARTS[f"{name}-mirror"] = Part(functools.partial(kirchhoffs, name), MIRROR, [(0.03, 2.5), (0.1, 600), (0.001, 0.5)])
LAWS = {  # two parts or three: what `--model` names, and, after these, what else may be the same curve
    None: ["ggx", "flat"], "mixture": ["beckmann", "power"], "mixture-ggx": ["ggx", "power"], "lambert": [None, "flat"],
    "blinn-phong": [None, "power"], "cook-torrance": ["beckmann", None], "cook-torrance-ggx": ["ggx", None],
    "kirchhoff-go": ["go", None],
    "cosine-lambert": ["power", "flat"], "ggx-ggx": ["ggx", "ggx", "flat"], "beckmann-ggx": ["beckmann", "ggx", "flat"],
    "beckmann-beckmann": ["beckmann", "beckmann", "flat"], "directive": ["directive", None],
    "kirchhoff-gaussian": ["gaussian", None], "kirchhoff-gaussian-mirror": ["gaussian-mirror", None],
    "kirchhoff-exponential-mirror": ["exponential-mirror", None], "kirchhoff-exponential": ["exponential", None],
}


class Refit:
    """The best refits of a law to many curves at once, in dB: a grid of shapes, then Levenberg–Marquardt from the best.

    A fit is, for each part, the ln of its level and its numbers.
    """

    def __init__(self, law, thetas):
        self.parts = [PARTS[name] for name in LAWS[law]]
        self.free, self.low, self.high, self.longest = (
            np.concatenate([getattr(part, name) for part in self.parts]) for name in ("free", "low", "high", "step"))
        self.used = np.array([np.arange(POINTS) < len(t) for t in thetas])
        self.theta = self.padded(thetas)
        shapes = [[(numbers, part.shape(self.theta, *numbers)) for numbers in part.grid] for part in self.parts]
        self.grid = [list(zip(*cell)) for cell in itertools.product(*shapes)]
        if self.parts[0] is self.parts[1]:
            self.grid = [cell for cell in self.grid if cell[0][0] < cell[0][1]]

    def padded(self, rows):
        return np.array([np.pad(row, (0, POINTS - len(row))) for row in rows])

    def levels(self, shapes):
        """Of the sum of shapes that is nearest to 1, none below 0. Two are exact. With a third, the two and the third in
        turn; each keeps a hundredth of what it would be alone, from which a search can raise it."""
        one = [np.sum(a, 1) + 1e-200 for a in shapes]
        both = [[np.sum(a * b, 1) + 1e-200 for b in shapes] for a in shapes]
        aa, ad, dd, third, t = both[0][0], both[0][1], both[1][1], range(2, len(shapes)), 0
        det = aa * dd - ad * ad + 1e-300
        for _ in range(20 if third else 1):
            a1, d1 = (one[i] - sum(both[i][j] * t for j in third) for i in (0, 1))
            with np.errstate(over="ignore"):
                s = np.clip((a1 * dd - d1 * ad) / det, 0, np.maximum(a1 / aa, 0))
                r = np.clip((d1 * aa - a1 * ad) / det, 0, np.maximum(d1 / dd, 0))
            for j in third:
                t = np.maximum(one[j] - both[0][j] * s - both[1][j] * r, 0) / both[j][j]
        return [np.maximum(x, 0.01 * one[i] / both[i][i]) for i, x in enumerate((s, r, t))] if third else [s, r]

    def start(self, grid, level_db):
        """Levels by relative least squares, and the shape of the grid that is then best in dB."""
        level, count = np.exp(level_db / DB), self.used.sum(1)
        best, found = np.full(len(level), np.inf), np.zeros((len(level), len(self.free)))
        for numbers, shapes in grid:
            shapes = [np.where(self.used, shape / level, 0) for shape in shapes]
            levels = self.levels(shapes)
            off = np.where(self.used, db(sum(s[:, None] * a for s, a in zip(levels, shapes))), 0)
            mean = off.sum(1) / count
            cost = (off**2).sum(1) - count * mean**2
            p = []
            for part, some, s in zip(self.parts, numbers, levels):
                p.append(np.log(np.maximum(s * np.exp(-mean / DB), 1e-12)))
                p += [np.full_like(s, x if part.plain else np.log(x)) for x in some]
            found = np.where((cost < best)[:, None], np.stack(p, 1), found)
            best = np.minimum(cost, best)
        return found

    def residual(self, p, level_db, rows=slice(None)):
        """Curve less fit in dB, the derivatives of the fit, and the sum of squares, of some of the curves."""
        p, terms, changes, theta, used = list(p.T[:, :, None]), [], [], self.theta[rows], self.used[rows]
        for part in self.parts:
            level, numbers, p = np.exp(p[0]), p[1: len(part.free)], p[len(part.free):]
            given = numbers if part.plain else np.exp(numbers)
            shape = part.shape(theta, *given)
            terms.append(level * shape)
            wider = [] if part.plain else [part.shape(theta, *given[:i], np.exp(x + 1e-5), *given[i + 1:])
                                           for i, x in enumerate(numbers)]
            changes.append([level * (w - shape) / 1e-5 for w in wider])
        total, slopes = np.maximum(sum(terms), 1e-30), []
        for part, term, change in zip(self.parts, terms, changes):
            slopes += [term / total, *(c / total for c in change)]
            slopes += [slopes[-1] * np.log(np.cos(theta))] if part.plain else []
        off = np.where(used, level_db[rows] - db(total), 0)
        return off, DB * np.stack(slopes, 2) * (used[:, :, None] & self.free), np.sum(off**2, 1)

    def descend(self, p, level_db, steps, thorough):
        off, slopes, cost = self.residual(p, level_db)
        damping, idle = np.full(len(p), 1e-2), np.zeros(len(p))
        for _ in range(steps):
            rows = np.nonzero(idle < 5)[0] if thorough else np.arange(len(p))
            if not len(rows):
                break
            pull = (slopes[rows].transpose(0, 2, 1) @ off[rows, :, None])[:, :, 0]
            outward = np.where(pull < 0, p[rows] <= self.low, p[rows] >= self.high)
            free = self.free & ~(thorough & outward)
            some = slopes[rows] * free[:, None]
            normal = some.transpose(0, 2, 1) @ some
            diagonal = np.einsum("bii->bi", normal)
            diagonal += damping[rows, None] * diagonal + 1e-9 + ~free
            step = np.linalg.solve(normal, (pull * free)[:, :, None])[:, :, 0]
            new = np.clip(p[rows] + np.clip(step, -self.longest, self.longest), self.low, self.high)
            tried = self.residual(new, level_db, rows)
            better, idle[rows] = tried[2] < cost[rows], np.where(tried[2] < 0.999 * cost[rows], 0, idle[rows] + 1)
            damping[rows] = np.clip(np.where(better, damping[rows] / 5, damping[rows] * 6), 1e-7, 1e7)
            for old, found in zip((p, off, slopes, cost), (new, *tried)):
                old[rows[better]] = found[better]
        return p, cost

    def left(self, curves_db, bands=3, short=7, long=15, thorough=False):
        """The rms of each curve, in dB, that no numbers of the law explain: short searches from the best shape of each
        band of the grid, and a long one from the best of their ends. Both are steps. A thorough search leaves numbers at
        a bound out of a step beyond it, and ends with five idle steps. The curves of part B are drawn by the other."""
        level_db, size = self.padded(curves_db), -(-len(self.grid) // bands)
        grids = [self.grid[i: i + size] for i in range(0, len(self.grid), size)]
        ends, costs = zip(*(self.descend(self.start(grid, level_db), level_db, short, thorough) for grid in grids))
        p = np.array(ends)[np.argmin(costs, axis=0), np.arange(len(level_db))]
        return np.sqrt(self.descend(p, level_db, long, thorough)[1] / self.used.sum(1))
