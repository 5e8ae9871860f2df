"""Run matdb over the curves of generate.py, and compare its answers with the truth. See README.md."""

import argparse
import collections
import concurrent.futures
import hashlib
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

from generate import DUE, EFFECTS, NOISES, RANGES, SURFACES

SAME = [{"diffuse-lobe", "limb-darkening"}, {"second-lobe", "instrument-lobe"}]  # alike in backscatter
SHAPES = set().union(*SAME)  # another law has these, too
ALL, CELL, SILENT = 0.01, 0.03, 0.10  # largest shares: names in part A, names in a cell of it, no name in part B
LEAST = 34  # curves from which on a single name keeps a cell within its share
LIMIT_S = 120


def command(matdb, truth, path, folder):
    model = ["--model", truth["declared"]] if truth["declared"] else []
    if truth.get("command") == "fit":
        return [matdb, "fit", path, *model, "--json"]
    noise = ["--noise-db", str(truth["noise_db"])] if truth["noise_db"] else []
    return [matdb, "diagnose", "--curve", path, *noise, *model, "--json", "-o", folder]


def ask(matdb, truth, path):
    """The verdict of a curve, and every effect with those that predict as well. `error` is no answer."""
    start = time.time()
    with tempfile.TemporaryDirectory() as folder:
        try:
            done = subprocess.run(command(matdb, truth, path, folder), capture_output=True, text=True, timeout=LIMIT_S)
            said, error = json.loads(done.stdout), done.stderr.strip()
        except subprocess.TimeoutExpired:
            said, error = {}, f"no answer within {LIMIT_S} s"
        except ValueError:
            said, error = {}, done.stderr.strip() or f"status {done.returncode}"
    out = {"seconds": time.time() - start}
    if "verdict" not in said:
        return {**out, "verdict": "error", "effects": [], "error": error}
    if truth.get("command") == "fit":  # a gauge is a convention, and no doubt
        doubts = [v["finding"] for v in said["verdict"] if v["finding"] != "gauge"]
        return {**out, "verdict": "doubts" if doubts or done.returncode else "tells-every-number", "effects": []}
    return {**out, "verdict": said["verdict"], "effects": [[e["name"], *e.get("class", [])] for e in said["effects"]]}


def ask_until(deadline, matdb, truth, path):
    """The answer, or None where the time is over."""
    return ask(matdb, truth, path) if time.time() < deadline else None


def hashed(*parts):
    return hashlib.sha256(b"\0".join(parts)).hexdigest()[:16]


def content(path):
    with open(path, "rb") as file:
        return file.read()


def recorded(path, about):
    """Answers of an earlier run by the names of the curves, from a line each: name, verdict, effects with those of their
    class behind a +. The first line says of which program and seed they are."""
    if not path or not os.path.exists(path):
        return {}
    with open(path) as file:
        first, *lines = file
    if first != f"# {about}\n":
        raise SystemExit(f"{path} is of another trial: {first.strip()}; this is # {about}")
    lines = [line.split() for line in lines]
    return {name: {"verdict": verdict, "effects": [e.split("+") for e in effects], "seconds": 0.0, "error": "recorded"}
            for name, verdict, *effects in lines}


def record(path, about, answered):
    lines = [" ".join([name, a["verdict"], *("+".join(e) for e in a["effects"])]) for name, a in sorted(answered.items())]
    with open(path, "w") as file:
        file.write(f"# {about}\n" + "".join(line + "\n" for line in lines))


def answers(matdb, folder, truths, jobs, earlier, deadline):
    """(truth, answer) of every curve. Answers are stored under program and curve; a stopped run goes on where it was."""
    program = hashed(content(shutil.which(matdb) or matdb))
    store, known = f"{folder}/answers-{program}.jsonl", {}
    if os.path.exists(store):
        with open(store) as file:
            known = {a["key"]: a for a in map(json.loads, file)}
    paths = [f"{folder}/{t['id']}.csv" for t in truths]
    keys = [hashed(content(p), " ".join(command("", t, "", "")).encode()) for t, p in zip(truths, paths)]
    for t, k in zip(truths, keys):
        if t["id"] in earlier:
            known.setdefault(k, {"key": k, **earlier[t["id"]]})
    pool = concurrent.futures.ThreadPoolExecutor(jobs)
    try:
        asked = {pool.submit(ask_until, deadline, matdb, t, p): k for t, p, k in zip(truths, paths, keys) if k not in known}
        with open(store, "a") as file:
            for future in concurrent.futures.as_completed(asked):
                if future.result() is None:
                    continue
                known[asked[future]] = {"key": asked[future], **future.result()}
                file.write(json.dumps(known[asked[future]]) + "\n")
                file.flush()
    finally:
        pool.shutdown(cancel_futures=True)
    return [(t, known[k]) for t, k in zip(truths, keys) if k in known]


