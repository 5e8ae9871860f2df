#!/usr/bin/env python3
"""Writes files of meshes and clouds with the peers' own libraries, and what a reader must find in them.

    python3 -m venv venv && venv/bin/pip install -r tests/peers/corpus/requirements.txt
    python3 -m venv blender && blender/bin/pip install -r tests/peers/corpus/requirements-blender.txt
    venv/bin/python tests/peers/corpus/make.py blender/bin/python

On Debian, Open3D needs the package libusb-1.0-0. The files go to `files/` next to this script, and what they hold to
`oracle.json`. matdb is not used: the oracle is what was given to each library. Each file is read back with another
library where there is one, and the script ends with an error where that finds something else. The same versions write
the same bytes.
"""

import datetime
import io
import json
import math
import os
import shutil
import struct
import subprocess
import sys
import tempfile
import warnings
from importlib import metadata
from pathlib import Path

import laspy
import meshio
import numpy as np
import open3d
import pandas
import plyfile
import pymeshlab
import pypcd4
import trimesh
import vtk
from stl import mesh as numpy_stl
from vtk.util import numpy_support

import igl

HERE = Path(__file__).parent
FILES = HERE / "files"

# Half a step of single precision below 2 m, and a little.
SINGLE = 1.3e-7
# The last digit of a double that was printed in full.
DOUBLE = 1e-14
# Six significant digits below 10 m of single precision, as C++ streams write them.
SIX_DIGITS = 5.3e-6
# Nothing below this is told apart in an area, m².
AREA = 1e-5


class FixedTime(datetime.datetime):
    """The time that writers put into their files."""

    @classmethod
    def now(cls, tz=None):
        return cls(2026, 1, 1)


# ---- geometry


def shifted(points, x):
    return [[a + x, b, c] for a, b, c in points]


def geometries():
    """Vertices, and polygons that run anticlockwise seen from outside."""
    tetra = [[0.1234567, 0.2, 0.3000001], [1.7, -0.4142136, 0.25], [0.55, 1.4512345, -0.35], [0.6, 0.35, 1.9]]
    tetra_faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
    x0, x1, y0, y1, z0, z1, z2 = -0.9, 1.1, -0.7, 0.8333333, 0.1, 1.2, 1.8
    box = [[x, y, z] for z in (z0, z1) for y in (y0, y1) for x in (x0, x1)]
    floor, left, right = [0, 2, 3, 1], [0, 4, 6, 2], [1, 3, 7, 5]
    hut = box + [[0.1, 0.05, z2]]
    hut_faces = [floor, left, right, [0, 1, 5, 4], [2, 6, 7, 3], [4, 5, 8], [5, 7, 8], [7, 6, 8], [6, 4, 8]]
    # Its ridge runs along x, so that the gables have five corners.
    house = box + [[x0, 0.05, z2], [x1, 0.05, z2]]
    house_faces = [floor, [0, 4, 8, 6, 2], [1, 3, 7, 9, 5], [0, 1, 5, 4], [2, 6, 7, 3], [4, 5, 9, 8], [7, 6, 8, 9]]
    ribbon = [[0.25 * i, 0.3 * (i % 2), 0.1 * math.sin(i)] for i in range(8)]
    ribbon_faces = [[i, i + 1, i + 2] if i % 2 == 0 else [i + 1, i, i + 2] for i in range(6)]
    pair = tetra + shifted(tetra, -1.9)
    pair_faces = tetra_faces + [[i + 4 for i in face] for face in tetra_faces]
    # Many vertices, more than 8 bits number.
    side = 17
    sheet = [
        [0.1 * i, 0.1 * j, round(0.2 * math.sin(0.5 * i) * math.cos(0.4 * j), 9)]
        for j in range(side)
        for i in range(side)
    ]
    sheet_faces = []
    for j in range(0, side - 1, 4):
        for i in range(0, side - 1, 4):
            n = j * side + i
            sheet_faces += [[n, n + 4, n + 4 + 4 * side], [n, n + 4 + 4 * side, n + 4 * side]]
    return {
        "tetra": (tetra, tetra_faces),
        "hut": (hut, hut_faces),
        "house": (house, house_faces),
        "ribbon": (ribbon, ribbon_faces),
        "pair": (pair, pair_faces),
        "sheet": (sheet, sheet_faces),
    }


GEOMETRIES = geometries()


def vertices(name, kind=np.float64):
    return np.array(GEOMETRIES[name][0], dtype=kind)


def faces(name):
    return GEOMETRIES[name][1]


def fans(polygons):
    """Polygons as triangles round their first corners."""
    return [[p[0], p[i], p[i + 1]] for p in polygons for i in range(1, len(p) - 1)]


def triangles(name, kind=np.int32):
    return np.array(fans(faces(name)), dtype=kind)


def area(points, polygon):
    """The area of a polygon times its normal."""
    p = [np.array(points[i]) for i in polygon]
    return 0.5 * sum(np.cross(p[i] - p[0], p[i + 1] - p[0]) for i in range(1, len(p) - 1))


def uv(name):
    return np.array([[round(0.1 + 0.37 * x % 1, 4), round(0.2 + 0.41 * y % 1, 4)] for x, y, _ in GEOMETRIES[name][0]])


def normals(name):
    """A vector of length 1 for each vertex, away from the middle."""
    away = vertices(name) - vertices(name).mean(axis=0)
    return away / np.linalg.norm(away, axis=1)[:, None]


def colours(name):
    return np.array([[40 * i % 256, 90, 255 - 30 * i % 256] for i in range(len(vertices(name)))], dtype=np.uint8)


# ---- clouds


