"""Generate scans with one undeclared effect, a pair, an unknown one or none. See README.md."""

import argparse
import functools
import glob
import json
import os
from typing import NamedTuple

import numpy as np

import diagnoses
import effects
import evidence
import physics
import refit
import scan
import targets
from target_state import State

HERE = os.path.dirname(os.path.abspath(__file__))
LOOKS = 4


class Plan(NamedTuple):
    """A case before it is made."""

    number: int
    seed: int
    labels: tuple = ()
    strength: str = "strong"
    speckle: str = "independent"  # or the waist, mm, of speckle that neighbours share
    waist: str = "13.6"  # mm, with independent speckle
    scan: str = "once"
    base: str = ""  # none: the next by turns
    level_sd: float = 1.5

    def is_shared(self):
        return self.speckle != "independent"

    def waist_mm(self):
        return float(self.speckle if self.is_shared() else self.waist)

    def draw(self, index):
        """Seed of the draws of an effect."""
        return self.seed, self.number, 77 + index


def write_cloud(path, power, range_m, ray, aim):
    seen = np.flatnonzero(np.isfinite(power))
    kind = [("x", "<f8"), ("y", "<f8"), ("z", "<f8"), ("xt_m", "<f4"), ("yt_m", "<f4"), ("range_m", "<f4"), ("power_dbm", "<f4"), ("chirp", "<i4")]
    rows = np.zeros(len(seen), kind)
    point = scan.ORIGIN + range_m[seen, None] * ray[seen]
    rows["x"], rows["y"], rows["z"] = point.T
    # x_t and y_t of the detection itself: the target frame has its origin at the centre, axes parallel to the global ones
    rows["xt_m"], rows["yt_m"] = (point - targets.CENTRE)[:, :2].T
    rows["range_m"], rows["power_dbm"], rows["chirp"] = range_m[seen], power[seen], seen
    names = {"<f8": "double", "<f4": "float", "<i4": "int"}
    head = "ply\nformat binary_little_endian 1.0\n" + f"element vertex {len(rows)}\n"
    head += "".join(f"property {names[t]} {n}\n" for n, t in kind) + "end_header\n"
    with open(path, "wb") as file:
        file.write(head.encode() + rows.tobytes())


def rays_file(pattern):
    return "rays.csv" if pattern == "once" else f"rays-{pattern}.csv"


def write_rays(path, pattern):
    aim, time = scan.aims(pattern)
    ray, (x, y, z) = scan.directions(aim), scan.ORIGIN
    lines = ["chirp,time_s,ox_m,oy_m,oz_m,dx,dy,dz\n"]
    for i, (t, d) in enumerate(zip(time, ray)):
        lines.append(f"{i},{t:.6f},{x},{y},{z},{d[0]:.9f},{d[1]:.9f},{d[2]:.9f}\n")
    diagnoses.write_whole(path, "".join(lines).encode())


def write_material(folder, slug, material, rng):
    """What the user has stored: a law whose numbers are a little off."""
    os.makedirs(folder, exist_ok=True)
    k = material["k"]
    lobe = (1.0 if material["kind"] == "plastic" else 1 - k) * material["f"] * np.exp(rng.normal(0, 0.2))
    rest = (1.0 if material["kind"] == "plastic" else k) * material["r"] * np.exp(rng.normal(0, 0.2))
    m = material["m"] * np.exp(rng.normal(0, 0.12))
    text = f"""slug = "{slug}"
name = "Stored law of {slug}"
class = "paint"
description = "Start values for a diagnosis."
licence = "CC0-1.0"
tags = ["test"]
frequency_ghz = [280, 320]
theta_deg = [0, 85]
render = "start"

[[source]]
key = "start"
kind = "synthetic"
title = "Start values"

[[fit]]
name = "start"
estimator = "stated"
source = "start"

[fit.scattering]
model = "mixture"
k = {k}
[fit.scattering.specular]
model = "cook-torrance"
distribution = "{material['distribution']}"
shadowing = "separable"
f_lambda = {lobe / (1 - k):.6g}
m = {m:.5g}
[fit.scattering.diffuse]
model = "blinn-phong"
r_s = {rest / k:.6g}
alpha = 0.5
"""
    with open(os.path.join(folder, "material.toml"), "w") as file:
        file.write(text)
    return {"m": m, "lobe": lobe, "rest": rest}


