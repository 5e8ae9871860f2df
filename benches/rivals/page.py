"""docs/performance.md from the stored results; needs nothing but Python."""

from pathlib import Path

from goals import LOW, MEDIUM, all_goals, mrays_per_s
from rows import HIERARCHY, PINHOLE, best, median, named, of_workload, ours, total
from words import bound, grouped, number, share, spread, table, times

LIMITS = Path(__file__).resolve().parent / "limits.md"
QUESTIONS = ("filter by", "full text", "matdb list", "matdb search", "matdb near", "open to", "nearest of all")
RIVALS = [LOW, MEDIUM, "Embree, medium build, robust", "Open3D", "Mitsuba, LLVM"]
MEASURED = [PINHOLE, HIERARCHY, LOW, MEDIUM, "Open3D", "Mitsuba, LLVM"]
WORKLOADS = ["paper", "body", "second bounce", "facets 3", "facets 4", "facets 5", "facets 6", "facets 7", "rays 4", "rays 5", "rays 7"]


def page(results):
    parts = [
        head(results), waits(results), contests_in_words(results), conditions(results), goals(results),
        tracing(results), paper(results), memory(results), reshading(results),
        rendering(results), formats(results), registration(results), fits(results), store(results),
        diagnosis(results), datasets(results), gpu(results), LIMITS.read_text(encoding="utf-8").strip() + "\n",
    ]
    return "\n".join(part for part in parts if part)


def head(results):
    quick = "**A trial run of few turns and small sizes: its numbers mean nothing.**\n\n" if results["quick"] else ""
    return f"""# Performance

{quick}This page says how long `matdb` takes, and how long other programs take on the same data. `benches/rivals/performance.py` generates it; see
[how to measure again](#how-to-measure-again).

**× 3 means that the other program takes three times as long as `matdb`**; below × 1 it is faster. Ratios transfer to other machines better
than times do. Unless a ratio says otherwise, the time to build a structure is included.
"""


def waits(results):
    """What a user waits for; what was not measured is left out."""
    rows = [row for part in [waits_for_scans, waits_for_curves_and_files, waits_for_the_database] for row in part(results)]
    return "## What you wait for\n\n" + table(["work", "time"], rows, right=["time"]) if rows else ""


def waits_for_scans(results):
    if found := results.get("render"):
        yield ["`matdb render scenes/mannequin.toml`, from start to end", ms(median(found["render"]))]
    for threads in [1, 2]:
        if mine := ours(of_workload(results.get("trace", []), "paper", threads)):
            yield [f"its {grouped(mine['rays'])} closest intersections, {threads_of(threads)}", ms(median(mine["total"]))]
    if found := results.get("reshade"):
        yield [f"its powers again with another effect, {threads_of(found[-1]['threads'])}", ms(median(found[-1]["effect"]))]
    if times_s := [row["diagnose_s"] for row in results.get("diagnosis", [])]:
        yield ["`matdb diagnose` of such a scan", f"{number(min(times_s))} to {number(max(times_s))} s"]
    if found := results.get("datasets"):
        yield [f"a labelled scan of a data set, {found['rays']} rays a spot, 1 core", f"{number(found['s'][0])} s"]
    for row in results.get("registration", []):
        if row["program"].startswith("matdb") and row["threads"] == 1 and "ms" in row:
            yield [f"registration of {grouped(row['points'])} points, 1 thread", ms(median(row["ms"]))]


def waits_for_curves_and_files(results):
    for part, key, words in [("fits", "fit", "fit of 5 000 points: {}"), ("formats", "work", "{}")]:
        for row in results.get(part, []):
            if row["program"] == "matdb" and "ms" in row:
                work = words.format(row[key]) if "bootstrap" not in row[key] else row[key]
                size = f", {grouped(row['facets'])} facets" if "facets" in row else ""
                yield [work + size, ms(median(row["ms"]))]


