"""The scans of a data set for PyTorch: one item is one scan, with a row for each return.

    python pytorch.py ds        # trains a few steps on the points of ds, and says how the loss falls
"""

import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet
import torch
from torch.utils.data import DataLoader, Dataset

COLUMNS = ["xt_m", "yt_m", "range_m", "power_dbm"]


class Scans(Dataset):
    """The scans of a split. An item is `(points, threat)`: float32 of the shape (rows, 4), the columns as in `COLUMNS` and NaN
    where a chirp has no return, and bool of the shape (rows,).

    A scan is a row group of its shard's table, so that an item reads nothing else. Files are opened in the process that reads
    them: the workers of a `DataLoader` share none.
    """

    def __init__(self, folder, split="train"):
        self.folder, self.files = Path(folder), {}
        scans = parquet.read_table(self.folder / "scans.parquet", columns=["key", "split", "shard", "scan"]).to_pylist()
        self.scans = [scan for scan in scans if scan["split"] == split]
        first = {}
        for scan in self.scans:
            scan["group"] = scan["scan"] - first.setdefault(scan["shard"], scan["scan"])

    def __len__(self):
        return len(self.scans)

    def __getitem__(self, place):
        scan = self.scans[place]
        shard = scan["shard"]
        if shard not in self.files:
            self.files[shard] = parquet.ParquetFile(self.folder / "points" / f"{shard}.parquet")
        rows = self.files[shard].read_row_group(scan["group"], columns=[*COLUMNS, "threat"])
        points = np.stack([rows[name].to_numpy() for name in COLUMNS], axis=1)
        return torch.from_numpy(points), torch.from_numpy(rows["threat"].to_numpy().copy())

    def __getstate__(self):
        return {**self.__dict__, "files": {}}


def joined(scans):
    """Scans of different lengths as one batch of points."""
    points, threat = zip(*scans)
    return torch.cat(points), torch.cat(threat)


def train(folder, epochs=3, seed=1):
    """Trains a small network to say which returns are of an object that is looked for; the mean loss of each epoch."""
    torch.manual_seed(seed)
    network = torch.nn.Sequential(torch.nn.Linear(4, 32), torch.nn.ReLU(), torch.nn.Linear(32, 1))
    steps, losses = torch.optim.Adam(network.parameters(), lr=0.01), []
    for _ in range(epochs):
        of_epoch = []
        for points, threat in DataLoader(Scans(folder), batch_size=4, shuffle=True, collate_fn=joined):
            seen = points.isfinite().all(dim=1)
            points, threat = points[seen], threat[seen].float()
            # About metres, and tens of decibels.
            points = (points - torch.tensor([0.0, 1.1, 8.0, -50.0])) / torch.tensor([0.2, 0.2, 0.1, 10.0])
            loss = torch.nn.functional.binary_cross_entropy_with_logits(network(points)[:, 0], threat)
            steps.zero_grad()
            loss.backward()
            steps.step()
            of_epoch.append(loss.item())
        losses.append(sum(of_epoch) / len(of_epoch))
    return losses


if __name__ == "__main__":
    print(" ".join(f"{loss:.3f}" for loss in train(sys.argv[1])))
