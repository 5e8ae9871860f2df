"""The transmission of a sheet, and its inversion.

Time goes as exp(+j w t), as in numpy's transform: a delay is exp(-j w t), and the index of what absorbs is n - j k.
A sheet of thickness d in air passes, at normal incidence,

    H = 4 n/(n + 1)^2 exp(-j (n - 1) w d/c) / (1 - ((n - 1)/(n + 1))^2 exp(-2 j n w d/c)),

the last factor being its echoes (Duvillaret, Garet & Coutaz 1996, DOI 10.1109/2944.571775).
"""

from dataclasses import dataclass

import numpy as np

C = 299792458.0
POINTS = 2**14  # of a transform: interpolates the spectrum
GATE = (-6e-12, 35e-12)  # around the peak of the empty path, s
TAPER = 3e-12  # over which the gate opens and closes, s
USEFUL = 10.0  # amplitude over its noise from which a frequency is useful
ANCHOR = (0.3e12, 1.0e12)  # where phases grow evenly, Hz: a line through them meets zero at zero
STEADY = 0.01  # of an index: more scatter is of something else than the sheet
DRAWS = 100


@dataclass
class Constants:
    """What was found, on a grid of frequencies."""

    f: np.ndarray
    n: np.ndarray  # complex, n - j k
    n_sd: np.ndarray  # of its real part
    k_sd: np.ndarray  # of minus its imaginary part
    thickness: tuple  # and its standard deviation, m
    thickness_from: str
    echo_thickness: float

    def at(self, f):
        """Everything at the nearest frequency of the grid."""
        i = int(np.argmin(abs(self.f - f)))
        n, k = self.n[i].real, -self.n[i].imag
        eps = self.n[i] ** 2
        per_k = 4 * np.pi * self.f[i] / C
        return {
            "f": f, "n": n, "n_sd": self.n_sd[i],
            "real": eps.real, "real_sd": 2 * np.hypot(n * self.n_sd[i], k * self.k_sd[i]),
            "imag": -eps.imag, "imag_sd": 2 * np.hypot(k * self.n_sd[i], n * self.k_sd[i]),
            "absorption": per_k * k, "absorption_sd": per_k * self.k_sd[i],
        }


def transmission(n, f, d):
    """H of a sheet."""
    turn = 2 * np.pi * f * d / C
    return 4 * n / (n + 1) ** 2 * np.exp(-1j * (n - 1) * turn) / (1 - ((n - 1) / (n + 1)) ** 2 * np.exp(-2j * n * turn))


def spectrum(time, signal, around, gate=GATE):
    """The spectrum of a trace between two times around a peak."""
    opened = np.clip((time - around - gate[0]) / TAPER, 0, 1) * np.clip((around + gate[1] - time) / TAPER, 0, 1)
    step = np.mean(np.diff(time))
    before = time < around + gate[0]
    level = signal[before].mean() if before.any() else 0.0
    return np.fft.rfft((signal - level) * np.sin(0.5 * np.pi * opened) ** 2, POINTS), np.fft.rfftfreq(POINTS, step)


def measured(run, gate=GATE):
    """H of a measurement where it is useful, its frequencies, and the standard deviation of ln H by noise."""
    (time, signal), (empty_time, empty) = (trace.T for trace in run)
    around = empty_time[np.argmax(abs(empty))]
    sheet, f = spectrum(time, signal, around, gate)
    path, _ = spectrum(empty_time, empty, around, gate)
    noise = [floor(time, signal, around, gate), floor(empty_time, empty, around, gate)]
    sd = np.hypot(noise[0] / abs(sheet).clip(1e-300), noise[1] / abs(path).clip(1e-300))
    return sheet / np.where(path == 0, 1e-300, path), f, sd


