"""docs/performance.md from the stored results; needs nothing but Python."""

import math
from pathlib import Path

from goals import LOW, MEDIUM, all_goals, mrays_per_s
from rows import HIERARCHY, PINHOLE, best, median, named, of_workload, ours
from words import bound, grouped, number, share, spread, table, times

LIMITS = Path(__file__).resolve().parent / "limits.md"
GROWTH = ["facets 3", "facets 4", "facets 5", "facets 6", "facets 7", "rays 4", "rays 5", "facets 6", "rays 7"]
BODIES = [
    (
        "paper",
        "The paper's scan",
        """ The elliptical scan, from one origin, of the mannequin at 8 m. Rivals get their rays sorted along a
Z-curve and are not charged for it; `matdb` takes them in the order of the scan, and its own sorting, once for each
scan pattern, is told apart. Right before each turn a program does the same for 40 ms uncounted, so that its threads and
caches are awake. “Agree” is the share of rays that meet the same facet as ours, or one equally far to 10⁻⁶ of
the range, or nothing in both.""",
    ),
    ("body", "The same body under a square of rays", ""),
]
FACTORS = {("facets 6", MEDIUM): 5, ("rays 7", MEDIUM): 1.2}
COLUMNS = [PINHOLE, HIERARCHY, LOW, MEDIUM, "Open3D", "Mitsuba, LLVM"]


def page(results):
    parts = [
        head(results), goals(results), losses(results),
        *bodies(results), reshading(results), growth(results), memory(results), second(results),
        rendering(results), formats(results), registration(results), fits(results), store(results),
        diagnosis(results), gpu(results), LIMITS.read_text(encoding="utf-8").strip() + "\n",
    ]
    return "\n".join(part for part in parts if part)


def head(results):
    machine, versions = results["machine"], results["versions"]
    quick = "**A trial run of few turns and small sizes: its numbers mean nothing.**\n\n" if results["quick"] else ""
    told = ", ".join(f"{name} {version}" for name, version in sorted(versions.items()))
    older = "".join(f"\n- {part}: measured {when}" for part, when in other_runs(results))
    failed = "".join(f"\n- {part} could not be measured: {why}" for part, why in results["failed"].items())
    return f"""# Performance

{quick}How long `matdb` takes beside others, on the same data, in one run. `benches/rivals/performance.py` measured it and wrote
this page; [its README](../benches/rivals/README.md) has the commands. Programs take turns, each a process of its own that
has read its input; after a first turn that does not count, the median of all turns is given and the quartiles in
brackets. Times are ms and belong to one machine. Ratios say more: **× 3 means that the other takes three times as long as
`matdb`**.

- {machine["cpu"]} (family and model {machine["family"]}), {machine["cores"]} cores of {machine["architecture"]} with {", ".join(machine["features"])}; {machine["memory_gb"]} GB; {machine["system"]}
- {machine["date"]}, commit `{machine["commit"]}`, {machine["rustc"]}; {results["minutes"]:.0f} minutes, load before them {machine["load_before"]}
- {told or "no rival"}{older}{failed}
"""


def other_runs(results):
    """The parts that the head's day, commit and load are not those of."""
    machine = results["machine"]
    for part, run in results.get("parts", {}).items():
        if all(machine[key] == run[key] for key in run if key != "minutes"):
            continue
        when = f"on {run['date']} at `{run['commit']}`, {run['minutes']:.0f} minutes, load before them {run['load_before']}"
        yield part, when + f", by {run['cpu']}" * (run["cpu"] != machine["cpu"])


def goals(results):
    rows = [[g.work, g.goal, g.measured, g.verdict()] for g in all_goals(results)]
    return "## Goals\n\n" + table(["work", "goal", "measured", ""], rows)


def losses(results):
    head = ["work", "threads", "program", "ratio", "ratio once built"]
    rows = [row for part in (lost_traces, lost_others) for row in part(results)]
    text = table(head, rows, right=[head[1], *head[3:]]) if rows else "Nowhere in this run.\n"
    return f"""## Where we lose

Every program that was faster than ours, by the fastest of its ways: with its build or, once it is built, in tracing alone, where
`matdb` has nothing to build. Memory has a table of its own.

{text}"""