def waits_for_the_database(results):
    rows = {row["what"]: row for row in results.get("store", [])}
    for what, work in [("look-up by name", "look-up of a name"), ("matdb list", "`matdb list`"), ("publish", "`matdb publish`")]:
        if what in rows and "materials" in rows:
            yield [f"{work}, {grouped(int(rows['materials']['value']))} materials", measured(rows[what])]


def ms(value):
    return f"{number(value)} ms"


def contests(results):
    """Every piece of work that others do, too, with the ratio of the fastest of them."""
    for rows in traces(results):
        if ratios := [fastest(rows, tracer, "total") for tracer in RIVALS if named(rows, tracer)]:
            yield size_of(rows[0]), min(ratios) / total(ours(rows))
    if found := results.get("datasets"):
        yield "labelled scans of a data set, 1 core", found["other_cpu_s"] / found["matdb_cpu_s"]
    for part, key in [("registration", "threads"), ("fits", "fit"), ("formats", "work")]:
        groups = {}
        for row, ratio in beside(results.get(part, []), key):
            if ratio is not None and not row["program"].startswith("matdb"):
                groups.setdefault(row[key], []).append(ratio)
        for group, ratios in groups.items():
            yield (f"registration, {threads_of(group)}" if key == "threads" else group), min(ratios)


def contests_in_words(results):
    found = list(contests(results))
    listed = lambda won: "; ".join(f"{work} ({times(ratio)})" for work, ratio in found if (ratio >= 1) == won) or "nowhere in this run"
    built = [
        fastest(rows, tracer, "trace") / median(ours(rows)["trace"])
        for rows in traces(results) for tracer in RIVALS if named(rows, tracer)
    ]
    once = f"""
- **Once built:** where a structure over the mesh is kept and its building does not count, the others trace faster in {sum(ratio < 1 for ratio in built)} of {len(built)}
  cases. `matdb` builds nothing for rays of one origin.""" if built else ""
    return f"""## Where we win and where we lose

Each against the fastest other program. Tracing comes first, by facets × rays on two threads, as in [its table](#tracing).

- **Faster:** {listed(True)}.
- **Slower:** {listed(False)}.{once}
"""


def conditions(results):
    machine, versions = results["machine"], results["versions"]
    told = ", ".join(f"{name} {version}" for name, version in sorted(versions.items()))
    older = "".join(f"\n- {part}: measured {when}" for part, when in other_runs(results))
    failed = "".join(f"\n- {part} could not be measured: {why}" for part, why in results["failed"].items())
    return f"""## What was measured, and when

Programs run in turns, each as its own process that has read its input. The first turn does not count. Tables give the median in ms and, where
times scatter, quartiles in brackets.

- {machine["cpu"]} (family and model {machine["family"]}), {machine["cores"]} cores of {machine["architecture"]} with {", ".join(machine["features"])}; {machine["memory_gb"]} GB; {machine["system"]}
- {machine["date"]}, commit `{machine["commit"]}`, {machine["rustc"]}; {results["minutes"]:.0f} minutes, load before them {machine["load_before"]}
- {told or "no rival"}{older}{failed}
"""


def other_runs(results):
    """The parts that the head's day, commit and load are not those of; parts of one run together."""
    machine, runs = results["machine"], {}
    for part, run in results.get("parts", {}).items():
        if any(machine[key] != run[key] for key in run if key != "minutes"):
            runs.setdefault((run["date"], run["commit"], run["load_before"], run["cpu"]), []).append((part, run["minutes"]))
    for (date, commit, load, cpu), parts in runs.items():
        minutes = sum(of for _, of in parts)
        when = f"on {date} at `{commit}`, {minutes:.0f} minutes, load before them {'unknown' if load is None else load}"
        yield ", ".join(part for part, _ in parts), when + f", by {cpu}" * (cpu != machine["cpu"])


def goals(results):
    rows = [[g.work, g.goal, g.measured, g.verdict()] for g in all_goals(results)]
    return "## Goals\n\n" + table(["work", "goal", "measured", ""], rows)


def workloads(results):
    """The rows of each workload and number of threads, in order."""
    groups = {}
    for row in results.get("trace", []):
        groups.setdefault((row["workload"], row["threads"]), []).append(row)
    return groups


