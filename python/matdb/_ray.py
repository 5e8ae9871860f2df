"""Data sets on a Ray cluster: a task makes a shard."""

from __future__ import annotations

import json
import os
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any, Callable

from ._extras import _needed

if TYPE_CHECKING:
    from ._matdb import Dataset

PLAN = ["plan.toml", "spec.toml", "inputs"]
"""What a node needs to make a shard."""


def _files(folder: Path, names: list[str]) -> dict[str, bytes]:
    """The bytes of files, and of those in folders, by their paths within a folder."""
    found = {}
    for name in names:
        path = folder / name
        for file in [path] if path.is_file() else sorted(path.glob("*")):
            found[str(file.relative_to(folder))] = file.read_bytes()
    return found


def _write(folder: Path, files: dict[str, bytes]) -> None:
    """Writes files under temporary names, and renames each when it is whole."""
    for name, data in files.items():
        place = folder / name
        place.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=place.parent, prefix=".matdb-", delete=False) as file:
            try:
                file.write(data)
                file.flush()
                os.fsync(file.fileno())
                os.chmod(file.name, 0o644)
                os.replace(file.name, place)
            except OSError:
                os.unlink(file.name)
                raise


def _made(folder: Path, shard: int, shards: int) -> tuple[int, dict[str, bytes]]:
    """Makes a shard in a folder with the plan, and gives the number of scans and its files, the manifest last."""
    import matdb

    # A task has one core. The threads of this process begin with the first shard.
    os.environ.setdefault("RAYON_NUM_THREADS", "1")
    scans = matdb.dataset(folder).shard(shard, shards)["scans"]
    files: dict[str, bytes] = {}
    for path in sorted((folder / "manifests").glob("*.json")):
        manifest = json.loads(path.read_bytes())
        if manifest["shard"] == shard:
            files |= _files(folder, [one["file"] for one in manifest["files"]])
            files[str(path.relative_to(folder))] = path.read_bytes()
    return scans, files


def _of_nothing_shared(plan: dict[str, bytes], shard: int, shards: int) -> tuple[int, dict[str, bytes]]:
    with tempfile.TemporaryDirectory() as folder:
        _write(Path(folder), plan)
        return _made(Path(folder), shard, shards)


def _of_shared_folder(folder: str, shard: int, shards: int) -> tuple[int, dict[str, bytes]]:
    return _made(Path(folder), shard, shards)[0], {}


def run(dataset: Dataset, address: str, shared: bool, progress: Callable[[int, int], Any] | None) -> dict[str, int]:
    """Makes the shards that are missing."""
    ray = _needed("ray", "ray")
    if not ray.is_initialized():
        try:
            ray.init(address=address, log_to_driver=False)
        except ConnectionError:
            if address != "auto":
                raise
            ray.init(log_to_driver=False)
    folder, shards = Path(dataset.folder).absolute(), dataset.shards
    missing = dataset.missing()
    # A lost node loses its tasks; whatever they have written is whole or not there.
    settings = {"num_cpus": 1, "max_retries": -1}
    if shared:
        given, work = str(folder), _of_shared_folder
    else:
        given, work = ray.put(_files(folder, PLAN)), _of_nothing_shared  # type: ignore[assignment]
    task = ray.remote(**settings)(work)
    waiting = [task.remote(given, shard, shards) for shard in missing]
    done = all_scans = 0
    while waiting:
        ready, waiting = ray.wait(waiting, num_returns=1)
        scans, files = ray.get(ready[0])
        _write(folder, files)
        done, all_scans = done + 1, all_scans + scans
        if progress is not None:
            progress(done, len(missing))
    # Writes the table of all scans.
    made: dict[str, int] = dataset.run()
    return {**made, "shards": made["shards"] + len(missing), "scans": made["scans"] + all_scans}
