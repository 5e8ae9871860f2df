"""The undeclared effects. Each has a shape of its own; `size` scales it and is calibrated by what a refit leaves.

`apply(state, size, rng)` changes the state. Draws come from rng in the same order whatever the size."""

import copy
import functools
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation
from scipy.special import gammainc, polygamma

import physics
import refit
import scan
import targets

RMS_DB = {"weak": 0.35, "moderate": 0.7, "strong": 1.4}
# Effects that change a scatter, a count or the strongest echoes: a strength of their own, dB, which every target reaches.
OWN_DB = {
    "angle-error": {"weak": 0.8, "moderate": 1.3, "strong": 2.0},  # excess scatter, rms over the echoes
    "compression": {"weak": 3.0, "moderate": 6.0, "strong": 10.0},  # what the strongest mean echo loses
    "noise-floor": {"weak": 0.7, "moderate": 1.5, "strong": 2.5},  # noise above the declared one
    "speckle": {"weak": 0.8, "moderate": 1.5, "strong": 2.5},  # excess scatter: sqrt(sd^2 - declared sd^2) of the powers in dB
}
UNKNOWN = ("spiral", "stripes", "sawtooth", "checkers")


def angle_error(s, size, rng):
    s.numbers["angle-error"] = [{"sd_deg": size}]
    tail = rng.standard_t(5, size=(s.n, 2)) / np.sqrt(5 / 3)
    s.tilt = np.radians(size) * tail


def anisotropy(s, size, rng):
    """Brushed along a grain that swings over the target; the density of slopes keeps its integral."""
    sway, start = rng.uniform(0.1, 0.5), rng.uniform(0, np.pi)
    grain = start + sway * np.sin(s.surface[:, 1] / 0.15)
    along = np.stack([np.cos(grain), np.sin(grain), np.zeros(s.n)], -1)
    along -= s.normal * np.sum(along * s.normal, 1, keepdims=True)
    along /= np.linalg.norm(along, axis=1, keepdims=True) + 1e-12
    across = np.cross(s.normal, along)
    a, b = np.sum(s.ray * along, 1), np.sum(s.ray * across, 1)
    r = np.exp(0.5 * size * 0.2)
    s.slope_scale = np.sqrt(((a / r) ** 2 + (b * r) ** 2) / (a**2 + b**2 + 1e-15))


def compression(s, size, rng):
    s.ceiling_mw = s.means_mw()[0].max() / size


