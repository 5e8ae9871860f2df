"""Labelled scans beside Embree and numpy, by `labelled.py`, which sets how many threads numpy has before it is loaded."""

import json
import subprocess
import sys
from pathlib import Path

from programs import TARGET

SCANS, QUICK = 16, 2


def measure(quick):
    script = Path(__file__).with_name("labelled.py")
    command = [sys.executable, script, "--json", "--matdb", TARGET / "matdb", "--scans", str(QUICK if quick else SCANS)]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
