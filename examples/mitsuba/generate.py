"""Generate scans with one undeclared effect, a pair, an unknown one or none. See README.md."""

import argparse
import copy
import functools
import json
import os

import numpy as np

import effects
import physics
import scan
import targets
from target_state import State

HERE = os.path.dirname(os.path.abspath(__file__))
LOOKS = 4


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


def write_rays(path):
    aim, time = scan.aims()
    ray, (x, y, z) = scan.directions(aim), scan.ORIGIN
    with open(path, "w") as file:
        file.write("chirp,time_s,ox_m,oy_m,oz_m,dx,dy,dz\n")
        for i, (t, d) in enumerate(zip(time, ray)):
            file.write(f"{i},{t:.6f},{x},{y},{z},{d[0]:.9f},{d[1]:.9f},{d[2]:.9f}\n")


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


def write_scene(path, name, slug, parts, speckle_mm, shared, looks, seed):
    footprint = targets.MATERIALS[name]["footprint"]
    text = f"""name = "{name}"
seed = {seed}

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
file = "../rays.csv"

[radar.speckle]
looks = {looks}
form = "{'law' if shared else 'independent'}"

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


def add_looks(rng, looks, w0, state, shared):
    """Fields of the looks; a broken number of looks is one weak look among whole ones of the same total."""
    whole = int(np.ceil(looks))
    fields = physics.speckle(rng, whole, w0, state.surface, state.piece, shared)
    if whole == looks:
        return fields
    # weights 1, ..., 1, b of intensities with (sum)^2 / sum of squares = looks
    n = whole - 1
    low, high = 0.0, 1.0
    for _ in range(60):
        b = (low + high) / 2
        low, high = (b, high) if (n + b) ** 2 / (n + b * b) < looks else (low, b)
    weight = np.array([1.0] * n + [b]) if n else np.array([1.0])
    return fields * np.sqrt(weight / weight.mean())[:, None]


@functools.lru_cache
def load(name):
    with np.load(f"{HERE}/bases/{name}.npz") as file:
        return dict(file)


@functools.lru_cache
def calibrated(name, mm, label, strength, draw):
    make = functools.partial(State, load(name), name, physics.waist_m(mm))
    return effects.calibrate(make, label, strength, draw, LOOKS)


def tilt_spread_db(state, size, use):
    """Sd over tilts of a chirp's mean power in dB: its quantiles at 0.05, 0.15, ... 0.95 over the chirps."""
    rng, drawn = np.random.default_rng(0), copy.copy(state)
    levels = []
    for _ in range(64):
        effects.angle_error(drawn, size, rng)
        levels.append(physics.db(drawn.means_mw()[0][use]))
    return [round(float(q), 4) for q in np.quantile(np.std(levels, 0), np.arange(0.05, 1, 0.1))]


def range_gain(before, ranges, use):
    """Gain in ln p that the ranges alone offer; of a chirp no more than a false alarm would cost."""
    change = (ranges - before.range_m)[use & (before.range_m > 0)] / physics.RANGE_SD_M
    ceiling = np.log(physics.GATE_M / physics.RANGE_SD_M / physics.FALSE_ALARM)
    return float(np.sum(np.minimum(change**2 / 2, ceiling)))


