"""The study of false alarms and the judgement over all effects: make the cases, diagnose them, print one table.

Stop it at any point. The next run goes on with what is missing, as long as the sources of the program, the scripts that
make cases and --seed are the same. With --record it does so on another machine, too."""

import argparse
import concurrent.futures
import multiprocessing
import json
import os
import signal
import time

import diagnoses
import generate
import page
import score
import sets

PARTS = ("alarms", "mitsuba")


class Record:
    """What became of every case that is done, in a file: first what was judged, then a line for each case. Without a file
    it is what the folder has."""

    KEYS = ("program", "cases", "seed")  # the same in one study

    def __init__(self, path, about):
        self.path, self.about, self.outcomes = path, about, {}
        if path and os.path.exists(path):
            with open(path) as file:
                first, *rest = map(json.loads, file)
            if any(first[key] != about[key] for key in self.KEYS):
                raise SystemExit(f"{path} is of another study: {first}; this is {about}")
            self.about, self.outcomes = first, {one["case"]: one for one in rest}

    def write(self):
        if self.path:
            lines = [self.about, *(self.outcomes[case] for case in sorted(self.outcomes))]
            diagnoses.write_whole(self.path, "".join(json.dumps(line) + "\n" for line in lines).encode())


def case_name(index, number):
    return f"{sets.SETS[index][1]} case-{number:03d}"


def run(folder, index, n, number, seed, program, deadline):
    """Makes and diagnoses one case, unless the time is over."""
    out = os.path.join(folder, sets.SETS[index][1])
    if STOP.is_set() or time.time() > deadline:
        return
    if not generate.made(out, number, seed):
        generate.make(out, sets.SETS[index][3](n, number, seed))
    answer = diagnoses.diagnose(program, os.path.join(out, f"case-{number:03d}"), 0)
    said = "+".join(e["name"] for e in answer.get("effects", [])) or "nothing"
    print(f"{case_name(index, number)}: {answer['verdict']}, said {said}", flush=True)


def begin_worker(stop):
    """Workers finish their case when the study is interrupted, and begin no other once `stop` is set."""
    global STOP
    STOP = stop
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def scored(folder, index, seed, program, record):
    """Score of the cases of a set that are done, and their number."""
    out, result, done = os.path.join(folder, sets.SETS[index][1]), score.Score(), 0
    for _, number in sets.cases(index, 10**6):
        name = case_name(index, number)
        if name not in record.outcomes:
            truth, case = generate.made(out, number, seed), os.path.join(out, f"case-{number:03d}")
            answer = diagnoses.kept(program.key, case, 0) if truth else None
            if not answer:
                continue
            record.outcomes[name] = score.outcome(name, truth, answer)
        done += 1
        result.add(record.outcomes[name])
    return result, done


def targets(scores, done):
    """What each target asks, how many came out so, of how many, the target, and whether it is met. `scores` and `done`
    are by the name of the set."""
    size, rows = {name: count for _, name, count, _ in sets.SETS}, []

    def merged(names):
        result = score.Score()
        for name in names:
            result.update(scores[name])
        return result

    def row(what, names, count, total, target, met):
        complete = all(done[n] == size[n] for n in names)
        rows.append((what, count, total, target, ("met" if met else "MISSED") if complete else "not all done"))

    def rate(what, names, kind, least):
        s = merged(names)
        row(what, names, s.right[kind], s.total[kind], f">= {least} %", 100 * s.right[kind] >= least * s.total[kind])

    def at_most(what, names, most):
        s = merged(names)
        wrong = s.total["complete"] - s.right["complete"]
        row(what, names, wrong, s.total["complete"], f"<= {most}", wrong <= most)

    strengths = ["strong", "moderate", "weak"]
    judged = [name for part, name, _, _ in sets.SETS if part == "mitsuba"]
    complete = [n for n in judged if n.startswith("complete")]
    for kind, least in zip(strengths, (95, 90, 85)):
        rate(f"right name first, {kind}", strengths, kind, least)
    rate("both of a pair", ["pairs"], "pair", 85)
    rate("unknown called unexplained", ["unknown"], "unknown", 95)
    s = merged(complete)
    wrong = s.total["complete"] - s.right["complete"]
    row("false alarms on complete scans", complete, wrong, s.total["complete"], "<= 3 %", 100 * wrong <= 3 * s.total["complete"])
    s = merged(judged)
    for what, of_laws in (("95 % intervals of effects that hold", False), ("95 % intervals of laws and level that hold", True)):
        names = [n for n in s.stated if n.startswith("law.") == of_laws]
        held, stated = (sum(c[n] for n in names) for c in (s.held, s.stated))
        row(what, judged, held, stated, ">= 90 %", 10 * held >= 9 * stated)
    short = [name for part, name, _, _ in sets.SETS if part == "alarms" and name != "alarms-long"]
    for name in short:
        at_most(f"false alarms, {name.removeprefix('alarms-')}", [name], 5)
    at_most("false alarms, all of these", short, 12)
    at_most("false alarms, 18 529 chirps", ["alarms-long"], 1)
    s = merged(strengths + ["pairs"])
    for kind in ("below weak", "not in the data"):
        rows.append((f"{kind}, right", s.right[kind], s.total[kind], "none", ""))
    return rows


