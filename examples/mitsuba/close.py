"""Close the loop over the cases of a folder: `diagnose --add`, `render` of the scene with what was found, `diagnose` of that.

The last diagnosis has nothing to find: the scene says all that made its cloud. A case of which the first diagnosis stores
nothing is counted apart."""

import argparse
import json
import os
import shutil
import subprocess


def close(matdb, folder, case):
    """(effects that were added, verdict on the cloud of the scene with them, words if a command failed)."""
    there = os.path.join(folder, f"closed-{case}")
    shutil.rmtree(there, ignore_errors=True)
    os.makedirs(there)
    for name in ("cloud.ply", "scene.toml"):
        shutil.copy(os.path.join(folder, case, name), there)
    db = os.path.join(there, "matdb.sqlite")
    after, again = (os.path.join(there, name) for name in ("scene-after.toml", "again"))

    def run(*words):
        done = subprocess.run([matdb, "--db", db, "-q", *words], capture_output=True, text=True)
        return done.stderr.strip() or f"status {done.returncode}" if done.returncode else ""

    def verdict(out):
        with open(os.path.join(out, "report.json")) as file:
            return json.load(file)

    first = os.path.join(there, "first")
    words = run("add", "--from", os.path.join(folder, case, "material")) or run(
        "diagnose", os.path.join(there, "cloud.ply"), "--scene", os.path.join(there, "scene.toml"), "--add", "-o", first)
    if words:
        return [], None, words
    added = [effect["name"] for effect in verdict(first).get("effects", [])]
    if not added:
        return [], None, ""
    words = run("render", after, "-o", again)
    if words:
        return added, None, words
    last = os.path.join(there, "last")
    words = run("diagnose", os.path.join(again, "cloud.ply"), "--scene", after, "-o", last)
    if words:
        return added, None, words
    answer = verdict(last)
    more = [effect["name"] for effect in answer["effects"]] + [one["covariate"] for one in answer["unexplained"]]
    return added, answer["verdict"], ", ".join(more)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder")
    parser.add_argument("--matdb", default="matdb")
    parser.add_argument("--cases", nargs="*", help="some of them")
    parser.add_argument("--every", type=int, default=1, help="every so many of them")
    parser.add_argument("--strict", action="store_true", help="exit with 1 unless nothing is missing in any")
    arguments = parser.parse_args()
    cases = arguments.cases or sorted(n for n in os.listdir(arguments.folder) if n.startswith("case-"))
    cases = cases[:: arguments.every]
    closed = stored = 0
    for case in cases:
        with open(os.path.join(arguments.folder, "truth", f"{case}.json")) as file:
            truth = json.load(file)
        added, verdict, words = close(arguments.matdb, arguments.folder, case)
        stored += bool(added)
        closed += verdict == "no-missing-effect"
        print(f"{case} {truth['base']} {'+'.join(truth['labels'])}: added {'+'.join(added) or 'nothing'}, then {verdict} {words}", flush=True)
    print(f"nothing missing in {closed} of {stored} scenes with what was found; {len(cases) - stored} cases found nothing")
    if arguments.strict and closed < len(cases):
        raise SystemExit(1)


if __name__ == "__main__":
    main()