def covering_layer(s, size, rng):
    """A polygon of five to seven corners; the loss grows with the way through it, and its thickness varies."""
    hit = np.flatnonzero(s.range_m > 0)
    centre = s.aim[rng.choice(hit)] * 0.6 + s.aim[hit].mean(0) * 0.4
    corners = rng.integers(5, 8)
    phi = np.sort((np.arange(corners) + rng.uniform(-0.3, 0.3, corners)) * 2 * np.pi / corners)
    corner = centre + (rng.uniform(0.10, 0.22, corners) * np.array([np.cos(phi), 1.4 * np.sin(phi)])).T
    inside = np.zeros(s.n, bool)
    for a, b in zip(corner, np.roll(corner, -1, 0)):
        cross = (a[1] > s.surface[:, 1]) != (b[1] > s.surface[:, 1])
        x = a[0] + (s.surface[:, 1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
        inside ^= cross & (s.surface[:, 0] < x)
    thick = 1 + 0.15 * np.sin(s.surface @ rng.normal(0, 12, 2) + rng.uniform(0, 6))
    s.numbers["covering-layer"] = [{"loss_db": float(size * np.mean(thick, where=inside & (s.range_m > 0)))}]
    s.gain = s.gain * physics.mw(-size * inside * thick / np.cos(s.theta()))


def drift(s, size, rng):
    """A warm-up that levels off, and two bends."""
    tau, knots = rng.uniform(0.1, 0.5), rng.normal(size=5)
    path = rng.choice([-1, 1]) * np.exp(-s.share / tau) * 2 + CubicSpline(np.linspace(0, 1, 5), knots)(s.share) * 0.6
    s.gain = s.gain * physics.mw(size * path)


def footprint(count, size, longer, turn):
    """Points, m, and weights of the two-way spot: an ellipse (sd `size` cm across it, `longer` times that along it)
    with 0.93 of the power, and a round foot 2.5 times as wide. A spiral of the golden angle, dense in both."""
    share, inner = (np.arange(count) + 0.5) / count, 0.4  # of the points, more lie far out than of the power
    radius = np.linspace(0, 20, 20001)
    reached = 1 - inner * np.exp(-(radius**2) / 2) - (1 - inner) * np.exp(-(radius**2) / 12.5)
    r, phi = np.interp(share, reached, radius), np.pi * (3 - np.sqrt(5)) * np.arange(count)
    x, y = longer * r * np.cos(phi), r * np.sin(phi)
    drawn = inner * np.exp(-(r**2) / 2) + (1 - inner) / 6.25 * np.exp(-(r**2) / 12.5)
    weight = (0.93 / longer * np.exp(-(r**2) / 2) + 0.07 / 6.25 * np.exp(-(x**2 + y**2) / 12.5)) / drawn
    c, s = np.cos(turn), np.sin(turn)
    return 0.01 * size * np.stack([c * x - s * y, s * x + c * y], -1), weight / weight.sum()


def diameter_m(size, longer):
    """Of the circle as large as the contour of half the one-way intensity, which is a quarter of the two-way one."""
    x, step = np.linspace(-4, 4, 801, retstep=True)
    u2, v2 = np.meshgrid(x**2, x**2)
    level = 0.93 / longer * np.exp(-(u2 / longer**2 + v2) / 2) + 0.07 / 6.25 * np.exp(-(u2 + v2) / 12.5)
    return float(0.01 * size * 2 * np.sqrt(np.count_nonzero(level >= level.max() / 4) * step**2 / np.pi))


TRACED = {}  # what finite_spot has traced for all chirps


def finite_spot(s, size, rng, count=96):
    """A footprint `size` cm wide (two-way sd), longer in one direction, and a weak wide foot.

    `count` sub-rays for each chirp; 4 and then 16 times as many where four parts of them differ: at edges."""
    longer, turn = rng.uniform(1.0, 1.4), rng.uniform(0, np.pi)
    key = (s.name, s.pattern, s.w0, size, longer, turn, count)
    if s.draft:
        traced = spread(s, size, longer, turn, np.arange(0, s.n, 3), (count,))
    else:
        if key not in TRACED:
            TRACED[key] = spread(s, size, longer, turn, np.arange(s.n), (count, 4 * count, 16 * count))
        traced = TRACED[key]
        s.numbers["finite-spot"] = [{"diameter_m": diameter_m(size, longer)}]
    s.spread, s.spread_share, s.range_m, s.piece, s.normal = (a.copy() for a in traced)


def spread(s, size, longer, turn, chirps, counts):
    """Power, share of the lobe, range, piece and normal of the chirps with a spot; the others stay silent."""
    power, share, range_m = np.zeros(s.n), np.zeros(s.n), np.zeros(s.n)
    piece, normal = s.piece.copy(), s.normal.copy()
    for count in counts:
        points, weight = footprint(count, size, longer, turn)
        apart = []
        for block in np.array_split(chirps, 1 + len(chirps) * count // 100_000):
            lobe, rest, hits = s.sub_rays(block, points, weight)
            each = lobe + rest
            power[block] = each.sum(1)
            safe = np.maximum(power[block], 1e-30)
            share[block], range_m[block] = lobe.sum(1) / safe, np.sum(each * hits["range"], 1) / safe
            new, strongest = s.range_m[block] <= 0, (np.arange(len(block)), np.argmax(each, 1))
            piece[block[new]], normal[block[new]] = hits["piece"][strongest][new], hits["normal"][strongest][new]
            part = np.stack([each[:, k::4].sum(1) / weight[k::4].sum() for k in range(4)])
            uneven = part.std(0) > 0.035 * part.mean(0)  # 0.15 dB
            apart.append(uneven & (power[block] > physics.mw(physics.THRESHOLD_DBM - 15)))
        chirps = chirps[np.concatenate(apart)]
    return power, share, np.where(power > physics.mw(physics.THRESHOLD_DBM - 40), range_m, 0.0), piece, normal


def foreign_patch(s, size, rng):
    hit = np.flatnonzero((s.range_m > 0) & (s.clean_theta() < np.radians(60)))
    centre, radius = s.aim[rng.choice(hit)], rng.uniform(0.045, 0.085)
    d = s.surface - centre
    phi, bumps = np.arctan2(d[:, 1], d[:, 0]), rng.uniform(0, 6, 2)
    outline = radius * (1 + 0.25 * np.cos(2 * phi + bumps[0]) + 0.15 * np.cos(3 * phi + bumps[1]))
    inside = (np.hypot(*d.T) < outline) & (s.piece == s.piece[np.argmin(np.hypot(*d.T))])
    sign = rng.choice([-1, 1])
    s.slope_scale = s.slope_scale * np.where(inside, 0.8 ** min(size / 3, 1.0), 1.0)  # its lobe is wider
    s.gain = s.gain * physics.mw(size * sign * inside)


def fov_gain(s, size, rng):
    x0, y0, power = rng.uniform(-0.06, 0.06), rng.uniform(-0.1, 0.1), rng.uniform(1.5, 2.8)
    r = np.hypot((s.aim[:, 0] - x0) / 0.25, (s.aim[:, 1] - y0) / 0.45)
    s.gain = s.gain * physics.mw(size * rng.choice([-1, 1, -1]) * (r**power + 0.2 * s.aim[:, 0] / 0.25))


def motion(s, size, rng):
    """A path with turns in all six degrees of freedom that begins at rest."""
    knots = rng.normal(size=(8, 6)) * np.array([4e-3, 2e-3, 4e-3, 0.008, 0.012, 0.006])
    knots[0] = 0
    path = size * CubicSpline(np.linspace(0, 1, 8), knots)(s.share)
    s.move(path[:, :3], path[:, 3:])


def pose(s, size, rng):
    v = rng.normal(size=6) * np.array([4e-3, 4e-3, 4e-3, 0.01, 0.015, 0.01])
    s.numbers["pose"] = [pose_numbers(s, size * v[:3], size * v[3:])]
    s.move(np.tile(size * v[:3], (s.n, 1)), np.tile(size * v[3:], (s.n, 1)))


def pose_numbers(s, shift, turn):
    """Angles about the fixed axes x, y, z, and the shift of the middle of what the scan would hit at rest."""
    turned, hit = Rotation.from_rotvec(turn), s.range_m > 0
    middle = (scan.ORIGIN + s.range_m[hit, None] * s.ray[hit]).mean(0) - targets.CENTRE
    shift = shift + turned.apply(middle) - middle
    angles = turned.as_euler("xyz", degrees=True)
    numbers = {f"translation_{a}_m": float(t) for a, t in zip("xyz", shift)}
    return numbers | {f"rotation_{a}_deg": float(r) for a, r in zip("xyz", angles)}


def multi_bounce(s, size, rng):
    """Both flanks of the groove light each other; the antenna sees the second surface through a wide pattern."""
    wide, area = 0.06, 0.005**2
    grid = np.flatnonzero(np.isin(s.grid_piece.ravel(), (1, 2)))
    x, y = np.meshgrid(s.grid_x, s.grid_y)
    aim = np.stack([x.ravel(), y.ravel()], -1)[grid]
    q_ray = scan.directions(aim)
    q = scan.ORIGIN + s.grid_range.ravel()[grid, None] * q_ray
    q_normal, q_piece = s.grid_normal.reshape(-1, 3)[grid], s.grid_piece.ravel()[grid]

    def f(a, b, normal):
        h = a + b
        h /= np.linalg.norm(h, axis=-1, keepdims=True)
        angle = np.arccos(np.clip(np.abs(np.sum(h * normal, -1)), 0, 1))
        return s.law.bare(angle, "lobe") + s.law.bare(angle, "rest")

    way = np.zeros(s.n)
    for i in np.flatnonzero(np.isin(s.piece, (1, 2))):
        other = (q_piece != s.piece[i]) & (np.hypot(*(aim - s.aim[i]).T) < 2 * wide)
        p = scan.ORIGIN + s.range_m[i] * s.ray[i]
        step = q[other] - p
        d = np.linalg.norm(step, axis=1)
        u = step / d[:, None]
        c1, c2 = np.clip(u @ s.normal[i], 0, 1), np.clip(-np.sum(u * q_normal[other], 1), 0, 1)
        pattern = 2 / (np.pi * wide**2) * np.exp(-2 * np.sum((aim[other] - s.aim[i]) ** 2, 1) / wide**2)
        both = f(-s.ray[i], u, s.normal[i]) * c1 * f(-u, -q_ray[other], q_normal[other]) * c2
        each = physics.WAVELENGTH_M**2 * pattern * area * both / np.maximum(d, 0.004) ** 2
        s.added_mw[i] += size * each.sum() * physics.mw(physics.POWER_DBM - physics.loss_db(s.w0))
        length = (s.range_m[i] + d + s.grid_range.ravel()[grid][other]) / 2
        way[i] = np.sum(each * (length - s.range_m[i])) / max(each.sum(), 1e-30)
    total, _ = s.means_mw()
    s.echo_shift = np.where(total > 0, way * s.added_mw / np.maximum(total, 1e-30), 0)


def noise_floor(s, size, rng):
    s.noise_gain = physics.mw(size)


def few_looks(s, size, rng):
    s.numbers["speckle"] = [{"looks": size}]
    s.looks = size


def subsurface(s, size, rng):
    """Volume return, a little stronger at normal incidence than at grazing."""
    s.added_mw = s.added_mw + 1e-3 * size * (0.8 + 0.3 * np.cos(s.theta())) * unit_volume_mw(s)


def unit_volume_mw(s):
    """Power of a sigma-0 of 1 with the footprint `paper`; with `projected` it is this over the cosine."""
    return s.scale_mw(np.where(s.range_m > 0, s.range_m, physics.FOCUS_M)) / (4 * np.pi)


def thin_film(s, size, rng):
    """A coating of slightly uneven thickness; what comes from below crosses it twice. Airy's formula over the band."""
    thickness, index, uneven = rng.uniform(1.2e-3, 2.8e-3), rng.uniform(1.7, 2.2), rng.normal(0, 0.3, 2)
    d = thickness * (1 + 0.02 * np.sin(s.surface @ (uneven * 20)))
    s.numbers["thin-film"] = [{"thickness_m": float(d[s.range_m > 0].mean()), "index": float(index)}]
    inner = np.sqrt(1 - (np.sin(s.theta()) / index) ** 2)
    out = np.zeros(s.n)
    for frequency in np.linspace(286.5e9, 313.5e9, 9):
        # from air through the film into a substrate of index 3.5, both polarisations alike (mean)
        r1, r2 = (1 - index) / (1 + index), (index - 3.5) / (index + 3.5)
        turn = np.exp(-4j * np.pi * index * d * inner * frequency / physics.LIGHT_M_S)
        out += 1 - np.abs((r1 + r2 * turn) / (1 + r1 * r2 * turn)) ** 2
    ratio = (out / out.mean()) ** 2
    s.rest_gain = s.rest_gain * np.maximum(1 + size * (ratio - 1), 0.02)


def correlated_shadowing(s, size, rng):
    """G1 in place of its square, with Smith's function of the lobe's own slopes."""
    g = physics.smith(s.material["distribution"], s.material["m"] * np.tan(s.theta()))
    s.numbers["correlated-shadowing"] = [{"share": min(size, 1.0)}]
    s.lobe_gain = s.lobe_gain * g**-min(size, 1.0)


def unknown(s, size, rng, kind):
    x, y = s.surface.T
    if kind == "spiral":
        c = rng.uniform(-0.08, 0.08, 2)
        wave = np.sin(3 * np.arctan2(y - c[1], x - c[0]) + np.hypot(x - c[0], y - c[1]) / rng.uniform(0.012, 0.025))
    elif kind == "stripes":  # as of a surface whose stripes turn the polarisation
        azimuth = np.arctan2(s.normal[:, 1], s.normal[:, 0])
        wave = np.cos(2 * azimuth) * np.sign(np.sin((x + 0.5 * y) / rng.uniform(0.015, 0.03)))
    elif kind == "sawtooth":
        wave = 2 * ((np.arange(s.n) / rng.uniform(200, 420)) % 1) - 1
    else:
        wave = np.sign(np.sin(x / 0.02) * np.sin(y / 0.026))
    s.gain = s.gain * physics.mw(size * wave)


EFFECTS = {
    "angle-error": angle_error, "anisotropy": anisotropy, "compression": compression, "covering-layer": covering_layer,
    "drift": drift, "finite-spot": finite_spot, "foreign-patch": foreign_patch, "fov-gain": fov_gain, "motion": motion,
    "multi-bounce": multi_bounce, "noise-floor": noise_floor, "pose": pose, "speckle": few_looks, "subsurface": subsurface,
    "thin-film": thin_film, "correlated-shadowing": correlated_shadowing,
    **{kind: functools.partial(unknown, kind=kind) for kind in UNKNOWN},
}
KNOWN = [n for n in EFFECTS if n not in UNKNOWN]
# Numbers that are learned from data by one who knows the form and the law: what is drawn, and the size. Constants of a form
# and its sign are no such numbers, nor is what the law's own level takes.
LEARNED = {
    "angle-error": 1,  # sd; the tilts are noise
    "anisotropy": 3,  # ratio, direction, sway
    "compression": 1,  # ceiling
    "correlated-shadowing": 1,  # power
    "covering-layer": 16,  # two of each of six corners (five to seven are drawn); loss; slopes in x and y of a wave, its phase
    "drift": 3,  # of six (height and time of the warm-up, four knots): no more pay near the limit
    "finite-spot": 3,  # width, what it is longer by, direction
    "foreign-patch": 6,  # centre (2), radius, phases of two waves, level, from which its lobe follows
    "fov-gain": 3,  # of four (centre (2), power, size): no more pay near the limit
    "motion": 42,  # seven knots in six degrees of freedom
    "multi-bounce": 1,  # size; the flanks are known
    "noise-floor": 2,  # level, which the realised gain has fitted to the same alarms already
    "pose": 6,  # shift, turn
    "speckle": 1,  # looks
    "subsurface": 1,  # level
    "thin-film": 5,  # thickness, index, size, slopes in x and y of a wave
    "spiral": 4,  # centre (2), pitch, size
    "stripes": 2,  # width, size
    "sawtooth": 2,  # period, size
    "checkers": 1,  # size
}
# Sizes below and beyond which an effect would not be itself: a spot of less than 1 mm changes a few chirps at edges.
START = {"finite-spot": 0.1}
LIMIT = {"finite-spot": 3.2, "thin-film": 1.0, "correlated-shadowing": 1.0}
# Where an effect needs a target of its own: a lobe that is seen all around, a concave place, a rough lobe.
BASES = {"multi-bounce": ["groove"], "correlated-shadowing": ["vase"]}


class Sized(NamedTuple):
    """Size of an effect, and what it leaves after a refit of the law: rms of the mean powers in dB, and nats in ln p."""

    size: float
    left_db: float
    gain: float
    law_mw: np.ndarray  # mean powers by the refitted law


def refitted(law, after):
    """The refit of an undisturbed law to the mean powers of a state, over the chirps that had an echo."""
    use = (law.power_mw > physics.mw(physics.THRESHOLD_DBM)) & (after.range_m > 0)
    return law.fit(after.seen_mw(), use)


# What a shape must take of that which an effect leaves in ln p. Of what it does not take a report makes other effects, which
# would shift its numbers.
SHAPE_TAKES = 0.75


def gains_of(s):
    """Columns, dB per unit, of the forms of a gain that a report may state, by the names of their numbers."""
    u, v = s.aim.T / 0.5
    p = 2 * s.share - 1
    drift = {"slope_db": p / 2, **{f"curve{n}_db": np.polynomial.Legendre.basis(n)(p) for n in range(2, 9)}}
    field = {
        "edge_db": u**2 + v**2, "slope_x_db": u, "slope_y_db": v,
        "oval_db": u**2 - v**2, "twist_db": 2 * u * v, "steep_db": (u**2 + v**2) ** 2,
    }
    members = {"drift": (drift, (1, 3, 8)), "fov-gain": (field, (1, 3, 6))}
    return {name: [dict(list(all_.items())[:n]) for n in counts] for name, (all_, counts) in members.items()}


def of_grain(s, count):
    """A straight grain (2 numbers: ln of the ratio, turn of the direction), or one that turns with x_t and y_t as well (4)."""
    along = np.array([0.0, 1.0, 0.0]) - s.normal * s.normal[:, 1:2]
    along /= np.linalg.norm(along, axis=1, keepdims=True) + 1e-12
    a, b = np.sum(s.ray * along, 1), np.sum(s.ray * np.cross(s.normal, along), 1)
    azimuth, (x, y) = np.arctan2(b, a), s.surface.T

    def at(numbers):
        ln_ratio, turn, by_x, by_y = [*numbers, 0, 0][:4]
        phi = azimuth - turn - by_x * x - by_y * y
        return np.sqrt(np.cos(phi) ** 2 * np.exp(-ln_ratio) + np.sin(phi) ** 2 * np.exp(ln_ratio)), None

    turns = (-1.5, 0, 1.5) if count > 2 else (0,)
    starts = [(0.3, k * np.pi / 4, 0, by_y)[:count] for k in range(4) for by_y in turns]
    # a ratio below 1 is one above 1, turned by a quarter; 7 a metre are 400 degrees
    return refit.Shape(at, starts, [0, -np.inf, -7, -7][:count], [np.log(10), np.inf, 7, 7][:count])


def of_volume(s, count):
    """Return from below: a level of sigma-0 (1 number: its ln), or a level times a power of the cosine (2)."""
    cosine, unit = np.cos(s.theta()), unit_volume_mw(s)
    if s.material["footprint"] == "projected":
        unit = unit / cosine

    def at(numbers):
        ln_sigma, power = [*numbers, 0][:2]
        return None, np.exp(ln_sigma) * cosine**power * unit

    starts = [(np.log(level), power)[:count] for level in (1e-3, 1e-2) for power in (0.3, 1.3)[:count]]
    return refit.Shape(at, starts, [-np.inf, 0][:count], [0, 4][:count])


TURNING = ("ratio", "turn_deg", "turn_by_x_deg_per_m", "turn_by_y_deg_per_m")
# Of an effect that is no gain: the shape of a form by the count of its numbers, and these by name. The first has a truth.
SHAPES = {
    "anisotropy": (of_grain, (TURNING[:2], TURNING)),
    "subsurface": (of_volume, (("sigma_v",), ("sigma_v", "cosine_power"))),
}
# One level of sigma-0 is 1/cos(theta) in power here, so that the weakest echoes decide its fit.
GRAZING = ("subsurface", ("sigma_v",), "projected")
FITTED = ("drift", "fov-gain", *SHAPES)


def fitted_numbers(before, after, name, use, looks):
    """Numbers of each form of an effect that a report may state: a fit without noise, of law and form, to true mean powers."""
    law, true = refit.Law(before), after.means_mw()[0]
    if name in gains_of(before):
        return [dict(zip(form, law.fit(true, use, form.values()).of_form())) for form in gains_of(before)[name]]
    make, forms = SHAPES[name]
    whole, out = law.fit(true, use).loss(looks), []
    for names in forms:
        fit = law.fit(true, use, shape=make(before, len(names)))
        good = fit.loss(looks) <= (1 - SHAPE_TAKES) * whole and (name, names, before.material["footprint"]) != GRAZING
        out.append({**dict.fromkeys(names), names[0]: float(np.exp(fit.of_form()[0])) if good else None})
    return out


def ceiling_cells(ratio):
    """Echo whose looks a ceiling compresses: its share in each cell of power, their middles in cells, and the width of a cell
    over the ceiling. `ratio` is the mean of each look before over the ceiling. The looks' cells are convolved."""
    cells, looks = 4096, len(ratio)
    edge = np.linspace(0, np.tanh(np.sqrt(40 * max(ratio))) ** 2, cells + 1)  # of the ceiling
    look = -np.diff(np.exp(-(np.arctanh(np.minimum(np.sqrt(edge), 1 - 1e-15)) ** 2) / np.reshape(ratio, (-1, 1))))
    share = np.maximum(np.fft.irfft(np.prod(np.fft.rfft(look, looks * cells), 0), looks * cells), 0)
    return share / share.sum(), np.arange(looks * cells) + looks / 2, edge[1] / looks


def ceiling_divergence(ratio, looks):
    """Kullback-Leibler divergence, nats, of an echo whose looks a ceiling compresses from the echo of Gamma with its mean."""
    share, middle, _ = ceiling_cells([ratio] * looks)
    of_gamma = np.diff(gammainc(looks, looks * np.append(middle - 0.5, middle[-1] + 0.5).clip(0) / (share @ middle)))
    full = share > 1e-14
    return float(share[full] @ np.log(share[full] / np.maximum(of_gamma[full], 1e-300)))


def lost_scatter(law, after, looks):
    """Nats in ln p by which a ceiling shows in the scatter of the echoes, beside their means."""
    if after.ceiling_mw is None:
        return 0.0
    ratio = np.geomspace(1e-4, 1e2, 61)
    nats = [ceiling_divergence(r, looks) for r in ratio]
    seen = law.power_mw[law.power_mw > physics.mw(physics.THRESHOLD_DBM)] / after.ceiling_mw
    return float(np.interp(np.log(seen), np.log(ratio), nats).sum())


def looks_for(declared, excess_db):
    """Looks whose scatter in dB exceeds that of the declared ones by this much, in squares."""
    factor = (10 / np.log(10)) ** 2
    wanted = factor * polygamma(1, declared) + excess_db**2
    low, high = 0.2, float(declared)
    for _ in range(60):
        middle = np.sqrt(low * high)
        low, high = (middle, high) if factor * polygamma(1, middle) > wanted else (low, middle)
    return high


def tilted_mw(state, size, count):
    """Mean power of each chirp with `count` tilts of this size."""
    rng, drawn, powers = np.random.default_rng(0), copy.copy(state), []
    for _ in range(count):
        angle_error(drawn, size, rng)
        powers.append(drawn.means_mw()[0])
    return np.array(powers)


def excess_scatter_db(state, size, count=64):
    """Sd over tilts of this size of the mean power of each chirp, dB; `count` draws."""
    return np.std(physics.db(tilted_mw(state, size, count)), 0, ddof=1)


def tilts_for(state, excess_db):
    """Sd of the tilts, degrees, for this excess scatter, rms over the echoes above the threshold."""
    use = state.means_mw()[0] > physics.mw(physics.THRESHOLD_DBM)

    def rms(size):
        return np.sqrt(np.mean(excess_scatter_db(state, size, 16)[use] ** 2))

    return brentq(lambda size: rms(size) - excess_db, 0.1, 20, xtol=1e-3)


def ceiling_for(loss_db):
    """Strongest mean echo over a ceiling below which it loses this much."""

    def lost(size):
        return -physics.db(physics.below_ceiling(size, 1.0) / size)

    return brentq(lambda size: lost(size) - loss_db, 1e-3, 1e3, xtol=1e-6)


def own_size(state, name, goal_db, looks):
    """Size of an effect with a strength of its own."""
    if name == "angle-error":
        return tilts_for(state, goal_db)
    if name == "compression":
        return ceiling_for(goal_db)
    return goal_db if name == "noise-floor" else looks_for(looks, goal_db)


def calibrate(make, name, strength, seed, looks):
    """An effect with the size for a strength."""
    if name in OWN_DB:
        size, law, after = own_size(make(), name, OWN_DB[name][strength], looks), refit.Law(make()), make()
        EFFECTS[name](after, size, np.random.default_rng(seed))
        whole = refitted(law, after)
        lost = whole.loss(looks) + lost_scatter(law, after, looks)
        return Sized(float(size), whole.rms_db(), lost, law.means_mw(whole.numbers))
    goal, start, law = RMS_DB[strength], START.get(name, 1e-2), refit.Law(make())

    def fit(size, draft=False):
        after = make()
        after.draft = draft
        EFFECTS[name](after, size, np.random.default_rng(seed))
        return refitted(law, after)

    def left(size):
        return fit(size, draft=True).rms_db()

    def found(size):
        whole = fit(size)
        return Sized(float(size), whole.rms_db(), whole.loss(looks), law.means_mw(whole.numbers))

    # the first crossing on the way up: a ceiling over everything leaves nothing again
    low = best = start
    most, size, limit = 0.0, start, LIMIT.get(name, 1e4)
    while size <= limit:
        now = left(size)
        if now > most:
            best, most = size, now
        if now >= goal or now < 0.7 * most:
            break
        low, size = size, (size * 2 if size == limit else min(size * 2, limit))
    if most < goal or size == start:
        return found(best)
    high = size
    for _ in range(6 if name == "finite-spot" else 12):
        middle = np.sqrt(low * high)
        low, high = (middle, high) if left(middle) < goal else (low, middle)
    whole = found(high)
    if name == "finite-spot" and abs(whole.left_db / goal - 1) > 0.03:  # the draft was off
        slope = np.log(left(1.2 * high) / left(high / 1.2)) / np.log(1.44)
        whole = found(high * (goal / whole.left_db) ** (1 / max(slope, 0.3)))
    return whole
