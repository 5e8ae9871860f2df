"""Checks the evaluation on sheets whose constants are known: how often the intervals hold. And whether the built-in material
is what its traces say.

    python check.py [--sheets 40]
"""

import argparse
import os
import tomllib

import numpy as np

import evaluate
import sheet

C = sheet.C


def truth(rng, f):
    """Index of a polymer with a broad band of absorption, n - j k, at each frequency."""
    eps = rng.uniform(2.0, 3.0)
    strength, centre, width = rng.uniform(0.02, 0.15), rng.uniform(1.5e12, 3e12), rng.uniform(1e12, 2e12)
    rise = rng.uniform(0.0, 0.02) * (f / 1e12)
    band = strength * centre**2 / (centre**2 - f**2 + 1j * width * f)
    return np.sqrt(eps + band - 1j * rise)


def passed_by(n, f, d):
    """What a sheet passes over what the same air does, by the characteristic matrix of a layer (Born & Wolf, Principles of
    Optics, 7th ed., sec. 1.6.2), and not by the sum of echoes that the evaluation solves."""
    turn = 2 * np.pi * f * d / C
    cos, sin = np.cos(n * turn), 1j * np.sin(n * turn)
    return 2 / (2 * cos + sin * (n + 1 / n)) * np.exp(1j * turn)


def runs(rng, n_of, thickness, count=2, noise=0.003):
    """Traces of a sheet and of the empty path, in the form of a dotTHz file."""
    time = np.arange(-17.16e-12, 82.8e-12, 0.02e-12)
    f = np.fft.rfftfreq(len(time), 0.02e-12)
    made = []
    for _ in range(count):
        pulse = (1 - (time / 0.25e-12) ** 2) * np.exp(-0.5 * (time / 0.25e-12) ** 2) * 17
        # Tails of water vapour and of the emitter, which both paths have.
        pulse = pulse + 0.2 * np.exp(-np.clip(time, 0, None) / 3e-12) * np.sin(2 * np.pi * 0.9e12 * time) * (time > 0)
        with np.errstate(divide="ignore", invalid="ignore"):
            above = np.where(f == 0, 1e9, f)
            passed = np.nan_to_num(passed_by(n_of(above), above, thickness))
        through = np.fft.irfft(np.fft.rfft(pulse) * passed, len(time))
        both = [signal + noise * rng.normal(size=len(time)) for signal in (through, pulse)]
        # A drift of the laser between the two traces.
        both[0] = both[0] * (1 + 0.002 * rng.normal())
        made.append([np.column_stack([time, signal]) for signal in both])
    return made


def check_built_in(folder):
    """The constants of the built-in material are those of the traces beside it."""
    traces, thicknesses = evaluate.read(os.path.join(folder, "PVDF_520um.thz"))
    found = sheet.evaluate(traces, float(np.mean(thicknesses)))
    with open(os.path.join(folder, "material.toml"), "rb") as file:
        stated = [row for row in tomllib.load(file)["permittivity"] if row["key"] == "pvdf"]
    for row in stated:
        at = found.at(1e9 * row["frequency_ghz"])
        for name, key in (("real", "real"), ("imaginary", "imag"), ("real_sd", "real_sd"), ("imaginary_sd", "imag_sd")):
            assert abs(row[name] - at[key]) < 1e-4, f"pvdf at {row['frequency_ghz']} GHz: {name} is {at[key]:.4f}, not {row[name]}"
    print(f"pvdf: {len(stated)} frequencies are as its traces say")


def refused(work, says):
    try:
        work()
    except SystemExit as error:
        assert says in str(error), f"{error}"
        return
    raise AssertionError(f"not refused: {says}")


def check_refusals():
    """What states a wrong thickness, or none, or is no trace, gets no constants."""
    rng = np.random.default_rng(1)
    made = runs(rng, lambda f: 1.6 - 0.01j + 0 * f, 0.6e-3)
    refused(lambda: sheet.evaluate(made, 1.2e-3), "no thickness within 15 % of 1.2 mm")
    for value in (None, "0,6 mm", -0.6, float("nan")):
        refused(lambda value=value: evaluate.metres("md1", value), "md1 is ")
    for table in (np.zeros(400), np.zeros((50, 2)), np.full((400, 2), np.nan)):
        refused(lambda table=table: evaluate.trace("a.thz", "1", table), "a trace is no table of times and signals")
    print("what states no thickness, or a wrong one, is refused")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sheets", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    check_built_in(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../materials/pvdf"))
    check_refusals()
    held = {"n": [0, 0], "k": [0, 0]}
    exact = 0.0
    for number in range(arguments.sheets):
        rng = np.random.default_rng([arguments.seed, number])
        parameters = rng.integers(2**32)

        def n_of(f, parameters=parameters):
            return truth(np.random.default_rng(parameters), f)

        thickness = rng.uniform(0.3e-3, 1.0e-3)
        # Without noise, and with the right thickness, Newton's method is exact.
        f = np.linspace(0.1e12, 1.5e12, 200)
        again = sheet.index(passed_by(n_of(f), f, thickness), f, thickness)
        exact = max(exact, abs(again - n_of(f)).max())
        sd = 0.02 * thickness
        found = sheet.evaluate(runs(rng, n_of, thickness), thickness + sd * rng.normal(), sd)
        for wanted in (0.2e12, 0.3e12, 0.5e12):
            at, right = found.at(wanted), n_of(np.array([wanted]))[0]
            i = int(np.argmin(abs(found.f - wanted)))
            for name, off, own in (("n", at["n"] - right.real, found.n_sd[i]), ("k", -found.n[i].imag + right.imag, found.k_sd[i])):
                held[name][0] += abs(off) < 1.96 * own
                held[name][1] += 1
    print(f"without noise: off by {exact:.1e} at most")
    for name, (inside, all_of_them) in held.items():
        print(f"95 % intervals of {name} that hold: {inside} of {all_of_them} ({100 * inside / all_of_them:.0f} %)")
    assert exact < 1e-6, "the inversion is not exact"
    assert all(inside >= 0.88 * count for inside, count in held.values()), "intervals do not hold what they promise"


if __name__ == "__main__":
    main()