def case(out, number, name, labels, strength, speckle_mm, shared, seed, level_sd):
    rng = np.random.default_rng([seed, number])
    w0 = physics.waist_m(speckle_mm)
    base = load(name)
    state, sizes, rms, kind = State(base, name, w0), {}, {}, None
    for index, label in enumerate(labels):
        draw = (seed, number, 77 + index)
        size, left = calibrated(name, speckle_mm, label, strength, draw)
        effects.EFFECTS[label](state, size, np.random.default_rng(draw))
        sizes[label], rms[label] = float(size), float(left)
        kind = getattr(state, "kind", kind)
    level = float(rng.normal(0, level_sd))
    power, share = state.means_mw()
    power = power * physics.mw(level)
    if state.ceiling_mw is not None:
        state.ceiling_mw *= physics.mw(level)
    safe = np.where(state.range_m > 0, state.range_m, physics.FOCUS_M)
    delta2 = (physics.WAVELENGTH_M / (2 * np.pi * physics.beam_width_m(w0, safe))) ** 2
    steady = share * delta2 / (targets.MATERIALS[name]["m"] ** 2 + delta2)
    looks = state.looks or LOOKS
    fields = add_looks(rng, looks, w0, state, shared)
    declared_noise = physics.mean_noise_mw(LOOKS)
    ranges = np.where(state.range_m > 0, state.range_m + getattr(state, "echo_shift", 0), 0)
    seen, where, alarm = physics.detect(rng, power, steady, ranges, fields, declared_noise * state.noise_gain, state.ceiling_mw)
    folder = os.path.join(out, f"case-{number:03d}")
    os.makedirs(os.path.join(out, "meshes"), exist_ok=True)
    os.makedirs(folder, exist_ok=True)
    parts = targets.MESHES[name]()
    for part, (v, f) in enumerate(parts):
        path = os.path.join(out, "meshes", f"{name}-{part}.ply")
        if not os.path.exists(path):
            targets.write_ply(path, v, f)
    rays = os.path.join(out, "rays.csv")
    if not os.path.exists(rays):
        write_rays(rays)
    slug = f"judge-{number:03d}"
    start = write_material(os.path.join(folder, "material"), slug, targets.MATERIALS[name], rng)
    write_scene(os.path.join(folder, "scene.toml"), name, slug, len(parts), speckle_mm, shared, LOOKS, number)
    write_cloud(os.path.join(folder, "cloud.ply"), seen, where, state.ray, state.aim)
    hit, echo = state.range_m > 0, np.isfinite(seen) & ~alarm
    truth = {
        "base": name, "labels": labels, "strength": strength if labels else None, "kind": kind, "sizes": sizes,
        "left_after_refit_db": rms,
        "reaches_strength": all(0.95 <= rms[n] / effects.RMS_DB[strength] <= 1.1 or n in ("speckle", "noise-floor") for n in labels),
        "level_offset_db": level, "speckle": f"shared, w0 = {speckle_mm} mm" if shared else "independent",
        "looks": float(looks), "declared_looks": LOOKS,
        "noise_dbm": float(physics.db(declared_noise * state.noise_gain)),
        "chirps": state.n, "hits": int(hit.sum()), "detections": int(np.isfinite(seen).sum()), "false_alarms": int(alarm.sum()),
        "silent_share_of_hits": float(np.mean(~np.isfinite(seen[base["range_m"] > 0]))),
        "range_gain": range_gain(State(base, name, w0), ranges, echo),
        "law": {k: v for k, v in targets.MATERIALS[name].items()}, "start": start,
    }
    if "angle-error" in labels:
        truth["tilt_spread_db"] = tilt_spread_db(state, sizes["angle-error"], echo)
    os.makedirs(os.path.join(out, "truth"), exist_ok=True)
    with open(os.path.join(out, "truth", f"case-{number:03d}.json"), "w") as file:
        json.dump(truth, file, indent=1)
    return truth


def choose(allowed, number, labels, arguments, mm):
    """The next target by turns on which every effect reaches its strength; else the first of them."""
    turn = (number + arguments.seed) % len(allowed)
    order = allowed[turn:] + allowed[:turn]
    for name in order:
        reached = True
        for index, label in enumerate(labels):
            draw = (arguments.seed, number, 77 + index)
            goal = effects.RMS_DB[arguments.strength] if label not in ("speckle", "noise-floor") else 0
            left = calibrated(name, mm, label, arguments.strength, draw)[1]
            reached = reached and 0.95 * goal <= left <= 1.1 * goal
        if reached:
            return name
    return order[0]


# Geometry first; added power after gains on the surface.
ORDER = ["motion", "pose", "finite-spot", "angle-error", "anisotropy", "foreign-patch"]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", required=True)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--effect", default="none", help="a name, NAME+NAME, unknown, none, or all (each name in turn)")
    parser.add_argument("--strength", default="strong", choices=list(effects.RMS_DB))
    parser.add_argument("--speckle", default="independent", choices=["independent", "8", "13.6", "19.2"])
    parser.add_argument("--waist", default="13.6", choices=["8", "13.6", "19.2"], help="waist, mm, with independent speckle")
    parser.add_argument("--base", choices=list(targets.MATERIALS), help="always this target [default: by turns]")
    parser.add_argument("--count", type=int, default=1, help="cases for each effect")
    parser.add_argument("--level-sd", type=float, default=1.5, help="standard deviation of the level's offset, dB")
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    arguments = parser.parse_args()
    names = [n for n in effects.EFFECTS if n != "unknown"] if arguments.effect == "all" else [arguments.effect]
    shared = arguments.speckle != "independent"
    mm = float(arguments.speckle if shared else arguments.waist)
    number = arguments.first
    for effect in names:
        labels = [] if effect == "none" else effect.split("+")
        for label in labels:
            if label not in effects.EFFECTS:
                parser.error(f"{label} is not an effect; choose from {', '.join(effects.EFFECTS)}")
        labels.sort(key=lambda n: ORDER.index(n) if n in ORDER else len(ORDER))
        allowed = [b for b in targets.MATERIALS if all(b in effects.BASES.get(n, [b]) for n in labels)]
        for _ in range(arguments.count):
            base = arguments.base or choose(allowed, number, labels, arguments, mm)
            t = case(arguments.out, number, base, labels, arguments.strength, mm, shared, arguments.seed, arguments.level_sd)
            print(f"case-{number:03d} {base} {'+'.join(labels) or 'none'} {t['left_after_refit_db']}: "
                  f"{t['detections']} detections, {t['silent_share_of_hits']:.2f} of the hits silent, {t['false_alarms']} false alarms")
            number += 1


if __name__ == "__main__":
    main()
