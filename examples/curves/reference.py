"""The best fit of a curve, found without the program: a grid of shapes, levels inside, the ten best refined.

ln p is the sum over rows of ln of the Gamma density over ln sigma0 (detections) or of ln P(below the limit).
"""

import csv

import numpy as np
from scipy.optimize import minimize
from scipy.special import gammainc, gammaln

LOOKS = 0.1, 1e4
LEAST_LEVEL = 1e-12
SHAPES = 10_000
BLOCK = 2_000_000  # numbers in one array


class Curve:
    def __init__(self, theta_deg, x, missed):
        order = np.argsort(missed, kind="stable")  # detections first
        self.theta, self.x = np.radians(theta_deg)[order], np.asarray(x)[order]
        self.seen = int(len(order) - np.sum(missed))


def read(path):
    with open(path) as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    missed = np.array([r["censor"] == "left" for r in rows])
    level = [float(r["threshold_db" if m else "sigma0_db"]) for r, m in zip(rows, missed)]
    return Curve(np.array([float(r["theta_deg"]) for r in rows]), 10 ** (np.array(level) / 10), missed)


def log_cdf(looks, y):
    """ln of the regularised lower incomplete gamma function, also where it underflows."""
    looks, y = np.broadcast_arrays(looks, y)
    out = np.zeros(y.shape)
    # Above this it is 1 to 1e-15, and below y = 1e-4 the start of its series is good to 1e-8: scipy takes long for both.
    some = y < looks + 40 + 12 * np.sqrt(looks)
    middle = some & (y >= 1e-4)
    value = gammainc(looks[middle], y[middle])
    kept = value > 1e-280
    middle[middle] = kept
    out[middle] = np.log(value[kept])
    rest = some & ~middle
    a, z = looks[rest], y[rest]
    with np.errstate(divide="ignore", invalid="ignore"):
        out[rest] = a * np.log(z) - z - gammaln(a + 1) - np.log1p(-np.minimum(z / (a + 1), 0.999))
    return out


def log_p(curve, s, looks):
    """ln p of the mean levels s (S, n) and looks (S, 1), row by row of s."""
    s = np.clip(s, 1e-290, 1e290)
    ratio = curve.x / s
    seen = ratio[:, : curve.seen]
    part = looks * (np.log(looks) + np.log(seen) - seen) - gammaln(looks)
    return part.sum(1) + log_cdf(looks, looks * ratio[:, curve.seen :]).sum(1)


def scoring_step(curve, p, s, looks):
    """A step of Fisher scoring in the ln of the levels; p (S, B, n) are their shares of s."""
    ratio = curve.x / np.clip(s, 1e-290, 1e290)
    slope, weight = looks * (ratio - 1), np.broadcast_to(looks, ratio.shape).copy()
    y = looks * ratio[:, curve.seen :]
    with np.errstate(divide="ignore", over="ignore"):
        hazard = np.exp(np.minimum(looks * np.log(y) - y - gammaln(looks) - log_cdf(looks, y), 600.0))
    slope[:, curve.seen :] = -hazard
    weight[:, curve.seen :] = np.maximum(hazard * (hazard + y - looks), 0)
    gradient = np.einsum("sbn,sn->sb", p, slope)
    hessian = np.einsum("sbn,scn,sn->sbc", p, p, weight)
    hessian += np.eye(p.shape[1]) * (1e-9 + 1e-3 * np.trace(hessian, axis1=1, axis2=2)[:, None, None])
    return np.clip(np.nan_to_num(np.linalg.solve(hessian, gradient[..., None])[..., 0]), -2.5, 2.5)


def solve_levels(curve, basis, levels, looks, rounds):
    """Levels (S, B) and looks (S, 1) for fixed shapes by alternating steps; returns them with ln p."""
    low, high = np.log(LEAST_LEVEL), 0.0
    u, best = np.log(levels), log_p(curve, np.einsum("sb,sbn->sn", levels, basis), looks)
    for turn in range(rounds):
        c = np.exp(u)
        s = np.einsum("sb,sbn->sn", c, basis)
        step = scoring_step(curve, c[..., None] * basis / np.clip(s, 1e-290, 1e290)[:, None], s, looks)
        for scale in (1.0, 0.3):
            tried = np.clip(u + scale * step, low, high)
            value = log_p(curve, np.einsum("sb,sbn->sn", np.exp(tried), basis), looks)
            better = value > best
            u, best = np.where(better[:, None], tried, u), np.where(better, value, best)
        s = np.einsum("sb,sbn->sn", np.exp(u), basis)
        width = max(0.8 * 0.75**turn, 0.02)
        sides = [log_p(curve, s, looks * np.exp(d)) for d in (-width, width)]
        bend = sides[0] + sides[1] - 2 * best
        with np.errstate(divide="ignore", invalid="ignore"):
            top = np.where(bend < 0, 0.5 * width * (sides[0] - sides[1]) / bend, np.sign(sides[1] - sides[0]) * width)
        tried = np.clip(looks * np.exp(np.clip(np.nan_to_num(top), -1.5, 1.5))[:, None], *LOOKS)
        value = log_p(curve, s, tried)
        better = value > best
        looks, best = np.where(better[:, None], tried, looks), np.where(better, value, best)
    return np.exp(u), looks, best