def floor(time, signal, around, gate):
    """Amplitude of the noise in a spectrum, from what comes before the pulse."""
    before = signal[time < around + gate[0] - TAPER]
    if len(before) < 50:
        before = signal[-len(signal) // 10 :]
    return before.std() * np.sqrt((gate[1] - gate[0]) / np.mean(np.diff(time)))


def index(transmitted, f, d):
    """n - j k at each frequency: Newton's method for the logarithm of H, from the sheet without echoes."""
    turn = 2 * np.pi * f * d / C
    phase = np.unwrap(np.angle(transmitted))
    even = (f > ANCHOR[0]) & (f < ANCHOR[1])
    if even.sum() > 2:
        offset = np.polyfit(f[even], phase[even], 1)[1]
        phase -= 2 * np.pi * np.round(offset / (2 * np.pi))
    wanted = np.log(abs(transmitted)) + 1j * phase
    n = 1 - phase / turn
    n = n + 1j * np.log(abs(transmitted) * (n + 1) ** 2 / (4 * n)) / turn
    for _ in range(40):
        off = log_transmission(n, turn) - wanted
        off = off.real + 1j * ((off.imag + np.pi) % (2 * np.pi) - np.pi)
        slope = (log_transmission(n + 1e-6, turn) - log_transmission(n - 1e-6, turn)) / 2e-6
        step = off / slope
        n = n - step * np.minimum(1, 0.05 / np.maximum(abs(step), 1e-12))
    return n


def log_transmission(n, turn):
    echoes = 1 - ((n - 1) / (n + 1)) ** 2 * np.exp(-2j * n * turn)
    return np.log(4 * n / (n + 1) ** 2 / echoes) - 1j * (n - 1) * turn


def waviness(n, f):
    """How much an index swings about a smooth curve over the frequency: a wrong thickness leaves swings of the echoes."""
    x = (f - f.mean()) / np.ptp(f)
    return np.sqrt(sum(np.mean((part - np.polyval(np.polyfit(x, part, 3), x)) ** 2) for part in (n.real, n.imag)))


def echo_thickness(transmitted, f, stated):
    """The thickness at which the index swings least, m; NaN where that is not within 15 % of the stated one."""
    trials = stated * np.linspace(0.85, 1.15, 61)
    swings = [waviness(index(transmitted, f, d), f) for d in trials]
    best = int(np.argmin(swings))
    if 0 < best < len(trials) - 1:
        a, b, c = swings[best - 1 : best + 2]
        return trials[best] + 0.5 * (trials[1] - trials[0]) * (a - c) / (a - 2 * b + c)
    return float("nan")


def evaluate(runs, stated, stated_sd=None):
    """The constants of a sheet from repeated measurements of it, and of a thickness that is stated, m.

    Their standard deviations hold the noise of the traces, the scatter of the repeats, the choice of the gate, and the
    error of the thickness. Without `stated_sd` the last is how far the echoes contradict the stated one, at least 1 %.
    """
    spectra = [measured(run) for run in runs]
    f = spectra[0][1]
    sd = np.max([one[2] for one in spectra], axis=0)
    # Below, a gate holds fewer than two waves.
    lowest = 2 / (GATE[1] - GATE[0])
    useful = longest((sd < 1 / USEFUL) & (f > lowest))
    if useful.sum() < 10:
        raise SystemExit("no frequency is above the noise by enough; average more traces")
    f, sd = f[useful], sd[useful]
    transmitted = np.array([one[0][useful] for one in spectra])
    even = (f > 0.15e12) & (f < 1.0e12)
    even = even if even.sum() > 20 else np.ones(len(f), bool)
    echoes = float(np.mean([echo_thickness(one[even], f[even], stated) for one in transmitted]))
    if not stated_sd and not np.isfinite(echoes):
        raise SystemExit(
            f"the echoes in the sheet show no thickness within 15 % of {1e3 * stated:.4g} mm: check its value and unit, or give its error by "
            "--thickness-sd-mm"
        )
    thickness_sd = stated_sd or max(abs(echoes - stated), 0.01 * stated)
    each = np.array([index(one, f, stated) for one in transmitted])
    n = each.mean(axis=0)
    rng = np.random.default_rng(0)
    drawn = []
    for _ in range(DRAWS):
        noise = (rng.normal(size=len(f)) + 1j * rng.normal(size=len(f))) * sd / np.sqrt(2)
        drawn.append(index(transmitted[0] * (1 + noise), f, stated))
    drawn = np.array(drawn)
    by_noise = [part.std(axis=0) / np.sqrt(len(runs)) for part in (drawn.real, drawn.imag)]
    # The mean of two repeats is off by as much as they differ from it.
    spread = each - n
    by_repeat = [np.sqrt((part**2).sum(axis=0) / max(len(runs) - 1, 1) / len(runs)) for part in (spread.real, spread.imag)]
    others = []
    for gate in ((GATE[0], 0.6 * GATE[1]), (1.5 * GATE[0], 1.6 * GATE[1])):
        again = [measured(run, gate)[0][useful] for run in runs]
        others.append(np.mean([index(one, f, stated) for one in again], axis=0) - n)
    by_gate = [np.max(abs(part), axis=0) for part in (np.array(others).real, np.array(others).imag)]
    # Where the gate or a repeat matters by more than this, something else than the sheet is seen, such as diffraction.
    own = np.hypot(np.hypot(by_noise[0], by_repeat[0]), by_gate[0])
    steady = longest((own < STEADY * n.real) & (n.imag < 0))
    if steady.sum() < 10:
        raise SystemExit("repeats or gates contradict each other at every frequency; measure again")
    thicker = np.mean([index(one, f, stated + thickness_sd) for one in transmitted], axis=0)
    thinner = np.mean([index(one, f, stated - thickness_sd) for one in transmitted], axis=0)
    slope = (thicker - thinner) / 2
    by_thickness = [abs(slope.real), abs(slope.imag)]
    n_sd, k_sd = (np.sqrt(sum(part[i] ** 2 for part in (by_noise, by_repeat, by_gate, by_thickness))) for i in (0, 1))
    f, n, n_sd, k_sd = f[steady], n[steady], n_sd[steady], k_sd[steady]
    said = "as stated, with the error that was given" if stated_sd else "as stated, with an error by the echoes"
    return Constants(f, n, n_sd, k_sd, (stated, thickness_sd), said, echoes)


def longest(which):
    """The longest run of true values."""
    best, start = (0, 0), None
    for i, on in enumerate([*which, False]):
        if on and start is None:
            start = i
        elif not on and start is not None:
            best, start = max(best, (i - start, start)), None
    mask = np.zeros(len(which), bool)
    mask[best[1] : best[1] + best[0]] = True
    return mask
