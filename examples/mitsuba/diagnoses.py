"""Run `matdb diagnose` over cases. A result is kept for as long as nothing has changed that it depends on."""

import hashlib
import json
import os
import re
import shutil
import subprocess
import time
import tomllib

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
# Sources that change no number of a diagnosis: publications, flags and printing, reports of a scan and of a curve,
# and how a page looks. Everything else in src may, adding a material and choosing what is tried included.
APART = ("src/catalogue/", "src/cli/", "src/report/curve/", "src/report/scan/", "src/report/templates/")


def sources(tree=ROOT):
    """Paths below the tree, in order, of all that a diagnosis depends on."""
    found = ["Cargo.lock", "Cargo.toml"]
    for folder, _, names in os.walk(os.path.join(tree, "src")):
        found += [os.path.relpath(os.path.join(folder, n), tree) for n in names]
    return sorted(p for p in found if not p.startswith(APART))


def digest(folder, paths):
    """Twelve hexadecimal digits over names and contents of files."""
    sha = hashlib.sha256()
    for path in paths:
        with open(os.path.join(folder, path), "rb") as file:
            content = file.read()
        sha.update(f"{path}\n{len(content)}\n".encode() + content)
    return sha.hexdigest()[:12]


class Program:
    """A program, the key of its sources, and their commit."""

    def __init__(self, matdb, key=None):
        """Without a key the program is taken for a build of this tree. Exits where cargo's list of its sources denies it."""
        self.path = shutil.which(matdb)
        if self.path is None:
            raise SystemExit(f"there is no program {matdb}: build it with `cargo build --release`, or give its path as --matdb")
        self.key, self.commit = key or digest(ROOT, sources()), "not this tree's"
        if key is None:
            self.commit = git("rev-parse", "--short=10", "HEAD") or "unknown"
            if git("status", "--porcelain", "--", *sources()):
                self.commit += " with changes"
            if not self.is_checked():
                self.commit += ", if the program was built from it"

    def is_checked(self):
        """Whether cargo has listed the sources of the program, which then are this tree's and older than it."""
        try:
            with open(self.path + ".d") as file:
                listed = re.split(r"(?<!\\) ", file.read().split(": ", 1)[1].strip())
        except (FileNotFoundError, IndexError):
            return False
        for path in (os.path.realpath(p.replace("\\ ", " ")) for p in listed):
            if not path.startswith(ROOT + os.sep):
                raise SystemExit(f"{self.path} was built from {path}: judge it from its own tree, or state its sources' key as --key")
            if not os.path.exists(path) or os.path.getmtime(path) > os.path.getmtime(self.path):
                raise SystemExit(f"{path} has changed since {self.path} was built: build the program anew")
        return True

    def __str__(self):
        return f"commit {self.commit}, key {self.key}"


def git(*words):
    run = subprocess.run(["git", "-C", ROOT, *words], capture_output=True, text=True)
    return run.stdout.strip() if run.returncode == 0 else ""


def inputs(folder):
    """Digest of what the program reads of a case."""
    with open(os.path.join(folder, "scene.toml"), "rb") as file:
        scene = tomllib.load(file)
    shared = [scene["radar"]["scan"]["file"]] + [mesh["file"] for mesh in scene["mesh"]]
    return digest(folder, ["cloud.ply", "material/material.toml", "scene.toml", *shared])


def kept(key, folder, seed):
    """The result of a case by a program of this key, or None."""
    out = os.path.join(folder, f"diagnosis-{seed}")
    try:
        with open(os.path.join(out, "result.json")) as file:
            result = json.load(file)
        if (result["key"], result["inputs"]) != (key, inputs(folder)):
            return None
        with open(os.path.join(out, "report.json")) as file:
            return {**json.load(file), **result}
    except (FileNotFoundError, KeyError, json.JSONDecodeError):
        return None


def diagnose(program, folder, seed):
    """report.json of a case, with seconds, exit status and words of the run. A kept result is not computed again."""
    result = kept(program.key, folder, seed)
    if result:
        return result
    db, out = os.path.join(folder, "matdb.sqlite"), os.path.join(folder, f"diagnosis-{seed}")
    shutil.rmtree(out, ignore_errors=True)
    for name in (db, db + "-wal", db + "-shm"):
        if os.path.exists(name):
            os.remove(name)
    start = time.time()
    added = subprocess.run(
        [program.path, "--db", db, "-q", "add", "--from", os.path.join(folder, "material")], capture_output=True, text=True)
    if added.returncode != 0:
        return {"verdict": "crash", "status": added.returncode, "words": added.stderr.strip()}
    run = subprocess.run(
        [program.path, "--db", db, "-q", "diagnose", os.path.join(folder, "cloud.ply"),
         "--scene", os.path.join(folder, "scene.toml"), "--seed", str(seed), "--no-controls", "-o", out],
        capture_output=True, text=True)
    result = {
        "key": program.key, "commit": program.commit, "inputs": inputs(folder),
        "seconds": time.time() - start, "status": run.returncode, "words": run.stderr.strip(),
    }
    try:
        with open(os.path.join(out, "report.json")) as file:
            answer = json.load(file)
    except FileNotFoundError:
        return {"verdict": "crash", **result}
    write_whole(os.path.join(out, "result.json"), json.dumps(result, indent=1).encode())
    return {**answer, **result}


def write_whole(path, content):
    """Writes a file, all of it or nothing; leaves one that has this content alone."""
    if os.path.exists(path):
        with open(path, "rb") as file:
            if file.read() == content:
                return
    draft = f"{path}.{os.getpid()}"
    with open(draft, "wb") as file:
        file.write(content)
    os.replace(draft, path)
