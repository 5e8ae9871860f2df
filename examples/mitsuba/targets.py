"""Targets: shapes that Mitsuba has, and meshes of our own, all in the global frame (m, y up)."""

import numpy as np

CENTRE = np.array([0.0, 1.1, 0.0])  # the scan's centre, which is the radar's secondary focus


def rotation(deg):
    """Rotation about the fixed axes x, then y, then z."""
    a, b, c = np.radians(deg)
    x = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    y = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    z = np.array([[np.cos(c), -np.sin(c), 0], [np.sin(c), np.cos(c), 0], [0, 0, 1]])
    return z @ y @ x


def grid_faces(rows, columns, offset=0):
    """Two triangles for each cell of a grid of rows x columns vertices."""
    i = np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)[None, :] + offset
    a, b, c, d = i, i + 1, i + columns, i + columns + 1
    return np.concatenate([np.stack([a, c, b], -1).reshape(-1, 3), np.stack([b, c, d], -1).reshape(-1, 3)])


def cap_mesh(centre, radius, fine=0.003, coarse=0.005, azimuths=360):
    """Front half of a sphere, in rings about +z: fine where a narrow lobe needs it, and everywhere within a few hundredths of
    a millimetre of the sphere, which thousands of ranges tell."""
    ring = np.concatenate([np.arange(1e-4, 0.45, fine), np.arange(0.45, 1.62, coarse)])
    phi = np.linspace(0, 2 * np.pi, azimuths + 1)
    t, p = np.meshgrid(ring, phi, indexing="ij")
    v = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], -1).reshape(-1, 3)
    # A little outside, so that the facets are on the sphere in the mean.
    wide = np.where(t < 0.45, fine, coarse)
    out = 1 + (wide**2 + (np.sin(t) * phi[1]) ** 2) / 12
    return centre + radius * out.reshape(-1, 1) * v, grid_faces(len(ring), len(phi))


def tube_mesh(p0, p1, radius, step=0.0025):
    """The side of a cylinder from p0 to p1."""
    axis = (p1 - p0) / np.linalg.norm(p1 - p0)
    front = np.array([0, 0, 1.0]) - axis * axis[2]
    front /= np.linalg.norm(front)
    side = np.cross(axis, front)
    phi = np.linspace(-np.pi, np.pi, int(2 * np.pi / step))  # open at both ends, as Mitsuba's is: rays meet its inside
    ring = radius * (np.cos(phi)[:, None] * front + np.sin(phi)[:, None] * side)
    return np.concatenate([p0 + ring, p1 + ring]), grid_faces(2, len(phi))


def cube_mesh(centre, half, deg):
    """A box of half sides `half`, turned."""
    corner = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    return centre + (corner * half) @ rotation(deg).T, np.array(faces)


def ellipsoid_mesh(centre, half, deg, n=72):
    t, p = np.meshgrid(np.linspace(1e-3, np.pi - 1e-3, n), np.linspace(0, 2 * np.pi, 2 * n + 1), indexing="ij")
    v = np.stack([np.sin(t) * np.sin(p), np.cos(t), np.sin(t) * np.cos(p)], -1).reshape(-1, 3)
    return centre + (v * half) @ rotation(deg).T, grid_faces(n, 2 * n + 1)


def merge(parts):
    """One mesh of several, and the part of each face."""
    vertices, faces, part, start = [], [], [], 0
    for number, (v, f) in enumerate(parts):
        vertices.append(v)
        faces.append(f + start)
        part.append(np.full(len(f), number))
        start += len(v)
    return np.concatenate(vertices), np.concatenate(faces), np.concatenate(part)


def body():
    """A figure of seven ellipsoids."""
    parts = [
        ((0, 1.12, -0.06), (0.165, 0.30, 0.115), (4, 0, 0)),
        ((0, 1.47, -0.05), (0.075, 0.11, 0.095), (0, 10, 0)),
        ((-0.205, 1.12, -0.07), (0.042, 0.25, 0.05), (0, 0, -5)),
        ((0.215, 1.14, -0.04), (0.042, 0.25, 0.05), (-8, 0, 7)),
        ((0, 0.86, -0.06), (0.175, 0.15, 0.12), (0, 0, 0)),
        ((-0.085, 0.66, -0.05), (0.075, 0.26, 0.08), (0, 0, 0)),
        ((0.085, 0.66, -0.05), (0.075, 0.26, 0.08), (5, 0, 0)),
    ]
    return [ellipsoid_mesh(np.array(c), np.array(h), d) for c, h, d in parts]