def table(head, rows):
    print("\n| " + " | ".join(head) + " |\n|---|" + "--:|" * (len(head) - 1))
    for row in rows:
        print("| " + " | ".join(map(str, row)) + " |")


def share(some, of):
    return f"{some} of {of}"


def complete(pairs):
    """Part A: whether any effect is named, by cell and by what was declared."""
    cells = collections.defaultdict(lambda: [0, 0])
    declared, names = collections.defaultdict(collections.Counter), collections.Counter()
    for t, a in pairs:
        cell = cells[t["law"], t["noise_db"], t["to_deg"]]
        cell[0] += bool(a["effects"])
        cell[1] += 1
        declared[t["declared_is"]][f"{a['verdict']}, named" if a["effects"] else a["verdict"]] += 1
        names.update(e[0] for e in a["effects"])
    columns = [(n, r) for n in NOISES for r in RANGES]
    print("\n## A. Nothing is missing: curves with a name")
    table(["law", *(f"{n} dB, {r}°" for n, r in columns)],
          [[law, *(share(*cells[law, *c]) if cells[law, *c][1] else "" for c in columns)] for law in SURFACES])
    kinds = sorted(set().union(*declared.values()))
    table(["declared law", *kinds], [[d, *(declared[d][k] for k in kinds)] for d in declared])
    print("\nNames: " + (", ".join(f"{n} {c}" for n, c in names.most_common()) or "none"))
    named = sum(n for n, _ in cells.values())
    judged = {c: n for c, n in cells.items() if n[1] >= LEAST}
    over = [c for c, (n, of) in judged.items() if n > CELL * of]
    print(f"Named: {share(named, len(pairs))}, {named / len(pairs):.1%}, at most {ALL:.0%}. "
          f"Cells above {CELL:.0%}: {share(len(over), len(judged))} with {LEAST} curves or more.")
    return named <= ALL * len(pairs) and not over


def right(effect, named):
    same = next((s for s in SAME if effect in s), {effect})
    return any(same & set(e) for e in named)


def is_a_shape(truth, answer):
    """Whether another law, of which the shape is a part, stands for the name of a shape."""
    return answer["verdict"] == "another-law" and truth["effect"] in SHAPES and not answer["effects"]


def missing(pairs):
    """Part B: what is said where one effect is missing, and its name is due: no other law is the same curve in the noise."""
    all_of_them, counts = pairs, collections.defaultdict(collections.Counter)
    pairs = [(t, a) for t, a in pairs if t["others_leave"] > DUE]
    for t, a in pairs:
        row = counts[t["effect"]]
        row["curves"] += 1
        if is_a_shape(t, a):
            row["right"] += 1
            row["as another law"] += 1
        elif not a["effects"]:
            row[a["verdict"]] += 1
        elif right(t["effect"], a["effects"]):
            row["right"] += 1
            row["right and more"] += len(a["effects"]) > 1
        else:
            row[a["effects"][0][0]] += 1
    fixed = ["curves", "right", "right and more", "as another law", "unexplained", "no-missing-effect"]
    others = sorted(set().union(*counts.values()) - set(fixed))
    print("\n## B. One effect is missing: right or equivalent names, no name, and, last, the first of other names")
    table(["missing", *fixed, *others], [[e, *(counts[e][k] for k in [*fixed, *others])] for e in EFFECTS if e in counts])
    silent = sum(not a["effects"] and not is_a_shape(t, a) for t, a in pairs)
    wrong = sum(bool(a["effects"]) and not right(t["effect"], a["effects"]) for t, a in pairs)
    print(f"\nNo name: {share(silent, len(pairs))}, {silent / len(pairs):.1%}, at most {SILENT:.0%}. "
          f"Another name: {share(wrong, len(pairs))}.")
    apart = [(t, a) for t, a in all_of_them if t["others_leave"] <= DUE]
    verdicts = collections.Counter("named" if a["effects"] else a["verdict"] for _, a in apart)
    if apart:
        print(f"Another law is the same curve in the noise, so that no name is due: {len(apart)}; "
              + ", ".join(f"{name} {count}" for name, count in verdicts.most_common()))
    return silent <= SILENT * len(pairs)