def tracing(results):
    groups = traces(results)
    lines = [
        [size_of(rows[0]), spread(ours(rows)["total"]), *(ratios(rows, tracer) for tracer in [HIERARCHY, *RIVALS])]
        for rows in groups
    ]
    if not lines:
        return ""
    shares = [row["agree"] for row in results["trace"] if "agree" in row]
    agree = "All programs hit the same facet" if min(shares, default=1) == 1 else f"At worst {share(min(shares))} of the rays of a row hit the same facet"
    head = ["facets × rays", "matdb, ms", "our hierarchy", *RIVALS]
    return f"""## Tracing

Two threads. Ratios of build and trace / of tracing alone, bold where `matdb` loses. For Embree the fastest of single rays and packets of
8 and 16 counts. 28 240 facets are the mannequin, other meshes a bumpy ball. The rays of a row share one origin and are sorted for the others, except in
the second bounce: reflections off the mannequin, unsorted, for which `matdb` builds its hierarchy. {agree} as ours, one equally
far to 10⁻⁶ of the range, or nothing in both.

{table(head, lines, right=head[1:])}"""


def traces(results):
    """The rows of each workload on two threads, where `matdb` was measured."""
    groups = workloads(results)
    return [rows for key in WORKLOADS if ours(rows := groups.get((key, 2), []))]


def size_of(row):
    return f"{grouped(row['facets'])} × {grouped(row['rays'])}" + ", second bounce" * (not row["coherent"])


def ratios(rows, tracer):
    """A tracer's fastest ways over ours, with its build and without."""
    mine = ours(rows)
    if not named(rows, tracer):
        reason = next((row["missing"] for row in rows if row["tracer"] == tracer and "missing" in row), "")
        return "not installed" if "install" in reason or "No module" in reason else reason and "failed"
    if best(rows, tracer) is mine:
        return "the same"
    found = [fastest(rows, tracer, part) / median(mine[part]) for part in ["total", "trace"]]
    return " / ".join(f"**{number(ratio)}**" if ratio < 1 else number(ratio) for ratio in found)


def fastest(rows, tracer, part):
    return min(median(row[part]) for row in named(rows, tracer))


def beside(rows, key):
    """Every row with the ratio of its time to ours in the same group; none where one is missing."""
    mine = {row[key]: median(row["ms"]) for row in rows if row["program"].startswith("matdb") and "ms" in row}
    for row in rows:
        known = "ms" in row and row[key] in mine
        yield row, median(row["ms"]) / mine[row[key]] if known else None


def paper(results):
    groups = [rows for (key, _), rows in workloads(results).items() if key == "paper"]
    if not groups:
        return ""
    first = groups[0][0]
    return f"""## The paper's scan

{grouped(first['facets'])} facets, {grouped(first['rays'])} rays: the elliptical scan of the mannequin at 8 m. The other programs get their rays sorted along a Z-curve, uncounted;
`matdb` takes them in the order of the scan, and its own sorting, once per scan pattern, is given separately. Before each turn a program
repeats the work for 40 ms, so that threads and caches are warm.

""" + "\n".join(full(rows) for rows in groups)


def full(rows):
    """Every tracer on one workload, in its fastest way."""
    mine = ours(rows)
    cells = []
    for tracer in dict.fromkeys(row["tracer"] for row in rows):
        row = best(rows, tracer)
        if row is None:
            reason = next(row["missing"] for row in rows if row["tracer"] == tracer)
            cells.append([tracer, "", "", reason, ""])
            continue
        ratio = median(row["total"]) / median(mine["total"]) if mine else None
        cells.append([
            name_of(row), number(median(row["build"])), spread(row["trace"]), number(median(row["total"])),
            "" if ratio is None else times(ratio),
        ])
    once = [row["once"] for row in rows if "once" in row]
    sorting = f" Sorting, once per pattern: {spread(once[0])} ms." if once else ""
    if mine and "power" in mine:
        sorting += f" Evaluating the power takes another {spread(mine['power'])} ms, which the goal includes."
    head = ["tracer", "build", "trace", "both", "ratio"]
    title = threads_of(rows[0]["threads"]).capitalize()
    return f"{title}.{sorting}\n\n" + table(head, cells, right=head[1:])


