"""One Gaussian beam, its speckle and its noise, in numpy: from the equations alone, with no code of the program."""

import functools

import numpy as np
from scipy.special import gammaincc, gammainccinv

LIGHT_M_S = 299_792_458.0
WAVELENGTH_M = LIGHT_M_S / 300e9
CELL_M = LIGHT_M_S / (2 * 27e9)
POWER_DBM, FOCUS_M, THRESHOLD_DBM = 7.0, 8.0, -77.0
RANGE_SD_M = 0.001
GATE_M, GATE_START_M = 1.0, 7.5
FALSE_ALARM = 3e-4  # of a gate without an echo
LN_WIDTH = np.linspace(-1.6, 1.6, 17)  # ln of what multiplies m, where a table has the lobe
# Half width at 1/e of the field for a spot of 16 mm, by what "diameter" means.
SPOT = {8.0: "1/e2", 13.6: "one-way-fwhm", 19.2: "two-way-fwhm"}


def waist_m(name_mm):
    """Waist at the focus: 16 mm as 1/e2 diameter, or as FWHM of exp(-2r^2/w^2) or of exp(-4r^2/w^2)."""
    return {8.0: 0.008, 13.6: 0.016 / np.sqrt(2 * np.log(2)), 19.2: 0.016 / np.sqrt(np.log(2))}[name_mm]


def loss_db(w0):
    """System loss that keeps the level of an extended target whatever the waist; 12.5 dB at 13.6 mm."""
    return 12.5 + 20 * np.log10(waist_m(13.6) / w0)


def beam_width_m(w0, range_m):
    """w at a range; the scene declares no growth off the axis."""
    rayleigh = np.pi * w0**2 / WAVELENGTH_M
    return w0 * np.sqrt(1 + ((range_m - FOCUS_M) / rayleigh) ** 2)


def db(x):
    return 10 * np.log10(np.maximum(x, 1e-30))


def mw(x):
    return 10 ** (np.asarray(x) / 10)


def smith(distribution, slope):
    """G1 at m tan(theta), as Walter gives it."""
    if distribution == "ggx":
        return 2 / (1 + np.sqrt(1 + slope**2))
    a = 1 / np.maximum(slope, 1e-9)
    return np.where(a < 1.6, (3.535 * a + 2.181 * a**2) / (1 + 2.276 * a + 2.577 * a**2), 1.0)


class Law:
    """f(theta) of Mitsuba's table, convolved over slope with the beam's own kernel exp(-s^2/d^2)/(pi d^2)."""

    def __init__(self, base, w0, material):
        self.angle, self.material = base["angle_rad"], material
        parts = {"lobe": base["f_lobe"], "rest": base["f_all"] - base["f_lobe"]}
        self.log = {part: np.log(np.maximum(f, 1e-20)) for part, f in parts.items()}  # below it Mitsuba says 0
        self.delta = WAVELENGTH_M / (2 * np.pi * beam_width_m(w0, FOCUS_M + np.array([0.0, 0.25, 0.5])))[::-1]
        self.wide = {part: self.convolved(functools.partial(self.bare, part=part)) for part in self.log}

    def convolved(self, bare):
        """ln of a law after the beam: a row for each delta, over the angles of the table."""
        x, w = np.polynomial.hermite.hermgauss(15)
        a, b = np.meshgrid(x, x)
        weight = np.outer(w, w) / np.pi
        slope = np.tan(self.angle)[:, None, None]
        rows = [np.sum(weight * bare(np.arctan(np.hypot(slope + d * a, d * b))), axis=(1, 2)) for d in self.delta]
        return np.log(np.array(rows))

    def bare(self, theta, part):
        return np.exp(np.interp(theta, self.angle, self.log[part]))

    def rougher(self, theta, width):
        """The lobe before the beam of a surface with `width` times the m: f cos^6/G1^2 is the density of its slopes."""
        met, m = np.arctan(np.tan(theta) / width), self.material["m"]
        g, g_met = (smith(self.material["distribution"], slope) for slope in (width * m * np.tan(theta), m * np.tan(met)))
        return self.bare(met, "lobe") * (np.cos(met) / np.cos(theta)) ** 6 * (g / g_met) ** 2 / width**2

    @functools.cached_property
    def lobes(self):
        """Tables of the lobe after the beam, for e^x times the m, x of LN_WIDTH."""
        return np.array([self.convolved(functools.partial(self.rougher, width=np.exp(x))) for x in LN_WIDTH])

    def f(self, theta, delta, part):
        return self.at(self.wide[part], theta, delta)

    def at(self, table, theta, delta):
        """Of a table, or of each of several."""
        below = np.clip(np.searchsorted(self.angle, theta) - 1, 0, len(self.angle) - 2)
        way = np.clip((theta - self.angle[below]) / (self.angle[below + 1] - self.angle[below]), 0, 1)
        rows = table[..., below] * (1 - way) + table[..., below + 1] * way
        step = (self.delta[1:] - self.delta[:-1])[:, None]
        share = np.clip((np.clip(delta, self.delta[0], self.delta[-1]) - self.delta[:-1, None]) / step, 0, 1)
        return np.exp(rows[..., 0, :] + np.sum(share * np.diff(rows, axis=-2), axis=-2))


