"""Fit every curve with matdb, and compare its ln p with the reference's. See README.md."""

import argparse
import hashlib
import json
import os
import resource
import shutil
import subprocess
import time

import reference
from laws import MODELS

MISS = 0.5


def run_matdb(program, path, model, extra):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([program, "fit", path, "--model", model, "--json", *extra], capture_output=True, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    try:
        said = json.loads(done.stdout)
    except ValueError:
        said = None
    return done.returncode, said, done.stderr.strip(), seconds


def hashed(*parts):
    return hashlib.sha256(b"\0".join(parts)).hexdigest()[:12]


def content(path):
    with open(path, "rb") as file:
        return file.read()


class Store:
    """Results in a file, one a line, each under a key; a run that was stopped goes on where it was."""

    def __init__(self, path):
        self.path, self.kept = path, {}
        if os.path.exists(path):
            with open(path) as file:
                self.kept = {r["key"]: r for r in map(json.loads, file)}

    def get(self, key, make):
        if key not in self.kept:
            self.kept[key] = {"key": key, **make()}
            with open(self.path, "a") as file:
                file.write(json.dumps(self.kept[key]) + "\n")
        return self.kept[key]


def truth_of(folder, group, number):
    with open(f"{folder}/truth/{group}-{number}.json") as file:
        return json.load(file)


def refer(folder, group, number):
    """The reference's best fit of a curve: its numbers, and the seconds that it took."""
    truth = truth_of(folder, group, number)
    start = None
    if truth["law"] == truth["fitted"]:
        start = list(truth["shape"].values()), list(truth["levels"].values()), truth["looks"]
    clock = time.process_time()
    curve = reference.read(f"{folder}/{group}/{number}.csv")
    value, shape, levels, looks = reference.best(MODELS[truth["fitted"]], curve, start)
    seconds = time.process_time() - clock
    return {"ln_p": value, "shape": shape, "levels": levels, "looks": looks, "seconds": seconds}


def judge(program, folder, group, number, extra, known):
    """What matdb makes of a curve, against `known`, the reference's fit."""
    truth = truth_of(folder, group, number)
    model = MODELS[truth["fitted"]]
    path = f"{folder}/{group}/{number}.csv"
    status, said, error, seconds = run_matdb(program, path, model.name, extra)
    out = {"group": group, "file": path, "model": model.name, "truth": truth, "seconds": seconds, "status": status}
    curve = reference.read(path)
    out["reference"] = known
    if said is None:
        return {**out, "kind": "refused", "error": error}
    shape, levels = model.read({e["name"]: e["value"] for e in said["estimates"]})
    value = reference.at(model, curve, shape, levels, said["looks"])
    findings = {v["finding"] for v in said["verdict"]}
    out["matdb"] = {"ln_p": value, "shape": shape, "levels": levels, "looks": said["looks"],
                    "stated": said["objective"], "agreeing": said["agreeing_starts"],
                    "iterations": said["iterations"], "says": said["sentences"]}
    out["deficit"] = out["reference"]["ln_p"] - value
    if status or not said["converged"]:
        out["kind"] = "failed"
    elif out["deficit"] <= MISS:
        out["kind"] = "good" if out["deficit"] >= -MISS else "reference short"
    else:
        out["kind"] = "warned miss" if "starts-disagree" in findings else "silent miss"
    out["warned"] = "starts-disagree" in findings
    if out["deficit"] > MISS:
        out["hold"] = hold = model.hold(out["reference"]["shape"])
        held = run_matdb(program, path, model.name, [*extra, *hold])[1] if hold else None
        out["held"] = held and held["objective"]
    return out


def table(results):
    head = ["model", "curves", "silent misses", "warned misses", "said failed", "refused", "warned, yet good",
            "worst deficit", "worst silent", "stated - ours", "reference short", "s per fit, mean", "max"]
    print("| " + " | ".join(head) + " |\n|---|" + "--:|" * (len(head) - 1))
    for group in dict.fromkeys(r["group"] for r in results):
        rows = [r for r in results if r["group"] == group]
        fitted = [r for r in rows if "matdb" in r]

        def count(kind):
            return sum(r["kind"] == kind for r in rows)

        worst = max((r["deficit"] for r in fitted), default=0)
        silent = max((r["deficit"] for r in fitted if r["kind"] in ("good", "silent miss")), default=0)
        apart = max((abs(r["matdb"]["stated"] - r["matdb"]["ln_p"]) for r in fitted), default=0)
        warned = sum(r["kind"] == "good" and r["warned"] for r in fitted)
        clock = [r["seconds"] for r in rows]
        kinds = [count(k) for k in ("silent miss", "warned miss", "failed", "refused")]
        cells = [group, len(rows), *kinds, warned, f"{worst:.2f}", f"{silent:.2f}", f"{apart:.1e}",
                 count("reference short"), f"{sum(clock) / len(clock):.2f}", f"{max(clock):.2f}"]
        print("| " + " | ".join(map(str, cells)) + " |")


def short(fit):
    numbers = ", ".join(f"{v:.5g}" for v in fit["shape"] + fit["levels"] + [fit["looks"]])
    return f"ln p {fit['ln_p']:.3f} at {numbers}"


def misses(results):
    for r in results:
        if r["kind"] in ("good", "failed") and abs(r.get("deficit", 0)) <= MISS:
            continue
        print(f"\n{r['kind']}: {r['file']} --model {r['model']}", end="")
        if r["kind"] == "refused":
            print(f"\n  {r['error']}")
            continue
        names = [s[0] for s in MODELS[r["model"]].shape] + list(MODELS[r["model"]].levels) + ["looks"]
        truth = r["truth"]
        print(f", {r['deficit']:.2f} below, {r['matdb']['agreeing']} starts agree ({', '.join(names)})")
        print(f"  truth, {truth['law']}: {truth['shape']} {truth['levels']} looks {truth['looks']:.4g}")
        print(f"  matdb: {short(r['matdb'])}\n  reference: {short(r['reference'])}")
        if r.get("hold"):
            print(f"  matdb with {' '.join(r['hold'])}: " + (f"{r['held']:.3f}" if r["held"] else "no fit"))
        print("  says: " + ("; ".join(r["matdb"]["says"]) or "nothing"))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder")
    parser.add_argument("--matdb", default="matdb")
    parser.add_argument("--models", nargs="*", help="only these groups")
    parser.add_argument("--count", type=int, default=10**9, help="at most so many curves of each group")
    parser.add_argument("--again", action="store_true", help="forget the stored results")
    parser.add_argument("--minutes", type=float, default=1e9, help="start no curve after this time")
    parser.add_argument("--strict", action="store_true", help="exit with 1 unless every curve is good")
    parser.add_argument("--only-reference", action="store_true", help="search the references alone; runs keep them")
    parser.add_argument("--only-table", action="store_true", help="print what is stored")
    parser.add_argument("--extra", nargs=argparse.REMAINDER, default=[], help="further options of matdb fit")
    a = parser.parse_args()
    # Results of another program, of other options, of another reference or of another curve are never mixed in.
    here = os.path.dirname(os.path.abspath(__file__))
    judges = hashed(content(f"{here}/reference.py"), content(f"{here}/laws.py"))
    references = Store(f"{a.folder}/references-{judges}.jsonl")
    key = ""
    if not a.only_reference:
        key = hashed(content(shutil.which(a.matdb) or a.matdb), *[option.encode() for option in a.extra])
    store = f"{a.folder}/results-{key}-{judges}.jsonl"
    if a.again and os.path.exists(store):
        os.remove(store)
    answers = Store(store)
    results = list(answers.kept.values())
    end = time.time() + 60 * a.minutes
    for group in [] if a.only_table else a.models or [*MODELS, "scan"]:
        for name in sorted(os.listdir(f"{a.folder}/{group}"))[: a.count]:
            number = name[:-4]
            curve = hashed(content(f"{a.folder}/{group}/{name}"), group.encode())
            if time.time() > end or curve in answers.kept:
                continue
            known = references.get(curve, lambda: refer(a.folder, group, number))
            if not a.only_reference:
                make = lambda: judge(a.matdb, a.folder, group, number, a.extra, known)
                results.append(answers.get(curve, make))
    if a.only_reference:
        return
    table(results)
    misses(results)
    if a.strict and (not results or any(r["kind"] != "good" for r in results)):
        raise SystemExit(1)


if __name__ == "__main__":
    main()
