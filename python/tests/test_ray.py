"""A data set on a Ray cluster has the bytes of one that is made without. Skipped where Ray is not installed."""

import subprocess

import pytest

import matdb as md

ray = pytest.importorskip("ray")
cluster_utils = pytest.importorskip("ray.cluster_utils")

SCENE = """
[radar.scan]
pattern = "raster"
lines = 12
chirps_per_line = 12
width_m = 0.3
height_m = 0.3
[spot]
rays = 4
[[mesh]]
name = "wall"
file = "builtin:sphere"
size_m = [0.6, 0.6, 0.3]
translation_m = [0, 1.1, 0]
[[region]]
name = "wall"
material = "mannequin-paint"
"""
SPEC = """
name = "walls"
scene = "scene.toml"
scans = 300
scans_per_shard = 10
[[vary]]
keys = ["mesh.wall.translation_m"]
from = [-0.05, 1.05, -0.05]
to = [0.05, 1.15, 0.05]
"""


def made(folder):
    return {str(one.relative_to(folder)): one.read_bytes() for one in sorted(folder.rglob("*")) if one.is_file() and one.name != "plan.toml"}


@pytest.fixture
def inputs(tmp_path):
    (tmp_path / "scene.toml").write_text(SCENE)
    (tmp_path / "spec.toml").write_text(SPEC)
    alone = md.dataset(tmp_path / "spec.toml", tmp_path / "alone")
    alone.run()
    return tmp_path


@pytest.fixture
def cluster():
    three = cluster_utils.Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    nodes = [three.add_node(num_cpus=1) for _ in range(2)]
    ray.init(address=three.address, log_to_driver=False)
    yield three, nodes
    ray.shutdown()
    three.shutdown()


@pytest.mark.parametrize("shared", [False, True])
def test_a_node_that_dies_changes_no_byte(inputs, cluster, shared):
    three, nodes = cluster
    dataset = md.dataset(inputs / "spec.toml", inputs / "on-ray")
    removed = []

    def progress(done, of):
        if done >= of // 3 and not removed:
            removed.append(nodes[0])
            three.remove_node(nodes[0], allow_graceful=False)

    said = dataset.run(ray="auto", shared=shared, progress=progress)
    assert removed and said["missing"] == 0
    # In a shared folder a lost task may have made its shard.
    assert said["scans"] == 300 or (shared and said["scans"] < 300)
    assert dataset.check()["complete"]
    assert made(inputs / "on-ray") == made(inputs / "alone")
    # A second call has nothing to do.
    assert dataset.run(ray="auto", shared=shared)["shards"] == 0


def test_a_driver_that_dies_is_started_again(inputs, cluster):
    three, _ = cluster
    md.dataset(inputs / "spec.toml", inputs / "on-ray")
    code = (
        "import os, ray, matdb as md\n"
        f"ray.init(address={three.address!r}, log_to_driver=False)\n"
        "md.dataset('on-ray').run(ray='auto', progress=lambda done, of: os._exit(3) if done == 5 else None)\n"
    )
    ended = subprocess.run(["python", "-c", code], cwd=inputs)
    assert ended.returncode == 3
    dataset = md.dataset(inputs / "on-ray")
    assert 0 < len(dataset.missing()) < dataset.shards
    dataset.run(ray="auto")
    assert made(inputs / "on-ray") == made(inputs / "alone")
