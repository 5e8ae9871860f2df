"""Meshes, rays and hits as all tracers read and write them; see examples/trace_speed/files.rs."""

import numpy as np

NONE = 2**32 - 1


def write_mesh(path, vertices, facets):
    with open(path, "wb") as file:
        np.array([len(vertices), len(facets)], "<u8").tofile(file)
        vertices.astype("<f8").tofile(file)
        facets.astype("<u4").tofile(file)


def read_mesh(path):
    """Vertices as rows of 64-bit floats, facets as rows of 32-bit integers."""
    with open(path, "rb") as file:
        vertices, facets = np.fromfile(file, "<u8", 2)
        return (
            np.fromfile(file, "<f8", 3 * int(vertices)).reshape(-1, 3),
            np.fromfile(file, "<u4", 3 * int(facets)).reshape(-1, 3),
        )


def write_rays(path, rays):
    with open(path, "wb") as file:
        np.array([len(rays)], "<u8").tofile(file)
        rays.astype("<f8").tofile(file)


def read_rays(path):
    """Rows of origin and direction."""
    with open(path, "rb") as file:
        count = int(np.fromfile(file, "<u8", 1)[0])
        return np.fromfile(file, "<f8", 6 * count).reshape(-1, 6)


def write_hits(path, facets, ranges_m):
    with open(path, "wb") as file:
        facets.astype("<u4").tofile(file)
        ranges_m.astype("<f8").tofile(file)


def read_hits(path, rays):
    with open(path, "rb") as file:
        return np.fromfile(file, "<u4", rays), np.fromfile(file, "<f8", rays)
