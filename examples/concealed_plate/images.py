"""Tables of points to pictures for a network. Both generators go through this code alone."""

import numpy as np
import pyarrow.dataset
import pyarrow.parquet

from stranger import SIDE

COLUMNS = ["scan", "chirp", "detected", "power_dbm", "range_m", "threat"]
RELIEF_OVER = 4                                 # relief is range less its mean over this many pixels to each side


def box_sum(values):
    """The sum over the square around each pixel."""
    for axis in (1, 2):
        width = [(0, 0), (0, 0), (0, 0)]
        width[axis] = (RELIEF_OVER + 1, RELIEF_OVER)
        total = np.cumsum(np.pad(values, width), axis)
        high = np.arange(2 * RELIEF_OVER + 1, total.shape[axis])
        values = np.take(total, high, axis) - np.take(total, high - 2 * RELIEF_OVER - 1, axis)
    return values


def box_mean(values):
    """The mean over the square around each pixel, without what is NaN."""
    there = np.isfinite(values)
    return box_sum(np.where(there, values, 0.0)) / np.maximum(box_sum(there.astype(float)), 1)


def pictures(table):
    """Power and relief of each chirp's farthest echo, (scans, 2, SIDE, SIDE), and where a plate lies along its axis."""
    numbers, scan = np.unique(table["scan"], return_inverse=True)
    chirp, power, distance = table["chirp"], table["power_dbm"], table["range_m"]
    shape = (len(numbers), SIDE * SIDE)
    threat = np.zeros(shape, bool)
    np.logical_or.at(threat, (scan, chirp), table["threat"])
    order = np.argsort(distance, kind="stable")
    order = order[table["detected"][order]]
    level, reach = np.full(shape, np.nan), np.full(shape, np.nan)
    level[scan[order], chirp[order]] = power[order]         # of several echoes the farthest is written last
    reach[scan[order], chirp[order]] = distance[order]
    level, reach = level.reshape(-1, SIDE, SIDE), reach.reshape(-1, SIDE, SIDE)
    relief = np.clip((reach - box_mean(reach)) / 0.01, -3, 3)
    both = np.stack([(np.nan_to_num(level, nan=-80.0) + 60) / 10, np.nan_to_num(relief)], 1)
    return both.astype(np.float32), threat.reshape(-1, SIDE, SIDE)


def from_data_set(folder, split):
    """Pictures of the scans of a split of a data set of matdb. Echoes below the threshold are not seen."""
    rows = pyarrow.dataset.dataset(sorted(map(str, (folder / "points").glob(f"{split}-*.parquet"))))
    table = rows.to_table(columns=COLUMNS, filter=pyarrow.dataset.field("detected") | pyarrow.dataset.field("threat")
                          | (pyarrow.dataset.field("chirp") == 0))
    return pictures({name: table[name].to_numpy() for name in COLUMNS})


def from_file(path):
    """Pictures of the scans of a file of the other generator."""
    table = pyarrow.parquet.read_table(path)
    table = {name: table[name].to_numpy() for name in table.column_names}
    return pictures({**table, "detected": np.isfinite(table["power_dbm"]) & np.isfinite(table["range_m"])})
