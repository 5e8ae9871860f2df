"""Times fits of matdb, SciPy and odrpack on one synthetic curve; see README.md beside this file."""

import sys
import tempfile
from pathlib import Path

from programs import alternate, build, end, example, start
from spread import spread

HERE = Path(__file__).resolve().parent
OURS = "matdb"
LEAST_SQUARES, DISTANCE, REFITS = "least squares", "orthogonal distance", "1 000 bootstrap refits"
RIVALS = {
    "scipy least_squares": (LEAST_SQUARES, "scipy_fit.py", "least_squares"),
    "scipy curve_fit": (LEAST_SQUARES, "scipy_fit.py", "curve_fit"),
    "odrpack": (DISTANCE, "odrpack_fit.py"),
}
THREADS = 2


def measure(folder, quick):
    """Rows, one for each fit and program; and versions."""
    from fitters import curve

    path = Path(folder) / "curve.csv"
    curve.write(path)
    python = lambda script, *words: [sys.executable, str(HERE / "fitters" / script), *words, str(path)]
    commands = {OURS: example("fit_speed", path)}
    commands |= {name: python(*script) for name, (_, *script) in RIVALS.items()}
    running, about, missing = start(commands, THREADS)
    answers = alternate(running, missing, 3 if quick else 21, 60)
    end(running, missing)
    return [*rows(answers, missing), *refits(path, quick)], versions_of(about)


def versions_of(about):
    return {name.split()[0]: of["version"] for name, of in about.items() if "version" in of}


def refits(path, quick):
    """The row of fits to curves drawn from the curve: only ours, as the goal is a time."""
    running, _, missing = start({OURS: example("fit_speed", path, "refits")}, THREADS)
    answers = alternate(running, missing, 2 if quick else 7, 60)
    end(running, missing)
    row = {"fit": REFITS, "program": OURS}
    if OURS in missing:
        return [row | {"missing": missing[OURS]}]
    converged = {f"{answer['converged']} of {answer['refits']} converged" for answer in answers[OURS]}
    return [row | {"ms": spread([answer["ms"] for answer in answers[OURS]]), "note": ", ".join(sorted(converged))}]


def rows(answers, missing):
    if OURS in missing:
        yield {"fit": "all", "program": OURS, "missing": missing[OURS]}
    ours, mine = answers.get(OURS, []), {}
    for fit in ours[0] if ours else []:
        mine[fit] = ours[0][fit]["values"]
        yield {"fit": fit, "program": OURS, "ms": spread([answer[fit]["ms"] for answer in ours])}
    for name, (fit, *_) in RIVALS.items():
        row = {"fit": fit, "program": name}
        if name in missing:
            yield row | {"missing": missing[name]}
            continue
        values = answers[name][0]["values"]
        row["ms"] = spread([answer["ms"] for answer in answers[name]])
        if fit in mine:
            row["gap"] = max(abs(a / b - 1) for a, b in zip(mine[fit], values))
        yield row


def main():
    build("fit_speed")
    with tempfile.TemporaryDirectory() as folder:
        for row in measure(folder, quick=False)[0]:
            print(row)


if __name__ == "__main__":
    main()
