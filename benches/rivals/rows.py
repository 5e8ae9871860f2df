"""Picking among the rows of the results."""

PINHOLE, HIERARCHY = "matdb pinhole", "matdb hierarchy"


def median(quartiles):
    return quartiles[1]


def of_workload(rows, key, threads):
    return [row for row in rows if row["workload"] == key and row["threads"] == threads]


def named(rows, tracer):
    return [row for row in rows if row["tracer"] == tracer and "total" in row]


def best(rows, tracer):
    """The fastest of a tracer's ways; None where it did not run."""
    return min(named(rows, tracer), key=lambda row: median(row["total"]), default=None)


def ours(rows):
    """The row of the tracer that is taken by default."""
    return best(rows, PINHOLE) or best(rows, HIERARCHY)


def total(row):
    return None if row is None else median(row["total"])
