"""A data set on a Ray cluster is made whole though a node is cut off from the network.

Three Ray nodes run in network namespaces of their own, joined by a bridge in a fourth. Skipped where Ray is not installed, where the
user is not root, and where namespaces cannot be made.
"""

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path

import pytest

import matdb as md

pytest.importorskip("ray")
from test_ray import inputs, made  # noqa: E402, F401

LIMIT_S = 300
"""For all of the test. The cleaning afterwards takes a few seconds."""

ADDRESSES = {"head": "10.77.0.1", "cut": "10.77.0.2", "kept": "10.77.0.3"}

# A link that is cut closes no connection: what is sent gets no answer. The head gives a node up when some checks in a row have failed.
# The driver gives up the task there when its connection has not answered a ping. With Ray's own settings that takes minutes. With these
# it takes seconds, and a busy machine still has time to answer. The node that is cut off ends itself later, here after the test.
SETTINGS = {
    "RAY_health_check_initial_delay_ms": "1000",
    "RAY_health_check_period_ms": "1000",
    "RAY_health_check_timeout_ms": "2000",
    "RAY_health_check_failure_threshold": "4",
    "RAY_grpc_client_keepalive_time_ms": "5000",
    "RAY_grpc_client_keepalive_timeout_ms": "10000",
    "RAY_gcs_rpc_server_reconnect_timeout_s": str(2 * LIMIT_S),
    # On a busy machine workers of a niceness of 15, as Ray's are, hardly run.
    "RAY_worker_niceness": "0",
    "RAY_USAGE_STATS_ENABLED": "0",
    "PYTHONUNBUFFERED": "1",
}

# What a worker runs: its place of the data set's folder is an empty one of its own.
HIDDEN = 'mount -t tmpfs none "$1" && cd "$1" && shift && exec "$@"'

DRIVER = """
import json, sys, time
import ray, matdb as md

made = md.dataset("spec.toml", "on-ray").run(ray=sys.argv[1])
said = {"made": made, "ended": time.time(), "alive": {node["NodeManagerAddress"]: node["Alive"] for node in ray.nodes()}}
with open("said.json", "w") as file:
    json.dump(said, file)
"""


def ip(*words):
    subprocess.run(["ip", *words], capture_output=True, text=True, timeout=60, check=True)


def processes(space):
    """The processes in a namespace. There are none if it does not exist."""
    ended = subprocess.run(["ip", "netns", "pids", space], capture_output=True, text=True, timeout=60)
    return [int(pid) for pid in ended.stdout.split()]


def at_work(space):
    """Whether a worker of Ray in a namespace is making a shard."""
    for pid in processes(space):
        with suppress(OSError):
            if b"_of_nothing_shared" in Path(f"/proc/{pid}/cmdline").read_bytes():
                return True
    return False


