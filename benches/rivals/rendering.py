"""Times the whole program: `matdb render` of the paper's scene, and merely writing the same files."""

import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

from programs import REST_S, ROOT, TARGET
from spread import spread

SCENE = ROOT / "scenes/mannequin.toml"
PROGRAM = str(TARGET / "matdb")
PEAK = (
    "import resource, subprocess, sys; subprocess.run(sys.argv[1:], check=True, stdout=subprocess.DEVNULL); "
    "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)"
)


def measure(folder, quick):
    folder = Path(folder)
    made, written = folder / "rendered", folder / "written"
    written.mkdir()
    command = [PROGRAM, "render", str(SCENE), "-o", str(made)]
    run = lambda command: said(command, folder)
    run(command)
    files = {file.name: file.read_bytes() for file in made.iterdir()}
    times = {"render": [], "start": [], "write": [], "write_unsynced": []}
    for _ in range(3 if quick else 21):
        shutil.rmtree(made)
        note(times["render"], lambda: run(command))
        note(times["start"], lambda: run([PROGRAM, "--version"]))
        note(times["write"], lambda: write(written, files, sync=True))
        note(times["write_unsynced"], lambda: write(written, files, sync=False))
    return {
        "bytes": sum(map(len, files.values())),
        "stages_ms": json.loads(run([*command, "--json"]))["timings_ms"],
        # By a small program in between: a process begins with its parent's peak.
        "memory_mb": round(int(run([sys.executable, "-c", PEAK, *command])) * 1024 / 1e6, 1),
        **{what: spread(values) for what, values in times.items()},
    }


def said(command, folder):
    """What a command prints that must succeed, where there is no database."""
    environment = {name: value for name, value in os.environ.items() if name != "MATDB"}
    return subprocess.run(command, check=True, cwd=folder, env=environment, capture_output=True).stdout


def note(times_ms, call):
    time.sleep(REST_S)
    began = time.perf_counter()
    call()
    times_ms.append(1e3 * (time.perf_counter() - began))


def write(folder, files, sync):
    """As safely as `render` does it: beside the place, to the disk, then into the place."""
    for name, data in files.items():
        with open(folder / f".{name}", "wb") as file:
            file.write(data)
            if sync:
                file.flush()
                os.fdatasync(file.fileno())
        os.replace(folder / f".{name}", folder / name)
