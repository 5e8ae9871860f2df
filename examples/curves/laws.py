"""The scattering laws, as sigma0 per unit level: formulas of the documentation, in code of their own.

Every model is `levels @ basis(shape, theta)`: sigma0 is linear in the levels, and the rest is the shape.
"""

import functools
import math

import numpy as np
from scipy.interpolate import RectBivariateSpline
from scipy.special import gammaln

WAVE_NUMBER = 2 * math.pi * 300e9 / 299_792_458.0


def beckmann(m, theta):
    """pi*D*cos2: sigma0 of a smooth facet's lobe, for a reflectance of one."""
    with np.errstate(under="ignore"):
        return np.exp(-((np.tan(theta) / m) ** 2)) / (m * m * np.cos(theta) ** 4)


def g1_beckmann(m, theta):
    a = 1 / np.maximum(m * np.tan(theta), 1e-30)
    low = np.minimum(a, 1.6)
    value = (3.535 * low + 2.181 * low**2) / (1 + 2.276 * low + 2.577 * low**2)
    return np.where(a < 1.6, value, 1.0)


def cook_torrance(m, theta, ggx):
    if ggx:
        t2 = np.tan(theta) ** 2
        lobe = m * m / (np.cos(theta) ** 4 * (m * m + t2) ** 2)
        return lobe * (2 / (1 + np.sqrt(1 + m * m * t2))) ** 2
    return beckmann(m, theta) * g1_beckmann(m, theta) ** 2


def blinn_phong(alpha, theta):
    return 2 * (alpha + 2) * np.cos(theta) ** (alpha + 2)


def correlation_series(height, length, theta):
    """exp(-x) * sum x**n/n! * exp(-q2*l2/(4n))/n for one height and an array of lengths: (len(length), n)."""
    x = (2 * WAVE_NUMBER * height * np.cos(theta)) ** 2
    quarter = (WAVE_NUMBER * length[:, None] * np.sin(theta)) ** 2  # q2*l2/4 with q = 2k*sin
    first = max(1, int(x.min() - 9 * math.sqrt(x.min()) - 5))
    n = np.arange(first, int(x.max() + 9 * math.sqrt(x.max()) + 14), dtype=float)[:, None]
    log_weight = n * np.log(x) - x - gammaln(n + 1) - np.log(n)
    with np.errstate(under="ignore"):
        return np.stack([np.exp(log_weight - row / n).sum(0) for row in quarter])


def kirchhoff(height, length, lobe, theta):
    """Coherent lobe and incoherent series, Gaussian correlation; (S, 1) columns give (S, n)."""
    pairs, where = np.hstack(np.broadcast_arrays(height, length)), np.zeros(1, int)
    if len(pairs) > 1:  # a grid has few heights and lengths
        pairs, where = np.unique(pairs, axis=0, return_inverse=True)
    series = np.empty((len(pairs), theta.size))
    for h in dict.fromkeys(pairs[:, 0]):
        rows = np.flatnonzero(pairs[:, 0] == h)
        series[rows] = correlation_series(max(h, 1e-12), pairs[rows, 1], theta.ravel())
    x = (2 * WAVE_NUMBER * height * np.cos(theta)) ** 2
    front = (WAVE_NUMBER * length / np.cos(theta)) ** 2  # k2/(pi*cos2) times pi*l2
    return np.exp(-x) * cook_torrance(lobe, theta, False) + front * series[where.ravel()]


@functools.lru_cache(maxsize=1)
def hemisphere():
    """ln of the integral of ((1+cos psi)/2)**alpha over the hemisphere, psi from a direction at theta."""
    angle = np.radians(np.linspace(0, 89.9, 90))
    power = np.geomspace(1, 200, 70)
    u, w = np.polynomial.legendre.leggauss(96)
    mu, w = (u + 1) / 2, w / 2
    azimuth = np.linspace(0, 2 * np.pi, 256, endpoint=False)
    value = np.empty((len(power), len(angle)))
    for j, t in enumerate(angle):
        c = mu[:, None] * np.cos(t) + np.sqrt(1 - mu[:, None] ** 2) * np.sin(t) * np.cos(azimuth)
        half = np.log(np.maximum((1 + c) / 2, 1e-300))
        for i, a in enumerate(power):
            value[i, j] = np.log((w[:, None] * np.exp(a * half)).sum() * 2 * np.pi / 256)
    return RectBivariateSpline(np.log(power), angle, value, kx=3, ky=3)


