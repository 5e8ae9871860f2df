"""The other side of programs.py, for programs in Python: a turn for every line on stdin."""

import json
import sys
import time


def serve(about, turn):
    """Says that all is read; then answers every line with what `turn` returns."""
    answers, sys.stdout = sys.stdout, sys.stderr  # libraries talk, too
    print("ready", json.dumps(about), file=answers, flush=True)
    for _ in sys.stdin:
        print(json.dumps(turn()), file=answers, flush=True)


def timed(call):
    """Milliseconds, and what the call returned."""
    began = time.perf_counter()
    answer = call()
    return 1e3 * (time.perf_counter() - began), answer
