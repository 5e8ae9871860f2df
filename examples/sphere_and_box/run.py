"""Judge `matdb measure`, `fit` and `diagnose` on scans of a sphere and a box, and on drawn curves. See README.md."""

import argparse
import concurrent.futures
import csv
import json
import os
import subprocess
import sys

import numpy as np
from scipy.optimize import minimize

import scan
sys.path += [f"{scan.HERE}/../curves", f"{scan.HERE}/../mitsuba"]
import diagnoses
import laws
import reference

MISS, SDS = 0.5, 3.0
GOOD, SAID, MISSED = KINDS = ["good", "says so", "MISSED"]


def read(path, noise_dbm):
    """A curve with its noise and a thin copy, and the model as its beam sees it. The normals count as exact: tilts by
    `theta_sd_deg` change ln p by some 0.02 here."""
    with open(path) as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    theta, sigma, power, missed, beam = (
        np.array([float(r[n]) for r in rows]) for n in ("theta_deg", "sigma0_db", "power_dbm", "censored", "beam_rad"))
    curve = reference.Curve(theta, scan.mw(sigma), missed > 0)
    curve.noise = scan.mw(sigma - power + noise_dbm)[np.argsort(missed, kind="stable")]
    thin = (theta < 20) | (np.arange(len(rows)) % 5 == 0)
    curve.thin = reference.Curve(theta[thin], scan.mw(sigma[thin]), missed[thin] > 0)

    def basis(s, t):
        lobe = laws.beckmann(np.hypot(s[1], beam.mean()), t) * laws.g1_beckmann(s[1], t) ** 2
        return laws.stack(laws.blinn_phong(s[0], t) + 0 * s[1], lobe + 0 * s[0])

    plain = laws.MODELS["mixture"]
    return curve, laws.Model(plain.name, plain.shape, plain.levels, basis, plain.read)


def ln_p(model, curve, shape, levels, looks):
    mean = model.sigma0(shape, levels, curve.theta) + curve.noise
    return reference.log_p(curve, mean[None], np.array([[looks]]))[0]


def best(model, curve, truth):
    """ln p of the best fit: 10 000 shapes, each with its best levels and looks, and searches from the ten best and from
    the truth. The grid takes every row below 20 degrees and every fifth beyond, without noise."""
    points, side = reference.grid(model)
    starts, values = [], []
    for block in np.array_split(points, 100):
        basis = model.basis(model.columns(block), curve.thin.theta[None])
        tries = [reference.solve_levels(curve.thin, basis, first, np.ones((len(block), 1)), 6)
                 for first in reference.first_levels(curve.thin, basis)]
        pick = np.argmax([t[2] for t in tries], axis=0), np.arange(len(block))
        levels, looks, value = (np.stack(part)[pick] for part in zip(*tries))
        starts.append(np.hstack([block, np.log(levels), np.log(looks)]))
        values.append(np.nan_to_num(value, nan=-1e300))
    known = np.log([truth["alpha"] + model.shape[0][3], truth["m"], truth["R"], truth["S"], scan.LOOKS])
    starts = [*np.concatenate(starts)[reference.peaks(np.concatenate(values), side, 2, 10)], known]
    bounds = model.bounds() + [(np.log(reference.LEAST_LEVEL), 0.0)] * 2 + [tuple(np.log(reference.LOOKS))]

    def cost(v):
        return -ln_p(model, curve, [c[0, 0] for c in model.columns(v[None, :2])], np.exp(v[2:4]), np.exp(v[4]))

    def search(v):
        inside = np.clip(v, *np.transpose(bounds))
        simplex = np.vstack([inside, inside + np.diag(np.where(inside > np.mean(bounds, 1), -0.15, 0.15))])
        options = {"initial_simplex": simplex, "maxiter": 2000, "xatol": 1e-5, "fatol": 1e-6}
        return minimize(cost, inside, method="Nelder-Mead", bounds=bounds, options=options).fun

    return -min(search(v) for v in starts)


def matdb(program, *words):
    return subprocess.run([program.path, *words], capture_output=True, text=True)


def judge_fit(program, path, noise_dbm, truth, compared):
    run = matdb(program, "fit", path, "--noise-dbm", str(noise_dbm), "--json")
    if not run.stdout:
        return MISSED, f"fit: status {run.returncode}, {run.stderr.strip()}"
    said = json.loads(run.stdout)
    if run.returncode or not said["converged"]:
        return SAID, f"fit: status {run.returncode}, {'; '.join(said['sentences'])} {run.stderr.strip()}"
    (curve, model), number = read(path, noise_dbm), {e["name"]: e for e in said["estimates"]}
    value = ln_p(model, curve, *model.read({n: e["value"] for n, e in number.items()}), said["looks"])
    below = best(model, curve, truth) - value
    kinds = [GOOD if below <= MISS else MISSED]
    words = [f"fit: {below:.2f} below the reference in ln p (matdb's own is {said['objective'] - value:+.2f} off)"]
    for name in ("specular.m", "diffuse.alpha"):
        v, sd, true = number[name]["value"], number[name]["sd"], truth[name.split(".")[1]]
        words.append(f"{name} {v:.4g} ± {sd or np.nan:.2g} for {true:.4g}")
        if compared:
            kinds.append(SAID if sd is None else GOOD if abs(v - true) <= SDS * sd else MISSED)
    kind = max(kinds, key=KINDS.index)
    return kind, ", ".join(words + (said["sentences"] if kind != GOOD else []))