def reshading(results):
    found = results.get("reshade", [])
    if not found:
        return ""
    ways = [("traced", "hits alone, anew"), ("same", "nothing changed"), ("law", "another law"), ("effect", "another effect")]
    rows = [[words, *(spread(row[key]) for row in found)] for key, words in ways]
    head = ["", *(f"{threads_of(row['threads'])}, ms" for row in found)]
    return f"""## The same scan again

A new prediction for {grouped(found[0]["shots"])} of {grouped(found[0]["chirps"])} chirps, those on the target, when the geometry stays and hits, angles and
footprints are reused. By `cargo bench --bench reshade`.

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

`matdb diagnose` from start to written files, once per row, on all cores: the scan of `scenes/bench.toml`, rendered in the same run with a
hidden effect. By `cargo bench --bench diagnose`. We know no other program that does this.

{table(head, rows, right=head[1:4])}"""


def datasets(results):
    found = results.get("datasets")
    if not found:
        return ""
    mine, other = found["matdb_cpu_s"], found["other_cpu_s"]
    rows = [["matdb", number(mine), times(1)], ["Embree and numpy", number(other), times(other / mine)]]
    one_s, two_s = found["s"]
    return f"""## Data sets

Labelled scans of the torso of `examples/datasets`, {found["rays"]} rays in each of 18 529 spots, points and images written, on one core, a
mean of {found["scans"]}. The other program is `benches/rivals/labelled.py`: one return for each chirp, one law of few instructions for all materials,
no effects and no checks. On two cores `matdb` makes {number(one_s / two_s)} times as many in the same time.

{table(["program", "CPU-s a scan", "ratio"], rows, right=["CPU-s a scan", "ratio"])}"""


def memory(results):
    lines = []
    for rows in traces(results):
        if rows[0]["workload"] in ("paper", "body"):
            continue
        found = [best(rows, tracer) for tracer in MEASURED]
        cells = ["" if row is None else number(row["memory_mb"]) for row in found]
        lines.append([size_of(rows[0]), number(rows[0]["mesh_mb"]), *cells])
    if not lines:
        return ""
    head = ["facets × rays", "our mesh", *(name.replace("matdb ", "") for name in MEASURED)]
    return f"""## Memory

Peak memory of a process in one turn on two threads, MB, beyond mesh and rays: structures and scratch. For `matdb` it includes the hits, which the others write into
memory that they have, and for Mitsuba what its compiler loads.

{table(head, lines, right=head[1:])}"""


def rendering(results):
    found = results.get("render")
    if not found:
        return ""
    write = median(found["write"])
    rows = [
        ["`matdb render`, from start to end", spread(found["render"]), times(median(found["render"]) / write)],
        ["writing its files, to the disk", spread(found["write"]), "× 1.00"],
        ["writing them, left to the system", spread(found["write_unsynced"]), times(median(found["write_unsynced"]) / write)],
        ["a process that only prints its version", spread(found["start"]), times(median(found["start"]) / write)],
    ]
    slowest = sorted(found["stages_ms"].items(), key=lambda stage: -stage[1])
    stages = ", ".join(f"{stage} {number(ms)}" for stage, ms in slowest)
    return f"""## The whole program

The paper's scene, {grouped(found["bytes"])} bytes of files. A script wrote the same files in the same turns, and the ratio is to that
writing. Peak memory {number(found["memory_mb"])} MB. Stages of one run, ms: {stages}.

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

Reading: a binary PLY mesh from the disk's cache to a checked mesh. Writing: a picture of 1024² and 7 channels to an
OpenEXR file, with the encoder's usual compression and without.

{table(head, rows, right=head[2:4])}"""