def write_scene(path, name, slug, parts, plan, looks):
    speckle_mm = plan.waist_mm()
    footprint = targets.MATERIALS[name]["footprint"]
    text = f"""name = "{name}"
seed = {plan.number}

[radar]
preset = "upm-300ghz"
transmit_power_dbm = {physics.POWER_DBM}
system_loss_db = {physics.loss_db(physics.waist_m(speckle_mm)):.4f}
threshold_dbm = {physics.THRESHOLD_DBM}
footprint = "{footprint}"
spot_diameter_m = 0.016
spot_diameter_is = "{physics.SPOT[speckle_mm]}"

[radar.beam]
focus_m = {physics.FOCUS_M}
edge_growth = 1.0

[radar.scan]
pattern = "rays"
file = "../{rays_file(plan.scan)}"

[radar.speckle]
looks = {looks}
form = "{'law' if plan.is_shared() else 'independent'}"

[radar.noise]
false_alarm_probability = {physics.FALSE_ALARM}
gate_length_m = {physics.GATE_M}
added = "before-looks"
range_sd_m = {physics.RANGE_SD_M}
"""
    for number in range(parts):
        text += f'\n[[mesh]]\nname = "part{number}"\nfile = "../meshes/{name}-{number}.ply"\n'
    text += f'\n[[region]]\nname = "all"\nmaterial = "{slug}"\n'
    with open(path, "w") as file:
        file.write(text)


@functools.lru_cache
def load(name, pattern="once"):
    """A base. What the chirps meet is stored for the scan `once`; for others Mitsuba traces it."""
    with np.load(f"{HERE}/bases/{name}.npz") as file:
        base = dict(file)
    if pattern != "once":
        import build_bases

        base.update(build_bases.met(name, pattern))
    return base


def untouched(name, plan):
    return State(load(name, plan.scan), name, physics.waist_m(plan.waist_mm()), plan.scan)


@functools.lru_cache
def calibrated(name, plan, index):
    """An effect of a plan with its size for a target."""
    return effects.calibrate(lambda: untouched(name, plan), plan.labels[index], plan.strength, plan.draw(index), LOOKS)


def reaches(name, plan):
    """Whether every effect of a plan gets as strong as wanted on a target."""
    goal = effects.RMS_DB[plan.strength]
    left = [calibrated(name, plan, i).left_db for i, label in enumerate(plan.labels) if label not in effects.OWN_DB]
    return all(0.95 * goal <= rms <= 1.1 * goal for rms in left)


def tilt_spread_db(state, size, use):
    """Sd over tilts of a chirp's mean power in dB: its quantiles at 0.05, 0.15, ... 0.95 over the chirps."""
    return [round(float(q), 4) for q in np.quantile(effects.excess_scatter_db(state, size)[use], np.arange(0.05, 1, 0.1))]


def range_gain(before, ranges, use):
    """Gain in ln p that the ranges alone offer; of a chirp no more than a false alarm would cost."""
    change = (ranges - before.range_m)[use & (before.range_m > 0)] / physics.RANGE_SD_M
    return float(np.sum(np.minimum(change**2 / 2, refit.MOST)))


@functools.lru_cache
def generator():
    """Digest of what a case depends on besides its plan."""
    files = ["build_bases", "effects", "evidence", "generate", "physics", "refit", "scan", "sets", "target_state", "targets"]
    bases = [os.path.relpath(path, HERE) for path in sorted(glob.glob(f"{HERE}/bases/*.npz"))]
    return diagnoses.digest(HERE, [f"{name}.py" for name in files] + bases)


def truth_path(out, number):
    return os.path.join(out, "truth", f"case-{number:03d}.json")


def made(out, number, seed):
    """Truth of a case of this number and seed that this generator has made, or None."""
    try:
        with open(truth_path(out, number)) as file:
            truth = json.load(file)
    except FileNotFoundError:
        return None
    return truth if truth.get("generator") == generator() and truth["plan"]["seed"] == seed else None


def make(out, plan):
    """Writes a case, its truth last, and returns the truth. One that is there of the same plan stays."""
    truth, record = made(out, plan.number, plan.seed), {**plan._asdict(), "labels": list(plan.labels)}
    if truth and truth["plan"] == record:
        return truth
    path = truth_path(out, plan.number)
    if os.path.exists(path):
        os.remove(path)
    truth = {**case(out, plan), "plan": record, "generator": generator()}
    os.makedirs(os.path.dirname(path), exist_ok=True)
    diagnoses.write_whole(path, json.dumps(truth, indent=1).encode())
    return truth


