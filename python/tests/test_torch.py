"""PyTorch and the library `datasets` read a data set. Skipped where PyTorch is not installed."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

import matdb as md

torch = pytest.importorskip("torch")
pd = pytest.importorskip("pandas")

EXAMPLES = Path(__file__).parents[2] / "examples" / "datasets"


def example():
    described = importlib.util.spec_from_file_location("pytorch_example", EXAMPLES / "pytorch.py")
    module = importlib.util.module_from_spec(described)
    described.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("torch")
    for name in ("torso.toml", "concealed.toml"):
        text = (EXAMPLES / name).read_text()
        text = text.replace("scans = 1000", "scans = 20\nscans_per_shard = 4\nimages = false").replace("rays = 16", "rays = 1")
        (folder / name).write_text(text)
    data = md.dataset(folder / "concealed.toml", folder / "ds")
    data.run()
    return folder / "ds"


def test_an_item_is_a_scan(made):
    scans = pd.read_parquet(made / "scans.parquet")
    items = example().Scans(made)
    assert len(items) == (scans.split == "train").sum() > 4
    for (points, threat), known in zip(items, items.scans):
        rows = pd.read_parquet(made / "points" / f"{known['shard']}.parquet")
        rows = rows[rows.scan == known["scan"]]
        assert points.dtype == torch.float32 and points.shape == (len(rows), 4)
        assert np.array_equal(points.numpy(), rows[["xt_m", "yt_m", "range_m", "power_dbm"]], equal_nan=True)
        assert np.array_equal(threat.numpy(), rows.threat)


def test_workers_read_what_one_process_reads(made):
    module = example()
    alone = list(module.Scans(made))
    loader = torch.utils.data.DataLoader(module.Scans(made), batch_size=None, num_workers=2, multiprocessing_context="fork")
    for (points, threat), (expected, labels) in zip(loader, alone, strict=True):
        assert torch.equal(points.nan_to_num(-1e9), expected.nan_to_num(-1e9)) and torch.equal(threat, labels)


def test_a_network_learns_from_it(made):
    losses = example().train(made, epochs=5)
    assert losses[-1] < 0.7 * losses[0]


def test_the_library_datasets_loads_it(made, tmp_path):
    datasets = pytest.importorskip("datasets")
    files = {split: [str(one) for one in made.glob(f"points/{split}-*.parquet")] for split in ("train", "test")}
    loaded = datasets.load_dataset("parquet", data_files=files, cache_dir=str(tmp_path))
    rows = pd.concat(pd.read_parquet(one) for one in sorted(files["train"]))
    assert loaded["train"].num_rows == len(rows)
    assert sum(loaded["train"]["threat"]) == rows.threat.sum()
