"""Run `matdb diagnose` over the cases of a folder and compare its answers with the truth. Lists every miss."""

import argparse
import collections
import concurrent.futures
import csv
import functools
import json
import math
import os
import shutil
import subprocess
import time


IN_THE_DATA = 5.0  # gain in ln p below which not even the true form can be seen
FALSE_ALARM = 3e-4  # declared, of a gate without an echo
LEFT_DB = {"strong": 1.33, "moderate": 0.665, "weak": 0.33}


def diagnose(matdb, folder, seed):
    """report.json of a case, with the seconds and the words if it failed. A report newer than cloud and program stays."""
    db, out = os.path.join(folder, "matdb.sqlite"), os.path.join(folder, f"diagnosis-{seed}")
    start = time.time()
    if not os.path.exists(db):
        added = subprocess.run([matdb, "--db", db, "-q", "add", "--from", os.path.join(folder, "material")], capture_output=True, text=True)
        if added.returncode != 0:
            return {"verdict": "crash", "words": added.stderr.strip()}
    report = os.path.join(out, "report.json")
    if os.path.exists(report):
        inputs = [os.path.join(folder, "cloud.ply"), os.path.join(folder, "scene.toml"), shutil.which(matdb) or matdb]
        if os.path.getmtime(report) > max(map(os.path.getmtime, inputs)):
            with open(report) as file:
                return {**json.load(file), "words": ""}
        os.remove(report)
    run = subprocess.run(
        [matdb, "--db", db, "-q", "diagnose", os.path.join(folder, "cloud.ply"), "--scene", os.path.join(folder, "scene.toml"), "--seed", str(seed), "-o", out],
        capture_output=True, text=True)
    answer = {"verdict": "crash"}
    if os.path.exists(report):
        with open(report) as file:
            answer = json.load(file)
    answer.update(seconds=time.time() - start, status=run.returncode, words=run.stderr.strip())
    return answer


def intervals(answer, truth):
    """(name, value, sd, truth, holds) of what the report states and the truth knows."""
    out, effects = [], {e["name"]: e["parameters"] for e in answer.get("effects", [])}
    known = {
        "speckle": {"looks": truth["looks"]},
        "angle-error": {"sd_deg": truth["sizes"].get("angle-error")},
        "noise-floor": {},
    }
    if "noise-floor" in truth["labels"]:
        # the power above the declared one
        total = 10 ** (truth["noise_dbm"] / 10)
        known["noise-floor"]["level_dbm"] = 10 * math.log10(total - total / 10 ** (truth["sizes"]["noise-floor"] / 10))
    for name in effects:
        for key, value in known.get(name, {}).items():
            if name in truth["labels"] and key in effects[name] and effects[name][key].get("sd"):
                p = effects[name][key]
                out.append((f"{name}.{key}", p["value"], p["sd"], value))
    # m of the law: only where the law has that number and nothing changes the lobe itself
    clean = set(truth["labels"]) <= {"drift", "fov-gain", "noise-floor", "speckle", "covering-layer", "motion", "pose"}
    if truth["law"]["kind"] == "blend" and clean:
        for p in answer.get("base", {}).get("parameters", []):
            if p["name"] == "specular.m" and p["sd"]:
                out.append(("law m", p["value"], p["sd"], truth["law"]["m"]))
    return [(n, v, s, t, abs(v - t) <= 1.96 * s) for n, v, s, t in out]


