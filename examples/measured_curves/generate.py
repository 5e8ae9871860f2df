"""Draw backscatter curves with nothing missing (A), with one missing effect (B), and stand-ins for measured data (C)."""

import argparse
import itertools
import json
import os

import numpy as np

from surfaces import DB, LAWS, Refit, cosine, db, film, fringes, kirchhoff, lobe, profiles

NOISES, RANGES = (0.1, 0.5, 2.0), (30, 60, 80)  # dB, degrees
MODELS = ["blinn-phong", "cook-torrance", "cook-torrance-ggx", "directive", "fresnel", "kirchhoff", "kirchhoff-go",
          "lambert", "mixture", "mixture-ggx"]
SURFACES = {  # the lobes, the diffuse parts, and the model that has this law
    "lambert": ([], ["flat"], "lambert"),
    "cosine": ([], ["power"], "blinn-phong"),
    "cosine-lambert": ([], ["power", "flat"], None),
    "beckmann-lambert": (["beckmann"], ["flat"], "mixture"),
    "ggx-lambert": (["ggx"], ["flat"], "mixture-ggx"),
    "beckmann-cosine": (["beckmann"], ["power"], "mixture"),
    "ggx-cosine": (["ggx"], ["power"], "mixture-ggx"),
    "two-lobes": (["ggx", "ggx"], ["flat"], None),
    "kirchhoff-go": (["go"], [], "kirchhoff-go"),
    "kirchhoff": (["kirchhoff"], [], "kirchhoff"),
}
WITH_LOBE = [None, "mixture", "mixture-ggx", "cook-torrance", "cook-torrance-ggx", "kirchhoff-go"]
WITH_DIFFUSE = [None, "mixture", "mixture-ggx", "lambert", "blinn-phong"]
EFFECTS = {  # the laws that lack the effect; None is the default, one GGX lobe over Lambert
    "diffuse-lobe": [None, "lambert"],
    "limb-darkening": [None, "lambert"],
    "second-lobe": [*WITH_LOBE, "lambert"],
    "subsurface": [*WITH_DIFFUSE, "kirchhoff-go"],
    "stray-light": [*WITH_DIFFUSE, "kirchhoff-go"],
    "thin-film": WITH_LOBE,
    "angle-offset": [*WITH_LOBE, "blinn-phong"],
    "instrument-lobe": [*WITH_LOBE, "lambert", "blinn-phong"],
}
DROP_DB, TIMES_NOISE, TOLERANCE, TRIES = 60, 5, 0.03, 3
DUE = 1  # the name of an effect is due where every other law leaves more than this many times the noise


def between(rng, low, high):
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def angles(rng, to_deg):
    return np.radians(np.linspace(0, to_deg, rng.integers(30, 121)))


class Surface:
    """A law with drawn numbers: lobes (kind, reflectance, width) and diffuse parts (level, power of the cosine)."""

    def __init__(self, rng, lobes, diffuse):
        first = between(rng, 0.05, 0.6)
        widths = [first, first * between(rng, 2, 6)]
        if lobes == ["kirchhoff"]:
            widths = [(between(rng, 1, 4), between(rng, 3, 60))]  # k·s, k·l
        elif not diffuse:
            widths = [between(rng, 0.07, 1.4)]
        self.lobes = [(kind, between(rng, 0.003, 0.5), width) for kind, width in zip(lobes, widths)]
        self.diffuse = [(4 * between(rng, 0.002, 0.2), between(rng, 0.3, 15) if part == "power" else 0)
                        for part in diffuse]

    def specular(self, theta):
        return sum((f * (kirchhoff(theta, *m) if kind == "kirchhoff" else lobe(kind, theta, m))
                    for kind, f, m in self.lobes), 0 * theta)

    def flat(self, theta):
        return sum((level * cosine(theta, power) for level, power in self.diffuse), 0 * theta)

    def level(self, theta):
        return self.specular(theta) + self.flat(theta)


def surface(rng, lobes, diffuse, theta):
    """One that does not fall by more than an instrument can follow."""
    while True:
        drawn = Surface(rng, lobes, diffuse)
        if np.ptp(db(drawn.level(theta))) <= DROP_DB:
            return drawn


