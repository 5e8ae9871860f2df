"""What a law alone can follow: its maximum-likelihood fit to mean powers, without noise."""

import functools
from typing import Callable, NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares

import physics

NEPERS = np.log(10) / 10  # of power, in one dB
STARTS = (0.0, -0.3, 0.3)  # ln of what multiplies m, where a fit begins
MOST = np.log(physics.GATE_M / physics.RANGE_SD_M / physics.FALSE_ALARM)  # what a chirp can lose: a false alarm costs as much


class Shape(NamedTuple):
    """A form that is no gain: what its numbers make of the chirps."""

    at: Callable  # numbers -> what multiplies the slopes (None: lobes stay), power that is added, mW; of every chirp
    starts: list  # numbers from which fits begin
    least: list
    most: list


class Fit(NamedTuple):
    numbers: np.ndarray  # the law's four, then one of each gain, then those of the shape
    left: np.ndarray  # ln of power over model, of each chirp in use

    def of_form(self):
        return self.numbers[4:].tolist()

    def rms_db(self):
        return float(np.sqrt(np.mean(self.left**2)) / NEPERS)

    def loss(self, looks):
        """What the model loses in ln p against the powers themselves: the looks times q - 1 - ln q, q = power over model."""
        return float(np.sum(np.minimum(looks * (np.expm1(self.left) - self.left), MOST)))


class Law:
    """The law of an undisturbed state with four free numbers: ln of what multiplies the level of the lobe, that of the
    rest and m, and a power of the cosine for the rest, at least 0 as in Blinn and Phong's law."""

    def __init__(self, before):
        self.theta, range_m = before.theta(), np.where(before.range_m > 0, before.range_m, physics.FOCUS_M)
        self.power_mw = before.means_mw()[0]
        lobe, self.rest = before.parts_mw(self.theta, range_m)
        self.ln_cos, self.delta, self.law = np.log(np.cos(self.theta)), before.delta(range_m), before.law
        self.scale = lobe / self.law.f(self.theta, self.delta, "lobe")
        self.ln_lobe = self.lobes(np.ones(before.n), slice(None))

    def lobes(self, slope_scale, use):
        """ln of the lobes of chirps over ln of what multiplies m, where slope_scale multiplies the slope of each."""
        theta = self.theta[use]
        met = np.arctan(np.tan(theta) * slope_scale[use])
        rows = self.law.at(self.law.lobes, met, self.delta[use])
        return CubicSpline(physics.LN_WIDTH, np.log(rows * self.scale[use] * (np.cos(met) / np.cos(theta)) ** 6))

    def means_mw(self, numbers):
        """Mean power of every chirp by the law's four numbers; 0 where it hits nothing."""
        lobe, rest, wider, power = numbers[:4]
        whole = np.exp(lobe + self.ln_lobe(wider)) + self.rest * np.exp(rest + power * self.ln_cos)
        return np.where(self.power_mw > 0, whole, 0.0)

    def fit(self, power_mw, use, gains=(), shape=None):
        """The best fit, by the likelihood of Gamma, to powers of the chirps in use. A gain is that of each chirp, dB per unit."""
        true, rest, ln_cos = np.log(np.maximum(power_mw[use], 1e-30)), self.rest[use], self.ln_cos[use]
        gains = np.array([NEPERS * gain[use] for gain in gains]).reshape(len(gains), len(true))
        own = 4 + len(gains)  # where the numbers of the shape begin

        @functools.lru_cache(2)
        def shaped(*numbers):
            slope_scale, added_mw = shape.at(numbers)
            lobes = self.lobes(slope_scale, use) if slope_scale is not None else None
            return lobes, 0.0 if added_mw is None else added_mw[use]

        def model(x):
            lobes, added = shaped(*x[own:]) if shape else (None, 0.0)
            ln_lobe, slope = (lobes(x[2]), lobes(x[2], 1)) if lobes else (self.ln_lobe(x[2])[use], self.ln_lobe(x[2], 1)[use])
            lobe, other = np.exp(x[0] + ln_lobe), rest * np.exp(x[1] + x[3] * ln_cos)
            whole = lobe + other + added
            left = true - np.log(whole) - x[4:own] @ gains
            return left, [lobe / whole, other / whole, lobe / whole * slope, other / whole * ln_cos, *gains]

        def left_of(x):
            return model(x)[0]

        def left_and_slopes(x):
            left, slopes = model(x)
            steps = 1e-6 * np.eye(len(x))[own:]
            return left, np.array([*slopes, *((left - left_of(x + step)) / 1e-6 for step in steps)])

        def root(left):  # half of its square is q - 1 - ln q
            return np.sign(left) * np.sqrt(2 * np.maximum(np.expm1(left) - left, 0))

        def slopes_of_root(x):
            left, slopes = left_and_slopes(x)
            steep = np.divide(np.expm1(left), root(left), out=np.ones_like(left), where=np.abs(left) > 1e-6)
            return -(steep * slopes).T

        def begin(wider, numbers):
            x = np.array([0, 0, wider, 0.3, *np.zeros(len(gains)), *numbers])
            x[:2] = np.mean(left_of(x))
            return x

        bounds = np.full((2, own), [[-np.inf], [np.inf]])
        bounds[:, 2], bounds[0, 3] = physics.LN_WIDTH[[0, -1]], 0
        bounds = np.hstack([bounds, [shape.least, shape.most]]) if shape else bounds

        def fitted(x, steps=None):
            return least_squares(lambda x: root(left_of(x)), x, slopes_of_root, bounds, max_nfev=steps)

        if shape:  # the most promising of many
            tried = [fitted(begin(0.0, numbers), 6) for numbers in shape.starts]
            starts = [fit.x for fit in sorted(tried, key=lambda fit: fit.cost)[:2]]
        else:
            starts = [begin(wider, ()) for wider in STARTS]
        best = min(map(fitted, starts), key=lambda fit: fit.cost).x
        return Fit(best, left_of(best))