def workloads(results):
    """The rows of each workload and number of threads, in order."""
    groups = {}
    for row in results.get("trace", []):
        groups.setdefault((row["workload"], row["threads"]), []).append(row)
    return groups


def lost_traces(results):
    for (_, threads), rows in workloads(results).items():
        mine = ours(rows)
        if mine is None:
            continue
        work = f"{grouped(mine['facets'])} facets, {grouped(mine['rays'])} rays" + ", second bounce" * (not mine["coherent"])
        for tracer in dict.fromkeys(row["tracer"] for row in rows if not row["tracer"].startswith("matdb")):
            ways = named(rows, tracer)
            ratio = lambda part: min((median(row[part]) for row in ways), default=math.inf) / median(mine[part])
            if min(ratio("total"), ratio("trace")) < 1:
                yield [work, threads, tracer, times(ratio("total")), times(ratio("trace"))]


def lost_others(results):
    for part, key in [("registration", "threads"), ("fits", "fit"), ("formats", "work")]:
        for row, ratio in beside(results.get(part, []), key):
            if ratio is not None and ratio < 1:
                work = part if key == "threads" else row[key]
                yield [work, row.get("threads", ""), row["program"], times(ratio), ""]


def beside(rows, key):
    """Every row with the ratio of its time to ours in the same group; none where one is missing."""
    mine = {row[key]: median(row["ms"]) for row in rows if row["program"].startswith("matdb") and "ms" in row}
    for row in rows:
        known = "ms" in row and row[key] in mine
        yield row, median(row["ms"]) / mine[row[key]] if known else None


def bodies(results):
    for key, title, words in BODIES:
        groups = [rows for (name, _), rows in workloads(results).items() if name == key]
        if groups:
            first = groups[0][0]
            size = f"{grouped(first['facets'])} facets, {grouped(first['rays'])} rays."
            yield f"## {title}\n\n{size}{words}\n\n" + "\n".join(full(rows) for rows in groups)


def full(rows):
    """All ways of all tracers on one workload."""
    mine = ours(rows)
    cells = []
    for row in rows:
        if "missing" in row:
            cells.append([row["tracer"], "", "", row["missing"], "", "", ""])
            continue
        ratio = median(row["total"]) / median(mine["total"]) if mine else None
        cells.append([
            name_of(row), spread(row["build"]), spread(row["trace"]), spread(row["total"]),
            "" if ratio is None else times(ratio),
            share(row["agree"]), number(row["memory_mb"]),
        ])
    once = [row["once"] for row in rows if "once" in row]
    sorting = f" Sorting, once for each pattern: {spread(once[0])} ms." if once else ""
    if mine and "power" in mine:
        sorting += f" Power, which the goal counts, too: {spread(mine['power'])} ms more."
    head = ["tracer", "build", "trace", "both", "ratio", "agree", "MB beside the input"]
    title = threads_of(rows[0]["threads"]).capitalize()
    return f"{title}.{sorting}\n\n" + table(head, cells, right=head[1:5] + head[6:])


def goal_cell(row, ratio):
    factor = FACTORS.get((row["workload"], row["tracer"]))
    if factor is None or ratio is None or row["threads"] != 2:
        return ""
    return f"≥ {bound(factor)}: {'met' if ratio >= factor else 'missed'}"


def reshading(results):
    found = results.get("reshade", [])
    if not found:
        return ""
    ways = [("traced", "hits alone, anew"), ("same", "nothing changed"), ("law", "another law"), ("effect", "another effect")]
    rows = [[words, *(spread(row[key]) for row in found)] for key, words in ways]
    head = ["", *(f"{threads_of(row['threads'])}, ms" for row in found)]
    return f"""## The same scan again

What is predicted for {grouped(found[0]["looks"])} of {grouped(found[0]["chirps"])} chirps, those on the target, when geometry stays, by
`cargo bench --bench reshade`: hits, angles and footprints are kept.

{table(head, rows, right=head[1:])}"""


