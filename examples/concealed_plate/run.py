"""Does it help recognition to draw materials from the posterior of their fits? Everything, from calibration to table.

python run.py --out DIR --matdb PATH [--small]. What a folder has already is not made again.
"""

import argparse
import concurrent.futures
import contextlib
import json
import multiprocessing
import shutil
import subprocess
import sys
from pathlib import Path

import matplotlib
import numpy as np
import pyarrow
import pyarrow.parquet

import images
import network
import score
import stranger

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402

HERE = Path(__file__).resolve().parent
ARMS = {"fixed": None, "posterior": 1.0, "wide": 5.0}       # and what multiplies the standard deviations
CEILING = "ceiling"                                         # the arm that learns from the other generator itself
MATERIALS = {"skin": "skin", "ball": "plate"}                # what was scanned, and what its material is called
INPUTS = {"power": [0], "power and range": [0, 1]}
OTHERS = {"plain": "the other generator", "effects": "the same with effects"}
TESTS = {"own": "its own, held out", **OTHERS}
SCORES = {"auc": "AUC", "precision": "average precision", "overlap": "IoU", "found": "found", "alarms": "false alarms"}
FULL = {"scans": 1250, "epochs": 10, "plain": 400, "effects": 800, "arms": [*ARMS, CEILING],
        "trainings": {"power and range": 5, "power": 3}}
SMALL = {"scans": 200, "epochs": 25, "plain": 60, "effects": 60, "arms": ["fixed", "posterior"],
         "trainings": {"power and range": 1}}


def matdb(options, *words):
    """Runs matdb in the folder of the experiment and returns what it prints."""
    command = [str(options.matdb), "--db", "materials.sqlite", *words]
    print(" ".join(command[3:]), flush=True)
    done = subprocess.run(command, cwd=options.out, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(command)}\n{done.stderr}")
    return done.stdout


def fill(template, **values):
    """A template of this folder with its values."""
    text = (HERE / template).read_text()
    for key, value in values.items():
        text = text.replace("{" + key + "}", str(value))
    return text


def materials(options):
    """Scans of bare skin and of a ball become materials of a database, as a user would make them."""
    if (options.out / "fits.json").exists():
        return
    for stale in options.out.glob("materials.sqlite*"):
        stale.unlink()
    stranger.calibration(options.out, options.seed)
    fits = {}
    for target, name in MATERIALS.items():
        (options.out / f"{target}.toml").write_text(fill("measure.toml", mesh=target))
        matdb(options, "measure", f"{target}.csv", "--scene", f"{target}.toml", "-o", f"measured-{target}")
        matdb(options, "add", "--from", f"measured-{target}/curve.csv", "--name", f"stranger-{name}",
              "--class", "other", "--kind", "synthetic", "--source", "examples/concealed_plate", "--licence", "CC0-1.0",
              "--instrument", "the other generator", "--frequency", "300", "--threshold", str(stranger.THRESHOLD_DBM))
        fits[name] = json.loads(matdb(options, "--json", "fit", f"stranger-{name}", "--noise-dbm",
                                      str(stranger.NOISE_DBM), "--save"))
    (options.out / "fits.json").write_text(json.dumps(fits))


def data_sets(options, size):
    """Two data sets for each arm: with and without a plate."""
    (options.out / "empty.toml").write_text(fill("torso.toml"))
    (options.out / "plate.toml").write_text(fill("torso.toml") + fill("plate.toml"))
    for arm in [arm for arm in size["arms"] if arm != CEILING]:
        for number, kind in enumerate(("plate", "empty")):
            name, plate = f"{arm}-{kind}", kind == "plate"
            spec = fill("spec.toml", name=name, scene=kind, scans=size["scans"], seed=options.seed + number,
                        objects='["plate"]' if plate else "[]") + (fill("spec-plate.toml") if plate else "")
            if ARMS[arm]:
                for material in ("skin", "plate") if plate else ("skin",):
                    spec += fill("posterior.toml", material=material, inflate=ARMS[arm])
            (options.out / f"{name}.toml").write_text(spec)
            matdb(options, "dataset", "run", f"{name}.toml", "-o", name)


@contextlib.contextmanager
def whole(path):
    """A name to write to. What was written gets its own name once it is whole."""
    part = path.with_name(f"part-{path.name}")
    yield part
    part.replace(path)


def others(options, size):
    """Scans of the other generator."""
    count = {"plain": size["plain"], "effects": size["effects"], CEILING: 2 * size["scans"] * (CEILING in size["arms"])}
    for number, (name, scans) in enumerate(count.items()):
        path = options.out / f"{name}.parquet"
        if scans and not path.exists():
            table = stranger.scans(options.seed + 100 + number, scans, name == "effects")
            with whole(path) as part:
                pyarrow.parquet.write_table(pyarrow.table(table), part)