def main():
    names = [name for _, name, _, _ in sets.SETS]
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("part", choices=[*PARTS, "table"], help="which study to go on with; `table`: only what is done")
    parser.add_argument("sets", nargs="*", metavar="SET", help=f"only these sets of it: {', '.join(names)}")
    parser.add_argument("--out", required=True)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--matdb", default="matdb")
    parser.add_argument("--key", help="key of the program's sources, where it is no build of this tree")
    parser.add_argument("--jobs", type=int, default=2, help="cases at once")
    parser.add_argument("--count", type=int, default=10**6, help="only the first cases of each set")
    parser.add_argument("--minutes", type=float, default=1e6, help="begin no case after this time")
    parser.add_argument("--record", help="file of what became of each case: it is read first, and written at the end")
    parser.add_argument("--page", help="write what is done as a page of the book, too")
    parser.add_argument("--strict", action="store_true", help="exit with 1 unless every case that is done is right")
    arguments = parser.parse_args()
    ours = [name for part, name, _, _ in sets.SETS if part == arguments.part]
    for name in arguments.sets:
        if name not in ours:
            parser.error(f"{name} is not a set of {arguments.part}; choose from {', '.join(ours)}")
    program, deadline = diagnoses.Program(arguments.matdb, arguments.key), time.time() + 60 * arguments.minutes
    by = {"program": program.key, "commit": program.commit, "cases": generate.generator(), "seed": arguments.seed}
    record, stop = Record(arguments.record, by), multiprocessing.Event()
    with concurrent.futures.ProcessPoolExecutor(arguments.jobs, initializer=begin_worker, initargs=(stop,)) as pool:
        running = [
            pool.submit(run, arguments.out, names.index(name), n, number, arguments.seed, program, deadline)
            for name in arguments.sets or ours for n, number in sets.cases(names.index(name), arguments.count)
            if case_name(names.index(name), number) not in record.outcomes]
        try:
            for future in running:
                future.result()
        except KeyboardInterrupt:
            print("stopped: waiting for the cases that run; the same command goes on with the others", flush=True)
            stop.set()
    found = [scored(arguments.out, index, arguments.seed, program, record) for index in range(len(names))]
    record.write()
    scores, done = ({name: f[i] for name, f in zip(names, found)} for i in (0, 1))
    everything = score.Score()
    for s in scores.values():
        everything.update(s)
    everything.print()
    print(f"judged: {program}; cases by {generate.generator()}, seed {arguments.seed}")
    print("done: " + ", ".join(f"{name} {done[name]} of {count}" for _, name, count, _ in sets.SETS))
    rows = targets(scores, done)
    for what, count, total, target, met in rows:
        print(f"  {what:44} {count:4} of {total:<5} {page.percent(count, total):>8}   {target:12} {met}")
    if arguments.page:
        with open(arguments.page, "w") as file:
            file.write(page.page(rows, scores, done, f"{program}; cases by {generate.generator()}, seed {arguments.seed}"))
    if arguments.strict and (not everything.total or everything.right != everything.total):
        raise SystemExit(1)


if __name__ == "__main__":
    main()
