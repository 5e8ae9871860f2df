"""The goals, and what of them was reached."""

from dataclasses import dataclass, replace

from rows import HIERARCHY, PINHOLE, best, median, named, of_workload, ours, total
from words import bound, grouped, number, times

# As lists ask, which stop at a page; what reads every line is no question.
QUESTIONS = ("filter by class", "filter by tag", "filter by frequency", "filter by kind", "filter by nothing", "full text")
LOW, MEDIUM = "Embree, low build", "Embree, medium build"
# Of graphics processors by name: the most million rays a second that somebody published for a walk in a compute shader.
PUBLISHED = {}


@dataclass
class Goal:
    """`reached` is None where nothing was measured, or nothing is known to hold it against."""

    work: str
    goal: str
    measured: str
    reached: bool | None
    unknown: str = "not measured"

    def verdict(self):
        return {True: "met", False: "**missed**", None: self.unknown}[self.reached]


def at_least(work, factor, theirs, mine, rival):
    if theirs is None or mine is None:
        return Goal(work, f"≥ {bound(factor)} × {rival}", "", None)
    ratio = theirs / mine
    return Goal(work, f"≥ {bound(factor)} × {rival}", times(ratio), ratio >= factor)


def at_most(work, most, unit, value):
    goal = f"≤ {bound(most)} {unit}".strip()
    if value is None:
        return Goal(work, goal, "", None)
    return Goal(work, goal, f"{number(value)} {unit}".strip(), value <= most)


def all_goals(results):
    return [
        *tracing(results), *reshading(results), *rendering(results), diagnosis(results), datasets(results), gpu(results), *fits(results), *registration(results),
        *store(results), *formats(results), *memory(results),
    ]


def tracing(results):
    rows = results.get("trace", [])
    paper = of_workload(rows, "paper", 2)
    whole = with_power(ours(paper))
    work = "paper's scan, facets → hits → power, 2 threads"
    for tracer, factor, name in [(MEDIUM, 8, "Embree medium"), (LOW, 4, "Embree low")]:
        yield at_least(work, factor, total(best(paper, tracer)), whole, f"{name}, build + trace")
    yield at_most("paper's scan, facets → hits, 1 thread", 0.6, "ms", total(ours(of_workload(rows, "paper", 1))))
    for key, name, factor in [("facets 6", "1 M × 1 M", 5), ("rays 7", "1 M × 10 M", 1.2)]:
        found = of_workload(rows, key, 2)
        work = f"{name}, facets → hits, 2 threads"
        yield at_least(work, factor, total(best(found, MEDIUM)), total(ours(found)), "Embree medium, build + trace")
    for threads in [1, 2]:
        found = of_workload(rows, "second bounce", threads)
        packets = [median(row["trace"]) for row in named(found, MEDIUM) if "packets" in row["way"]]
        mine = ours(found)
        work = f"general rays, trace alone, {threads} thread{'s' * (threads > 1)}"
        yield at_least(work, 0.8, min(packets, default=None), mine and median(mine["trace"]), "Embree packets")


def with_power(mine):
    """From facets to power."""
    return median(mine["with_power"]) if mine and "with_power" in mine else None


def reshading(results):
    for threads in [1, 2]:
        row = next((row for row in results.get("reshade", []) if row["threads"] == threads), None)
        slowest = row and max(median(row["law"]), median(row["effect"]))
        chirps = f"a scan of {grouped(row['chirps'])} chirps, {grouped(row['shots'])} of them on the target," if row else "a scan"
        work = f"{chirps} again with another law or effect, {threads} thread{'s' * (threads > 1)}"
        yield at_most(work, 1, "ms", slowest)


def rendering(results):
    found = results.get("render")
    ratio = median(found["render"]) / median(found["write"]) if found else None
    yield at_most("whole `render` of the paper's scene over writing its files", 3, "", ratio)


def diagnosis(results):
    slowest = max((row["diagnose_s"] for row in results.get("diagnosis", [])), default=None)
    return at_most("whole diagnosis of 18 529 chirps, the slowest of several", 60, "s", slowest)


def datasets(results):
    found = results.get("datasets")
    work, goal = "labelled scans with 64-ray spots, truth and images, 1 core", "≥ 8 a second"
    if not found:
        return Goal(work, goal, "", None)
    rate = 1 / found["matdb_cpu_s"]
    return Goal(work, goal, f"{number(rate)} a second", rate >= 8)