def diagnosis(results):
    found = results.get("diagnosis", [])
    if not found:
        return ""
    rows = [
        [row["hidden"], number(row["diagnose_s"]), number(row["render_s"]), times(row["diagnose_s"] / row["render_s"]), row["said"]]
        for row in found
    ]
    head = ["hidden", "diagnosis, s", "render, s", "ratio", "said"]
    return f"""## Diagnosis

`matdb diagnose` from start to files written, once for each, by `cargo bench --bench diagnose`: the scan of the paper's size of
`scenes/bench.toml`, rendered in the same run with what is hidden, on all cores. Nobody else is known to do this.

{table(head, rows, right=head[1:4])}"""


def growth(results):
    text = ""
    for threads in [1, 2]:
        lines = []
        for key in dict.fromkeys(GROWTH):
            rows = of_workload(results.get("trace", []), key, threads)
            if rows:
                lines.append([grouped(rows[0]["facets"]), grouped(rows[0]["rays"]), *growth_cells(rows)])
        if lines:
            head = ["facets", "rays", *(name.replace("matdb ", "") for name in COLUMNS)]
            text += f"{threads_of(threads).capitalize()}.\n\n" + table(head, lines, right=head) + "\n"
    if not text:
        return ""
    shares = [row["agree"] for row in results.get("trace", []) if row["workload"] in GROWTH and "agree" in row]
    agree = "All programs meet the same facet" if min(shares, default=1) == 1 else f"At worst {share(min(shares))} of the rays of a row meet the same facet"
    return f"""## Growth

A ball of bumps, ever finer, under ever more rays of one origin. Build and trace together; of Embree the fastest of
single rays and packets of 8 and 16. {agree} as ours, or one equally far, or nothing in both.

{text}"""


def growth_cells(rows):
    mine = ours(rows)
    for tracer in COLUMNS:
        row = best(rows, tracer)
        if row is None:
            reason = next((row["missing"] for row in rows if row["tracer"] == tracer and "missing" in row), "")
            yield "not installed" if "install" in reason or "No module" in reason else reason and "failed"
        elif row is mine or mine is None:
            yield spread(row["total"])
        else:
            ratio = median(row["total"]) / median(mine["total"])
            goal = goal_cell(row, ratio)
            yield f"{spread(row['total'])}, {times(ratio)}" + (f" (goal {goal})" if goal else "")


def memory(results):
    lines = []
    for (key, threads), rows in workloads(results).items():
        if key in GROWTH:
            found = [best(rows, tracer) for tracer in COLUMNS]
            cells = ["" if row is None else number(row["memory_mb"]) for row in found]
            size = [grouped(rows[0]["facets"]), grouped(rows[0]["rays"]), threads, number(rows[0]["mesh_mb"])]
            lines.append([*size, *cells])
    if not lines:
        return ""
    head = ["facets", "rays", "threads", "our mesh", *(name.replace("matdb ", "") for name in COLUMNS)]
    return f"""## Memory

The most that a process held in one turn, MB, beyond what it held with mesh and rays read: structures and
scratch, for `matdb` its hits, which the others write into memory that they have, and for Mitsuba what its compiler loads.

{table(head, lines, right=head)}"""


def second(results):
    groups = [rows for (key, _), rows in workloads(results).items() if key == "second bounce"]
    if not groups:
        return ""
    first = groups[0][0]
    return f"""## Rays of many origins

{grouped(first["rays"])} rays that the mannequin of {grouped(first["facets"])} facets reflects like a mirror, from where they met it. They share no origin, so `matdb`
takes its hierarchy. No one's rays are sorted.

""" + "\n".join(full(rows) for rows in groups)


def rendering(results):
    found = results.get("render")
    if not found:
        return ""
    write = median(found["write"])
    rows = [
        ["`matdb render`, from start to end", spread(found["render"]), times(median(found["render"]) / write)],
        ["writing its files, to the disk", spread(found["write"]), "× 1.00"],
        ["writing them, left to the system", spread(found["write_unsynced"]), times(median(found["write_unsynced"]) / write)],
        ["a process that only tells its version", spread(found["start"]), times(median(found["start"]) / write)],
    ]
    slowest = sorted(found["stages_ms"].items(), key=lambda stage: -stage[1])
    stages = ", ".join(f"{stage} {number(ms)}" for stage, ms in slowest)
    return f"""## The whole program

The paper's scene, {grouped(found["bytes"])} bytes of files, which a script wrote again in the same turns; here the ratio is to that
writing. At most {number(found["memory_mb"])} MB. Stages of one run, ms: {stages}.

""" + table(["", "ms", "ratio"], rows, right=["ms", "ratio"])