def groove():
    """A panel: flat, a groove of two flanks at 45 degrees, flat, and a round rib; extruded along y, turned."""
    pieces = [
        np.array([[-0.30, 0.0], [-0.12, 0.0]]),
        np.array([[-0.12, 0.0], [-0.06, -0.06]]),
        np.array([[-0.06, -0.06], [0.0, 0.0]]),
        np.array([[0.0, 0.0], [0.04, 0.0]]),
    ]
    phi = np.arange(-1.35, 1.3501, 0.0025)
    rib = np.stack([0.15 + 0.11 * np.sin(phi) / np.sin(1.35), 0.11 * (np.cos(phi) - np.cos(1.35)) / np.sin(1.35)], -1)
    pieces += [rib, np.array([[0.26, 0.0], [0.40, 0.0]])]
    turn = rotation((-6, 9, 0))
    parts = []
    for p in pieces:
        rows = [np.stack([p[:, 0], np.full(len(p), y), p[:, 1]], -1) for y in (-0.42, 0.42)]
        parts.append((CENTRE + np.concatenate(rows) @ turn.T, grid_faces(2, len(p))))
    return parts


def vase():
    """A surface of revolution with a waist, leaning a little to the front."""
    y = np.arange(-0.40, 0.4001, 0.0025)
    r = 0.17 + 0.045 * np.sin(2 * np.pi * (y + 0.1) / 0.62)
    p = np.arange(-1.75, 1.75, 0.008)
    v = np.stack([r[:, None] * np.sin(p), np.repeat(y[:, None], len(p), 1), r[:, None] * np.cos(p)], -1)
    v = CENTRE + np.array([0, 0, -0.12]) + v.reshape(-1, 3) @ rotation((14, 0, 5)).T
    return [(v, grid_faces(len(y), len(p)))]


TILT = rotation((0, 0, 7)) @ np.array([0, 1.0, 0]) + np.array([0, 0, 0.18])
TILT /= np.linalg.norm(TILT)
BALL = (CENTRE + np.array([0.02, 0.0, -0.22]), 0.30)
TUBE = (CENTRE + np.array([0.0, 0, -0.16]) - 0.42 * TILT, CENTRE + np.array([0.0, 0, -0.16]) + 0.42 * TILT, 0.19)
BOX = (CENTRE + np.array([0.0, 0.22, -0.14]), np.array([0.13, 0.13, 0.13]), (24, 37, 0))
UNDER = (CENTRE + np.array([0.0, -0.21, -0.14]), 0.19)

# The mesh that the user has of each target.
MESHES = {
    "sphere": lambda: [cap_mesh(*BALL)],
    "cylinder": lambda: [tube_mesh(*TUBE)],
    "box": lambda: [cube_mesh(*BOX), cap_mesh(*UNDER)],
    "body": body,
    "groove": groove,
    "vase": vase,
}


def ply(vertices, faces):
    """Binary PLY of triangles."""
    head = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(vertices)}\nproperty double x\nproperty double y\nproperty double z\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    record = np.zeros(len(faces), dtype=[("n", "u1"), ("v", "<i4", 3)])
    record["n"], record["v"] = 3, faces
    return head.encode() + np.asarray(vertices, "<f8").tobytes() + record.tobytes()


def write_ply(path, vertices, faces):
    with open(path, "wb") as file:
        file.write(ply(vertices, faces))


# Share of the diffuse part, lobes as (weight, kind, m, reflectance), reflectance of the diffuse part. What the
# laboratory knows of its material: the numbers that were given to Mitsuba, where the law has such numbers.
MATERIALS = {
    "sphere": dict(kind="blend", distribution="beckmann", m=0.08, f=0.06, k=0.10, r=0.012, footprint="projected"),
    "cylinder": dict(kind="blend", distribution="ggx", m=0.10, f=0.05, k=0.15, r=0.008, footprint="projected"),
    "box": dict(kind="blend", distribution="beckmann", m=0.12, f=0.10, k=0.20, r=0.006, footprint="paper"),
    # eta = 1.5: Mitsuba's own Fresnel and its transmitted diffuse part, which no number below states exactly
    "body": dict(kind="plastic", distribution="beckmann", m=0.16, eta=1.5, r=0.0016, f=0.04, k=0.5, footprint="projected"),
    "groove": dict(kind="blend", distribution="ggx", m=0.14, f=0.08, k=0.15, r=0.014, footprint="paper"),
    "vase": dict(kind="blend", distribution="ggx", m=0.45, f=0.04, k=0.20, r=0.002, footprint="projected"),
}
