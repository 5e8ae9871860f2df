"""Run `matdb diagnose` over the cases of a folder and compare its answers with the truth. Lists every miss."""

import argparse
import collections
import concurrent.futures
import functools
import json
import math
import os

import diagnoses
import effects
from intervals import intervals


IN_THE_DATA = 5.0  # gain in held-out ln p below which not even the true form can be seen
FOLDS = 5
COST = FOLDS / (2 * (FOLDS - 1))  # in held-out ln p, of a number that is learned from the other folds
PAYS = 2  # times its cost is what a number gains, in the mean over those that are learned
LEFT_DB = {"strong": 1.33, "moderate": 0.665, "weak": 0.33}


@functools.lru_cache
def divergence(true_looks, sd, looks):
    """Kullback-Leibler divergence, nats a chirp, of powers of `true_looks` looks whose ln mean has the sd `sd` from
    the closest powers of `looks` looks: those of the same mean."""

    def log_density(u, k):  # of u = ln power, mean 1
        return k * u - k * math.exp(u) + k * math.log(k) - math.lgamma(k)

    nodes = [(sd * i / 5, math.exp(-((i / 5) ** 2) / 2)) for i in range(-20, 21)] if sd else [(0.0, 1.0)]
    step, whole = 0.02, sum(w for _, w in nodes)
    grid = [-25 + step * i for i in range(1550)]
    p = [sum(w * math.exp(log_density(u - s, true_looks)) for s, w in nodes) / whole for u in grid]
    mean = math.log(sum(p[i] * math.exp(u) for i, u in enumerate(grid)) * step)
    inside = [(u, p[i]) for i, u in enumerate(grid) if p[i] > 1e-300]
    return step * sum(x * (math.log(x) - log_density(u - mean, looks)) for u, x in inside)


def expected_gain(truth):
    """Gain in ln p that the true form of each effect is expected to have over the refitted base, from the truth alone."""
    echoes, looks, share = truth["detections"] - truth["false_alarms"], truth["declared_looks"], truth["independent_share"]
    out = {}
    for label in truth["labels"]:
        if label == "speckle":
            out[label] = share * echoes * divergence(truth["looks"], 0.0, looks)
        elif label == "angle-error":
            # every chirp has a tilt of its own, which neighbours that share a speckle show the better: at least this
            spread = [s * math.log(10) / 10 for s in truth["tilt_spread_db"]]  # nepers of power
            out[label] = echoes * sum(divergence(looks, s, looks) for s in spread) / len(spread)
        elif label == "noise-floor":  # a count that is there
            out[label] = truth["realised_gain"][label]
        else:
            out[label] = share * truth["power_gain"][label]
            if label in ("motion", "pose"):  # which the ranges show as well
                out[label] += truth["range_gain"]
    return out


def held_out(effect, gain):
    """What a form of this gain, with its numbers known, gains in held-out ln p where they are learned from the other folds.

    A form is made simpler until its numbers pay."""
    return gain - min(COST * effects.LEARNED[effect], max(gain, 0) / PAYS)


def held_out_gain(truth):
    """The same of each effect of a case, from its realised gain."""
    return {label: held_out(truth["kind"] if label == "unknown" else label, gain)
            for label, gain in truth["realised_gain"].items()}


def judge(answer, truth):
    """What kind of case it is, whether the answer is right, and the names that were said."""
    said = [e["name"] for e in answer.get("effects", [])]
    labels, verdict = truth["labels"], answer["verdict"]
    if not labels:
        return "complete", verdict == "no-missing-effect", said
    if labels == ["unknown"]:
        kind, good = "unknown", verdict == "unexplained" and not said
    elif len(labels) > 1:
        kind, good = "pair", set(labels) == set(said[:2])
    else:
        kind, good = truth["strength"], said[:1] == labels
        if not truth["reaches_strength"]:
            left = truth["left_after_refit_db"][labels[0]]
            kind = next((k for k in list(LEFT_DB)[list(LEFT_DB).index(kind):] if left >= LEFT_DB[k]), "below weak")
    return "not in the data" if min(held_out_gain(truth).values()) < IN_THE_DATA else kind, good, said


def outcome(case, truth, answer):
    """What became of a case: all that a score counts, as JSON can hold it."""
    kind, good, said = judge(answer, truth)
    return {
        "case": case, "kind": kind, "right": bool(good), "truth": "+".join(truth["labels"]) or "none",
        "names": bool(said), "said": "+".join(said) or answer["verdict"], "seconds": answer.get("seconds"),
        "held": [(name, bool(holds)) for name, *_, holds in intervals(answer, truth)],
        "intervals": [
            f"{case} {truth['base']}: interval of {name}: {value:.4g} +- {sd:.2g}, truth {true:.4g}"
            for name, value, sd, true, holds in intervals(answer, truth) if not holds],
        "words": in_words(case, truth, answer, said) if not good or kind == "not in the data" else "",
    }