def formats(results):
    rows = []
    for row, ratio in beside(results.get("formats", []), "work"):
        size = f"{number(row['bytes'] / 1e6)} MB" if "bytes" in row else f"{grouped(row['facets'])} facets" if "facets" in row else ""
        rows.append([row["work"], row["program"], *timed(row, ratio), size])
    if not rows:
        return ""
    head = ["work", "program", "ms", "ratio", "what"]
    return f"""## Files

A binary PLY mesh from the disk's cache to a mesh that has been checked; a picture of 1024² and 7 channels to an
OpenEXR file, with the encoder's usual compression, and without any.

{table(head, rows, right=head[2:4])}"""


def timed(row, ratio):
    if "missing" in row:
        return [row["missing"], ""]
    return [spread(row["ms"]), "" if ratio is None else times(ratio)]


def registration(results):
    found = results.get("registration", [])
    if not found:
        return ""
    rows = []
    for row, ratio in sorted(beside(found, "threads"), key=lambda pair: pair[0]["threads"]):
        errors = [number(row["shift_mm"]), number(row["turn_deg"])] if "ms" in row else ["", ""]
        rows.append([row["program"], row["threads"], *timed(row, ratio), *errors])
    points = next((grouped(row["points"]) for row in found if "points" in row), "")
    head = ["program", "threads", "ms", "ratio", "off, mm", "off, °"]
    return f"""## Registration

{points} points of a scan of the human scene, 32 mm and 5° off. Rivals align them with one virtual scan of the pushed mesh;
`matdb` also builds its structures, scans anew until the pose rests, and computes the covariance.

{table(head, rows, right=head[1:])}"""


def fits(results):
    rows = []
    for row, ratio in beside(results.get("fits", []), "fit"):
        gap = f"{row['gap']:.0e}" if "gap" in row else row.get("note", "")
        rows.append([row["fit"], row["program"], *timed(row, ratio), gap])
    if not rows:
        return ""
    head = ["fit", "program", "ms", "ratio", "largest relative gap of a parameter"]
    return f"""## Fits

Four parameters, 5 000 points, one start. Refits are least squares of curves whose points are drawn from the curve with
replacement, from what the curve itself gave, side by side on both threads.

{table(head, rows, right=head[2:])}"""


def store(results):
    rows = []
    for row in results.get("store", []):
        unit, value = row["unit"].replace("us", "µs"), row["value"]
        shown = grouped(int(value)) if not unit and value == int(value) else number(value)
        goal = "" if row["goal"] is None else f"≤ {bound(row['goal'])}: {'met' if value <= row['goal'] else 'missed'}"
        rows.append([row["what"], f"{shown} {unit}".strip(), goal])
    if not rows:
        return ""
    return f"""## Database

By `cargo bench --bench store`.

{table(["what", "measured", "goal"], rows, right=["measured"])}"""


def gpu(results):
    found = results.get("gpu", [])
    if not found:
        return "## GPU\n\nNo GPU was at hand, so there is no figure of one.\n"
    rows = [
        [
            grouped(row["facets"]), grouped(row["rays"]), row["threads"], spread(row["hold"]), spread(row["answers"]),
            number(mrays_per_s(row)), spread(row["hits"]),
        ]
        for row in found
    ]
    head = ["facets", "rays", "threads", "hold the hierarchy", "answers", "million rays/s", "hits"]
    return f"""## GPU

{found[0]["adapter"]}, by `cargo bench --features gpu --bench trace`, ms. The hierarchy has been built; “answers” is what the
device says of the rays, “hits” is that and what the processor decides and measures of them.

{table(head, rows, right=head)}"""


def name_of(row):
    return row["tracer"] + (f", {row['way']}" if row.get("way") else "")


def threads_of(threads):
    return "1 thread" if threads == 1 else f"{threads} threads"
