"""Backscatter of surfaces, σ⁰ = 4π·f·cos²θ with f in 1/sr, and the best refit of a law. Angles in rad, levels linear."""

import numpy as np

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


def kirchhoff(theta, ks, kl):
    """σ⁰ of exponentially correlated heights, reflectance 1. Ulaby, Moore & Fung, vol. 2 (1982), ch. 12: the series of
    exp(q²s²ρ), q = 2k·cos θ, each term with the spectrum (l/n)²/(1 + (2kl·sin θ/n)²)^1.5."""
    phase, total = (2 * ks * np.cos(theta)) ** 2, 0
    weight = np.exp(-phase)
    for n in range(1, int(phase.max() + 10 * np.sqrt(phase.max()) + 20)):
        weight = weight * phase / n
        total = total + weight * (kl / n) ** 2 / (1 + (2 * kl * np.sin(theta) / n) ** 2) ** 1.5
    return 2 * total / np.cos(theta) ** 2


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


LAWS = {  # what `--model` names: the lobe, and the least power of the diffuse part's cosine and whether it is free
    None: ("ggx", 0, False), "mixture": ("beckmann", 0, True), "mixture-ggx": ("ggx", 0, True),
    "lambert": (None, 0, False), "blinn-phong": (None, 0, True), "cook-torrance": ("beckmann", None, False),
    "cook-torrance-ggx": ("ggx", None, False), "kirchhoff-go": ("go", None, False),
}
WIDTHS, POWERS, POINTS = np.geomspace(0.01, 2, 16), (0, 1, 4, 20, 100, 500), 120


class Refit:
    """The best refits of a law to many curves at once, in dB: a grid of shapes, then Levenberg–Marquardt from the best.

    A fit is four numbers: ln of the lobe's level, ln of its width, ln of the diffuse level, the power of its cosine.
    """

    def __init__(self, law, thetas):
        self.kind, power, free = LAWS[law]
        self.used = np.array([np.arange(POINTS) < len(t) for t in thetas])
        self.theta = self.padded(thetas)
        self.free = np.array([self.kind is not None] * 2 + [power is not None, free])
        shapes = [(m, p) for m in (WIDTHS if self.kind else [1]) for p in (POWERS if free else [0])]
        self.grid = [(m, p, *self.parts(m, p)) for m, p in shapes]

    def padded(self, rows):
        return np.array([np.pad(row, (0, POINTS - len(row))) for row in rows])

    def parts(self, m, power):
        return lobe(self.kind, self.theta, m), cosine(self.theta, power if self.free[2] else None)

    def start(self, grid, level_db):
        """Levels by relative least squares, and the shape of the grid that is then best in dB."""
        level, count = np.exp(level_db / DB), self.used.sum(1)
        best, found = np.full(len(level), np.inf), np.zeros((len(level), 4))
        for m, power, *shapes in grid:
            a, d = (np.where(self.used, s / level, 0) for s in shapes)
            aa, ad, dd, a1, d1 = (np.sum(x, 1) + 1e-200 for x in (a * a, a * d, d * d, a, d))
            det = aa * dd - ad * ad + 1e-300
            s, r = np.clip((a1 * dd - d1 * ad) / det, 0, a1 / aa), np.clip((d1 * aa - a1 * ad) / det, 0, d1 / dd)
            off = np.where(self.used, db(s[:, None] * a + r[:, None] * d), 0)
            mean = off.sum(1) / count
            cost = (off**2).sum(1) - count * mean**2
            s, r = (np.log(np.maximum(x * np.exp(-mean / DB), 1e-12)) for x in (s, r))
            numbers = np.stack([s, np.full_like(s, np.log(m)), r, np.full_like(s, power)], 1)
            found = np.where((cost < best)[:, None], numbers, found)
            best = np.minimum(cost, best)
        return found

    def residual(self, p, level_db):
        """Curve less fit in dB, the derivatives of the fit, and the sum of squares."""
        s, m, r, power = p.T[:, :, None]
        shape, flat = self.parts(np.exp(m), power)
        wider = lobe(self.kind, self.theta, np.exp(m + 1e-5))
        total = np.maximum(np.exp(s) * shape + np.exp(r) * flat, 1e-30)
        a, d = np.exp(s) * shape / total, np.exp(r) * flat / total
        slopes = [a, np.exp(s) * (wider - shape) / 1e-5 / total, d, d * np.log(np.cos(self.theta))]
        off = np.where(self.used, level_db - db(total), 0)
        return off, DB * np.stack(slopes, 2) * (self.used[:, :, None] & self.free), np.sum(off**2, 1)

    def descend(self, p, level_db, steps):
        off, slopes, cost = self.residual(p, level_db)
        damping = np.full(len(p), 1e-2)
        for _ in range(steps):
            normal = slopes.transpose(0, 2, 1) @ slopes
            diagonal = np.einsum("bii->bi", normal)
            diagonal += damping[:, None] * diagonal + 1e-9 + ~self.free
            step = np.linalg.solve(normal, slopes.transpose(0, 2, 1) @ off[:, :, None])[:, :, 0]
            step = np.clip(step, [-3, -1, -3, -300], [3, 1, 3, 300])
            new = np.clip(p + step, [-40, np.log(0.001), -40, 0], [20, np.log(2), 20, 1000])
            tried = self.residual(new, level_db)
            better = tried[2] < cost
            p[better], off[better], slopes[better], cost[better] = (x[better] for x in (new, *tried))
            damping = np.clip(np.where(better, damping / 5, damping * 6), 1e-7, 1e7)
        return p, cost

    def left(self, curves_db, bands=3, short=7, long=15):
        """The rms of each curve, in dB, that no numbers of the law explain: short searches from the best shape of each
        band of the grid, and a long one from the best of their ends. Both are steps."""
        level_db, size = self.padded(curves_db), -(-len(self.grid) // bands)
        grids = [self.grid[i: i + size] for i in range(0, len(self.grid), size)]
        ends, costs = zip(*(self.descend(self.start(grid, level_db), level_db, short) for grid in grids))
        p = np.array(ends)[np.argmin(costs, axis=0), np.arange(len(level_db))]
        return np.sqrt(self.descend(p, level_db, long)[1] / self.used.sum(1))