class Score:
    """What became of cases, by their kind."""

    def __init__(self):
        self.right, self.total = collections.Counter(), collections.Counter()
        self.held, self.stated = collections.Counter(), collections.Counter()  # intervals, by the name of the number
        self.alarms, self.confusion = collections.Counter(), collections.Counter()
        self.misses, self.apart, self.seconds = [], [], []

    def add(self, one):
        """Counts an outcome."""
        kind, good = one["kind"], one["right"]
        self.total[kind] += 1
        self.right[kind] += good
        for name, holds in one["held"]:
            self.stated[name] += 1
            self.held[name] += holds
        self.misses += one["intervals"]
        self.confusion[one["truth"], one["said"]] += 1
        if kind == "complete" and not good:
            self.alarms["named" if one["names"] else one["said"]] += 1
        if one["seconds"] is not None:
            self.seconds.append(one["seconds"])
        if one["words"]:
            (self.apart if kind == "not in the data" else self.misses).append(one["words"])

    def update(self, other):
        for name in ("right", "total", "held", "stated", "alarms", "confusion"):
            getattr(self, name).update(getattr(other, name))
        self.misses, self.apart, self.seconds = self.misses + other.misses, self.apart + other.apart, self.seconds + other.seconds

    def print(self):
        print("right first name (pairs: both; unknown: unexplained and no name; complete: nothing missing):")
        for kind in self.total:
            if kind != "not in the data":
                print(f"  {kind:16} {self.right[kind]:4} of {self.total[kind]}")
        if self.apart:
            print(f"  not in the data: {len(self.apart)} cases, {self.right['not in the data']} of them right all the same")
        if self.alarms:
            print("  complete scans that were called otherwise:", ", ".join(f"{n} {what}" for what, n in self.alarms.items()))
        print(f"95 % intervals that hold the truth: {self.held.total()} of {self.stated.total()}")
        for name, count in sorted(self.stated.items()):
            print(f"  {name:32} {self.held[name]:4} of {count}")
        if self.seconds:
            seconds = sorted(self.seconds)
            print(f"seconds a case: median {seconds[len(seconds) // 2]:.1f}, worst {seconds[-1]:.1f}")
        print("truth -> said:")
        for (truth, said), count in sorted(self.confusion.items()):
            print(f"  {truth:28} -> {said:32} {count}")
        print("misses:" if self.misses else "no misses")
        for line in self.misses:
            print(" ", line)
        if self.apart:
            print(f"not in the data (on these data the true form itself gains less than {IN_THE_DATA:g} in held-out ln p):")
            for line in self.apart:
                print(" ", line)


def in_words(case, truth, answer, said):
    left = ", ".join(f"{u.get('covariate')} {u.get('strength_db') or 0:.2f} dB" for u in answer.get("unexplained", []))
    words = "" if said or left else f" [{answer.get('reason') or answer['words'][-200:]}]"
    expected, held = expected_gain(truth), held_out_gain(truth)
    gain = ", ".join(f"for {g} expected {expected[g]:.1f}, realised {v:.1f}, held out {held[g]:.1f}"
                     for g, v in truth["realised_gain"].items()) or "none"
    if set(truth["labels"]) & {"finite-spot", "multi-bounce"}:
        gain += f", by ranges {truth['range_gain']:.0f} more"
    return (f"{case} {truth['base']} {'+'.join(truth['labels']) or 'none'} ({truth['strength']}, {truth.get('kind')}, "
            f"{truth['speckle']}, level {truth['level_offset_db']:+.1f} dB; gain {gain}): "
            f"{answer['verdict']}, said {'+'.join(said) or 'nothing'}; left: {left or 'nothing'}{words}")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder")
    parser.add_argument("--matdb", default="matdb")
    parser.add_argument("--key", help="key of the program's sources, where it is no build of this tree")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2, help="diagnoses at once")
    parser.add_argument("--strict", action="store_true", help="exit with 1 unless every case is right")
    arguments = parser.parse_args()
    program, folder = diagnoses.Program(arguments.matdb, arguments.key), arguments.folder
    print(f"judged: {program}")
    truths = os.path.join(folder, "truth")  # a case has one once it is whole
    if not os.path.isdir(truths):
        raise SystemExit(f"{folder} has no cases: generate.py makes some")
    names = sorted(n.removesuffix(".json") for n in os.listdir(truths) if n.endswith(".json"))
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        answers = list(pool.map(lambda n: diagnoses.diagnose(program, os.path.join(folder, n), arguments.seed), names))
    score = Score()
    for name, answer in zip(names, answers):
        with open(os.path.join(truths, f"{name}.json")) as file:
            truth = json.load(file)
        score.add(outcome(name, truth, answer))
    score.print()
    if arguments.strict and (not names or score.right != score.total):
        raise SystemExit(1)


if __name__ == "__main__":
    main()