def first_levels(curve, basis):
    """Crude starts; of two lobes, either may be the one that makes the peak."""
    ratio = curve.x[: curve.seen] / np.clip(basis[:, :, : curve.seen], 1e-250, None)
    middle = np.median(ratio, axis=2)
    if basis.shape[1] == 1:
        return [np.clip(middle, 1e-6, 1.0)]
    near = np.argsort(curve.theta[: curve.seen])[: max(3, curve.seen // 5)]
    peak = np.median(ratio[:, :, near], axis=2)
    low = np.quantile(ratio, 0.3, axis=2)
    starts = np.stack([low[:, 0], peak[:, 1]], axis=1), np.stack([peak[:, 0], low[:, 1]], axis=1)
    return [np.clip(s / 2, 1e-6, 1.0) for s in starts]


def grid(model):
    """At least SHAPES points (S, K) in the variables of the search, and the side of the grid."""
    if not model.shape:
        return np.zeros((1, 0)), 1
    side = int(np.ceil(SHAPES ** (1 / len(model.shape)) - 1e-9))
    axes = [np.linspace(*b, side) for b in model.bounds()]
    return np.stack([a.ravel() for a in np.meshgrid(*axes, indexing="ij")], axis=1), side


def peaks(value, side, dimensions, count):
    """The best points, those first that no neighbour along an axis exceeds."""
    cube = value.reshape((side,) * dimensions)
    top = np.ones(cube.shape, bool)
    for axis in range(dimensions):
        moved = np.moveaxis(cube, axis, 0)
        mask = np.moveaxis(top, axis, 0)
        mask[1:] &= moved[1:] >= moved[:-1]
        mask[:-1] &= moved[:-1] >= moved[1:]
    order = np.argsort(-value)
    hills = order[top.ravel()[order]]
    rest = order[~top.ravel()[order]]
    return np.concatenate([hills[: count - 3], rest])[:count]


COARSE, FINE = {"xatol": 1e-3, "fatol": 1e-3}, {"xatol": 1e-5, "fatol": 1e-6}
NEAR = 3.0  # ln p below the best up to which a rough end is searched to the end


def refine(model, curve, starts):
    """The best end of searches from all starts: Nelder-Mead over the ln of shapes, levels and looks, roughly for
    all, then finely and by L-BFGS-B for those that came near the best."""
    rough = [descend(model, curve, start, [COARSE], polish=False) for start in starts]
    least = min(cost for cost, _ in rough)
    cost, v = min(descend(model, curve, v, [FINE], polish=True) for cost, v in rough if cost <= least + NEAR)
    k, v = len(model.shape), np.array(v)
    shape = [float(c[0, 0]) for c in model.columns(v[None, :k])]
    return -cost, shape, [float(x) for x in np.exp(v[k:-1])], float(np.exp(v[-1]))


def descend(model, curve, start, rounds, polish):
    """(cost, place) where a search from a start ends; the place as a list."""
    k = len(model.shape)
    bounds = model.bounds() + [(np.log(LEAST_LEVEL), 0.0)] * len(model.levels) + [tuple(np.log(LOOKS))]
    low, high = np.array(bounds).T
    theta = curve.theta[None, :]

    def cost(v):
        v = np.clip(v, low, high)
        s = np.exp(v[k:-1]) @ model.basis(model.columns(v[None, :k]), theta)[0]
        return -log_p(curve, s[None, :], np.exp(v[-1:])[None, :])[0]

    v = np.clip(start, low, high)
    for options in rounds:
        inside = np.where(v > (low + high) / 2, -0.15, 0.15)
        simplex = np.vstack([v, v + np.diag(inside)])
        found = minimize(cost, v, method="Nelder-Mead", bounds=bounds,
                         options={"maxiter": 250 * len(v), "initial_simplex": simplex, **options})
        v = found.x
    if polish:
        polished = minimize(cost, v, method="L-BFGS-B", bounds=bounds)
        if polished.fun < found.fun:
            found, v = polished, polished.x
    return float(found.fun), np.clip(v, low, high).tolist()


def at(model, curve, shape, levels, looks):
    """ln p at given numbers."""
    return float(log_p(curve, model.sigma0(shape, levels, curve.theta)[None, :], np.array([[looks]]))[0])


def best(model, curve, truth=None):
    """(ln p, shape, levels, looks) of the best fit; `truth`, as (shape, levels, looks), is one more start."""
    points, side = grid(model)
    theta = curve.theta[None, :]
    size = max(1, BLOCK // (curve.theta.size * len(model.levels)))
    value, level, looks = [], [], []
    for i in range(0, len(points), size):
        basis = model.basis(model.columns(points[i : i + size]), theta)
        basis = np.broadcast_to(basis, (len(points[i : i + size]),) + basis.shape[1:])
        tries = [solve_levels(curve, basis, c, np.full((len(c), 1), 1.0), 4) for c in first_levels(curve, basis)]
        pick = np.argmax([t[2] for t in tries], axis=0)
        for out, j in ((level, 0), (looks, 1), (value, 2)):
            out.append(np.stack([t[j] for t in tries])[pick, np.arange(len(pick))])
    value, level, looks = np.concatenate(value), np.concatenate(level), np.concatenate(looks)
    value = np.nan_to_num(value, nan=-1e300, posinf=-1e300, neginf=-1e300)
    some = np.argsort(-value)[:500]  # these are solved to the end
    basis = model.basis(model.columns(points[some]), theta)
    basis = np.broadcast_to(basis, (len(some),) + basis.shape[1:])
    level[some], looks[some], value[some] = solve_levels(curve, basis, level[some], looks[some], 12)
    chosen = peaks(value, side, len(model.shape), 10) if model.shape else [0]
    starts = [np.concatenate([points[i], np.log(level[i]), np.log(looks[i])]) for i in chosen]
    if truth is not None:
        shape, levels, true_looks = truth
        u = [np.log(v + s[3]) for v, s in zip(shape, model.shape)]
        starts.append(np.concatenate([u, np.log(np.maximum(levels, LEAST_LEVEL)), [np.log(true_looks)]]))
    return refine(model, curve, starts)