def timed(row, ratio):
    if "missing" in row:
        return [row["missing"], ""]
    return [spread(row["ms"]), "" if ratio is None else times(ratio)]


def registration(results):
    found = results.get("registration", [])
    if not found:
        return ""
    counts = sorted({row["threads"] for row in found})
    programs = {}
    for row, ratio in beside(found, "threads"):
        programs.setdefault(row["program"], {})[row["threads"]] = (row, timed(row, ratio))
    rows = []
    for program, by in programs.items():
        row = next(iter(by.values()))[0]
        errors = [number(row["shift_mm"]), number(row["turn_deg"])] if "ms" in row else ["", ""]
        rows.append([program, *(cell for count in counts for cell in (by[count][1] if count in by else ["", ""])), *errors])
    points = next((grouped(row["points"]) for row in found if "points" in row), "")
    head = ["program", *(cell for count in counts for cell in (f"{threads_of(count)}, ms", "ratio")), "off, mm", "off, °"]
    return f"""## Registration

{points} points of a scan of the human scene, 32 mm and 5° off. The other programs align them with one virtual scan of the displaced mesh.
`matdb` also builds its structures, repeats the virtual scan until the pose converges, and computes the covariance.

{table(head, rows, right=head[1:])}"""


def fits(results):
    rows = []
    for row, ratio in beside(results.get("fits", []), "fit"):
        gap = f"{row['gap']:.0e}" if "gap" in row else row.get("note", "")
        rows.append([row["fit"], row["program"], *timed(row, ratio), gap])
    if not rows:
        return ""
    head = ["fit", "program", "ms", "ratio", "largest relative gap"]
    return f"""## Fits

Four parameters, 5 000 points, one start; the gap is that of a parameter. Refits are a bootstrap by least squares: points drawn with replacement, started from
the fit of the curve, in parallel on both threads.

{table(head, rows, right=head[2:])}"""


def store(results):
    rows = []
    for group in slowest_of_each(results.get("store", [])):
        row = max(group, key=lambda row: row["value"])
        what = row["what"] if len(group) == 1 else f"{row['what']} (slowest of {len(group)})"
        goal = "" if row["goal"] is None else f"≤ {bound(row['goal'])}: {'met' if row['value'] <= row['goal'] else 'missed'}"
        rows.append([what, measured(row), goal])
    if not rows:
        return ""
    return f"""## Database

By `cargo bench --bench store`.

{table(["what", "measured", "goal"], rows, right=["measured"])}"""


def slowest_of_each(rows):
    """Questions of one kind and with one goal together, everything else by itself; without what follows from another row."""
    groups = {}
    for row in rows:
        if row["what"].endswith("each") or row["what"] in ("publish again, files", "publish again, size"):
            continue
        kind = next((kind for kind in QUESTIONS if row["what"].startswith(kind)), row["what"])
        groups.setdefault((kind, row["goal"]), []).append(row)
    return list(groups.values())


def measured(row):
    unit, value = row["unit"].replace("us", "µs"), row["value"]
    shown = grouped(int(value)) if not unit and value == int(value) else number(value)
    return f"{shown} {unit}".strip()


def gpu(results):
    found = results.get("gpu", [])
    if not found:
        return "## GPU\n\nNo GPU was available, so there is no timing of one.\n"
    rows = [
        [
            grouped(row["facets"]), grouped(row["rays"]), row["threads"], spread(row["hold"]), spread(row["answers"]),
            number(mrays_per_s(row)), spread(row["hits"]),
        ]
        for row in found
    ]
    head = ["facets", "rays", "threads", "hold the hierarchy", "answers", "million rays/s", "hits"]
    return f"""## GPU

{found[0]["adapter"]}, by `cargo bench --features gpu --bench trace`, ms. The hierarchy is built already. “Answers” is the time of the
device, “hits” adds what the processor decides and measures.

{table(head, rows, right=head)}"""


def name_of(row):
    return row["tracer"] + (f", {row['way']}" if row.get("way") else "")


def threads_of(threads):
    return "1 thread" if threads == 1 else f"{threads} threads"
