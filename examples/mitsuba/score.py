"""Run `matdb diagnose` over the cases of a folder and compare its answers with the truth. Lists every miss."""

import argparse
import collections
import concurrent.futures
import json
import math
import os
import shutil
import subprocess
import time


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


def judge(answer, truth):
    """What kind of case it is, whether the answer is right, and the names that were said."""
    said = [e["name"] for e in answer.get("effects", [])]
    labels, verdict = truth["labels"], answer["verdict"]
    if not labels:
        return "complete", verdict == "no-missing-effect", said
    if labels == ["unknown"]:
        return "unknown", verdict == "unexplained" and not said, said
    if len(labels) > 1:
        return "pair", set(labels) == set(said[:2]), said
    kind = truth["strength"]
    if not truth["reaches_strength"]:
        left = truth["left_after_refit_db"][labels[0]]
        kind = "moderate" if left >= 0.665 and kind == "strong" else "weak" if left >= 0.33 else "not in the data"
    return kind, said[:1] == labels, said


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder")
    parser.add_argument("--matdb", default="matdb")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2)
    arguments = parser.parse_args()
    names = sorted(n for n in os.listdir(arguments.folder) if n.startswith("case-"))
    truths = {}
    for n in names:
        with open(os.path.join(arguments.folder, "truth", f"{n}.json")) as file:
            truths[n] = json.load(file)
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        answers = dict(zip(names, pool.map(lambda n: diagnose(arguments.matdb, os.path.join(arguments.folder, n), arguments.seed), names)))
    right, total, held, misses, confusion = collections.Counter(), collections.Counter(), [], [], collections.Counter()
    alarms = collections.Counter()
    for n in names:
        truth, answer = truths[n], answers[n]
        kind, good, said = judge(answer, truth)
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
        if not good:
            words = "" if said or left else f" [{answer.get('reason') or answer['words'][-200:]}]"
            misses.append(f"{n} {truth['base']} {'+'.join(truth['labels']) or 'none'} ({truth['strength']}, {truth.get('kind')}, {truth['speckle']}, "
                          f"level {truth['level_offset_db']:+.1f} dB): {answer['verdict']}, said {'+'.join(said) or 'nothing'}; left: {left or 'nothing'}{words}")
    print("right first name (pairs: both; unknown: unexplained and no name; complete: nothing missing):")
    for kind in total:
        print(f"  {kind:16} {right[kind]:4} of {total[kind]}")
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


if __name__ == "__main__":
    main()