def mean_noise_mw(looks):
    """Noise in a range cell, so that a gate of mean-of-looks noise passes the threshold with FALSE_ALARM."""
    cells = GATE_M / CELL_M
    return looks * mw(THRESHOLD_DBM) / gammainccinv(looks, -np.expm1(np.log1p(-FALSE_ALARM) / cells))


def alarm_probability(looks, noise_mw):
    cells = GATE_M / CELL_M
    return -np.expm1(cells * np.log1p(-gammaincc(looks, looks * mw(THRESHOLD_DBM) / noise_mw)))


def below_ceiling(power, ceiling):
    """Mean power over speckle, where each look is below a ceiling."""
    looks, weight = np.polynomial.laguerre.laggauss(32)
    return ceiling * np.tanh(np.sqrt(np.multiply.outer(power, looks) / ceiling)) ** 2 @ weight


def look_weights(looks):
    """A broken number of looks is one weak look among whole ones: weights 1, ..., 1, b, (sum)^2 / sum of squares = looks."""
    n = int(np.ceil(looks)) - 1
    b = (n - np.sqrt(n * (n - (looks - 1) * (looks - n)))) / (looks - 1) if n else 1.0
    weights = np.array([1.0] * n + [b])
    return weights / weights.mean()


def speckle(rng, looks, w0, where, piece, shared):
    """Complex fields of unit mean intensity, one row a look.

    Shared: scatterers on a jittered lattice of w0/3, fixed to the surface (one set for each piece of the target),
    weighed by the two-way field exp(-2 d^2/w0^2): amplitudes of beams d apart correlate as exp(-d^2/w0^2)."""
    n = len(where)
    if not shared:
        return (rng.normal(size=(looks, n)) + 1j * rng.normal(size=(looks, n))) / np.sqrt(2)
    out = np.zeros((looks, n), complex)
    step, reach = w0 / 3, 6
    cell = np.floor(where / step).astype(int)
    low = cell.min(0) - reach
    shape = tuple(cell.max(0) + reach + 1 - low)
    for p in np.unique(piece):
        jitter = rng.uniform(0, 1, shape + (2,))
        wave = (rng.normal(size=(looks,) + shape) + 1j * rng.normal(size=(looks,) + shape)) / np.sqrt(2)
        mine = np.flatnonzero(piece == p)
        norm = np.zeros(len(mine))
        for i in range(-reach, reach + 1):
            for j in range(-reach, reach + 1):
                at = cell[mine] + (i, j) - low
                d = (cell[mine] + (i, j) + jitter[at[:, 0], at[:, 1]]) * step - where[mine]
                weight = np.exp(-2 * np.sum(d**2, 1) / w0**2)
                out[:, mine] += weight * wave[:, at[:, 0], at[:, 1]]
                norm += weight**2
        out[:, mine] /= np.sqrt(norm)
    return out


def detect(rng, power_mw, steady, range_m, fields, noise_mw, ceiling_mw=None):
    """Echo of every chirp (power in dBm, range; NaN where silent), and which are false alarms.

    `steady` is the share of an echo that does not speckle. Every look has noise of its own. The strongest cell of the
    gate is reported if it passes the threshold."""
    looks, n = fields.shape
    fixed = np.sqrt(power_mw * steady) * np.exp(-4j * np.pi * range_m / WAVELENGTH_M)
    noise = (rng.normal(size=(looks, n)) + 1j * rng.normal(size=(looks, n))) * np.sqrt(noise_mw / 2)
    each = np.abs(fixed + np.sqrt(power_mw * (1 - steady)) * fields + noise) ** 2
    if ceiling_mw is not None:
        each = ceiling_mw * np.tanh(np.sqrt(each / ceiling_mw)) ** 2
    echo = np.where(range_m > 0, each.mean(0), 0.0)
    cells = GATE_M / CELL_M - 1
    other = noise_mw / looks * gammainccinv(looks, -np.expm1(np.log(rng.uniform(size=n)) / cells))
    alarm = other > echo
    power = db(np.maximum(echo, other))
    where = np.where(alarm, rng.uniform(GATE_START_M, GATE_START_M + GATE_M, n), range_m + rng.normal(0, RANGE_SD_M, n))
    seen = power >= THRESHOLD_DBM
    return np.where(seen, power, np.nan), np.where(seen, where, np.nan), alarm & seen