def own_pictures(options, size, arm, split):
    """Pictures and masks of an arm's scans to train on or to test with: four fifths and one fifth."""
    if arm == CEILING:
        first = 2 * size["scans"] * 4 // 5
        part = slice(first) if split == "train" else slice(first, None)
        return [values[part] for values in images.from_file(options.out / f"{arm}.parquet")]
    both = [images.from_data_set(options.out / f"{arm}-{kind}", split) for kind in ("plate", "empty")]
    return [np.concatenate(parts) for parts in zip(*both)]


def pictures(options, size):
    """The pictures of every training set and of every test, in one file each."""
    wanted = {f"{arm}-{split}": (arm, split) for arm in size["arms"] for split in ("train", "test")}
    for name in (*wanted, *OTHERS):
        path = options.out / f"{name}.npz"
        if not path.exists():
            seen, truth = (own_pictures(options, size, *wanted[name]) if name in wanted
                           else images.from_file(options.out / f"{name}.parquet"))
            with whole(path) as part:
                np.savez(part, pictures=seen, masks=truth)


def load(path, inputs):
    """Pictures and masks of a file; channels that are not an input are 0."""
    with np.load(path) as file:
        keep, masks = file["pictures"], file["masks"]
    keep[:, [channel for channel in (0, 1) if channel not in INPUTS[inputs]]] = 0
    return keep, masks


def train(out, inputs, arm, seed, epochs):
    """Trains one network and keeps what the scores need of every test: scans of its own materials, and the others."""
    path = out / "trained" / f"{inputs.replace(' ', '-')}-{arm}-{seed}.npz"
    if not path.exists():
        trained = network.train(*load(out / f"{arm}-train.npz", inputs), seed, epochs)
        kept = {}
        for name in TESTS:
            seen, truth = load(out / (f"{arm}-test.npz" if name == "own" else f"{name}.npz"), inputs)
            masks, scores = network.predict(trained, seen)
            kept.update({f"{name} {key}": value for key, value in score.judge(masks, scores, truth).items()})
            if name == "effects":
                kept["masks"] = masks.astype(np.float16)
        with whole(path) as part:
            np.savez_compressed(part, **kept)
    return path


def trainings(options, size):
    """All networks, in as many processes as --jobs."""
    (options.out / "trained").mkdir(exist_ok=True)
    with concurrent.futures.ProcessPoolExecutor(options.jobs, multiprocessing.get_context("spawn")) as pool:
        jobs = {(inputs, arm, seed): pool.submit(train, options.out, inputs, arm, seed, size["epochs"])
                for inputs, number in size["trainings"].items() for seed in range(number) for arm in size["arms"]}
        for key, job in jobs.items():
            job.result()
            print("trained", *key, flush=True)


def read(options, inputs, arm, seed, name):
    """What is kept of one network on one test."""
    with np.load(options.out / "trained" / f"{inputs.replace(' ', '-')}-{arm}-{seed}.npz") as file:
        return {key: file[f"{name} {key}"] for key in ("has", "score", "precision", "overlap")}


def laws(options):
    """Levels of the fitted laws at some angles with their 95 % bands, and the true ones, dB."""
    rows = []
    for name, truth in (("skin", stranger.SKIN), ("plate", stranger.PLATE)):
        told = matdb(options, "--json", "predict", f"stranger-{name}", "--angles", "5:50:15")
        for level in json.loads(told)["levels"]:
            cosine = np.cos(np.radians(level["theta_deg"]))
            sigma0_db = 10 * np.log10(4 * np.pi * stranger.law(truth, cosine) * cosine**2)
            rows.append([name, *(round(float(v), 2) for v in
                                 (level["theta_deg"], sigma0_db, level["sigma0_db"], *level["band_db"]))])
    return rows


def results(options, size):
    """All scores with their intervals, and the fits, as results.json."""
    fits = json.loads((options.out / "fits.json").read_text())
    found = {"size": size, "chance_precision": {}, "fits": {}, "laws": laws(options)}
    for name, fit in fits.items():
        found["fits"][name] = {one["name"]: [float(f"{one[key]:.4g}") for key in ("value", "sd")]
                               for one in fit["estimates"]}
    for name in OTHERS:
        masks = load(options.out / f"{name}.npz", "power")[1]
        found["chance_precision"][name] = round(float(masks[masks.any((1, 2))].mean()), 4)
    found["scores"] = {inputs: {} for inputs in size["trainings"]}
    for inputs, tests_of in found["scores"].items():
        for name in TESTS:
            judged = {arm: [score.decide(*(read(options, inputs, arm, seed, test) for test in (name, "own")))
                            for seed in range(size["trainings"][inputs])] for arm in size["arms"]}
            tests_of[name] = score.summary(judged, "fixed")
        del tests_of["own"]["less fixed"]                   # the arms have scans of their own there
    (options.out / "results.json").write_text(json.dumps(found) + "\n")
    return found