def disturbed(name, plan, indices):
    """A target with effects of a plan, by their places in it."""
    state = untouched(name, plan)
    for index in indices:
        size = calibrated(name, plan, index).size
        effects.EFFECTS[plan.labels[index]](state, size, np.random.default_rng(plan.draw(index)))
    return state


def observe(rng, state, shared):
    """What a scan reports of a target."""
    power, share = state.means_mw()
    hit = state.range_m > 0
    delta2 = state.delta(np.where(hit, state.range_m, physics.FOCUS_M)) ** 2
    steady = share * delta2 / (state.material["m"] ** 2 + delta2)
    weights = physics.look_weights(state.looks or LOOKS)
    fields = physics.speckle(rng, len(weights), state.w0, state.surface, state.piece, shared) * np.sqrt(weights)[:, None]
    ranges = np.where(hit, state.range_m + getattr(state, "echo_shift", 0), 0)
    noise = physics.mean_noise_mw(LOOKS) * state.noise_gain
    report = physics.detect(rng, power, steady, ranges, fields, noise, state.ceiling_mw)
    return evidence.Observed(state, power, steady, ranges, noise, report)


def realised_gain(data, before, alone, label, found, level, share):
    """Gain in ln p of what was observed, by the true form of an effect over the law refitted without it; others stay.

    `alone` are the mean powers with this effect alone, `share` is that of independent chirps."""
    law = found.law_mw
    left_out = np.divide(law, alone, out=np.ones_like(law), where=alone > 0)
    without = np.where((alone > 0) | (law == 0), data.power_mw * left_out, law * physics.mw(level))
    gain = data.gain(label, found.size, without, LOOKS)
    if label in ("angle-error", "noise-floor"):  # which share no speckle
        return gain
    return share * gain + (data.range_gain(before) if label in ("motion", "pose") else 0.0)


def case(out, plan):
    """Writes a case, and returns its truth."""
    number, labels, shared, speckle_mm = plan.number, plan.labels, plan.is_shared(), plan.waist_mm()
    name = plan.base or choose(plan)
    rng = np.random.default_rng([plan.seed, number])
    before, state = untouched(name, plan), disturbed(name, plan, range(len(labels)))
    sizes = {"unknown" if n in effects.UNKNOWN else n: calibrated(name, plan, i) for i, n in enumerate(labels)}
    level = float(rng.normal(0, plan.level_sd))
    state.gain = state.gain * physics.mw(level)
    if state.ceiling_mw is not None:
        state.ceiling_mw *= physics.mw(level)
        state.numbers["compression"] = [{"saturation_dbm": float(physics.db(state.ceiling_mw))}]
    declared_noise = physics.mean_noise_mw(LOOKS)
    if "noise-floor" in labels:  # the power above the declared one
        state.numbers["noise-floor"] = [{"level_dbm": float(physics.db(declared_noise * (state.noise_gain - 1)))}]
    data = observe(rng, state, shared)
    folder = os.path.join(out, f"case-{number:03d}")
    os.makedirs(os.path.join(out, "meshes"), exist_ok=True)
    os.makedirs(folder, exist_ok=True)
    parts = targets.MESHES[name]()
    for part, (v, f) in enumerate(parts):
        diagnoses.write_whole(os.path.join(out, "meshes", f"{name}-{part}.ply"), targets.ply(v, f))
    write_rays(os.path.join(out, rays_file(plan.scan)), plan.scan)
    slug = f"judge-{number:03d}"
    start = write_material(os.path.join(folder, "material"), slug, targets.MATERIALS[name], rng)
    write_scene(os.path.join(folder, "scene.toml"), name, slug, len(parts), plan, LOOKS)
    write_cloud(os.path.join(folder, "cloud.ply"), data.seen_dbm, data.seen_m, state.ray, state.aim)
    share = evidence.independent_share(state.aim, state.w0) if shared and labels else 1.0
    fitted, realised = {}, {}
    for index, (label, found) in enumerate(sizes.items()):
        alone = disturbed(name, plan, [index])
        realised[label] = realised_gain(data, before, alone.means_mw()[0], label, found, level, share)
        if label in effects.FITTED:
            fitted[label] = effects.fitted_numbers(before, alone, label, data.echo & (before.range_m > 0), LOOKS)
    truth = {
        "base": name, "labels": list(sizes), "strength": plan.strength if labels else None,
        "kind": next((n for n in labels if n in effects.UNKNOWN), None),
        "sizes": {label: found.size for label, found in sizes.items()},
        "numbers": state.numbers | fitted,
        "left_after_refit_db": {label: found.left_db for label, found in sizes.items()},
        "power_gain": {label: found.gain for label, found in sizes.items()},
        "realised_gain": realised, "independent_share": share,
        "reaches_strength": reaches(name, plan),
        "level_offset_db": level, "speckle": f"shared, w0 = {speckle_mm} mm" if shared else "independent",
        "looks": float(state.looks or LOOKS), "declared_looks": LOOKS, "noise_dbm": float(physics.db(data.noise_mw)),
        "chirps": state.n, "hits": int(np.sum(state.range_m > 0)),
        "detections": int(data.seen.sum()), "false_alarms": int(data.alarm.sum()),
        "silent_share_of_hits": float(np.mean(~data.seen[before.range_m > 0])),
        "range_gain": range_gain(before, data.range_m, data.echo),
        "law": {k: v for k, v in targets.MATERIALS[name].items()}, "start": start,
    }
    if "angle-error" in labels:
        truth["tilt_spread_db"] = tilt_spread_db(state, sizes["angle-error"].size, data.echo)
    return truth