class Nodes:
    """Namespaces, and the processes started in them."""

    def __init__(self, folder, logs):
        self.folder, self.logs = folder, logs
        self.started, self.until = {}, time.monotonic() + LIMIT_S
        self.spaces = {name: f"matdb-{os.getpid()}-{name}" for name in ["bridge", *ADDRESSES]}

    def join(self):
        bridge = self.spaces["bridge"]
        ip("netns", "add", bridge)
        ip("-n", bridge, "link", "add", "bridge", "type", "bridge")
        ip("-n", bridge, "link", "set", "bridge", "up")
        for name, address in ADDRESSES.items():
            space = self.spaces[name]
            ip("netns", "add", space)
            ip("link", "add", "eth0", "netns", space, "type", "veth", "peer", "name", name, "netns", bridge)
            ip("-n", bridge, "link", "set", name, "master", "bridge", "up")
            ip("-n", space, "address", "add", f"{address}/24", "dev", "eth0")
            ip("-n", space, "link", "set", "eth0", "up")
            ip("-n", space, "link", "set", "lo", "up")
        # Also tries what a worker needs: a mount that only the process and its children see.
        ip("netns", "exec", space, "sh", "-c", HIDDEN, "sh", str(self.folder), "true")

    def start(self, name, space, command):
        """Starts a command in a namespace, as the leader of a process group."""
        settings = {key: value for key, value in os.environ.items() if not key.startswith("RAY_")}
        with open(self.logs / f"{name}.log", "wb") as log:
            self.started[name] = subprocess.Popen(
                ["ip", "netns", "exec", self.spaces[space], *command],
                cwd=self.folder,
                env=settings | SETTINGS | {"TMPDIR": str(self.logs)},
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                start_new_session=True,
            )
        return self.started[name]

    def start_ray(self, name):
        """Starts the node of Ray in a namespace."""
        command = [sys.executable, "-m", "ray.scripts.scripts", "start", "--block", "--num-cpus=1", f"--temp-dir={self.logs / name}"]
        command += [f"--node-ip-address={ADDRESSES[name]}", "--object-store-memory=100000000"]
        if name == "head":
            command += ["--head", "--port=6379", "--include-dashboard=false"]
        else:
            command = ["sh", "-c", HIDDEN, "sh", str(self.folder), *command, f"--address={ADDRESSES['head']}:6379"]
        self.start(name, name, command)
        self.wait(name, lambda: "Ray runtime started" in self.log(name))

    def log(self, name):
        return (self.logs / f"{name}.log").read_text(errors="replace")

    def wait(self, name, reached):
        """Waits until something is reached. Fails if a process ends before it, or at the limit."""
        while not reached():
            if (code := self.started[name].poll()) is not None or time.monotonic() > self.until:
                pytest.fail(f"{name}, code {code}:\n{self.log(name)}")
            time.sleep(0.05)

    def end(self):
        for one in self.started.values():
            # A leader that has not been waited for still has its number.
            if one.returncode is None:
                os.killpg(one.pid, signal.SIGKILL)
        for space in self.spaces.values():
            # What Ray has put into other groups is in the namespace too, and nothing else is.
            for _ in range(100):
                if not (left := processes(space)):
                    break
                for pid in left:
                    with suppress(ProcessLookupError):
                        os.kill(pid, signal.SIGKILL)
                time.sleep(0.1)
            subprocess.run(["ip", "netns", "delete", space], capture_output=True, timeout=60)
        for one in self.started.values():
            one.wait(60)


@pytest.fixture
def nodes(inputs):  # noqa: F811
    if os.geteuid() != 0:
        pytest.skip("network namespaces need root")
    if shutil.which("ip") is None:
        pytest.skip("network namespaces need `ip` of iproute2")
    # The path of a socket must be short, which those of pytest are not.
    with tempfile.TemporaryDirectory(prefix="matdb-", dir="/tmp", ignore_cleanup_errors=True) as logs:
        three = Nodes(inputs, Path(logs))
        try:
            try:
                three.join()
            except subprocess.CalledProcessError as error:
                pytest.skip(f"no network namespaces: {' '.join(error.cmd)}: {error.stderr.strip()}")
            for name in ADDRESSES:
                three.start_ray(name)
            yield three
        finally:
            three.end()


def test_a_node_that_is_cut_off_changes_no_byte(inputs, nodes):  # noqa: F811
    manifests = inputs / "on-ray/manifests"
    shards = len(list((inputs / "alone/manifests").iterdir()))
    driver = nodes.start("driver", "head", [sys.executable, "-c", DRIVER, f"{ADDRESSES['head']}:6379"])
    # Shards have come in, and the node is making one.
    nodes.wait("driver", lambda: len(list(manifests.glob("*.json"))) >= 5 and at_work(nodes.spaces["cut"]))
    ip("-n", nodes.spaces["bridge"], "link", "set", "cut", "down")
    cut, before = time.time(), len(list(manifests.glob("*.json")))
    assert before < shards
    nodes.wait("driver", lambda: driver.poll() is not None)
    assert driver.returncode == 0, nodes.log("driver")
    said = json.loads((inputs / "said.json").read_text())
    print(f"{shards} shards, {before} before the cut; {said['ended'] - cut:.1f} s after it")
    # The node lives, but the cluster has given it up.
    assert nodes.started["cut"].poll() is None and processes(nodes.spaces["cut"])
    assert said["alive"] == {address: name != "cut" for name, address in ADDRESSES.items()}
    assert said["made"]["missing"] == 0
    assert md.dataset(inputs / "on-ray").check()["complete"]
    assert made(inputs / "on-ray") == made(inputs / "alone")
