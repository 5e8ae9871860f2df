"""Seven targets as meshes about their own middle, and the motions that leave each surface in itself."""

import numpy as np

from motions import direction, turn

UNIT = np.eye(3)


class Target:
    """A surface in its own frame.

    `grid(step_m)` gives the points of a curved surface as rows of rings, `corners` and `faces` a flat one. `turns` and
    `shifts` are the axes, through the origin, about and along which the surface does not change. `rotation` is how it
    is thought to stand, `field_m` the width and height that are scanned.
    """

    def __init__(self, field_m, rotation=UNIT, turns=(), shifts=(), grid=None, corners=None, faces=None):
        self.field_m, self.rotation = field_m, rotation
        self.turns, self.shifts = np.reshape(turns, (-1, 3)), np.reshape(shifts, (-1, 3))
        self.grid, self.corners, self.faces = grid, corners, faces

    def mesh(self, step_m):
        """Vertices and triangles, whose sides are about a step where the surface is curved."""
        if self.grid is None:
            a, b, c, d = np.transpose(self.faces)
            return np.array(self.corners, float), np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
        points = self.grid(step_m)
        index = np.arange(points[..., 0].size).reshape(points.shape[:2])
        a, b = index[:-1].ravel(), index[1:].ravel()
        c, d = np.roll(index, -1, 1)[1:].ravel(), np.roll(index, -1, 1)[:-1].ravel()
        return points.reshape(-1, 3), np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def star(radius, largest_m):
    """A surface by its radius in each direction, in rings about the y axis."""

    def grid(step_m):
        polar = np.linspace(1e-6, np.pi - 1e-6, int(np.pi * largest_m / step_m))[:, None]
        azimuth = np.linspace(0, 2 * np.pi, int(2 * np.pi * largest_m / step_m), endpoint=False)[None]
        x, y, z = np.sin(polar) * np.sin(azimuth), np.cos(polar), np.sin(polar) * np.cos(azimuth)
        u = np.stack(np.broadcast_arrays(x, y, z), -1)
        return radius(u)[..., None] * u

    return grid


def sphere(rng):
    r = rng.uniform(0.12, 0.16)
    return Target([2 * r + 0.1] * 2, turns=UNIT, grid=star(lambda u: r + 0 * u[..., 0], r))


def cylinder(rng):
    """Its ends are out of view, and its axis lies across the line of sight."""
    r = rng.uniform(0.06, 0.1)

    def grid(step_m):
        azimuth = np.linspace(0, 2 * np.pi, int(2 * np.pi * r / step_m), endpoint=False)
        x, z = r * np.sin(azimuth), r * np.cos(azimuth)
        return np.stack([np.stack([x, y + 0 * x, z], 1) for y in (-0.6, 0.6)])

    return Target([2 * r + 0.15, 0.35], turn([0, 0, 1], rng.uniform(-15, 15)), [[0, 1, 0]], [[0, 1, 0]], grid)


def spheroid(rng):
    """Long or flat; its axis is within 50° of upright."""
    across, along = [(0.09, 0.2), (0.19, 0.09)][rng.integers(2)] * rng.uniform(0.9, 1.1, 2)
    radius = lambda u: 1 / np.sqrt((u[..., 0] ** 2 + u[..., 2] ** 2) / across**2 + u[..., 1] ** 2 / along**2)
    tilt = turn(direction(rng), rng.uniform(10, 50))
    return Target([2 * max(across, along) + 0.06] * 2, tilt, turns=[[0, 1, 0]], grid=star(radius, max(across, along)))


def plate(rng):
    """Its edges are out of view."""
    corners = [[x, y, 0] for x, y in ((-0.6, -0.6), (0.6, -0.6), (0.6, 0.6), (-0.6, 0.6))]
    tilt = turn([*direction(rng)[:2], 0], rng.uniform(5, 35))
    return Target([0.35, 0.35], tilt, UNIT[2], UNIT[:2], corners=corners, faces=[[0, 1, 2, 3]])


def corner(rng):
    """Three squares that meet at right angles, seen from inside."""
    side = rng.uniform(0.18, 0.26)
    corners = [[x, y, z] for x in (0, side) for y in (0, side) for z in (0, side)]
    # The diagonal of the cube towards the radar, and the middle of the squares at the origin.
    to_radar = turn([1, -1, 0], np.degrees(np.arccos(np.sqrt(1 / 3))))
    rotation = turn(direction(rng), rng.uniform(0, 15)) @ turn([0, 0, 1], rng.uniform(-180, 180)) @ to_radar
    faces = [[0, 4, 6, 2], [0, 1, 5, 4], [0, 2, 3, 1]]
    return Target([0.5, 0.5], rotation, corners=np.array(corners) - side / 3, faces=faces)


def box(rng):
    """Three of its faces are seen."""
    unit = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    sides = rng.uniform(0.16, 0.28, 3)
    tilt = turn([1, 0, 0], rng.uniform(25, 40) * rng.choice([-1, 1])) @ turn([0, 1, 0], rng.uniform(30, 60))
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return Target([0.5, 0.5], tilt, corners=unit * sides, faces=faces)


def torso(rng):
    """A rounded block with eight bumps, no two alike, most of them towards the radar."""
    half, power = np.array([0.17, 0.25, 0.11]) * rng.uniform(0.9, 1.1, 3), rng.uniform(2.2, 2.8)
    at = np.array([direction(rng) + [0, 0, 0.6] for _ in range(8)])
    at /= np.linalg.norm(at, axis=1, keepdims=True)
    height, width = rng.uniform(0.04, 0.14, 8), rng.uniform(0.25, 0.5, 8)

    def radius(u):
        block = (np.abs(u / half) ** power).sum(-1) ** (-1 / power)
        return block * (1 + sum(h * np.exp((u @ a - 1) / w**2) for a, h, w in zip(at, height, width)))

    return Target([0.55, 0.7], turn([0, 1, 0], rng.uniform(-20, 20)), grid=star(radius, 0.25))


ALL = {"sphere": sphere, "cylinder": cylinder, "spheroid": spheroid, "plate": plate, "corner": corner, "box": box,
       "torso": torso}