def components(law):
    """The lobes and the diffuse parts of what `--model` names."""
    return [p for p in LAWS[law] if p in ("ggx", "beckmann", "go")], [p for p in LAWS[law] if p in ("flat", "power")]


def backscatter(theta, level_db):
    return {"theta_deg": np.degrees(theta), "sigma0_db": level_db}


def complete(seed, k):
    """Case k of part A."""
    rng = np.random.default_rng([seed, 1, k])
    law = list(SURFACES)[k % 10]
    noise, to = NOISES[k // 10 % 3], RANGES[(k // 30 + k) % 3]
    lobes, diffuse, right = SURFACES[law]
    theta = angles(rng, to)
    drawn = surface(rng, lobes, diffuse, theta)
    declared = rng.choice([None, None, right or rng.choice(MODELS), rng.choice(MODELS)])
    truth = {"id": f"A/{k:05}", "law": law, "noise_db": noise, "to_deg": to, "declared": declared,
             "declared_is": "default" if declared is None else "right" if declared == right else "other",
             "lobes": drawn.lobes, "diffuse": drawn.diffuse}
    return truth, backscatter(theta, db(drawn.level(theta)) + noise * rng.standard_normal(len(theta)))


class Missing:
    """Case k of part B: a surface of the declared law, and the level with an effect of the size x."""

    def __init__(self, seed, k, attempt):
        self.rng = rng = np.random.default_rng([seed, 2, k, attempt])
        self.k, self.effect = k, list(EFFECTS)[k % 8]
        self.noise, self.to = NOISES[k // 8 % 3], RANGES[(k // 24 + k) % 3]
        laws = EFFECTS[self.effect]
        self.declared = None if rng.random() < 0.4 else laws[rng.integers(len(laws))]
        self.level = None
        while self.level is None:
            self.theta = angles(rng, self.to)
            self.base = surface(rng, *components(self.declared), self.theta)
            self.number, self.largest, self.level = self.draw()

    def draw(self):
        """The number that goes with the size, the largest size, and σ⁰ by the size. No σ⁰ where the angles are unfit."""
        rng, theta, base = self.rng, self.theta, self.base
        specular, flat = base.specular(theta), base.flat(theta)
        if self.effect == "diffuse-lobe":
            return None, 50, lambda x: specular + flat * np.cos(theta) ** x
        if self.effect == "limb-darkening":
            sign, largest = [(1, 5), (-1, 0.9)][rng.integers(2)]
            return sign, largest, lambda x: specular + flat * np.cos(theta) ** (2 * sign * x)
        if self.effect == "second-lobe":
            ratio = between(rng, 2, 6) ** rng.choice([-1, 1])
            m = min(max(ratio * base.lobes[0][2], 0.02), 1.5) if base.lobes else between(rng, 0.05, 0.6)
            return m, 1, lambda x: specular + flat + x * lobe("ggx", theta, m)
        if self.effect == "subsurface":
            return None, 1, lambda x: specular + flat + x
        if self.effect == "stray-light":
            return None, 0.1, lambda x: specular + flat + 4 * np.pi * x * np.cos(theta)
        if self.effect == "thin-film":
            thickness, sign = between(rng, 1, 20), rng.choice([-1, 1])
            path = fringes(theta[: np.argmax(np.append(specular < flat, True))], thickness)
            fit = len(path) > 1 and path[0] - path[-1] >= 1 and np.diff(path).min() > -0.2
            level = lambda x: specular * film(theta, sign * x, thickness) + flat
            return thickness, 0.95, level if fit else None
        if self.effect == "angle-offset":
            sign = rng.choice([-1, 1])
            return sign, min(9.5, 89 - self.to), lambda x: base.level(np.abs(theta + sign * np.radians(x)))
        least = 2.8 * np.degrees(theta[1])  # four angles within the lobe
        width = rng.uniform(least, 5) if least < 5 else 5.0
        peak = cosine(theta, 0) * np.exp(-((2 * np.degrees(theta) / width) ** 2) / 2)  # 2θ from the mirror direction
        return width, 1e4, (lambda x: specular + flat + 4 * np.pi * x * peak) if least < 5 else None

    def result(self, size, left, reached):
        number = self.number if self.number is None else float(self.number)
        reached = reached and np.ptp(db(self.level(size))) <= DROP_DB
        truth = {"id": f"B/{self.k:05}", "effect": self.effect, "noise_db": self.noise, "to_deg": self.to,
                 "declared": self.declared, "lobes": self.base.lobes, "diffuse": self.base.diffuse, "size": size,
                 "number": number, "left_db": left, "reached": bool(reached)}
        noise = self.noise * self.rng.standard_normal(len(self.theta))
        return truth, backscatter(self.theta, db(self.level(size)) + noise)


def least(case):
    """A size that changes the curve's shape by less than the goal. A refit takes some of it, so the size is larger."""
    base, some = db(case.level(0)), case.largest * np.geomspace(1e-7, 1, 30)
    small = lambda x: np.std(db(case.level(x)) - base) < TIMES_NOISE * case.noise
    return max(itertools.takewhile(small, some), default=some[0])


def sizes(cases):
    """The sizes at which the best refit leaves TIMES_NOISE times the noise, what it leaves, and whether it is that much."""
    goal = TIMES_NOISE * np.array([c.noise for c in cases])
    largest, x = np.log([c.largest for c in cases]), np.log([least(c) for c in cases])
    low, high = np.stack([x, 0 * x]), np.stack([x + np.inf, 0 * x])  # ln of a size, and ln of what is left over the goal
    off, todo = 0 * x, np.arange(len(cases))

    def refit(rows, **search):
        some = [cases[i] for i in rows]
        left = Refit(some[0].declared, [c.theta for c in some]).left(
            [db(c.level(size)) for c, size in zip(some, np.exp(x[rows]))], **search)
        return np.log(np.maximum(left, 1e-9) / goal[rows])

    for _ in range(14):
        off[todo] = refit(todo)
        todo = todo[(np.abs(off) > TOLERANCE)[todo] & ((off > 0) | (x < largest))[todo]]
        if not len(todo):
            break
        for side, rows in ((low, todo[off[todo] < 0]), (high, todo[off[todo] > 0])):
            side[:, rows] = x[rows], off[rows]
        (a, below), (b, above) = low[:, todo], high[:, todo]
        with np.errstate(invalid="ignore"):
            inside = ((a + b) / 2 + a - below * (b - a) / (above - below)) / 2  # between bisection and a line
        x[todo] = np.minimum(np.where(np.isfinite(b), inside, a + np.clip(0.2 - below, 0.2, 2)), largest[todo])
    close = np.nonzero(np.abs(off) <= TOLERANCE)[0]
    if len(close):
        off[close] = refit(close, bands=4, short=10, long=25)
    return zip(np.exp(x), goal * np.exp(off), np.abs(off) <= TOLERANCE)


def left_by(law, thetas, levels_db):
    """What the best refit of a law leaves of each curve, in dB. The search is longer where there are more numbers."""
    bands = 32 if LAWS[law][2:] else 16 if "mirror" in str(law) else 4
    short, long = (10, 25) if bands == 4 else (12, 80)
    return Refit(law, thetas).left(levels_db, bands, short, long, thorough=True)


def left_by_others(declared, thetas, noises, levels_db):
    """What the best refit of any law but the declared one leaves of each curve without its noise, in times the noise.
    Once a law leaves no more than DUE, no further ones are tried."""
    best = np.full(len(thetas), np.inf)
    for law in LAWS:
        rows = [i for i in range(len(thetas)) if declared[i] != law and best[i] > DUE]
        for some in (rows[i: i + 300] for i in range(0, len(rows), 300)):
            left = left_by(law, [thetas[i] for i in some], [levels_db[i] for i in some])
            best[some] = np.minimum(best[some], left / [noises[i] for i in some])
    return best


def missing(seed, count):
    """Part B; a case whose effect cannot get that large, or takes a curve too far down, is drawn again, and marked where
    this does not help."""
    done, drawn, wanted = {}, {}, range(count)
    for attempt in range(TRIES):
        cases = [Missing(seed, k, attempt) for k in wanted]
        for law in LAWS:
            same = [c for c in cases if c.declared == law]
            for i in range(0, len(same), 300):
                chunk = same[i: i + 300]
                for case, found in zip(chunk, sizes(chunk)):
                    done[case.k], drawn[case.k] = case.result(*map(float, found)), case
        wanted = [k for k in wanted if not done[k][0]["reached"]]
    reached = [k for k in sorted(done) if done[k][0]["reached"]]
    some = [drawn[k] for k in reached]
    levels_db = [db(case.level(done[case.k][0]["size"])) for case in some]
    left = left_by_others([c.declared for c in some], [c.theta for c in some], [c.noise for c in some], levels_db)
    for k, x in zip(reached, left):
        done[k][0]["others_leave"] = float(x)
    return [done[k] for k in sorted(done)]


def smooth(rng, theta, waves):
    """A slow random change with the rms 1: cosines of at most `waves` half waves over the angles."""
    phase = np.pi * np.arange(1, waves + 1) * theta[:, None] / theta[-1] + rng.uniform(0, 2 * np.pi, waves)
    change = np.cos(phase) @ rng.standard_normal(waves)
    return (change - change.mean()) / change.std()


def sea(rng, i):
    """Kirchhoff's limit, slope variance 0.017 of both directions together, |R|² = 0.49; half of them without a noise. Every
    other has too few angles for an answer."""
    theta = np.radians(np.linspace(0, 18, 10 + i % 10 if i % 2 else 24 + i % 16))
    level = db(0.49 * lobe("go", theta, np.sqrt(0.017))) + 0.5 * rng.standard_normal(len(theta))
    return {"noise_db": 0.5 if i % 20 < 10 else None}, backscatter(theta, level)


def grating(rng, i):
    """Peaks at sin θs = sin θi + n·λ/d on Lambert: in backscatter sin θ = n·λ/2d, or in the plane of incidence.

    n = 0 is left out: a peak of fixed width in the mirror direction has a name.
    """
    width, pitch, plane = np.radians([1, 2, 3])[i % 3], [0.26, 0.38, 0.58][i // 3 % 3], i // 9 % 2
    theta = np.radians(np.arange(0, 75, 0.5))
    theta_i, theta_s = theta, -theta
    if plane:
        theta_i, theta_s = np.radians(np.meshgrid([20, 45], np.arange(-75, 76), indexing="ij")).reshape(2, -1)
        theta_i, theta_s = (x[np.abs(theta_s + theta_i) > np.radians(3)] for x in (theta_i, theta_s))  # hides the source
    brdf = np.full(len(theta_i), 0.1 / np.pi)
    for n in [-6, -5, -4, -3, -2, -1, 1, 2, 3, 4, 5, 6]:
        height, sine = 0.1 / np.pi * 10 ** rng.uniform(0.4, 1.5), np.sin(theta_i) + n * pitch
        off = theta_s - np.arcsin(np.clip(sine, -1, 1))
        brdf += np.where(np.abs(sine) < 1, height * np.exp(-((off / width) ** 2) / 2), 0)
    brdf *= np.exp(0.3 * rng.standard_normal(len(brdf)) / DB)
    table = {"theta_i_deg": np.degrees(theta_i), "theta_s_deg": np.degrees(theta_s), "brdf_per_sr": brdf}
    return {"noise_db": 0.3}, table if plane else backscatter(theta, db(4 * np.pi * brdf * np.cos(theta) ** 2))


def white(rng, i):
    """Lambert with 5 dB of noise that is declared as 0.1 dB."""
    theta = angles(rng, RANGES[i % 3])
    return {"noise_db": 0.1}, backscatter(theta, db(0.4 * cosine(theta, 0)) + 5 * rng.standard_normal(len(theta)))


def rough(rng, i):
    """Gaussian profiles, 471 of them: their speckle is 0.2 dB. To 60° or to where they return 40 dB less."""
    ks, kl = [0.8, 1.2, 1.8, 2.4, 3.0][i % 5], [6, 10, 16][i // 5]
    correlation = ["gaussian", "exponential"][i % 2]
    reach = np.radians(np.arange(10, 61, 2.0))
    far = db(profiles(rng, np.append(0, reach), ks, kl, correlation, 100))
    theta = np.linspace(0, reach[np.nonzero(far[1:] > far[0] - 40)[0][-1]], 60)
    return ({"noise_db": 0.2, "ks": ks, "kl": kl, "correlation": correlation},
            backscatter(theta, db(profiles(rng, theta, ks, kl, correlation, 471)) - 20))


def mount(rng, i):
    """Three mounts of a sample: the same surface, the same angles, another smooth error of 0.3 dB each."""
    sample = np.random.default_rng([*rng.bit_generator.seed_seq.entropy[:-1], 1000 + i // 3])
    theta = np.radians(np.linspace(0, 70, 71))
    level = db(surface(sample, ["ggx"], ["flat"], theta).level(theta))
    return {"noise_db": 0.1}, backscatter(theta, level + 0.3 * smooth(rng, theta, 4) + 0.1 * rng.standard_normal(71))


def model_error(rng, i):
    """A smooth error of which the best refit of the default law leaves 0.12 dB; the noise is 0.03 dB. Where another law
    follows the curve within the noise, it is a right answer, too."""
    theta = angles(rng, RANGES[i % 3])
    level, error = db(surface(rng, ["ggx"], ["flat"], theta).level(theta)), smooth(rng, theta, 4)
    refit, size = Refit(None, [theta]), 0.15
    for _ in range(8):
        size *= 0.12 / refit.left([level + size * error])[0]
    noise, level = 0.03 * rng.standard_normal(len(theta)), level + size * error
    others = float(left_by_others([None], [theta], [0.03], [level])[0])
    verdicts = [*DOUBTS, "another-law"] if others <= DUE else DOUBTS
    return {"noise_db": 0.03, "others_leave": others, "verdicts": verdicts}, backscatter(theta, level + noise)


def seven(rng, i):
    """Seven angles that scatter by 11 dB rms about the law that `matdb fit` is given."""
    theta = np.radians(np.linspace(5, 65, 7))
    law = ["lambert", "blinn-phong", "mixture", "cook-torrance-ggx"][i % 4]
    level = db(surface(rng, *components(law), theta).level(theta))
    return {"command": "fit", "declared": law}, backscatter(theta, level + 11 * rng.standard_normal(7))


DOUBTS = ["unexplained", "cannot-tell"]
ANY = ["no-missing-effect", "another-law", "noise-unknown", *DOUBTS]
STAND_INS = {  # how many, and the verdicts that are right
    sea: (20, ANY), grating: (18, ["unexplained"]), white: (9, ["unexplained"]), rough: (15, ANY), mount: (15, ANY),
    model_error: (9, DOUBTS), seven: (12, ["doubts"]),
}


def stand_ins(seed):
    for number, (make, (count, verdicts)) in enumerate(STAND_INS.items()):
        for i in range(count):
            kind = make.__name__.replace("_", "-")
            truth, table = make(np.random.default_rng([seed, 3, number, i]), i)
            yield {"id": f"C/{kind}-{i:02}", "kind": kind, "verdicts": verdicts, "declared": None, **truth}, table


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", default="out")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=10000, help="curves of part A, and of part B")
    a = parser.parse_args()
    for part in "ABC":
        os.makedirs(f"{a.out}/{part}", exist_ok=True)
    cases = [*(complete(a.seed, k) for k in range(a.count)), *missing(a.seed, a.count), *stand_ins(a.seed)]
    with open(f"{a.out}/truth.jsonl", "w") as file:
        for truth, table in cases:
            file.write(json.dumps(truth) + "\n")
            digits = ",".join("%.7g" if name == "brdf_per_sr" else "%.4f" for name in table)
            rows = "\n".join(digits % row for row in zip(*table.values()))
            with open(f"{a.out}/{truth['id']}.csv", "w") as curve:
                curve.write(",".join(table) + "\n" + rows + "\n")


if __name__ == "__main__":
    main()
