"""Meshes and rays that all tracers get, as files in a folder."""

import subprocess
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from files import NONE, read_hits, read_mesh, read_rays, write_mesh, write_rays
from programs import example

ORIGIN_M = np.array([0.0, 1.1, 8.0])
HALF_M = 0.55
LIFT_M = 1e-3


@dataclass
class Workload:
    """One mesh and one set of rays."""

    key: str
    mesh: str
    """`body`, or the number of facets of a ball."""
    rays: str | int
    """`paper`, `second` or the number of rays."""
    turns: int
    seconds: float
    threads: list = field(default_factory=lambda: [1, 2])
    robust: bool = False
    warm_up_s: float = 0
    """Uncounted before each turn, for work so short that waking threads would be most of it."""

    @property
    def is_coherent(self):
        return self.rays != "second"


FULL = [
    Workload("paper", "body", "paper", 41, 45, robust=True, warm_up_s=0.04),
    Workload("body", "body", 10**6, 11, 15, robust=True),
    Workload("second bounce", "body", "second", 7, 15),
    Workload("facets 3", 10**3, 10**6, 7, 8),
    Workload("facets 4", 10**4, 10**6, 7, 8),
    Workload("facets 5", 10**5, 10**6, 7, 8),
    Workload("facets 6", 10**6, 10**6, 11, 60, robust=True),
    Workload("facets 7", 10**7, 10**5, 2, 20),
    Workload("rays 4", 10**6, 10**4, 7, 10),
    Workload("rays 5", 10**6, 10**5, 7, 10),
    Workload("rays 7", 10**6, 10**7, 5, 30),
]

QUICK = [
    Workload("paper", "body", "paper", 3, 5, robust=True, warm_up_s=0.04),
    Workload("body", "body", 10**5, 3, 5),
    Workload("second bounce", "body", "second", 3, 5),
    Workload("facets 4", 10**4, 10**4, 3, 5, threads=[2]),
]


def ball(facets):
    """A ball of bumps, so that parts of it hide others; open at the poles by less than is seen."""
    rows = max(2, round((facets / 4) ** 0.5))
    columns = facets // (2 * rows)
    theta = np.linspace(1e-3, np.pi - 1e-3, rows + 1)[:, None]
    phi = np.arange(columns)[None, :] * (2 * np.pi / columns)
    radius = 0.5 * (1 + 0.06 * np.sin(9 * theta) * np.sin(12 * phi))
    parts = radius * np.sin(theta) * np.cos(phi), radius * np.cos(theta) + 1.1, radius * np.sin(theta) * np.sin(phi)
    vertices = np.stack(parts, -1).reshape(-1, 3)
    row, column = np.divmod(np.arange(rows * columns), columns)
    beside = (column + 1) % columns
    a, b = row * columns + column, row * columns + beside
    c, d = a + columns, b + columns
    return vertices, np.stack([np.stack([a, b, d], -1), np.stack([a, d, c], -1)], 1).reshape(-1, 3)


def square(count):
    """Rays from one origin to a square grid of points, row after row."""
    side = round(count**0.5)
    at = HALF_M * (2 * (np.arange(side) + 0.5) / side - 1)
    through = np.zeros((side, side, 3))
    through[..., 0], through[..., 1] = at[None, :], 1.1 + at[:, None]
    along = through.reshape(-1, 3) - ORIGIN_M
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    return np.hstack([np.broadcast_to(ORIGIN_M, along.shape), along])


def mirrored(vertices, facets, rays, hits):
    """Where rays go on that a mesh reflects like a mirror; they start a little above it."""
    met, ranges_m = hits
    hit = met != NONE
    origins, along = rays[hit, :3], rays[hit, 3:]
    a, b, c = (vertices[facets[met[hit], corner]] for corner in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    against = (along * normal).sum(1, keepdims=True)
    normal *= -np.sign(against)
    points = origins + ranges_m[hit, None] * along + LIFT_M * normal
    along = along + 2 * np.abs(against) * normal
    return np.hstack([points, along / np.linalg.norm(along, axis=1, keepdims=True)])


def order(rays):
    """Rays of one origin along a Z-shaped curve over the picture, which suits packets."""
    axis = rays[:, 3:].mean(0)
    axis /= np.linalg.norm(axis)
    right = np.cross(axis, [0.3, 1.0, 0.2])
    right /= np.linalg.norm(right)
    basis = np.stack([right, np.cross(axis, right), axis])
    u, v, w = (rays[:, 3:] @ basis.T).T
    code = np.zeros(len(rays), np.uint64)
    for shift, part in enumerate((u / w, v / w)):
        width = max(part.max() - part.min(), 1e-12)
        step = ((part - part.min()) / width * 65535).astype(np.uint64)
        for bit in range(16):
            code |= ((step >> np.uint64(bit)) & np.uint64(1)) << np.uint64(2 * bit + shift)
    return np.argsort(code, kind="stable")


class Files:
    """The files of a workload in a folder that is made once for all of them."""

    def __init__(self, folder, workload):
        self.folder = Path(folder)
        self.mesh = self.folder / f"{workload.mesh}.mesh"
        self.rays = self.folder / f"{workload.mesh}-{workload.rays}.rays"
        self.sorted = self.folder / "sorted.rays"
        if not self.mesh.exists():
            self._write_mesh(workload.mesh)
        if not self.rays.exists():
            self._write_rays(workload.rays)
        vertices, facets = read_mesh(self.mesh)
        self.vertices, self.facets = len(vertices), len(facets)
        rays = read_rays(self.rays)
        self.count = len(rays)
        self.order = order(rays) if workload.is_coherent else np.arange(len(rays))
        write_rays(self.sorted, rays[self.order])

    @property
    def mesh_mb(self):
        """Of the mesh in matdb's memory: three 64-bit floats a vertex, three 32-bit integers a facet."""
        return (24 * self.vertices + 12 * self.facets) / 1e6

    def hits(self, name):
        return self.folder / f"{name}.hits"

    def _write_mesh(self, mesh):
        if mesh == "body":
            subprocess.run(example("trace_speed", "write", self.mesh, self._paper()), check=True)
        else:
            write_mesh(self.mesh, *ball(mesh))

    def _write_rays(self, rays):
        if rays == "second":
            first = square(10**6)
            write_rays(self.rays, first)
            hits = self.hits("first")
            command = example("trace_speed", "pinhole", self.mesh, self.rays, hits)
            subprocess.run(command, check=True, input=b"\n", stdout=subprocess.DEVNULL)
            write_rays(self.rays, mirrored(*read_mesh(self.mesh), first, read_hits(hits, len(first))))
        elif rays != "paper":
            write_rays(self.rays, square(rays))

    def _paper(self):
        return self.folder / "body-paper.rays"