def directive(alpha_r, alpha_i, back, theta):
    """Degli-Esposti's two lobes, IEEE Trans. Antennas Propag. 55 (2007) 143; `back` is 1 - lambda."""
    t = np.broadcast_to(theta, np.broadcast(alpha_r, theta).shape)
    log_r = np.broadcast_to(np.log(alpha_r), t.shape)
    log_i = np.broadcast_to(np.log(alpha_i), t.shape)
    f_r, f_i = np.exp(hemisphere().ev(log_r, t)), np.exp(hemisphere().ev(log_i, t))
    lobes = (1 - back) * np.cos(t) ** (2 * alpha_r) + back
    return 4 * np.pi * np.cos(t) * lobes / ((1 - back) * f_r + back * f_i)


class Model:
    """A law: names and bounds of shape and levels, and how to read them from the estimates of a fit.

    `shape` is a list of (name, low, high, shift): the search runs in ln(value + shift). All levels are 0 to 1.
    """

    def __init__(self, name, shape, levels, basis, read):
        self.name, self.shape, self.levels, self.basis, self.read = name, shape, levels, basis, read

    def columns(self, search):
        """(S, K) of the search to K columns (S, 1) within the bounds."""
        return [np.clip(np.exp(search[:, [i]]) - s[3], s[1], s[2]) for i, s in enumerate(self.shape)]

    def bounds(self):
        return [(math.log(low + shift), math.log(high + shift)) for _, low, high, shift in self.shape]

    def hold(self, shape):
        """Options of matdb fit that hold the shape."""
        pairs = [("lambda", 1 - v) if s[0] == "1 - lambda" else (s[0], v) for s, v in zip(self.shape, shape)]
        return [w for name, v in pairs for w in ("--fix", f"{name}={v:.9g}")]

    def sigma0(self, shape, levels, theta):
        return np.asarray(levels) @ self.basis([np.array([[v]]) for v in shape], np.asarray(theta)[None, :])[0]


def stack(*parts):
    return np.stack(parts, axis=1)


def reflectance(e):
    root = np.sqrt(complex(e["eps_real"], -e["eps_imag"]))
    return abs((root - 1) / (root + 1)) ** 2


def facets(name, ggx):
    return Model(name, [("m", 1e-3, 2.0, 0.0)], ["f_lambda"], lambda s, t: stack(cook_torrance(s[0], t, ggx)),
                 lambda e: ([e["m"]], [e["f_lambda"]]))


def mixture(name, ggx):
    return Model(name, [("diffuse.alpha", 0.0, 1000.0, 1.0), ("specular.m", 1e-3, 2.0, 0.0)], ["R", "S"],
                 lambda s, t: stack(blinn_phong(s[0], t) + 0 * s[1], cook_torrance(s[1], t, ggx) + 0 * s[0]),
                 lambda e: ([e["diffuse.alpha"], e["specular.m"]], [e["R"], e["S"]]))


MODELS = {m.name: m for m in [
    Model("lambert", [], ["albedo"], lambda s, t: stack(4 * np.cos(t) ** 2), lambda e: ([], [e["albedo"]])),
    Model("blinn-phong", [("alpha", 0.0, 1000.0, 1.0)], ["r_s"], lambda s, t: stack(blinn_phong(s[0], t)),
          lambda e: ([e["alpha"]], [e["r_s"]])),
    facets("cook-torrance", False),
    facets("cook-torrance-ggx", True),
    mixture("mixture", False),
    mixture("mixture-ggx", True),
    Model("fresnel", [("lobe_rad", 1e-3, 0.5, 0.0)], ["reflectance"],
          lambda s, t: stack(cook_torrance(s[0], t, False)),
          lambda e: ([e["lobe_rad"]], [reflectance(e)])),
    Model("kirchhoff-go", [("rms_slope", 1e-3, 1.0, 0.0)], ["reflectance"],
          lambda s, t: stack(beckmann(math.sqrt(2) * s[0], t)), lambda e: ([e["rms_slope"]], [reflectance(e)])),
    Model("kirchhoff", [("rms_height_m", 0.0, 2e-3, 1e-7), ("correlation_length_m", 1e-5, 0.1, 0.0),
                        ("lobe_rad", 1e-3, 0.5, 0.0)],
          ["reflectance"], lambda s, t: stack(kirchhoff(s[0], s[1], s[2], t)),
          lambda e: ([e[n] for n in ("rms_height_m", "correlation_length_m", "lobe_rad")], [reflectance(e)])),
    Model("directive", [("alpha_r", 1.0, 200.0, 0.0), ("alpha_i", 1.0, 200.0, 0.0), ("1 - lambda", 0.0, 1.0, 1e-7)],
          ["s squared"], lambda s, t: stack(directive(s[0], s[1], s[2], t)),
          lambda e: ([e["alpha_r"], e["alpha_i"], 1 - e["lambda"]], [e["s"] ** 2])),
]}