def gpu(results):
    goal = Goal("GPU", "within 2 × of the best published rate", "no GPU was available", None)
    fastest = max(results.get("gpu", []), key=mrays_per_s, default=None)
    if fastest is None:
        return goal
    rate, published = mrays_per_s(fastest), PUBLISHED.get(fastest["adapter"])
    measured = f"{number(rate)} million rays/s by {fastest['adapter']}"
    if published is None:
        return replace(goal, measured=measured, unknown="no rate published")
    return replace(goal, measured=f"{measured}, {number(published)} published", reached=2 * rate >= published)


def mrays_per_s(row):
    """Of the device's answers, without what the processor decides and measures."""
    return row["rays"] / median(row["answers"]) / 1e3


def fits(results):
    rows = [row for row in results.get("fits", []) if "ms" in row]
    fastest = lambda fit, program: min(
        (median(row["ms"]) for row in rows if row["fit"] == fit and row["program"].startswith(program)), default=None
    )
    for fit, rival, name, factor in [
        ("least squares", "scipy", "the fastest of scipy", 7.4),
        ("orthogonal distance", "odrpack", "odrpack", 9.5),
    ]:
        yield at_least(f"{fit}, 4 parameters, 5 000 points", factor, fastest(fit, rival), fastest(fit, "matdb"), name)
    refits = fastest("1 000 bootstrap refits", "matdb")
    yield at_most("1 000 bootstrap refits, 2 threads", 1, "s", refits and refits / 1e3)


def registration(results):
    rows = [row for row in results.get("registration", []) if "ms" in row]
    for threads in [1, 2]:
        here = [row for row in rows if row["threads"] == threads]
        mine = next((row for row in here if row["program"].startswith("matdb")), None)
        work = f"registration, {threads} thread{'s' * (threads > 1)}"
        # Ours asks the scan itself which point belongs to which place.
        yield at_most(f"{work}, by projective association", 10, "ms", mine and median(mine["ms"]))
        for rival in ["small_gicp", "Open3D"]:
            fastest = min((median(row["ms"]) for row in here if row["program"].startswith(rival)), default=None)
            yield at_least(work, 1, fastest, mine and median(mine["ms"]), f"the fastest of {rival}")
    error = (mine["shift_mm"], mine["turn_deg"]) if rows and mine else (None, None)
    yield at_most("registration, error of the shift", 0.1, "mm", error[0])
    yield at_most("registration, error of the turn", 0.02, "°", error[1])


def store(results):
    rows = {row["what"]: row for row in results.get("store", [])}
    value = lambda *starts: max((r["value"] for what, r in rows.items() if what.startswith(starts)), default=None)
    of = "database: "
    yield at_most(of + "insert over SQLite alone", 1.5, "", value("bulk import over"))
    yield at_most(of + "look-up by name", 20, "µs", value("look-up"))
    yield at_most(of + "the slowest filter or full text", 1000, "µs", value(*QUESTIONS))
    yield at_most(of + "the slowest opening", 5, "ms", value("open"))
    yield at_most(of + "the slowest listing command", 50, "ms", listing(rows))
    yield at_most(of + "memory of `matdb publish`", 500, "MiB", value("publish, memory", "publish again, memory"))


def listing(rows):
    return max((r["value"] for what, r in rows.items() if what.startswith("matdb") and r["goal"] is not None), default=None)


def formats(results):
    ms = {(row["work"], row["program"]): median(row["ms"]) for row in results.get("formats", []) if "ms" in row}
    yield at_most("read and check a binary PLY of 1 M triangles", 10, "ms", ms.get(("read PLY", "matdb")))
    yield at_most("write EXR, 1024², 7 channels, ZIP16", 100, "ms", ms.get(("write EXR", "matdb")))


def memory(results):
    rows = of_workload(results.get("trace", []), "facets 7", 2)
    for tracer, name in [(PINHOLE, "pinhole"), (HIERARCHY, "hierarchy")]:
        mine = best(rows, tracer)
        over = (mine["mesh_mb"] + mine["memory_mb"]) / mine["mesh_mb"] if mine else None
        yield at_most(f"memory, 10 M facets, mesh included, {name}", 1.5, "× the mesh", over)