def cloud():
    """Points of a curved patch, 2.5 m away."""
    count = 14
    angles = [(0.11 * (i % 5) - 0.2, 0.13 * (i // 5) - 0.15) for i in range(count)]
    ranges = [round(2.5 + 0.031 * math.sin(1.7 * i), 6) for i in range(count)]
    points = [
        [
            round(r * math.sin(a) * math.cos(e), 6),
            round(r * math.sin(e) + 0.9, 6),
            round(-r * math.cos(a) * math.cos(e), 6),
        ]
        for (a, e), r in zip(angles, ranges)
    ]
    power_dbm = [round(-58.5 - 0.83 * i + 1.9 * math.cos(2.3 * i), 3) for i in range(count)]
    return {
        "x": [p[0] for p in points],
        "y": [p[1] for p in points],
        "z": [p[2] for p in points],
        "range_m": ranges,
        "chirp": [3 * i + i % 2 for i in range(count)],
        "power_dbm": power_dbm,
        "power_w": [float(f"{10 ** (0.1 * p - 3):.9g}") for p in power_dbm],
        "power_db": [round(p + 90, 3) for p in power_dbm],
        "counts": [round(10 ** (0.1 * (p + 55)) * 60000) for p in power_dbm],
        "red": [40 + 9 * i for i in range(count)],
    }


CLOUD = cloud()
ALL = list(range(len(CLOUD["x"])))
# Points that have a place, where others have none.
KEPT = [i for i in ALL if i not in (2, 7)]


def places(kind=np.float64):
    return np.array([CLOUD[axis] for axis in "xyz"], dtype=kind).T


def column(name, kind=np.float64):
    return np.array(CLOUD[name], dtype=kind)


def with_holes(points):
    points = points.copy()
    points[[2, 7]] = np.nan
    return points


# ---- readers, for what another library finds


def read_plyfile(path):
    data = plyfile.PlyData.read(str(path))
    points = np.array([data["vertex"][axis] for axis in "xyz"], dtype=np.float64).T
    polygons = []
    for element in data.elements:
        if element.name not in ("face", "tristrips"):
            continue
        name = next(n for n in ("vertex_indices", "vertex_index") if n in [p.name for p in element.properties])
        for corners in element[name]:
            polygons += strips(corners) if element.name == "tristrips" else [[int(i) for i in corners]]
    return points, polygons


def strips(corners):
    found, strip = [], []
    for corner in [int(i) for i in corners] + [-1]:
        if corner >= 0:
            strip.append(corner)
            continue
        for i in range(len(strip) - 2):
            a, b, c = strip[i : i + 3]
            found.append([b, a, c] if i % 2 else [a, b, c])
        strip = []
    return found


def read_meshio(path):
    mesh = meshio.read(path)
    return np.array(mesh.points, dtype=np.float64), [
        [int(i) for i in cell] for block in mesh.cells for cell in block.data
    ]


def read_vtk(path):
    kind = {".ply": vtk.vtkPLYReader, ".obj": vtk.vtkOBJReader, ".stl": vtk.vtkSTLReader}[path.suffix]
    reader = kind()
    reader.SetFileName(str(path))
    reader.Update()
    data = reader.GetOutput()
    points = numpy_support.vtk_to_numpy(data.GetPoints().GetData()).astype(np.float64)
    polygons, ids = [], vtk.vtkIdList()
    cells = data.GetPolys()
    cells.InitTraversal()
    while cells.GetNextCell(ids):
        polygons.append([ids.GetId(i) for i in range(ids.GetNumberOfIds())])
    return points, polygons


def read_trimesh(path):
    mesh = trimesh.load(path, process=False, force="mesh", maintain_order=True)
    return np.array(mesh.vertices), [[int(i) for i in face] for face in mesh.faces]


def read_open3d(path):
    mesh = open3d.io.read_triangle_mesh(str(path))
    return np.asarray(mesh.vertices), [[int(i) for i in face] for face in np.asarray(mesh.triangles)]


def read_numpy_stl(path):
    corners = numpy_stl.Mesh.from_file(str(path)).vectors.astype(np.float64).reshape(-1, 3)
    return corners, [[n, n + 1, n + 2] for n in range(0, len(corners), 3)]


MESH_READERS = {
    "numpy-stl": read_numpy_stl,
    "plyfile": read_plyfile,
    "meshio": read_meshio,
    "vtk": read_vtk,
    "trimesh": read_trimesh,
    "open3d": read_open3d,
}


def check_mesh(path, geometry, reader, tolerance_m):
    """Compares what a library reads with what was written; gives the number of its vertices."""
    points, polygons = MESH_READERS[reader](path)
    expected, expected_polygons = GEOMETRIES[geometry]
    expected = np.array(expected)
    number = []
    for point in points:
        distances = np.abs(expected - point).max(axis=1)
        number.append(int(distances.argmin()) if distances.min() <= tolerance_m else None)
    assert {n for p in polygons for n in p} <= set(range(len(points))), f"{path.name}: indices"
    used = {n for p in expected_polygons for n in p}
    assert used <= set(number), f"{path.name}: {reader} does not find vertices {used - set(number)}"
    areas = [0.0] * len(expected_polygons)
    cut = [0] * len(expected_polygons)
    for triangle in fans(polygons):
        corners = [number[i] for i in triangle]
        homes = [n for n, polygon in enumerate(expected_polygons) if runs_along(polygon, corners)]
        assert len(homes) == 1, f"{path.name}: {reader} finds the triangle {corners}, which is of the polygons {homes}"
        cut[homes[0]] += 1
        areas[homes[0]] += np.linalg.norm(area(expected, corners))
    for n, polygon in enumerate(expected_polygons):
        assert cut[n] == len(polygon) - 2, f"{path.name}: {reader} finds {cut[n]} triangles of polygon {n}"
        assert abs(areas[n] - np.linalg.norm(area(expected, polygon))) < AREA, f"{path.name}: area of polygon {n}"
    return len(points)


def runs_along(polygon, corners):
    """Whether the corners come in the polygon in this order, anywhere begun."""
    if any(corner not in polygon for corner in corners):
        return False
    at = [polygon.index(corner) for corner in corners]
    return any(at[i] < at[(i + 1) % 3] < at[(i + 2) % 3] for i in range(3))


# ---- the corpus


class Corpus:
    def __init__(self, folder):
        self.folder = folder
        self.files = {}
        self.count = {}

    def path(self, name):
        return self.folder / name

    def add(self, name, library, options, entry):
        assert name not in self.files and self.path(name).exists(), name
        self.files[name] = {"library": library, "options": options, **entry}
        self.count[library] = self.count.get(library, 0) + 1

    def mesh(self, name, library, options, geometry, reader, tolerance_m, labels=None, count=None):
        """A mesh; `count` is the number of its vertices where writers repeat or drop some."""
        path = self.path(name)
        found = check_mesh(path, geometry, reader, tolerance_m)
        expected = count or (found if path.suffix != ".stl" else len(set(sum(faces(geometry), []))))
        if path.suffix == ".obj":
            expected = sum(line.startswith(b"v ") for line in path.read_bytes().splitlines())
        entry = {
            "kind": "mesh",
            "geometry": geometry,
            "vertices": expected,
            "tolerance_m": tolerance_m,
            "checked_by": reader,
        }
        if labels:
            entry["labels"] = labels
        self.add(name, library, options, entry)

    def no_mesh(self, name, library, options, refused):
        self.add(name, library, options, {"kind": "mesh", "refused": refused})

    def cloud(self, name, library, options, read, columns, tolerance_m, tolerance_power=None, rows=None, **reading):
        """A cloud. `columns` says which of the file's columns hold which of the oracle's; `read` reads them back."""
        checked_by, reader = read
        found = reader(self.path(name))
        rows = rows or ALL
        axes = {ours: theirs for theirs, ours in columns.items() if ours in "xyz"}
        is_there = ~np.isnan(np.array(found[axes["x"]], dtype=np.float64))
        for theirs, ours in columns.items():
            values = np.array(found[theirs], dtype=np.float64)[is_there]
            expected = column(ours)[rows]
            assert len(values) == len(expected), f"{name}: {len(values)} values of {theirs}"
            if ours in "xyz":
                values = (
                    values * reading.get("metres_per_unit", 1) - reading.get("shifted_m", (0, 0, 0))["xyz".index(ours)]
                )
            off = np.abs(values - expected)
            most = tolerance_m if ours in ("x", "y", "z", "range_m") else tolerance_power or 0
            if ours in ("power_w", "counts", "red"):
                off = off / expected
            if ours == "chirp":
                most = 0
            assert off.max() <= most, f"{name}: {theirs} is off by {off.max()}"
        entry = {"kind": "cloud", "columns": columns, "tolerance_m": tolerance_m, "tolerance_power": tolerance_power}
        entry = {key: value for key, value in entry.items() if value is not None}
        if rows != ALL:
            entry["rows"] = rows
        self.add(name, library, options, {**entry, **reading, "checked_by": checked_by})


def write_open3d_meshes(corpus):
    def legacy(name):
        mesh = open3d.geometry.TriangleMesh()
        mesh.vertices = open3d.utility.Vector3dVector(vertices(name))
        mesh.triangles = open3d.utility.Vector3iVector(triangles(name))
        return mesh

    def write(file, mesh, geometry, options, reader, tolerance_m, labels=None, module=open3d.io, **keys):
        with tempfile.TemporaryDirectory() as folder:
            assert module.write_triangle_mesh(f"{folder}/{file}", mesh, **keys), file
            shutil.copy(f"{folder}/{file}", corpus.path(file))
        corpus.mesh(file, "open3d", options, geometry, reader, tolerance_m, labels)

    bare = legacy("tetra")
    write("open3d-ascii.ply", bare, "tetra", "write_ascii", "plyfile", SIX_DIGITS, write_ascii=True)
    write("open3d-binary.ply", bare, "tetra", "binary, doubles", "plyfile", DOUBLE)
    write("open3d.obj", bare, "tetra", "no normals", "vtk", SIX_DIGITS)
    full = legacy("house")
    full.compute_vertex_normals()
    full.vertex_colors = open3d.utility.Vector3dVector(colours("house") / 255)
    write(
        "open3d-full-ascii.ply", full, "house", "write_ascii, normals, colours", "plyfile", SIX_DIGITS, write_ascii=True
    )
    write("open3d-full-binary.ply", full, "house", "binary, normals, colours", "plyfile", DOUBLE)
    write("open3d-full.obj", full, "house", "normals, colours after each vertex", "vtk", SIX_DIGITS)
    write("open3d.stl", full, "house", "binary", "meshio", SINGLE)
    plain = legacy("sheet")
    write("open3d-sheet.ply", plain, "sheet", "binary, 289 vertices of which 25 have faces", "plyfile", DOUBLE)
    textured = legacy("pair")
    count = len(triangles("pair"))
    textured.triangle_uvs = open3d.utility.Vector2dVector(
        np.array([[0.1 + 0.001 * i, 0.9 - 0.002 * i] for i in range(3 * count)])
    )
    textured.triangle_material_ids = open3d.utility.IntVector([0] * 4 + [1] * 4)
    textured.textures = [open3d.geometry.Image(np.full((2, 2, 3), 90 * n + 50, np.uint8)) for n in range(2)]
    names = ["open3d-textured_0"] * 4 + ["open3d-textured_1"] * 4
    write("open3d-textured.obj", textured, "pair", "two textures", "vtk", SIX_DIGITS, {"usemtl": names})
    tensor = open3d.t.geometry.TriangleMesh.from_legacy(legacy("tetra"))
    for file in ("open3d-tensor.ply", "open3d-tensor.obj", "open3d-tensor.stl"):
        reader = "plyfile" if file.endswith("ply") else "trimesh"
        write(file, tensor, "tetra", "t.io, single precision", reader, 2 * SINGLE, module=open3d.t.io)
    tensor.vertex.normals = open3d.core.Tensor(normals("tetra").astype(np.float32))
    write("open3d-tensor-normals.obj", tensor, "tetra", "t.io, normals", "trimesh", 2 * SINGLE, module=open3d.t.io)
    lines = open3d.geometry.LineSet(
        open3d.utility.Vector3dVector(vertices("tetra")), open3d.utility.Vector2iVector([[0, 1], [1, 2]])
    )
    open3d.io.write_line_set(str(corpus.path("open3d-lines.ply")), lines)
    corpus.no_mesh("open3d-lines.ply", "open3d", "a LineSet, which has no faces", "the mesh has no facets")


def write_open3d_clouds(corpus):
    def by_plyfile(path):
        return plyfile.PlyData.read(str(path))["vertex"]

    def by_pypcd4(path):
        read = pypcd4.PointCloud.from_path(path)
        return {name: read.pc_data[name] for name in read.fields}

    def by_lines(path):
        """pypcd4 does not read the blank at the end of Open3D's lines."""
        lines = path.read_text().splitlines()
        names = next(line for line in lines if line.startswith("FIELDS")).split()[1:]
        start = lines.index("DATA ascii") + 1
        return dict(zip(names, np.array([line.split() for line in lines[start:]], dtype=np.float64).T))

    plain = {"x": "x", "y": "y", "z": "z", "intensity": "power_dbm", "chirp": "chirp"}
    for kind, bits, tolerance in ((np.float32, 32, 2.5 * SINGLE), (np.float64, 64, DOUBLE)):
        for holes in (False, True):
            points = places(kind)
            made = open3d.t.geometry.PointCloud(open3d.core.Tensor(with_holes(points) if holes else points))
            made.point.intensity = open3d.core.Tensor(column("power_dbm", kind)[:, None])
            made.point.chirp = open3d.core.Tensor(column("chirp", np.uint16)[:, None])
            if holes and bits == 64:
                continue
            if not holes and bits == 32:
                made.point.normals = open3d.core.Tensor(np.tile(np.array([[0, 0, 1]], kind), (len(ALL), 1)))
                made.point.colors = open3d.core.Tensor(np.tile(np.array([[10, 20, 30]], np.uint8), (len(ALL), 1)))
            rows, what = (KEPT, "-holes") if holes else (None, "")
            power = 5e-6 if bits == 32 else 1e-12
            for file, form, read, keys in (
                ("ascii.ply", "write_ascii", ("plyfile", by_plyfile), {"write_ascii": True}),
                ("binary.ply", "binary", ("plyfile", by_plyfile), {}),
                ("ascii.pcd", "write_ascii", ("numpy", by_lines), {"write_ascii": True}),
                ("binary.pcd", "binary", ("pypcd4", by_pypcd4), {}),
                ("compressed.pcd", "binary_compressed", ("pypcd4", by_pypcd4), {"compressed": True}),
            ):
                name = f"open3d-{bits}{what}-{file}"
                assert open3d.t.io.write_point_cloud(str(corpus.path(name)), made, **keys), name
                is_text = "ascii" in name
                extra = ", normals and colours" if bits == 32 and not holes else ""
                corpus.cloud(
                    name,
                    "open3d",
                    f"t.io, {form}, {bits} bits{', points without a place' if holes else ''}{extra}",
                    read,
                    plain,
                    SIX_DIGITS if is_text else tolerance,
                    6e-5 if is_text else power,
                    rows,
                    rename="intensity=power_dbm",
                    power="dbm",
                )
    bare = open3d.t.geometry.PointCloud(open3d.core.Tensor(places(np.float32)))
    bare.point.intensities = open3d.core.Tensor(column("power_dbm", np.float32)[:, None])

    def by_numpy(path, **keys):
        return dict(enumerate(np.loadtxt(path, **keys).T))

    four = {0: "x", 1: "y", 2: "z", 3: "power_dbm"}
    with tempfile.TemporaryDirectory() as folder:
        assert open3d.t.io.write_point_cloud(f"{folder}/a.xyzi", bare)
        shutil.copy(f"{folder}/a.xyzi", corpus.path("open3d-i.xyz"))
    numbered(
        "open3d-i.xyz", corpus, "open3d", "t.io, .xyzi renamed to .xyz", by_numpy, four, SIX_DIGITS, 1e-5, power="dbm"
    )
    assert open3d.t.io.write_point_cloud(str(corpus.path("open3d-i.pts")), bare)
    skip = lambda path: by_numpy(path, skiprows=1)
    numbered("open3d-i.pts", corpus, "open3d", "t.io, intensities", skip, four, SIX_DIGITS, 1e-5, power="dbm")
    legacy = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(places()))
    for file in ("open3d-places.xyz", "open3d-places.pts"):
        assert open3d.io.write_point_cloud(str(corpus.path(file)), legacy)
        read = skip if file.endswith("pts") else by_numpy
        numbered(
            file,
            corpus,
            "open3d",
            "places alone",
            read,
            {0: "x", 1: "y", 2: "z"},
            SIX_DIGITS,
            refused="no column power_dbm",
        )
    legacy.colors = open3d.utility.Vector3dVector(np.array([[red / 255, 0.2, 0.4] for red in CLOUD["red"]]))
    for form, keys in (("ascii", {"write_ascii": True}), ("binary", {}), ("compressed", {"compressed": True})):
        name = f"open3d-places-{form}.pcd"
        assert open3d.io.write_point_cloud(str(corpus.path(name)), legacy, **keys)
        corpus.cloud(
            name,
            "open3d",
            f"{form}, places and colours alone",
            ("numpy", by_lines) if form == "ascii" else ("pypcd4", by_pypcd4),
            {"x": "x", "y": "y", "z": "z"},
            SIX_DIGITS,
            refused="no column power_dbm",
        )
    for form, keys in (("ascii", {"write_ascii": True}), ("binary", {})):
        name = f"open3d-red-{form}.ply"
        assert open3d.io.write_point_cloud(str(corpus.path(name)), legacy, **keys)
        corpus.cloud(
            name,
            "open3d",
            f"{form}, colours, of which red stands for counts",
            ("plyfile", by_plyfile),
            {"x": "x", "y": "y", "z": "z", "red": "red"},
            SIX_DIGITS if form == "ascii" else DOUBLE,
            0,
            rename="red=power_counts",
            power="counts",
        )
    assert open3d.io.write_point_cloud(str(corpus.path("open3d-colours.pts")), legacy)
    seven = {0: "x", 1: "y", 2: "z", 4: "red"}
    numbered(
        "open3d-colours.pts",
        corpus,
        "open3d",
        "colours",
        skip,
        seven,
        SIX_DIGITS,
        0,
        rename="1=x,2=y,3=z,5=power_counts",
        power="counts",
    )


def numbered(name, corpus, library, options, read, columns, tolerance_m, tolerance_power=None, **reading):
    """A text without a header, whose columns matdb names by their numbers."""
    found = read(corpus.path(name))
    names = ["x", "y", "z", "power"] if len(found) <= 4 else [str(n + 1) for n in range(len(found))]
    table = {names[at]: values for at, values in found.items()}
    columns = {names[at]: ours for at, ours in columns.items()}
    corpus.cloud(
        name, library, options, ("numpy", lambda path: table), columns, tolerance_m, tolerance_power, **reading
    )


def write_trimesh(corpus):
    def made(name, **keys):
        return trimesh.Trimesh(vertices(name), triangles(name), process=False, **keys)

    def write(file, mesh, geometry, options, reader, tolerance_m, labels=None, **keys):
        kind = keys.pop("file_type", file.rsplit(".", 1)[1])
        if kind == "obj":
            keys.setdefault("mtl_name", file.replace(".obj", ".mtl"))
            keys["return_texture"] = True
        data = mesh.export(file_type=kind, **keys)
        data = data[0] if isinstance(data, tuple) else data
        corpus.path(file).write_bytes(data.encode() if isinstance(data, str) else data)
        corpus.mesh(file, "trimesh", options, geometry, reader, tolerance_m, labels)

    write("trimesh-binary.ply", made("tetra"), "tetra", "binary", "plyfile", SINGLE)
    write("trimesh-ascii.ply", made("tetra"), "tetra", "ascii", "plyfile", SINGLE, encoding="ascii")
    full = made("house", vertex_colors=np.hstack([colours("house"), np.full((10, 1), 255, np.uint8)]))
    full.vertex_attributes["power_dbm"] = np.linspace(-60, -70, 10)
    part = np.array([n for n, p in enumerate(faces("house")) for _ in range(len(p) - 2)], dtype=np.int32)
    full.face_attributes["part"] = part
    full.face_attributes["weight"] = 0.5 * part.astype(np.float64)
    parts = {"part": [str(n) for n in range(7)]}
    for encoding in ("ascii", "binary"):
        write(
            f"trimesh-full-{encoding}.ply",
            full,
            "house",
            f"{encoding}, normals, colours, attributes of vertices and faces",
            "plyfile",
            SINGLE,
            parts,
            encoding=encoding,
            vertex_normal=True,
        )
    of_faces = made("tetra", face_colors=np.array([[200, 0, 10 * n, 255] for n in range(4)], dtype=np.uint8))
    blue = {"blue": [str(10 * n) for n in range(4)]}
    write("trimesh-face-colours.ply", of_faces, "tetra", "colours of faces", "plyfile", SINGLE, blue)
    write("trimesh.obj", made("tetra"), "tetra", "include_normals=False", "vtk", 1e-7, include_normals=False)
    write("trimesh-normals.obj", full, "house", "normals, colours after each vertex", "vtk", 1e-7, include_normals=True)
    write("trimesh-digits.obj", made("house"), "house", "digits=3", "vtk", 5.1e-4, digits=3, include_normals=False)
    from PIL import Image

    material = trimesh.visual.material.SimpleMaterial(image=Image.new("RGB", (2, 2), (90, 80, 70)), name="plaster")
    visual = trimesh.visual.TextureVisuals(uv=uv("tetra"), material=material)
    write(
        "trimesh-textured.obj",
        made("tetra", visual=visual),
        "tetra",
        "texture coordinates, a material",
        "vtk",
        1e-7,
        {"usemtl": ["plaster"] * 4},
    )
    write("trimesh.stl", made("house"), "house", "binary", "meshio", SINGLE)
    write("trimesh-ascii.stl", made("house"), "house", "stl_ascii", "vtk", SINGLE, file_type="stl_ascii")
    scene = trimesh.Scene()
    for name, x in (("alpha", 0), ("beta", -1.9)):
        mesh = trimesh.Trimesh(np.array(shifted(GEOMETRIES["tetra"][0], x)), faces("tetra"), process=False)
        scene.add_geometry(mesh, geom_name=name, node_name=name)
    objects = {"group": ["alpha"] * 4 + ["beta"] * 4}
    write("trimesh-scene.obj", scene, "pair", "a scene of two objects", "vtk", 1e-7, objects)
    write("trimesh-scene.ply", scene, "pair", "a scene of two objects", "plyfile", SINGLE)
    write("trimesh-scene.stl", scene, "pair", "a scene of two objects", "meshio", SINGLE)

    def by_plyfile(path):
        return plyfile.PlyData.read(str(path))["vertex"]

    points = trimesh.PointCloud(places(), colors=np.tile(np.array([[1, 2, 3, 255]], np.uint8), (len(ALL), 1)))
    # Its PLY writer looks for them, though the class has none.
    points.vertex_attributes = {"power_dbm": column("power_dbm"), "chirp": column("chirp", np.uint32)}
    columns = {"x": "x", "y": "y", "z": "z", "power_dbm": "power_dbm", "chirp": "chirp"}
    for encoding, tolerance in (("ascii", 5.1e-9), ("binary", 1e-12)):
        name = f"trimesh-cloud-{encoding}.ply"
        corpus.path(name).write_bytes(points.export(file_type="ply", encoding=encoding))
        corpus.cloud(
            name,
            "trimesh",
            f"{encoding}, attributes",
            ("plyfile", by_plyfile),
            columns,
            2.5 * SINGLE,
            tolerance,
            power="dbm",
        )
    points.colors = np.array([[red, 0, 0, 255] for red in CLOUD["red"]], dtype=np.uint8)
    corpus.path("trimesh-cloud.xyz").write_text(points.export(file_type="xyz"))
    read = lambda path: dict(enumerate(np.loadtxt(path).T))
    seven = {0: "x", 1: "y", 2: "z", 3: "red"}
    numbered(
        "trimesh-cloud.xyz",
        corpus,
        "trimesh",
        "colours",
        read,
        seven,
        1e-8,
        0,
        rename="1=x,2=y,3=z,4=power_counts",
        power="counts",
    )
    corpus.path("trimesh-cloud.csv").write_text(
        trimesh.exchange.xyz.export_xyz(points, write_colors=False, delimiter=",")
    )
    # A CSV has a header; the first point would be taken for it.
    read = lambda path: {axis: np.loadtxt(path, delimiter=",").T[at] for at, axis in enumerate("xyz")}
    corpus.add(
        "trimesh-cloud.csv",
        "trimesh",
        "export_xyz with commas, no header",
        {"kind": "cloud", "refused": "has no columns x_m, y_m, z_m and power_dbm"},
    )


def write_meshio(corpus):
    def block(name, kind):
        """Neighbouring polygons of as many corners, as meshio has them."""
        blocks = []
        for face in faces(name):
            what = {3: "triangle", 4: "quad"}.get(len(face), "polygon")
            if not blocks or blocks[-1][0] != what:
                blocks.append((what, []))
            blocks[-1][1].append(face)
        return [(what, np.array(cells, dtype=kind)) for what, cells in blocks]

    def write(file, geometry, options, reader, tolerance_m, kind=np.int32, real=np.float64, point_data=None, **keys):
        mesh = meshio.Mesh(vertices(geometry, real), block(geometry, kind), point_data=point_data or {})
        mesh.write(corpus.path(file), **keys)
        corpus.mesh(file, "meshio", options, geometry, reader, tolerance_m)

    for binary in (True, False):
        form = "binary" if binary else "ascii"
        write(f"meshio-{form}.ply", "hut", f"{form}, triangles and quads", "plyfile", DOUBLE, binary=binary)
        write(
            f"meshio-single-{form}.ply",
            "tetra",
            f"{form}, single precision",
            "plyfile",
            SINGLE,
            real=np.float32,
            binary=binary,
        )
        write(f"meshio-house-{form}.ply", "house", f"{form}, polygons", "plyfile", DOUBLE, binary=binary)
        data = {"power_dbm": np.linspace(-60, -70, 9), "label": np.arange(9, dtype=np.int64) + 2**40}
        # plyfile knows no integers of 64 bits.
        write(
            f"meshio-data-{form}.ply",
            "hut",
            f"{form}, point data of 64 bits",
            "meshio",
            DOUBLE,
            point_data=data,
            binary=binary,
        )
        for kind in (np.uint8, np.uint16, np.int16, np.uint32):
            write(
                f"meshio-{np.dtype(kind)}-{form}.ply",
                "hut",
                f"{form}, indices {np.dtype(kind)}",
                "plyfile",
                DOUBLE,
                kind,
                binary=binary,
            )
        write(f"meshio-uint64-{form}.ply", "hut", f"{form}, indices uint64", "meshio", DOUBLE, np.uint64, binary=binary)
        write(f"meshio-{form}.stl", "tetra", form, "vtk", SINGLE, binary=binary)
    write("meshio.obj", "hut", "triangles and quads", "vtk", SINGLE)
    data = {"obj:vn": normals("hut"), "obj:vt": uv("hut")}
    write("meshio-full.obj", "house", "polygons", "vtk", SINGLE)
    write("meshio-normals.obj", "hut", "normals and texture coordinates", "vtk", SINGLE, point_data=data)
    # A cloud, as cells of one vertex each.
    for binary in (True, False):
        form = "binary" if binary else "ascii"
        name = f"meshio-cloud-{form}.ply"
        points = meshio.Mesh(
            places(),
            [("vertex", np.array([[i] for i in ALL], dtype=np.int32))],
            point_data={"power_w": column("power_w"), "range_m": column("range_m"), "chirp": column("chirp", np.int64)},
        )
        points.write(corpus.path(name), binary=binary)
        columns = {"x": "x", "y": "y", "z": "z", "power_w": "power_w", "range_m": "range_m", "chirp": "chirp"}

        def read(path):
            mesh = meshio.read(path)
            return {**dict(zip("xyz", mesh.points.T)), **mesh.point_data}

        corpus.cloud(
            name, "meshio", f"{form}, vertex cells, point data", ("meshio", read), columns, DOUBLE, 1e-14, power="w"
        )
    shutil.copy(corpus.path("meshio-cloud-binary.ply"), corpus.path("meshio-vertex-cells.ply"))
    corpus.no_mesh("meshio-vertex-cells.ply", "meshio", "cells of one vertex each", "the mesh has no facets")


def vtk_data(name, strip=False, lines=False, single=False):
    data, points, cells = vtk.vtkPolyData(), vtk.vtkPoints(), vtk.vtkCellArray()
    points.SetDataType(vtk.VTK_FLOAT if single else vtk.VTK_DOUBLE)
    for point in GEOMETRIES[name][0]:
        points.InsertNextPoint(point)
    data.SetPoints(points)
    for face in [list(range(len(GEOMETRIES[name][0])))] if strip else faces(name):
        cells.InsertNextCell(len(face), face)
    data.SetStrips(cells) if strip else data.SetPolys(cells)
    if lines:
        more, ones = vtk.vtkCellArray(), vtk.vtkCellArray()
        more.InsertNextCell(3, [0, 1, 2])
        ones.InsertNextCell(1, [3])
        data.SetLines(more)
        data.SetVerts(ones)
    return data


def vtk_array(values, name=None):
    array = numpy_support.numpy_to_vtk(np.ascontiguousarray(values), deep=True)
    if name:
        array.SetName(name)
    return array


def write_vtk(corpus):
    def write(kind, file, data, geometry, options, reader, tolerance_m, labels=None, setup=None):
        writer = kind()
        writer.SetFileName(str(corpus.path(file)))
        writer.SetInputData(data)
        if setup:
            setup(writer)
        assert writer.Write() == 1, file
        corpus.mesh(file, "vtk", options, geometry, reader, tolerance_m, labels)

    forms = {
        "ascii": lambda w: w.SetFileTypeToASCII(),
        "little": lambda w: (w.SetFileTypeToBinary(), w.SetDataByteOrderToLittleEndian()),
        "big": lambda w: (w.SetFileTypeToBinary(), w.SetDataByteOrderToBigEndian()),
    }
    for form, setup in forms.items():
        write(
            vtk.vtkPLYWriter,
            f"vtk-{form}.ply",
            vtk_data("house"),
            "house",
            f"{form}, polygons",
            "plyfile",
            SINGLE,
            setup=setup,
        )
        full = vtk_data("hut")
        full.GetPointData().SetNormals(vtk_array(normals("hut").astype(np.float32)))
        full.GetPointData().SetTCoords(vtk_array(uv("hut").astype(np.float32)))
        full.GetPointData().AddArray(vtk_array(colours("hut"), "rgb"))

        def with_colours(writer):
            setup(writer)
            writer.SetArrayName("rgb")
            writer.SetColorModeToDefault()
            writer.AddComment("with everything")

        write(
            vtk.vtkPLYWriter,
            f"vtk-full-{form}.ply",
            full,
            "hut",
            f"{form}, normals, texture coordinates, colours",
            "plyfile",
            SINGLE,
            setup=with_colours,
        )
    tints = np.array([[10 * n, 20, 30, 255] for n in range(9)], dtype=np.uint8)
    tinted = vtk_data("hut")
    tinted.GetCellData().AddArray(vtk_array(tints, "tint"))

    def with_tints(writer):
        writer.SetFileTypeToBinary()
        writer.SetDataByteOrderToBigEndian()
        writer.SetArrayName("tint")
        writer.EnableAlphaOn()

    labels = {"red": [str(10 * n) for n in range(9)], "alpha": ["255"] * 9}
    write(
        vtk.vtkPLYWriter,
        "vtk-tints.ply",
        tinted,
        "hut",
        "big-endian, colours of cells",
        "plyfile",
        SINGLE,
        labels,
        with_tints,
    )
    write(
        vtk.vtkSTLWriter, "vtk-ascii.stl", vtk_data("tetra"), "tetra", "ascii", "trimesh", SINGLE, setup=forms["ascii"]
    )
    header = lambda w: (w.SetFileTypeToASCII(), w.SetHeader("facet of a house"))
    write(
        vtk.vtkSTLWriter,
        "vtk-header.stl",
        vtk_data("house"),
        "house",
        "ascii, a header of its own",
        "numpy-stl",
        SIX_DIGITS,
        setup=header,
    )
    binary = lambda w: (w.SetFileTypeToBinary(), w.SetHeader("solid of a house"))
    write(
        vtk.vtkSTLWriter,
        "vtk-binary.stl",
        vtk_data("house"),
        "house",
        "binary, its header begins with solid",
        "meshio",
        SINGLE,
        setup=binary,
    )
    strip = vtk_data("ribbon", strip=True)
    write(
        vtk.vtkSTLWriter,
        "vtk-strip.stl",
        strip,
        "ribbon",
        "a strip, ascii",
        "trimesh",
        SIX_DIGITS,
        setup=forms["ascii"],
    )
    write(
        vtk.vtkSTLWriter,
        "vtk-strip-binary.stl",
        strip,
        "ribbon",
        "a strip, binary",
        "trimesh",
        SINGLE,
        setup=lambda w: w.SetFileTypeToBinary(),
    )
    write(
        vtk.vtkOBJWriter,
        "vtk.obj",
        vtk_data("house", lines=True),
        "house",
        "polygons, lines and points",
        "trimesh",
        SIX_DIGITS,
    )
    write(vtk.vtkOBJWriter, "vtk-strip.obj", strip, "ribbon", "a strip", "trimesh", SIX_DIGITS)
    full = vtk_data("hut")
    full.GetPointData().SetNormals(vtk_array(normals("hut").astype(np.float32)))
    write(vtk.vtkOBJWriter, "vtk-normals.obj", full, "hut", "normals", "trimesh", SIX_DIGITS)
    full.GetPointData().SetTCoords(vtk_array(uv("hut").astype(np.float32)))
    write(vtk.vtkOBJWriter, "vtk-full.obj", full, "hut", "normals and texture coordinates", "trimesh", SIX_DIGITS)
    export_vtk(corpus)
    # Clouds.
    data = vtk.vtkPolyData()
    points = vtk.vtkPoints()
    points.SetDataTypeToDouble()
    for place in places():
        points.InsertNextPoint(place)
    data.SetPoints(points)
    writer = vtk.vtkSimplePointsWriter()
    writer.SetFileName(str(corpus.path("vtk-places.xyz")))
    writer.SetInputData(data)
    writer.Write()
    read = lambda path: dict(enumerate(np.loadtxt(path).T))
    numbered(
        "vtk-places.xyz",
        corpus,
        "vtk",
        "vtkSimplePointsWriter",
        read,
        {0: "x", 1: "y", 2: "z"},
        SIX_DIGITS,
        refused="no column power_dbm",
    )
    table = vtk.vtkTable()
    names = {"x": "X", "y": "Y", "z": "Z", "power_dbm": "Power (dBm)", "chirp": "Chirp"}
    for ours, theirs in names.items():
        table.AddColumn(vtk_array(column(ours, np.int32 if ours == "chirp" else np.float64), theirs))
    for file, mark, quotes in (
        ("vtk.csv", ",", True),
        ("vtk-semicolons.csv", ";", True),
        ("vtk-tabs.txt", "\t", False),
    ):
        writer = vtk.vtkDelimitedTextWriter()
        writer.SetFileName(str(corpus.path(file)))
        writer.SetFieldDelimiter(mark)
        writer.SetUseStringDelimiter(quotes)
        writer.SetInputData(table)
        writer.Write()

        def read(path, mark=mark):
            return pandas.read_csv(path, sep=mark)

        corpus.cloud(
            file,
            "vtk",
            f"vtkDelimitedTextWriter, {'quoted names' if quotes else 'no quotes'}",
            ("pandas", read),
            {theirs: ours for ours, theirs in names.items()},
            SIX_DIGITS,
            6e-5,
            rename="Power (dBm)=power_dbm",
            power="dbm",
        )


def export_vtk(corpus):
    """A scene of two actors, by the exporter of render windows."""
    renderer, window = vtk.vtkRenderer(), vtk.vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.AddRenderer(renderer)
    for x in (0.0, -1.9):
        data = vtk_data("tetra")
        data.GetPointData().SetNormals(vtk_array(normals("tetra").astype(np.float32)))
        mapper, actor = vtk.vtkPolyDataMapper(), vtk.vtkActor()
        mapper.SetInputData(data)
        actor.SetMapper(mapper)
        actor.SetPosition(x, 0, 0)
        renderer.AddActor(actor)
    exporter = vtk.vtkOBJExporter()
    exporter.SetRenderWindow(window)
    with tempfile.TemporaryDirectory() as folder:
        exporter.SetFilePrefix(f"{folder}/vtk-exporter")
        exporter.Write()
        shutil.copy(f"{folder}/vtk-exporter.obj", corpus.path("vtk-exporter.obj"))
    corpus.mesh(
        "vtk-exporter.obj", "vtk", "vtkOBJExporter, two actors, normals and materials", "pair", "trimesh", SIX_DIGITS
    )


def write_plyfile(corpus):
    def vertex_element(name, kind, more=()):
        fields = [(axis, kind) for axis in "xyz"] + [(n, t) for n, t, _ in more]
        rows = np.zeros(len(vertices(name)), dtype=fields)
        for at, axis in enumerate("xyz"):
            rows[axis] = vertices(name)[:, at]
        for n, _, values in more:
            rows[n] = values
        return rows

    def list_rows(lists, item, name="vertex_indices", more=()):
        rows = np.zeros(len(lists), dtype=[(name, "O")] + [(n, t) for n, t, _ in more])
        for at, corners in enumerate(lists):
            rows[name][at] = np.array(corners, dtype=item)
        for n, _, values in more:
            rows[n] = values
        return rows

    def packed(rows, names):
        """Some of the columns, without gaps between them."""
        kept = np.zeros(len(rows), dtype=[(name, rows.dtype[name]) for name in names])
        for name in names:
            kept[name] = rows[name]
        return kept

    describe = plyfile.PlyElement.describe

    def write(file, elements, geometry, options, reader, tolerance_m, labels=None, comments=(), **keys):
        plyfile.PlyData(elements, comments=list(comments), **keys).write(str(corpus.path(file)))
        corpus.mesh(file, "plyfile", options, geometry, reader, tolerance_m, labels)

    forms = {"ascii": {"text": True}, "little": {"byte_order": "<"}, "big": {"byte_order": ">"}}
    for form, keys in forms.items():
        for real in ("f4", "f8"):
            tolerance = SINGLE if real == "f4" else DOUBLE
            # Text has as many digits as numpy prints of single precision.
            elements = [
                describe(vertex_element("house", real), "vertex"),
                describe(list_rows(faces("house"), "i4"), "face"),
            ]
            write(
                f"plyfile-{real}-{form}.ply",
                elements,
                "house",
                f"{form}, {real}, polygons",
                "vtk",
                max(tolerance, SINGLE),
                **keys,
            )
        for count, item in (("u1", "u1"), ("i1", "i2"), ("u2", "u2"), ("i4", "i4"), ("u4", "u4"), ("i2", "u4")):
            element = describe(list_rows(faces("hut"), item), "face", len_types={"vertex_indices": count})
            write(
                f"plyfile-{count}-{item}-{form}.ply",
                [describe(vertex_element("hut", "f4"), "vertex"), element],
                "hut",
                f"{form}, lists of {item} counted by {count}",
                "open3d",
                SINGLE,
                **keys,
            )
        # The faces first, elements before, between and behind, lists of vertices, further properties of every kind.
        sensor = np.array([(2.5, 7)], dtype=[("range", "f8"), ("serial", "u2")])
        edges = np.array([(0, 1), (1, 2)], dtype=[("vertex1", "i4"), ("vertex2", "i4")])
        mates = np.zeros(9, dtype=[("x", "f8"), ("y", "f8"), ("mates", "O"), ("z", "f8"), ("flag", "i1")])
        for at, axis in enumerate("xyz"):
            mates[axis] = vertices("hut")[:, at]
        for at in range(9):
            mates["mates"][at] = np.arange(at % 3, dtype="i4")
        more = [
            ("part", "u1", [5, 5, 6, 6, 7, 8, 8, 8, 9]),
            ("weight", "f4", np.arange(9)),
            ("serial", "i4", np.arange(9) - 4),
        ]
        labels = {"part": ["5", "5", "6", "6", "7", "8", "8", "8", "9"], "serial": [str(n - 4) for n in range(9)]}
        has_lists = form != "big"
        if not has_lists:
            # plyfile writes numbers next to lists in the machine's order of bytes, whatever the header says.
            more, mates = more[:1], packed(mates, ["x", "y", "z", "flag"])
            del labels["serial"]
        face_rows = list_rows(faces("hut"), "i4", "vertex_index", more)
        elements = [
            describe(sensor, "sensor", comments=["of the sensor"]),
            describe(face_rows, "face"),
            describe(mates, "vertex", len_types={"mates": "u2"} if has_lists else {}),
            describe(edges, "edge"),
        ]
        write(
            f"plyfile-mixed-{form}.ply",
            elements,
            "hut",
            f"{form}, faces before vertices, elements and lists that no mesh needs, vertex_index",
            "plyfile",
            DOUBLE,
            labels,
            comments=["a comment", "another one"],
            obj_info=["num_cols 9"],
            **keys,
        )
        # Strips of triangles, as scanners of the nineties wrote them: -1 ends one.
        both = list(range(5)) + [-1] + [4, 3, 5, -1] + [4, 5, 6, 7]
        elements = [
            describe(vertex_element("ribbon", "f4"), "vertex"),
            describe(list_rows([both], "i4"), "tristrips", len_types={"vertex_indices": "i4"}),
        ]
        write(f"plyfile-strips-{form}.ply", elements, "ribbon", f"{form}, tristrips", "plyfile", SINGLE, **keys)
        # A vertex that no face has is not a number.
        rows = np.concatenate(
            [vertex_element("tetra", "f4"), np.array([(np.nan,) * 3], dtype=[(a, "f4") for a in "xyz"])]
        )
        elements = [describe(rows, "vertex"), describe(list_rows(faces("tetra"), "i4"), "face")]
        file = f"plyfile-removed-{form}.ply"
        plyfile.PlyData(elements, **keys).write(str(corpus.path(file)))
        corpus.mesh(
            file, "plyfile", f"{form}, a vertex without faces that is not a number", "tetra", "plyfile", SINGLE, count=4
        )
        cloud_rows = np.zeros(
            len(ALL),
            dtype=[
                ("x", "f4"),
                ("power_w", "f8"),
                ("y", "f8"),
                ("near", "O"),
                ("z", "f4"),
                ("chirp", "u4"),
                ("range_m", "f4"),
                ("facet", "i2"),
            ],
        )
        for name in ("x", "y", "z", "power_w", "chirp", "range_m"):
            cloud_rows[name] = CLOUD[name]
        for at in ALL:
            cloud_rows["near"][at] = np.arange(at % 4, dtype="u1")
        cloud_rows = packed(cloud_rows, [n for n in cloud_rows.dtype.names if has_lists or n != "near"])
        elements = [describe(sensor, "sensor"), describe(cloud_rows, "vertex"), describe(edges, "edge")]
        file = f"plyfile-cloud-{form}.ply"
        plyfile.PlyData(elements, comments=["from a radar"], **keys).write(str(corpus.path(file)))
        columns = {name: name for name in ("x", "y", "z", "power_w", "chirp", "range_m")}
        read = ("plyfile", lambda path: plyfile.PlyData.read(str(path))["vertex"])
        corpus.cloud(
            file, "plyfile", f"{form}, watts, lists, other elements", read, columns, 2.5 * SINGLE, 1e-12, power="w"
        )


def write_pymeshlab(corpus):
    def write(file, mesh, geometry, options, reader, tolerance_m, labels=None, **keys):
        ms = pymeshlab.MeshSet()
        ms.add_mesh(mesh)
        with tempfile.TemporaryDirectory() as folder:
            ms.save_current_mesh(f"{folder}/{file}", **keys)
            shutil.copy(f"{folder}/{file}", corpus.path(file))
        corpus.mesh(file, "pymeshlab", options, geometry, reader, tolerance_m, labels)

    tetra = lambda **more: pymeshlab.Mesh(vertices("tetra"), triangles("tetra"), **more)
    house = lambda: pymeshlab.Mesh(vertices("house"), [np.array(f, dtype=np.uint32) for f in faces("house")])
    write("pymeshlab.ply", tetra(), "tetra", "defaults", "plyfile", DOUBLE)
    for binary in (True, False):
        form = "binary" if binary else "ascii"
        tolerance = DOUBLE if binary else SIX_DIGITS
        write(
            f"pymeshlab-{form}-polygons.ply",
            house(),
            "house",
            f"{form}, a mesh of polygons",
            "plyfile",
            max(tolerance, SINGLE),
            binary=binary,
        )
        wedges = np.array([[0.01 * i, 1 - 0.02 * i] for i in range(12)])
        full = tetra(
            v_normals_matrix=normals("tetra"),
            v_scalar_array=np.arange(4.0),
            f_scalar_array=np.arange(4.0),
            f_color_matrix=np.array([[0.2 * n, 0, 0, 1] for n in range(4)]),
            w_tex_coords_matrix=wedges,
        )
        labels = {"red": [str(51 * n) for n in range(4)]}
        write(
            f"pymeshlab-{form}-full.ply",
            full,
            "tetra",
            f"{form}, normals, quality, flags, colours of faces, wedge texture coordinates",
            "plyfile",
            tolerance,
            labels,
            binary=binary,
            save_vertex_normal=True,
            save_vertex_flag=True,
            save_face_flag=True,
            save_face_color=True,
            save_face_quality=True,
            save_wedge_texcoord=True,
        )
        write(f"pymeshlab-{form}.stl", house(), "house", form, "vtk", SINGLE if binary else SIX_DIGITS, binary=binary)
    write("pymeshlab.obj", tetra(), "tetra", "defaults", "vtk", SINGLE)
    write("pymeshlab-polygons.obj", house(), "house", "polygons", "vtk", SINGLE, save_polygonal=True)
    wedged = tetra(w_tex_coords_matrix=np.array([[0.01 * i, 1 - 0.02 * i] for i in range(12)]))
    write(
        "pymeshlab-wedges.obj",
        wedged,
        "tetra",
        "normals and wedge texture coordinates",
        "vtk",
        SINGLE,
        save_wedge_texcoord=True,
    )
    ms = pymeshlab.MeshSet()
    ms.add_mesh(
        pymeshlab.Mesh(
            places(), v_scalar_array=column("power_dbm"), v_normals_matrix=np.tile([[0.0, 0.0, 1.0]], (len(ALL), 1))
        )
    )
    for binary in (True, False):
        form = "binary" if binary else "ascii"
        name = f"pymeshlab-cloud-{form}.ply"
        ms.save_current_mesh(str(corpus.path(name)), binary=binary, save_vertex_quality=True)
        columns = {"x": "x", "y": "y", "z": "z", "quality": "power_dbm"}
        read = ("plyfile", lambda path: plyfile.PlyData.read(str(path))["vertex"])
        tolerances = (DOUBLE, 1e-12) if binary else (SIX_DIGITS, 6e-5)
        corpus.cloud(
            name, "pymeshlab", f"{form}, quality", read, columns, *tolerances, rename="quality=power_dbm", power="dbm"
        )
    ms.save_current_mesh(str(corpus.path("pymeshlab-cloud.xyz")))
    read = lambda path: dict(enumerate(np.loadtxt(path).T))
    six = {0: "x", 1: "y", 2: "z"}
    numbered(
        "pymeshlab-cloud.xyz", corpus, "pymeshlab", "places and normals", read, six, 5.1e-7, refused="1, 2, 3, 4, 5, 6"
    )


def write_stl(corpus):
    data = np.zeros(len(triangles("house")), dtype=numpy_stl.Mesh.dtype)
    data["vectors"] = vertices("house")[triangles("house")]
    data["attr"] = 7
    import stl.stl

    mesh = numpy_stl.Mesh(data)
    # What looks at the locale would write other digits on other machines.
    for form, mode in (("ascii", stl.stl.Mode.ASCII), ("binary", stl.stl.Mode.BINARY)):
        buffer = io.BytesIO()
        mesh.save("a house", fh=buffer, mode=mode)
        name = f"numpy-stl-{form}.stl"
        corpus.path(name).write_bytes(buffer.getvalue())
        corpus.mesh(name, "numpy-stl", f"{form}, a name, attribute bytes", "house", "vtk", SINGLE)


def write_igl(corpus):
    # The name of a solid is the path as it was given.
    os.chdir(corpus.folder)
    points, corners = vertices("tetra"), triangles("tetra", np.int64)
    ascii_, binary = igl.FileEncoding.Ascii, igl.FileEncoding.Binary
    for form, encoding in (("ascii", ascii_), ("binary", binary)):
        for file, reader in ((f"libigl-{form}.ply", "plyfile"), (f"libigl-{form}.stl", "vtk")):
            igl.write_triangle_mesh(file, points, corners, encoding)
            corpus.mesh(file, "libigl", form, "tetra", reader, SIX_DIGITS)
        file = f"libigl-full-{form}.ply"
        edges = np.array([[0, 1], [1, 2]], dtype=np.int64)
        igl.writePLY(
            file,
            points,
            corners,
            edges,
            normals("tetra"),
            uv("tetra"),
            np.ascontiguousarray(np.arange(4.0)[:, None]),
            ["power"],
            np.ascontiguousarray(np.arange(4.0)[:, None]),
            ["weight"],
            comments=["a comment"],
            encoding=encoding,
        )
        corpus.mesh(
            file, "libigl", f"{form}, edges, normals, texture coordinates, data", "tetra", "plyfile", SIX_DIGITS
        )
    igl.write_triangle_mesh("libigl.obj", points, corners)
    corpus.mesh("libigl.obj", "libigl", "defaults", "tetra", "vtk", SINGLE)
    igl.writeOBJ("libigl-full.obj", points, corners, normals("tetra"), corners, uv("tetra"), corners)
    corpus.mesh("libigl-full.obj", "libigl", "normals and texture coordinates", "tetra", "vtk", SINGLE)


def write_blender(corpus):
    names = [["plaster", "paint"][n % 2] for n in range(len(faces("house")))]
    files = {
        "blender.obj": ("defaults", "vtk", {"usemtl": names, "group": ["house"] * len(names)}),
        "blender-groups.obj": (
            "groups by object, material, vertices and smoothness, colours",
            "vtk",
            {"usemtl": names},
        ),
        "blender-plain.obj": ("no materials, normals or texture coordinates", "vtk", None),
        "blender-triangles.obj": ("as triangles", "vtk", {"usemtl": names}),
        "blender-ascii.ply": ("ascii, polygons", "plyfile", None),
        "blender-binary.ply": ("binary, polygons", "plyfile", None),
        "blender-full-ascii.ply": (
            "ascii, normals, texture coordinates, colours, a group of vertices",
            "plyfile",
            None,
        ),
        "blender-full-binary.ply": (
            "binary, normals, texture coordinates, colours, a group of vertices",
            "plyfile",
            None,
        ),
        "blender-ascii.stl": ("ascii", "vtk", None),
        "blender-binary.stl": ("binary", "vtk", None),
    }
    with tempfile.TemporaryDirectory() as folder:
        given = Path(folder) / "geometries.json"
        given.write_text(json.dumps(GEOMETRIES))
        command = [sys.argv[1], str(HERE / "blender.py"), str(given), folder]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        for file, (options, reader, labels) in files.items():
            shutil.copy(f"{folder}/{file}", corpus.path(file))
            corpus.mesh(file, "blender", options, "house", reader, 5.1e-7, labels)


# ---- LAS, read by the offsets of its specification

EXTRA_KINDS = {1: "u1", 2: "i1", 3: "<u2", 4: "<i2", 5: "<u4", 6: "<i4", 7: "<u8", 8: "<i8", 9: "<f4", 10: "<f8"}
RECORD = {0: 20, 1: 28, 2: 26, 3: 34, 4: 57, 5: 63, 6: 30, 7: 36, 8: 38, 9: 59, 10: 67}
GPS_TIME = {1: 20, 3: 20, 4: 20, 5: 20, 6: 22, 7: 22, 8: 22, 9: 22, 10: 22}


def by_specification(path):
    data = path.read_bytes()
    kind, length, count = struct.unpack_from("<BHI", data, 104)
    start, records = struct.unpack_from("<II", data, 96)
    scales, offsets = struct.unpack_from("<3d", data, 131), struct.unpack_from("<3d", data, 155)
    if data[25] >= 4:
        count = struct.unpack_from("<Q", data, 247)[0]
    fields = {"X": ("<i4", 0), "Y": ("<i4", 4), "Z": ("<i4", 8), "intensity": ("<u2", 12)}
    if kind in GPS_TIME:
        fields["gps_time"] = ("<f8", GPS_TIME[kind])
    at, linear = struct.unpack_from("<H", data, 94)[0], {}
    behind = RECORD[kind]
    for _ in range(records):
        user, number, size = struct.unpack_from("<16sHH", data, at + 2)
        if user.rstrip(b"\0") == b"LASF_Spec" and number == 4:
            for entry in range(at + 54, at + 54 + size, 192):
                code, options = data[entry + 2], data[entry + 3]
                name = data[entry + 4 : entry + 36].rstrip(b"\0").decode()
                several = 1 if code <= 10 else 2 + (code - 11) // 10
                one = EXTRA_KINDS[code if code <= 10 else (code - 1) % 10 + 1]
                if several == 1:
                    fields[name] = (one, behind)
                    scale = struct.unpack_from("<d", data, entry + 112)[0] if options & 8 else 1
                    offset = struct.unpack_from("<d", data, entry + 136)[0] if options & 16 else 0
                    linear[name] = (scale, offset)
                behind += several * np.dtype(one).itemsize
        at += 54 + size
    names = list(fields)
    layout = {
        "names": names,
        "formats": [fields[n][0] for n in names],
        "offsets": [fields[n][1] for n in names],
        "itemsize": length,
    }
    rows = np.frombuffer(data, dtype=np.dtype(layout), count=count, offset=start)
    found = {name: rows[name].astype(np.float64) for name in names}
    for axis, name in enumerate("xyz"):
        found[name] = found[name.upper()] * scales[axis] + offsets[axis]
    for name, (scale, offset) in linear.items():
        found[name] = found[name] * scale + offset
    return found


def by_other_backend(backend):
    def read(path):
        las = laspy.read(path, laz_backend=backend)
        names = list(las.point_format.dimension_names)
        found = {name: np.array(las[name], dtype=np.float64) for name in names if las[name].ndim == 1}
        return {**found, "x": np.array(las.x), "y": np.array(las.y), "z": np.array(las.z)}

    return read


def write_laspy(corpus):
    def write(
        file,
        options,
        kind,
        version,
        scales=(1e-3,) * 3,
        offsets=(0.0,) * 3,
        extra=(),
        values=(),
        backend=None,
        shift=(0, 0, 0),
        more=None,
        **entry,
    ):
        header = laspy.LasHeader(point_format=kind, version=version)
        header.creation_date = datetime.date(2026, 1, 1)
        header.system_identifier, header.generating_software = "bench", "laspy"
        header.scales, header.offsets = np.array(scales), np.array(offsets)
        header.add_extra_dims(list(extra))
        las = laspy.LasData(header)
        points = places() + np.array(shift)
        las.x, las.y, las.z = points.T
        las.intensity = column("counts", np.uint16)
        if "gps_time" in las.point_format.dimension_names:
            las.gps_time = 0.25 * np.arange(len(ALL))
        if "red" in las.point_format.dimension_names:
            las.red = column("red", np.uint16)
        for name, numbers in values:
            las[name] = numbers
        if more:
            more(las)
        buffer = io.BytesIO()
        las.write(buffer, do_compress=backend is not None, laz_backend=backend)
        corpus.path(file).write_bytes(buffer.getvalue())
        other = laspy.LazBackend.Lazrs if backend == laspy.LazBackend.Laszip else laspy.LazBackend.Laszip
        read = ("numpy, by the specification", by_specification)
        if backend is not None:
            read = (f"laspy with {'lazrs' if other == laspy.LazBackend.Lazrs else 'laszip'}", by_other_backend(other))
        corpus.cloud(file, "laspy", options, read, **entry)

    counts = {"x": "x", "y": "y", "z": "z", "intensity": "counts"}
    as_counts = {"columns": counts, "tolerance_power": 0, "rename": "intensity=power_counts", "power": "counts"}
    versions = {
        0: "1.2",
        1: "1.1",
        2: "1.2",
        3: "1.3",
        4: "1.3",
        5: "1.3",
        6: "1.4",
        7: "1.4",
        8: "1.4",
        9: "1.4",
        10: "1.4",
    }
    lazrs, parallel, laszip = laspy.LazBackend.Lazrs, laspy.LazBackend.LazrsParallel, laspy.LazBackend.Laszip
    for kind, version in versions.items():
        write(
            f"laspy-{kind}.las",
            f"point format {kind}, LAS {version}, intensity",
            kind,
            version,
            tolerance_m=5.1e-4,
            **as_counts,
        )
        if kind in (4, 5, 9, 10):
            # No backend compresses wave packets.
            continue
        for name, backend in (("lazrs", lazrs), ("parallel", parallel), ("laszip", laszip)):
            if name == "parallel" and kind not in (1, 6):
                continue
            write(
                f"laspy-{kind}-{name}.laz",
                f"point format {kind}, LAS {version}, intensity, by {name}",
                kind,
                version,
                backend=backend,
                tolerance_m=5.1e-4,
                **as_counts,
            )
    parameters = laspy.ExtraBytesParams
    named = {"x": "x", "y": "y", "z": "z"}
    extra = [parameters("power_dbm", "f4"), parameters("chirp", "u4"), parameters("range_m", "f8")]
    values = [
        ("power_dbm", column("power_dbm", np.float32)),
        ("chirp", column("chirp", np.uint32)),
        ("range_m", column("range_m")),
    ]
    columns = {**named, "power_dbm": "power_dbm", "chirp": "chirp", "range_m": "range_m"}
    for kind in (0, 3, 6, 7):
        for file, backend in (
            (f"laspy-extra-{kind}.las", None),
            (f"laspy-extra-{kind}.laz", lazrs),
            (f"laspy-extra-{kind}-laszip.laz", laszip),
        ):
            write(
                file,
                f"point format {kind}, extra dimensions f4, u4 and f8",
                kind,
                "1.4",
                (1e-6, 1e-5, 1e-6),
                (0.5, -1.0, -2.5),
                extra,
                values,
                backend,
                columns=columns,
                tolerance_m=5.1e-6,
                tolerance_power=5e-6,
                power="dbm",
            )
    # Whole numbers with a scale and an offset, as LAS 1.4 has them.
    scaled = [parameters("power_dbm", "i2", "level", offsets=np.array([-60.0]), scales=np.array([0.001]))]
    values = [("power_dbm", column("power_dbm"))]
    columns = {**named, "power_dbm": "power_dbm"}
    for file, backend in (("laspy-scaled.las", None), ("laspy-scaled.laz", lazrs)):
        write(
            file,
            "extra dimension i2 with scale and offset",
            6,
            "1.4",
            (1e-4,) * 3,
            (0,) * 3,
            scaled,
            values,
            backend,
            columns=columns,
            tolerance_m=5.1e-5,
            tolerance_power=5.1e-4,
            power="dbm",
        )
    # One of each kind of number before the power.
    kinds = ["u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f4", "f8"]
    many = [parameters(f"kind {n}", n) for n in kinds] + [parameters("Power", "f8")]
    values = [(f"kind {n}", (np.arange(len(ALL)) - (3 if n[0] != "u" else 0)).astype(n)) for n in kinds]
    values += [("Power", column("power_w"))]
    columns = {**named, "Power": "power_w"}
    for file, backend in (("laspy-kinds.las", None), ("laspy-kinds.laz", lazrs)):
        write(
            file,
            "an extra dimension of each kind",
            1,
            "1.2",
            (1e-4,) * 3,
            (0,) * 3,
            many,
            values,
            backend,
            columns=columns,
            tolerance_m=5.1e-5,
            tolerance_power=1e-14,
            rename="Power=power_w",
            power="w",
        )
    # Vectors, which LAS 1.4 R15 deprecates, before the power.
    vectors = [parameters("normal", "3f4"), parameters("pair", "2u2"), parameters("power_dbm", "f8")]
    values = [
        ("normal", np.tile(np.array([[0, 0, 1]], np.float32), (len(ALL), 1))),
        ("pair", np.ones((len(ALL), 2), np.uint16)),
    ]
    values += [("power_dbm", column("power_dbm"))]
    columns = {**named, "power_dbm": "power_dbm"}
    for file, backend in (("laspy-vectors.las", None), ("laspy-vectors.laz", lazrs)):
        write(
            file,
            "extra dimensions 3f4 and 2u2 before the power",
            7,
            "1.4",
            (1e-4,) * 3,
            (0,) * 3,
            vectors,
            values,
            backend,
            columns=columns,
            tolerance_m=5.1e-5,
            tolerance_power=1e-12,
            power="dbm",
        )
    shift = [412345.0, 5734567.0, 120.0]
    for file, backend in (("laspy-far.las", None), ("laspy-far.laz", laszip)):
        write(
            file,
            "places of a map, offsets of whole kilometres",
            6,
            "1.4",
            offsets=(412e3, 5734e3, 0),
            shift=shift,
            backend=backend,
            tolerance_m=5.1e-4,
            shifted_m=shift,
            **as_counts,
        )

    def with_records(las):
        las.header.vlrs.append(laspy.vlrs.known.WktCoordinateSystemVlr('LOCAL_CS["bench"]'))
        las.evlrs = laspy.vlrs.vlrlist.VLRList([laspy.VLR("bench", 7, "a note", b"x" * 100)])

    for file, backend in (("laspy-records.las", None), ("laspy-records.laz", lazrs)):
        write(
            file,
            "a coordinate system, and an extended record behind the points",
            6,
            "1.4",
            backend=backend,
            more=with_records,
            tolerance_m=5.1e-4,
            **as_counts,
        )
    for file, backend in (("laspy-empty.las", None), ("laspy-empty.laz", lazrs), ("laspy-empty-laszip.laz", laszip)):
        header = laspy.LasHeader(point_format=6, version="1.4")
        header.creation_date = datetime.date(2026, 1, 1)
        buffer = io.BytesIO()
        laspy.LasData(header).write(buffer, do_compress=backend is not None, laz_backend=backend)
        corpus.path(file).write_bytes(buffer.getvalue())
        corpus.add(file, "laspy", "no points", {"kind": "cloud", "refused": "the cloud has no points"})
    # The default reading: an intensity is of no stated unit.
    write(
        "laspy-unnamed.las",
        "intensity, not named as a power",
        6,
        "1.4",
        columns=counts,
        tolerance_m=5.1e-4,
        tolerance_power=0,
        refused="no column power_dbm",
    )


def write_pypcd4(corpus):
    forms = {
        "ascii": pypcd4.Encoding.ASCII,
        "binary": pypcd4.Encoding.BINARY,
        "compressed": pypcd4.Encoding.BINARY_COMPRESSED,
    }

    def by_open3d(path):
        read = open3d.t.io.read_point_cloud(str(path))
        found = {name: read.point[name].numpy() for name in read.point}
        places = dict(zip("xyz", found.pop("positions").T))
        return {**places, **{name: values[:, 0] for name, values in found.items()}}

    def by_pypcd4(path):
        read = pypcd4.PointCloud.from_path(path)
        return {name: read.pc_data[name] for name in read.fields}

    for form, encoding in forms.items():
        points = np.column_stack([places(np.float32), column("power_dbm", np.float32)])
        name = f"pypcd4-xyzi-{form}.pcd"
        pypcd4.PointCloud.from_xyzi_points(points).save(corpus.path(name), encoding)
        columns = {"x": "x", "y": "y", "z": "z", "intensity": "power_dbm"}
        corpus.cloud(
            name,
            "pypcd4",
            f"{form}, x y z intensity",
            ("open3d", by_open3d),
            columns,
            2.5 * SINGLE,
            5e-6,
            rename="intensity=power_dbm",
            power="dbm",
        )
        fields = ["ring", "x", "y", "z", "descriptor", "power_db", "t", "chirp", "class", "big"]
        types = [
            np.uint16,
            np.float64,
            np.float64,
            np.float64,
            np.float32,
            np.float64,
            np.int64,
            np.uint32,
            np.int8,
            np.uint64,
        ]
        counts = [1, 1, 1, 1, 3, 1, 1, 1, 1, 1]
        n = len(ALL)
        arrays = [
            np.arange(n),
            *places().T,
            *np.ones((3, n)),
            column("power_db"),
            np.arange(n) - 5,
            column("chirp"),
            -np.ones(n),
            np.arange(n),
        ]
        letters = [pypcd4.pypcd4.NUMPY_TYPE_TO_PCD_TYPE[np.dtype(t)] for t in types]
        stated = {"fields": fields, "type": [t for t, _ in letters], "size": [s for _, s in letters], "count": counts}
        stated = pypcd4.MetaData.model_validate({**stated, "width": n, "height": 1, "points": n})
        rows = np.zeros(n, dtype=stated.build_dtype())
        for field, values in zip(rows.dtype.names, arrays):
            rows[field] = values
        name = f"pypcd4-custom-{form}.pcd"
        pypcd4.PointCloud(stated, rows).save(corpus.path(name), encoding)
        columns = {"x": "x", "y": "y", "z": "z", "power_db": "power_db", "chirp": "chirp"}
        corpus.cloud(
            name,
            "pypcd4",
            f"{form}, fields of every type, one of three values",
            ("open3d", by_open3d),
            columns,
            1e-9,
            1e-9,
            power="db",
        )


def write_pandas(corpus):
    frame = pandas.DataFrame({name: CLOUD[name] for name in ("x", "y", "z", "power_dbm", "range_m", "chirp")})
    columns = {name: name for name in frame}
    import csv

    def by_csv(**keys):
        def read(path):
            text = (
                path.read_text(encoding="utf-8-sig").replace(",", ".")
                if keys.get("delimiter") == ";"
                else path.read_text(encoding="utf-8-sig")
            )
            rows = list(csv.DictReader(io.StringIO(text), **keys))
            return {name: [float(row[name] or "nan") for row in rows] for name in rows[0] if name}

        return ("csv", read)

    def write(file, options, read, keys, made=frame, **entry):
        made.to_csv(corpus.path(file), **keys)
        entry = {"columns": columns, "tolerance_m": DOUBLE, "tolerance_power": 1e-12, "power": "dbm", **entry}
        corpus.cloud(file, "pandas", options, read, **entry)

    write("pandas-index.csv", "defaults, with the index as first column without a name", by_csv(), {})
    write("pandas.csv", "index=False", by_csv(), {"index": False})
    write(
        "pandas-german.csv", "sep=';', decimal=','", by_csv(delimiter=";"), {"index": False, "sep": ";", "decimal": ","}
    )
    write(
        "pandas-tabs.txt",
        "sep tab, CRLF",
        by_csv(delimiter="\t"),
        {"index": False, "sep": "\t", "lineterminator": "\r\n"},
    )
    write(
        "pandas-bom.csv", "encoding utf-8-sig, as Excel wants it", by_csv(), {"index": False, "encoding": "utf-8-sig"}
    )
    write("pandas-quoted.csv", "quoting of everything", by_csv(), {"index": False, "quoting": csv.QUOTE_ALL})
    write(
        "pandas-rounded.csv",
        "float_format %.3f",
        by_csv(),
        {"index": False, "float_format": "%.3f"},
        tolerance_m=5.1e-4,
        tolerance_power=5.1e-4,
    )
    holes = frame.astype(float)
    holes.loc[[2, 7], ["x", "y", "z"]] = math.nan
    write(
        "pandas-nan.csv",
        "na_rep='nan', points without a place",
        by_csv(),
        {"index": False, "na_rep": "nan"},
        holes,
        rows=KEPT,
    )
    millimetres = frame.assign(**{axis: [1000 * v for v in CLOUD[axis]] for axis in "xyz"}).drop(columns="range_m")
    less = {name: name for name in millimetres}
    write(
        "pandas-mm.csv",
        "places in millimetres",
        by_csv(),
        {"index": False},
        millimetres,
        columns=less,
        tolerance_m=1e-12,
        metres_per_unit=1e-3,
    )


def write_numpy(corpus):
    four = np.column_stack([places(), column("power_dbm")])

    def by_pandas(path, **keys):
        return dict(enumerate(pandas.read_csv(path, header=None, comment="#", **keys).to_numpy().T))

    columns = {0: "x", 1: "y", 2: "z", 3: "power_dbm"}
    for file, options, keys, sep in (
        ("numpy.xyz", "savetxt defaults", {}, " "),
        ("numpy-fixed.txt", "fmt %.6f", {"fmt": "%.6f"}, " "),
        ("numpy-commas.txt", "delimiter ','", {"delimiter": ","}, ","),
        ("numpy-note.asc", "a header of more words than columns", {"header": "made on a radar bench"}, " "),
    ):
        np.savetxt(corpus.path(file), four, **keys)
        read = lambda path, sep=sep: by_pandas(path, sep=sep)
        numbered(file, corpus, "numpy", options, read, columns, 1e-12, 1e-12, power="dbm")
    header = {
        "columns": {"X": "x", "Y": "y", "Z": "z", "RSSI": "power_dbm"},
        "tolerance_m": 1e-12,
        "tolerance_power": 1e-12,
    }
    for file, options, keys, sep in (
        ("numpy-header.xyz", "header, commented", {"header": "X Y Z RSSI"}, " "),
        (
            "numpy-names.csv",
            "header, comments='', delimiter ','",
            {"header": "X,Y,Z,RSSI", "comments": "", "delimiter": ","},
            ",",
        ),
    ):
        np.savetxt(corpus.path(file), four, **keys)

        def read(path, sep=sep):
            return dict(
                zip(("X", "Y", "Z", "RSSI"), by_pandas(path, sep=sep, skiprows=0 if sep == " " else 1).values())
            )

        corpus.cloud(file, "numpy", options, ("pandas", read), **header, rename="RSSI=power_dbm", power="dbm")


LIBRARIES = {
    "open3d": [write_open3d_meshes, write_open3d_clouds],
    "trimesh": [write_trimesh],
    "meshio": [write_meshio],
    "vtk": [write_vtk],
    "plyfile": [write_plyfile],
    "pymeshlab": [write_pymeshlab],
    "numpy-stl": [write_stl],
    "blender": [write_blender],
    "libigl": [write_igl],
    "laspy": [write_laspy],
    "pypcd4": [write_pypcd4],
    "pandas": [write_pandas],
    "numpy": [write_numpy],
}


def version(library):
    if library != "blender":
        return metadata.version(library)
    return (HERE / "requirements-blender.txt").read_text().strip().split("==")[1]


def main():
    warnings.simplefilter("ignore")
    open3d.utility.set_verbosity_level(open3d.utility.VerbosityLevel.Error)
    vtk.vtkObject.GlobalWarningDisplayOff()
    # The time of writing stands in some headers.
    import stl.base
    import stl.stl

    for module in (meshio.ply._ply, meshio.obj._obj, stl.stl):
        module.datetime = type("datetime", (), {"datetime": FixedTime})
    shutil.rmtree(FILES, ignore_errors=True)
    FILES.mkdir()
    corpus = Corpus(FILES)
    for writers in LIBRARIES.values():
        for write in writers:
            write(corpus)
    write_oracle(corpus)
    for library, count in corpus.count.items():
        print(f"{library} {version(library)}: {count} files")
    total = sum(path.stat().st_size for path in FILES.iterdir())
    print(f"{len(corpus.files)} files of {total} bytes")


def write_oracle(corpus):
    """The oracle, a line for each file and each thing that they hold."""
    lines = ["{", '"libraries": ' + json.dumps({name: version(name) for name in LIBRARIES}) + ",", '"geometries": {']
    shapes = [f'"{name}": ' + json.dumps({"vertices": v, "polygons": f}) for name, (v, f) in GEOMETRIES.items()]
    lines += [",\n".join(shapes), "},", '"cloud": {']
    lines += [",\n".join(f'"{name}": ' + json.dumps(values) for name, values in CLOUD.items()), "},", '"files": {']
    lines += [",\n".join(f'"{name}": ' + json.dumps(entry) for name, entry in sorted(corpus.files.items())), "}", "}"]
    (HERE / "oracle.json").write_text("\n".join(lines) + "\n")
    json.loads((HERE / "oracle.json").read_text())


if __name__ == "__main__":
    sys.exit(main())
