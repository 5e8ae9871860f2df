"""What a law alone can follow: its maximum-likelihood fit to mean powers, without noise."""

from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares

import physics

NEPERS = np.log(10) / 10  # of power, in one dB
STARTS = (0.0, -0.3, 0.3)  # ln of what multiplies m, where a fit begins
MOST = np.log(physics.GATE_M / physics.RANGE_SD_M / physics.FALSE_ALARM)  # what a chirp can lose: a false alarm costs as much


class Fit(NamedTuple):
    numbers: np.ndarray  # the law's four, then one of each form
    left: np.ndarray  # ln of power over model, of each chirp in use

    def of_forms(self):
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
        theta, range_m = before.theta(), np.where(before.range_m > 0, before.range_m, physics.FOCUS_M)
        self.power_mw = before.means_mw()[0]
        lobe, self.rest = before.parts_mw(theta, range_m)
        self.ln_cos, delta = np.log(np.cos(theta)), before.delta(range_m)
        rows = [before.law.at(table, theta, delta) for table in before.law.lobes]
        self.ln_lobe = CubicSpline(physics.LN_WIDTH, np.log(rows * lobe / before.law.f(theta, delta, "lobe")))

    def fit(self, power_mw, use, forms=()):
        """The best fit, by the likelihood of Gamma, to powers of the chirps in use. A form is a gain of each chirp, dB per unit."""
        true, rest, ln_cos = np.log(np.maximum(power_mw[use], 1e-30)), self.rest[use], self.ln_cos[use]
        gains = np.array([NEPERS * form[use] for form in forms]).reshape(len(forms), len(true))

        def left_and_slopes(x):
            lobe, other = np.exp(x[0] + self.ln_lobe(x[2])[use]), rest * np.exp(x[1] + x[3] * ln_cos)
            share = lobe / (lobe + other)
            slopes = [share, 1 - share, share * self.ln_lobe(x[2], 1)[use], (1 - share) * ln_cos, *gains]
            return true - np.log(lobe + other) - x[4:] @ gains, np.array(slopes)

        def root(left):  # half of its square is q - 1 - ln q
            return np.sign(left) * np.sqrt(2 * np.maximum(np.expm1(left) - left, 0))

        def slopes_of_root(x):
            left, slopes = left_and_slopes(x)
            steep = np.divide(np.expm1(left), root(left), out=np.ones_like(left), where=np.abs(left) > 1e-6)
            return -(steep * slopes).T

        def begin(wider):
            x = np.array([0, 0, wider, 0.3, *np.zeros(len(forms))])
            x[:2] = np.mean(left_and_slopes(x)[0])
            return x

        least, most = np.full((2, 4 + len(forms)), [[-np.inf], [np.inf]])
        (least[2], most[2]), least[3] = physics.LN_WIDTH[[0, -1]], 0
        fits = [least_squares(lambda x: root(left_and_slopes(x)[0]), begin(wider), slopes_of_root, (least, most)) for wider in STARTS]
        best = min(fits, key=lambda fit: fit.cost).x
        return Fit(best, left_and_slopes(best)[0])