def table(found):
    """Laws and scores as tables of Markdown: of each arm on scans of its own, and on the other generator's."""
    lines = ["| material | angle | true σ⁰, dB | fitted σ⁰, dB |", "|---|--:|--:|--:|"]
    lines += ["| {} | {:.0f}° | {:.1f} | {:.1f} ({:.1f} to {:.1f}) |".format(*row) for row in found["laws"]]
    for inputs, tests_of in found["scores"].items():
        for part, title in (("arms", "trained on"), ("less fixed", "less `fixed`")):
            lines += ["", f"Input: {inputs}", "", f"| test | {title} | {' | '.join(SCORES.values())} |",
                      "|---|---|" + "--:|" * len(SCORES)]
            for test, label in (TESTS if part == "arms" else OTHERS).items():
                for arm, scores in tests_of[test][part].items():
                    cells = ["{:.3f} ({:.3f} to {:.3f})".format(*scores[name]) for name in SCORES]
                    lines.append(f"| {label} | `{arm}` | {' | '.join(cells)} |")
    return "\n".join(lines)


def figure(options):
    """One scan of the other generator with effects: power, relief, truth, and what two networks mark."""
    inputs = "power and range"
    with np.load(options.out / "effects.npz") as file:
        seen, truth = file["pictures"], file["masks"]
    judged = [read(options, inputs, arm, 0, "effects") for arm in ("fixed", "posterior")]
    middle = np.argsort(judged[0]["precision"] + judged[1]["precision"])[len(judged[0]["precision"]) // 2]
    number = np.flatnonzero(judged[0]["has"])[middle]
    edge = (np.arange(images.SIDE + 1) - images.SIDE / 2) * stranger.STEP_M * 100
    panels = [("power, dBm", seen[number, 0] * 10 - 60, dict(vmin=-77, vmax=-42)),
              ("relief, mm", seen[number, 1] * 10, dict(vmin=-15, vmax=15, cmap="coolwarm"))]
    for arm in ("fixed", "posterior"):
        with np.load(options.out / "trained" / f"{inputs.replace(' ', '-')}-{arm}-0.npz") as file:
            marked = file["masks"][number].astype(float)
            panels.append((f"plate, by {arm}", marked, dict(vmin=0, vmax=1, cmap="magma")))
    drawing, axes = pyplot.subplots(1, len(panels), figsize=(13, 3.4), constrained_layout=True)
    for axis, (title, picture, style) in zip(axes, panels):
        drawing.colorbar(axis.pcolormesh(edge, edge, picture, **style), ax=axis)
        centre = (edge[1:] + edge[:-1]) / 2
        axis.contour(centre, centre, truth[number], levels=[0.5], colors="lime", linewidths=1.2)
        axis.set(title=title, xlabel="x, cm", aspect="equal")
    axes[0].set_ylabel("y, cm")
    drawing.savefig(options.out / "recognition.png", dpi=80)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder of everything that is made")
    parser.add_argument("--matdb", default="matdb", help="the program")
    parser.add_argument("--seed", type=int, default=1, help="of calibration, data sets and tests")
    parser.add_argument("--jobs", type=int, default=2, help="networks that are trained at once")
    parser.add_argument("--small", action="store_true", help="two minutes; fails if something is broken")
    options = parser.parse_args()
    options.matdb = Path(shutil.which(options.matdb) or sys.exit(f"there is no program {options.matdb}")).resolve()
    options.out.mkdir(parents=True, exist_ok=True)
    size = SMALL if options.small else FULL
    materials(options)
    data_sets(options, size)
    others(options, size)
    pictures(options, size)
    trainings(options, size)
    found = results(options, size)
    print(table(found))
    figure(options)
    for inputs, tests_of in found["scores"].items():
        for arm in size["arms"]:
            auc = tests_of["own"]["arms"][arm]["auc"][0]
            if auc < 0.6:
                sys.exit(f"broken: {arm}, {inputs}: an AUC of {auc:.2f} on scans of its own world")


if __name__ == "__main__":
    main()
