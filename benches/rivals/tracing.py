"""Times of closest hits by all tracers on all workloads."""

import numpy as np

import tracers
from files import read_hits
from programs import alternate, end, example, start
from spread import spread
from workloads import FULL, QUICK, Files

RANGE_GAP = 1e-6


def measure(folder, quick, say):
    """Rows, one for each workload, number of threads, tracer and way to trace; and versions."""
    rows, versions = [], {}
    for workload in QUICK if quick else FULL:
        files = Files(folder, workload)
        for threads in workload.threads:
            say(f"trace: {workload.key}, {files.facets} facets, {files.count} rays, {threads} threads")
            found, about = compare(files, workload, threads)
            rows += found
            versions |= {name.split(",")[0]: of["version"] for name, of in about.items() if "version" in of}
        files.rays.unlink(missing_ok=True)
    return rows, versions


def compare(files, workload, threads):
    commands = {}
    for tracer in tracers.ALL:
        commands |= tracer(files, workload, threads)
    # What our power takes on top: in the same turns, so that it meets the same load.
    power = {"power": example("trace_speed", "power")} if workload.key == "paper" else {}
    running, about, missing = start(commands | power, threads)
    answers = alternate(running, missing, workload.turns, workload.seconds, workload.warm_up_s)
    memory_mb = {name: program.memory_mb for name, program in running.items()}
    end(running, missing)
    of = {
        "workload": workload.key, "facets": files.facets, "rays": files.count, "threads": threads,
        "mesh_mb": round(files.mesh_mb, 3), "coherent": workload.is_coherent,
    }
    reference, rows = None, []
    for name in commands:
        if name in missing:
            rows.append(of | {"tracer": name, "missing": missing[name]})
            continue
        hits = read_hits(files.hits(name), files.count)
        files.hits(name).unlink()
        if not name.startswith("matdb"):
            hits = unsorted(hits, files.order)
        reference = hits if reference is None else reference
        more = {"tracer": name, "agree": agreement(reference, hits), "memory_mb": round(memory_mb[name], 1)}
        powers = answers.get("power") if name.startswith("matdb") else None
        rows += [of | more | row for row in ways(answers[name], powers)]
    return rows, about


def ways(answers, powers):
    """A program may trace in several ways after one build. `powers` took the same turns."""
    names = answers[0].get("traces", {"": 0})
    for way in names:
        traces = [answer["traces"][way] if way else answer["trace"] for answer in answers]
        builds = [answer["build"] for answer in answers]
        row = {"way": way, "build": spread(builds), "trace": spread(traces), "turns": len(answers)}
        row["total"] = spread([build + trace for build, trace in zip(builds, traces)])
        if "once" in answers[0]:
            row["once"] = spread([answer["once"] for answer in answers])
        if powers:
            sums = [build + trace + of["power"] for build, trace, of in zip(builds, traces, powers, strict=True)]
            row["power"], row["with_power"] = spread([of["power"] for of in powers]), spread(sums)
        yield row


def unsorted(hits, order):
    back = np.empty_like(order)
    back[order] = np.arange(len(order))
    return tuple(part[back] for part in hits)


def agreement(ours, theirs):
    """Share of rays that meet the same facet, or meet one equally far away, or nothing in both."""
    (facet, range_m), (other, other_m) = ours, theirs
    with np.errstate(invalid="ignore"):
        near = np.isfinite(range_m) & (np.abs(other_m - range_m) <= RANGE_GAP * range_m)
    return float(np.mean((facet == other) | near))
