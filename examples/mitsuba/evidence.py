"""What the observations of a scan gain in ln p: the true form of an effect against the law refitted without it."""

import numpy as np
from scipy.special import gammainc, gammaln

import effects
import physics
import refit

TILTS = 1000  # draws that stand for all tilts of a chirp
LN_RATIO = np.arange(-7, 5, 0.02)  # of a mean over a ceiling; below, the ceiling changes nothing


class Observed:
    """What a scan reports of each chirp, and what it was drawn from: mean echoes, the share of each that does not speckle,
    ranges, and the mean noise."""

    def __init__(self, state, power_mw, steady, range_m, noise_mw, report):
        self.state, self.power_mw, self.steady, self.range_m, self.noise_mw = state, power_mw, steady, range_m, noise_mw
        self.seen_dbm, self.seen_m, self.alarm = report
        self.seen = np.isfinite(self.seen_dbm)
        self.echo = self.seen & ~self.alarm
        # where no echo is reported, one stayed below this
        self.reported_mw = physics.mw(np.where(self.seen, self.seen_dbm, physics.THRESHOLD_DBM))

    def looks(self, looks):
        """Looks of Gamma with mean and variance of an echo: noise has whole looks, and a share does not speckle."""
        mean, speckled = self.power_mw + self.noise_mw, self.power_mw * (1 - self.steady)
        rest = mean**2 - speckled**2 - (self.power_mw * self.steady) ** 2
        return mean**2 / (speckled**2 / looks + rest / np.ceil(looks))

    def ln_p(self, power_mw, looks, ceiling_mw=None):
        """ln p of what each chirp reports: the density of an echo over ln power; else that an echo stays below."""
        mean, k = power_mw + self.noise_mw, self.looks(looks)
        u = k * self.reported_mw / mean
        out = np.where(self.echo, k * np.log(u) - u - gammaln(k), np.log(np.maximum(gammainc(k, u), 1e-300)))
        if ceiling_mw is None:
            return out
        table = np.array([self.ln_p_below(ceiling_mw, np.exp(x) * physics.look_weights(looks)) for x in LN_RATIO])
        at = np.clip((np.log(mean / ceiling_mw) - LN_RATIO[0]) / (LN_RATIO[1] - LN_RATIO[0]), 0, len(LN_RATIO) - 1.001)
        row, chirp = at.astype(int), np.arange(len(self.echo))
        return np.where(at > 0, table[row, chirp] * (1 - at + row) + table[row + 1, chirp] * (at - row), out)

    def ln_p_below(self, ceiling_mw, ratio):
        """The same of echoes whose looks have these means over a ceiling that compresses each."""
        share, middle, width = effects.ceiling_cells(ratio)
        at = self.reported_mw / ceiling_mw / width
        p = np.where(self.echo, at * np.interp(at, middle, share), np.interp(at, middle + 0.5, np.cumsum(share)))
        return np.log(np.maximum(p, 1e-300))

    def gain(self, label, size, without_mw, declared):
        """Gain of the powers and silences, over means by the law without the effect. `declared` looks."""
        looks, ceiling = self.state.looks or declared, self.state.ceiling_mw
        if label == "noise-floor":  # by its false alarms alone
            count, due = self.alarm.sum(), physics.FALSE_ALARM * max(np.sum(~self.seen | (self.range_m <= 0)), 1)
            return float(count * np.log(count / due) - count + due) if count > due else 0.0
        if label == "angle-error":
            tilted = effects.tilted_mw(self.state, size, TILTS)
            true = np.logaddexp.reduce(self.ln_p(tilted, looks, ceiling)) - np.log(TILTS)
            return capped(true - self.ln_p(tilted.mean(0), looks, ceiling))
        true = self.ln_p(self.power_mw, looks, ceiling)
        if label == "speckle":
            return capped(true - self.ln_p(self.power_mw, declared, ceiling))
        return capped(true - self.ln_p(without_mw, looks, None if label == "compression" else ceiling))

    def range_gain(self, before):
        """Gain of the ranges over those of the target before the effect."""
        use = self.echo & (before.range_m > 0)
        squares = [(self.seen_m[use] - range_m[use]) ** 2 for range_m in (before.range_m, self.range_m)]
        return capped((squares[0] - squares[1]) / (2 * physics.RANGE_SD_M**2))


def capped(gains):
    """Their sum; of a chirp no more than a false alarm costs."""
    return float(np.clip(gains, -refit.MOST, refit.MOST).sum())


def independent_share(aim, w0):
    """Chirps with speckle of their own among all, where neighbours share it."""
    return len(aim) / float(sum(np.exp(-2 * np.sum((aim - place) ** 2, 1) / w0**2).sum() for place in aim))
