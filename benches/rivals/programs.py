"""Programs that are timed in turns: each is started once, reads its input and waits for its next turn."""

import json
import os
import random
import subprocess
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "release"

# Between two turns: threads of some programs wait for work awake for a while.
REST_S = 0.05
LEAST_TURNS = 3


class Missing(Exception):
    """A program that is not there or does not run; its text says why."""


def cargo(*words):
    """What cargo prints when it succeeds."""
    command = ["cargo", words[0], "--quiet", *words[1:]]
    return subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout


def build(*examples):
    """Builds the program and some examples with optimisation."""
    cargo("build", "--release", "--bin", "matdb", *(word for name in examples for word in ("--example", name)))


def example(name, *arguments):
    """The command that runs an example that has been built."""
    return [str(TARGET / "examples" / name), *map(str, arguments)]


class Program:
    """A program that answers each line on its stdin with a line of JSON."""

    def __init__(self, command, threads):
        cores = sorted(os.sched_getaffinity(0))[:threads]
        self.errors = tempfile.TemporaryFile("w+", errors="replace")
        self.memory_mb = None
        try:
            self.process = subprocess.Popen(
                command, text=True, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                stderr=self.errors, preexec_fn=lambda: os.sched_setaffinity(0, cores),
                env=os.environ | {"RAYON_NUM_THREADS": str(threads), "OMP_WAIT_POLICY": "passive"},
            )
        except OSError as reason:
            raise Missing(f"not installed: {Path(command[0]).name}") from reason

    def line(self):
        line = self.process.stdout.readline()
        if line:
            return line
        self.process.wait()
        self.errors.seek(0)
        last = self.errors.read().strip().splitlines()[-1:]
        raise Missing(last[0] if last else f"ended with {self.process.returncode}")

    def ready(self):
        """Waits until the input is read; what the program tells of itself."""
        words = self.line().split(maxsplit=1)
        self.resting_kib = self.kib("VmRSS")
        return json.loads(words[1]) if len(words) > 1 else {}

    def turn(self):
        try:
            self.process.stdin.write("\n")
            self.process.stdin.flush()
        except BrokenPipeError:
            pass  # line() tells why
        return json.loads(self.line())

    def watched_turn(self):
        """A turn in which the peak of memory is noted: what comes on top of the input."""
        Path(f"/proc/{self.process.pid}/clear_refs").write_text("5")
        answer = self.turn()
        self.memory_mb = max(0, self.kib("VmHWM") - self.resting_kib) * 1024 / 1e6
        return answer

    def kib(self, what):
        for line in Path(f"/proc/{self.process.pid}/status").read_text().splitlines():
            if line.startswith(what + ":"):
                return int(line.split()[1])
        return 0

    def end(self):
        """Lets the program write its answer and end."""
        self.process.stdin.close()
        code = self.process.wait()
        self.process.stdout.close()
        self.errors.close()
        if code:
            raise Missing(f"ended with {code}")


def start(commands, threads):
    """Starts programs by name; those that run, what they say of themselves, and why others do not."""
    running, about, missing = {}, {}, {}
    for name, command in commands.items():
        try:
            if isinstance(command, Missing):
                raise command
            running[name] = Program(command, threads)
        except Missing as reason:
            missing[name] = str(reason)
    for name in list(running):
        try:
            about[name] = running[name].ready()
        except Missing as reason:
            missing[name] = str(reason)
            del running[name]
    return running, about, missing


def alternate(running, missing, turns, seconds, warm_up_s=0):
    """The answers of all turns; a first turn of each program is not counted, and every round has another
    order. After so many seconds no further round begins, if there have been enough. A program that fails
    becomes a missing one. For `warm_up_s` before each turn a program does its work over and over, uncounted."""
    answers = {name: [] for name in running}
    began = time.monotonic()
    for number in range(turns + 1):
        names = list(running)
        random.Random(number).shuffle(names)
        for name in names:
            time.sleep(REST_S)
            try:
                until = time.monotonic() + warm_up_s
                while time.monotonic() < until:
                    running[name].turn()
                take = running[name].watched_turn if number == 1 else running[name].turn
                answer = take()
            except Missing as reason:
                missing[name] = str(reason)
                del running[name], answers[name]
                continue
            if number:
                answers[name].append(answer)
        if number >= min(turns, LEAST_TURNS) and time.monotonic() - began > seconds:
            break
    return answers


def end(running, missing):
    for name in list(running):
        try:
            running[name].end()
        except Missing as reason:
            missing[name] = str(reason)
            del running[name]