def stand_ins(pairs):
    """Part C: no name, and a verdict among those that are right."""
    rows, misses = collections.defaultdict(collections.Counter), []
    for t, a in pairs:
        names = [e[0] for e in a["effects"]]
        wrong = bool(names) or a["verdict"] not in t["verdicts"]
        film = {"thin film": int("thin-film" in names)}
        rows[t["kind"]].update(curves=1, misses=int(wrong), named=int(bool(names)), **film)
        rows[t["kind"]][a["verdict"]] += 1
        if wrong:
            misses.append(f"- {t['id']}: {a['verdict']} {' '.join(names)} {a.get('error', '')}".rstrip())
    fixed = ["curves", "misses", "named", "thin film"]
    verdicts = sorted(set().union(*rows.values()) - set(fixed))
    print("\n## C. Stand-ins for measured data")
    table(["data", *fixed, *verdicts], [[kind, *(row[k] for k in [*fixed, *verdicts])] for kind, row in rows.items()])
    print("\nMisses: " + str(len(misses)), *misses, sep="\n")
    return not misses


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder")
    parser.add_argument("--matdb", default="matdb")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--parts", default="ABC")
    parser.add_argument("--due", action="store_true", help="of part B, ask only where a name is due")
    parser.add_argument("--count", type=int, default=10**9, help="the first curves of parts A and B, and of each kind of C")
    parser.add_argument("--record", help="a file of answers by this program: read first, and written at the end")
    parser.add_argument("--about", default="", help="first line of the record: the program's commit and the seed")
    parser.add_argument("--minutes", type=float, default=1e6, help="ask nothing after this time")
    parser.add_argument("--strict", action="store_true", help="exit with 1 unless every target is met")
    a = parser.parse_args()
    with open(f"{a.folder}/truth.jsonl") as file:
        truths = [t for t in map(json.loads, file) if t["id"][0] in a.parts]
    truths = [t for t in truths if int(t["id"][2:].split("-")[-1]) < a.count]
    if a.due:
        truths = [t for t in truths if t["id"][0] != "B" or not t["reached"] or t["others_leave"] > DUE]
    # Curves without a name that is due come last.
    truths.sort(key=lambda t: (t["id"][0] != "A", t.get("others_leave", DUE + 1) <= DUE))
    asked = [t for t in truths if t.get("reached", True)]
    earlier = recorded(a.record, a.about)
    pairs = answers(a.matdb, a.folder, asked, a.jobs, earlier, time.time() + 60 * a.minutes)
    if a.record:
        record(a.record, a.about, {**earlier, **{t["id"]: b for t, b in pairs}})
    if len(pairs) < len(asked):
        print(f"Not all done: {share(len(pairs), len(asked))}.")
    met = bool(a.parts)
    for part, judge in zip("ABC", (complete, missing, stand_ins)):
        if part in a.parts:
            mine = [(t, b) for t, b in pairs if t["id"][0] == part]
            met &= bool(mine) and judge(mine)
    small = sum(not t.get("reached", True) for t in truths)
    errors = [f"- {t['id']}: {b['error']}" for t, b in pairs if b["verdict"] == "error"]
    print(f"\nLeft out, as the effect cannot get that large: {small}. No answer: {len(errors)}.", *errors, sep="\n")
    seconds = [b["seconds"] for _, b in pairs]
    print(f"Seconds a curve: median {statistics.median(seconds or [0]):.2f}, longest {max(seconds, default=0):.1f}.")
    if a.strict and (errors or not met or len(pairs) < len(asked)):
        sys.exit(1)


if __name__ == "__main__":
    main()