def choose(plan):
    """The next target by turns on which every effect reaches its strength; else the first of them."""
    order = allowed(plan)
    return next((name for name in order if reaches(name, plan)), order[0])


def allowed(plan):
    """Targets that have what the effects need, from the next by turns on."""
    names = [b for b in targets.MATERIALS if all(b in effects.BASES.get(n, [b]) for n in plan.labels)]
    turn = (plan.number + plan.seed) % max(len(names), 1)
    return names[turn:] + names[:turn]


# Geometry first; added power after gains on the surface.
ORDER = ["motion", "pose", "finite-spot", "angle-error", "anisotropy", "foreign-patch"]


def in_order(labels):
    return tuple(sorted(labels, key=lambda n: ORDER.index(n) if n in ORDER else len(ORDER)))


def labels_of(effect, number):
    """Names of effects from how they are asked for; the kinds of `unknown` by turns."""
    if effect == "none":
        return ()
    if effect == "unknown":
        return (effects.UNKNOWN[number % len(effects.UNKNOWN)],)
    return in_order(effect.split("+"))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", required=True)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--effect", default="none", help="a name, NAME+NAME, unknown, none, or all (each name in turn)")
    parser.add_argument("--strength", default="strong", choices=list(effects.RMS_DB))
    parser.add_argument("--speckle", default="independent", choices=["independent", "8", "13.6", "19.2"])
    parser.add_argument("--waist", default="13.6", choices=["8", "13.6", "19.2"], help="waist, mm, with independent speckle")
    parser.add_argument("--scan", default="once", choices=list(scan.PATTERNS), help="which places are met in which order")
    parser.add_argument("--base", default="", choices=list(targets.MATERIALS), help="always this target [default: by turns]")
    parser.add_argument("--count", type=int, default=1, help="cases for each effect")
    parser.add_argument("--level-sd", type=float, default=1.5, help="standard deviation of the level's offset, dB")
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    arguments = parser.parse_args()
    names = effects.KNOWN if arguments.effect == "all" else [arguments.effect]
    for effect in names:
        for label in effect.split("+"):
            if label not in [*effects.EFFECTS, "unknown", "none"]:
                parser.error(f"{label} is not an effect; choose from {', '.join(effects.EFFECTS)}")
    given = {name: getattr(arguments, name) for name in Plan._fields if hasattr(arguments, name)}
    for number, effect in enumerate((n for n in names for _ in range(arguments.count)), arguments.first):
        t = make(arguments.out, Plan(number, labels=labels_of(effect, number), **given))
        labels = t["plan"]["labels"]
        print(f"case-{number:03d} {t['base']} {'+'.join(labels) or 'none'} {t['left_after_refit_db']}: "
              f"{t['detections']} detections, {t['silent_share_of_hits']:.2f} of the hits silent, {t['false_alarms']} false alarms")


if __name__ == "__main__":
    main()