@functools.lru_cache
def independent_share(rays, w0):
    """Chirps with speckle of their own among all: 1/sum of exp(-2 d^2/w0^2) over the aims at the target plane z = 0."""
    cells, total = collections.defaultdict(list), 0.0
    with open(rays) as file:
        for row in csv.DictReader(file):
            way = -float(row["oz_m"]) / float(row["dz"])
            x, y = (float(row[f"o{a}_m"]) + way * float(row[f"d{a}"]) for a in "xy")
            cells[int(x // (2.5 * w0)), int(y // (2.5 * w0))].append((x, y))
    for (i, j), mine in cells.items():
        near = [p for a in (i - 1, i, i + 1) for b in (j - 1, j, j + 1) for p in cells.get((a, b), [])]
        total += sum(math.exp(-2 * ((x - u) ** 2 + (y - v) ** 2) / w0**2) for x, y in mine for u, v in near)
    return sum(map(len, cells.values())) / total


@functools.lru_cache
def divergence(true_looks, sd, looks):
    """Kullback-Leibler divergence, nats a chirp, of powers of `true_looks` looks whose ln mean has the sd `sd` from
    the closest powers of `looks` looks: those of the same mean."""

    def log_density(u, k):  # of u = ln power, mean 1
        return k * u - k * math.exp(u) + k * math.log(k) - math.lgamma(k)

    nodes = [(sd * i / 5, math.exp(-((i / 5) ** 2) / 2)) for i in range(-20, 21)] if sd else [(0.0, 1.0)]
    step, whole = 0.02, sum(w for _, w in nodes)
    grid = [-25 + step * i for i in range(1550)]
    p = [sum(w * math.exp(log_density(u - s, true_looks)) for s, w in nodes) / whole for u in grid]
    mean = math.log(sum(p[i] * math.exp(u) for i, u in enumerate(grid)) * step)
    inside = [(u, p[i]) for i, u in enumerate(grid) if p[i] > 1e-300]
    return step * sum(x * (math.log(x) - log_density(u - mean, looks)) for u, x in inside)


def expected_gain(truth, folder):
    """Gain in ln p that the true form of each effect has over the refitted base, from the truth alone."""
    echoes, looks = truth["detections"] - truth["false_alarms"], truth.get("declared_looks", 4)
    share = 1.0
    if truth["speckle"].startswith("shared"):
        share = independent_share(os.path.join(folder, "rays.csv"), float(truth["speckle"].split()[-2]) / 1000)
    out = {}
    for label in truth["labels"]:
        left = truth["left_after_refit_db"][label] * math.log(10) / 10  # nepers of power
        if label == "speckle":
            out[label] = share * echoes * divergence(truth["looks"], 0.0, looks)
        elif label == "angle-error":
            # every chirp has a tilt of its own, which neighbours that share a speckle show the better: at least this
            spread = [s * math.log(10) / 10 for s in truth.get("tilt_spread_db", [])] or [left]
            out[label] = echoes * sum(divergence(looks, s, looks) for s in spread) / len(spread)
        elif label == "noise-floor":  # by its false alarms alone, which share no speckle
            empty = truth["chirps"] - truth["hits"] * (1 - truth["silent_share_of_hits"])
            count, declared = truth["false_alarms"], max(empty, 1) * FALSE_ALARM
            out[label] = count * math.log(count / declared) - count + declared if count > declared else 0.0
        else:
            out[label] = share * echoes * looks * left**2 / 2
            if label in ("motion", "pose"):  # which the ranges show as well
                out[label] += truth.get("range_gain", 0.0)
    return out


def judge(answer, truth, gains):
    """What kind of case it is, whether the answer is right, and the names that were said."""
    said = [e["name"] for e in answer.get("effects", [])]
    labels, verdict = truth["labels"], answer["verdict"]
    if not labels:
        return "complete", verdict == "no-missing-effect", said
    if labels == ["unknown"]:
        kind, good = "unknown", verdict == "unexplained" and not said
    elif len(labels) > 1:
        kind, good = "pair", set(labels) == set(said[:2])
    else:
        kind, good = truth["strength"], said[:1] == labels
        if not truth["reaches_strength"]:
            left = truth["left_after_refit_db"][labels[0]]
            kind = next((k for k in list(LEFT_DB)[list(LEFT_DB).index(kind):] if left >= LEFT_DB[k]), "below weak")
    return "not in the data" if min(gains.values()) < IN_THE_DATA else kind, good, said


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder")
    parser.add_argument("--matdb", default="matdb")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--strict", action="store_true", help="exit with 1 unless every case is right")
    arguments = parser.parse_args()
    names = sorted(n for n in os.listdir(arguments.folder) if n.startswith("case-"))
    truths = {}
    for n in names:
        with open(os.path.join(arguments.folder, "truth", f"{n}.json")) as file:
            truths[n] = json.load(file)
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        answers = dict(zip(names, pool.map(lambda n: diagnose(arguments.matdb, os.path.join(arguments.folder, n), arguments.seed), names)))
    right, total, held, confusion = collections.Counter(), collections.Counter(), [], collections.Counter()
    misses, apart = [], []
    alarms = collections.Counter()
    for n in names:
        truth, answer = truths[n], answers[n]
        gains = expected_gain(truth, arguments.folder)
        kind, good, said = judge(answer, truth, gains)
        total[kind] += 1
        right[kind] += good
        for i in intervals(answer, truth):
            held.append(i[4])
            if not i[4]:
                misses.append(f"{n} {truth['base']}: interval of {i[0]}: {i[1]:.4g} +- {i[2]:.2g}, truth {i[3]:.4g}")
        confusion["+".join(truth["labels"]) or "none", "+".join(said) or answer["verdict"]] += 1
        if kind == "complete":
            alarms["named"] += bool(said)
            alarms["unexplained"] += not said and answer["verdict"] == "unexplained"
        left = ", ".join(f"{u.get('covariate')} {u.get('strength_db') or 0:.2f} dB" for u in answer.get("unexplained", []))
        if not good or kind == "not in the data":
            words = "" if said or left else f" [{answer.get('reason') or answer['words'][-200:]}]"
            gain = ", ".join(f"{v:.1f} for {g}" for g, v in gains.items()) or "none"
            if set(truth["labels"]) & {"finite-spot", "multi-bounce"}:
                gain += f", by ranges {truth.get('range_gain', 0.0):.0f} more"
            (apart if kind == "not in the data" else misses).append(
                f"{n} {truth['base']} {'+'.join(truth['labels']) or 'none'} ({truth['strength']}, {truth.get('kind')}, "
                f"{truth['speckle']}, level {truth['level_offset_db']:+.1f} dB; expected gain {gain}): "
                f"{answer['verdict']}, said {'+'.join(said) or 'nothing'}; left: {left or 'nothing'}{words}")
    print("right first name (pairs: both; unknown: unexplained and no name; complete: nothing missing):")
    for kind in total:
        if kind != "not in the data":
            print(f"  {kind:16} {right[kind]:4} of {total[kind]}")
    if apart:
        print(f"  not in the data: {len(apart)} cases, {right['not in the data']} of them right all the same")
    if total["complete"]:
        print(f"  complete scans with a named effect: {alarms['named']}, called unexplained: {alarms['unexplained']}, of {total['complete']}")
    print(f"95 % intervals that hold the truth: {sum(held)} of {len(held)}")
    seconds = sorted(a["seconds"] for a in answers.values() if "seconds" in a)
    if seconds:
        print(f"seconds a case: median {seconds[len(seconds) // 2]:.1f}, worst {seconds[-1]:.1f} ({arguments.jobs} at once)")
    print("truth -> said:")
    for (truth, said), count in sorted(confusion.items()):
        print(f"  {truth:28} -> {said:32} {count}")
    print("misses:" if misses else "no misses")
    for m in misses:
        print(" ", m)
    if apart:
        print(f"not in the data (the true form itself is expected to gain less than {IN_THE_DATA:g} in ln p):")
        for m in apart:
            print(" ", m)
    if arguments.strict and (not names or right != total):
        raise SystemExit(1)


if __name__ == "__main__":
    main()