def judge_diagnosis(program, folder, level_db):
    said = diagnoses.diagnose(program, folder, 0)
    verdict, level = said["verdict"], said.get("base", {}).get("level_db") or {"value": np.nan, "sd": np.nan}
    wrong = []
    if verdict != "no-missing-effect":
        wrong += [said.get("reason", ""), said.get("words", ""), json.dumps(said.get("unexplained", []))]
    if (said["status"] == 0) == (verdict in ("crash", "cannot-tell", "contradictory")):
        wrong.append(f"status {said['status']}")
    if not abs(level["value"] - level_db) <= SDS * level["sd"]:
        wrong.append(f"the level is not within {SDS:g} sd")
    named = " ".join([verdict, *(e["name"] for e in said.get("effects", []))])
    words = f"{os.path.basename(folder)}: {named}, level {level['value']:.2f} ± {level['sd']:.2f} dB for {level_db:g}"
    return MISSED if wrong else GOOD, "; ".join([words, *filter(None, wrong)])


def judge(program, folder, seed, name):
    """(kind, words) of a case, kept in the folder of its seed."""
    kept = f"{folder}/{name}.json"
    if os.path.exists(kept):
        with open(kept) as file:
            return json.load(file)
    os.makedirs(folder, exist_ok=True)
    rng, draws = np.random.default_rng([seed, 0]), np.random.default_rng([seed, 1 + ord(name)])
    target, stored = scan.draw_target(rng), {n: v * rng.uniform(0.7, 1.3) for n, v in scan.LAW.items()}
    at, curve = f"{folder}/{name}", f"{folder}/{name}-measured/curve.csv"
    if name == "A":
        scan.write_scan(at, draws, target, stored)
        run = matdb(program, "measure", f"{at}/cloud.ply", "--scene", f"{at}/scene.toml", "-o", os.path.dirname(curve))
        fit = MISSED, f"measure: status {run.returncode}, {run.stderr.strip()}"
        if run.returncode == 0:
            fit = judge_fit(program, curve, scan.NOISE_DBM, scan.LAW, True)
        parts = [fit, judge_diagnosis(program, at, 0)]
    elif name == "B":
        law = scan.write_curve(f"{at}.csv", draws)
        parts = [judge_fit(program, f"{at}.csv", scan.CURVE_NOISE_DBM, law, False)]
    else:
        scan.write_scan(f"{at}-high", draws, target, stored, echo_db=15)
        scan.write_scan(f"{at}-low", draws, target, stored, scale_db=-15)
        parts = [judge_diagnosis(program, f"{at}-high", 15), judge_diagnosis(program, f"{at}-low", -15)]
    kinds, words = zip(*parts)
    answer = [max(kinds, key=KINDS.index), "; ".join(words)]
    diagnoses.write_whole(kept, json.dumps(answer).encode())
    return answer


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", required=True, help="FIRST..END, without END")
    parser.add_argument("--matdb", default="matdb")
    parser.add_argument("--out", required=True)
    parser.add_argument("--jobs", type=int, default=2, help="cases at once")
    a = parser.parse_args()
    program = diagnoses.Program(a.matdb, "of its content")
    # Answers of another program or of another judge are never mixed in.
    files = [program.path, diagnoses.__file__, laws.__file__, reference.__file__]
    files += [f"{scan.HERE}/{name}" for name in ("box.obj", "material.toml", "run.py", "scan.py", "scene.toml")]
    program.key = diagnoses.digest("", files)
    out = os.path.abspath(f"{a.out}/{program.key}")
    scan.write_shared(f"{out}/shared")
    tasks = [(f"{out}/seed-{seed}", seed, name) for seed in range(*map(int, a.seeds.split(".."))) for name in "ABC"]
    kinds = {name: [] for name in "ABC"}
    with concurrent.futures.ProcessPoolExecutor(a.jobs) as pool:
        running = [pool.submit(judge, program, *task) for task in tasks]
        for (_, seed, name), future in zip(tasks, running):
            kind, words = future.result()
            kinds[name].append(kind)
            print(f"seed {seed} {name} {kind}: {words}", flush=True)
    for name, mine in kinds.items():
        print(f"{name}: {mine.count(GOOD)} of {len(mine)}" + (f", {mine.count(SAID)} say so" if SAID in mine else ""))
    raise SystemExit(any(MISSED in mine for mine in kinds.values()))


if __name__ == "__main__":
    main()
