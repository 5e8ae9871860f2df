"""Data sets as their page describes them: labels from code that shares nothing with the program, laws, and other people's readers."""

import io
import itertools
import json
import os
import re
import subprocess
import sysconfig
import tarfile
import time
from pathlib import Path
from statistics import NormalDist
from types import SimpleNamespace
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest
from PIL import Image

ENVIRONMENT = {**os.environ, "PATH": os.environ["PATH"] + os.pathsep + sysconfig.get_path("scripts")}

MATERIAL = """
slug = "{name}"
name = "{name}"
class = "paint"
description = "A law that is computed by hand."
licence = "CC0-1.0"
frequency_ghz = [290, 310]
theta_deg = [0, 80]
render = "stated"
[[source]]
key = "chosen"
kind = "synthetic"
title = "Chosen for a test"
licence = "CC0-1.0"
[[permittivity]]
key = "{name}"
frequency_ghz = 300
real = 1.6
imaginary = 0.08
source = "chosen"
[[fit]]
name = "stated"
estimator = "stated"
source = "chosen"
[fit.scattering]
model = "lambert"
albedo = {albedo}
"""


def command(folder, *words, threads=None, refused=False):
    """What the program says; the test fails where it fails."""
    environment = ENVIRONMENT if threads is None else {**ENVIRONMENT, "RAYON_NUM_THREADS": str(threads)}
    done = subprocess.run(["matdb", *words], cwd=folder, env=environment, capture_output=True, text=True, timeout=300)
    assert (done.returncode != 0) == refused, f"matdb {' '.join(words)}\n{done.stdout}{done.stderr}"
    return done.stderr if refused else done.stdout


def make(folder, scene, specification, name="ds"):
    (folder / "scene.toml").write_text(scene)
    (folder / "spec.toml").write_text(specification)
    command(folder, "dataset", "run", "spec.toml", "-o", name, "-q")
    return folder / name


def scans_of(folder):
    return pd.read_parquet(folder / "scans.parquet")


def points_of(folder):
    """All rows, each with the shard that holds it, since scans are counted from 0 in each split."""
    return pd.concat([pd.read_parquet(path).assign(shard=path.stem) for path in sorted((folder / "points").iterdir())], ignore_index=True)


def points_of_scan(points, scan):
    return points[(points.shard == scan["shard"]) & (points.scan == scan["scan"])].reset_index(drop=True)


def images_of(folder):
    """The files of each scan by its key: {key: {"json": bytes, …}}."""
    found = {}
    for path in sorted((folder / "images").iterdir()):
        with tarfile.open(path) as archive:
            for member in archive:
                key, _, kind = member.name.partition(".")
                found.setdefault(key, {})[kind] = archive.extractfile(member).read()
    return found


def drawn(scan, key, count=3):
    return np.array([scan[f"{key}.{axis}"] for axis in range(count)])


def rotation(degrees):
    """About the fixed axes x, then y, then z."""
    (cx, cy, cz), (sx, sy, sz) = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    about_x, about_y = [[1, 0, 0], [0, cx, -sx], [0, sx, cx]], [[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]]
    return np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]]) @ np.array(about_y) @ np.array(about_x)


def write_mesh(path, vertices, facets):
    header = f"ply\nformat ascii 1.0\nelement vertex {len(vertices)}\nproperty double x\nproperty double y\nproperty double z\n"
    header += f"element face {len(facets)}\nproperty list uchar int vertex_indices\nend_header\n"
    lines = [" ".join(repr(float(number)) for number in vertex) for vertex in vertices]
    lines += ["3 " + " ".join(str(int(corner)) for corner in facet) for facet in facets]
    path.write_text(header + "\n".join(lines) + "\n")


def sphere(radius_m, bands=8, sectors=12):
    """A closed mesh whose facets all have three corners."""
    polar, azimuth = np.meshgrid(np.linspace(0, np.pi, bands + 1)[1:-1], np.arange(sectors) * 2 * np.pi / sectors, indexing="ij")
    rings = np.stack([np.sin(polar) * np.cos(azimuth), np.cos(polar), -np.sin(polar) * np.sin(azimuth)], axis=2).reshape(-1, 3)
    vertices = np.vstack([rings, [[0, 1, 0], [0, -1, 0]]]) * radius_m
    facets = []
    for band, sector in itertools.product(range(bands - 1), range(sectors)):
        here, there = band * sectors + sector, band * sectors + (sector + 1) % sectors
        if band == 0:
            facets.append([len(rings), here, there])
        if band == bands - 2:
            facets.append([len(rings) + 1, there, here])
        else:
            facets += [[here, here + sectors, there], [there, here + sectors, there + sectors]]
    return vertices, np.array(facets)


# --- Labels -----------------------------------------------------------------------------------------------------------------------

WALL = np.array([[-0.5, 0.6, 0], [0.2, 0.6, 0.1], [0.2, 1.6, 0], [-0.5, 1.6, -0.1]])
SHEET = np.array([[-0.05, -0.2, 0], [0.3, -0.2, 0], [0.3, 0.2, 0], [-0.05, 0.2, 0]])
SQUARE = np.array([[0, 1, 2], [0, 2, 3]])
BALL, BALL_FACETS = sphere(0.08)
ALBEDO = {"wall": 0.8, "plate": 0.5, "sheet": 0.05}

LABELS_SCENE = """
[radar]
threshold_dbm = -50
returns = "all"
[radar.scan]
pattern = "rays"
file = "rays.csv"
[radar.beam]
edge_growth = 1
[spot]
rays = 1
[[mesh]]
name = "wall"
file = "wall.ply"
[[mesh]]
name = "plate"
file = "plate.ply"
[[mesh]]
name = "sheet"
file = "sheet.ply"
translation_m = [0, 1.1, 0.45]
[[region]]
name = "wall"
material = "of-wall"
[[region]]
name = "plate"
material = "of-plate"
mesh = "plate"
[[region]]
name = "sheet"
material = "of-sheet"
mesh = "sheet"
thickness_m = 0.0005
"""
LABELS = """
name = "labels"
scene = "scene.toml"
scans = 8
seed = 3
objects = ["plate"]
licence = "CC0-1.0"
split = { train = 0.5, validation = 0.25, test = 0.25 }
[[choose]]
name = "size"
apart = true
option = [
    { name = "large", set = { "mesh.plate.scale" = 1.0 } },
    { name = "middle", set = { "mesh.plate.scale" = 0.8 } },
    { name = "small", set = { "mesh.plate.scale" = 0.6 } },
]
[[vary]]
keys = ["mesh.plate.rotation_deg"]
from = [-180, -90, -180]
to = [180, 90, 180]
[[vary]]
keys = ["mesh.plate.translation_m"]
from = [-0.1, 1.0, 0.12]
to = [0.25, 1.2, 0.15]
[[vary]]
keys = ["mesh.sheet.rotation_deg"]
from = [-30, -30, -90]
to = [30, 30, 90]
[[vary]]
keys = ["radar.system_loss_db"]
mean = 12
sd = 1
[[vary]]
keys = ["radar.air_loss_db_per_m"]
from = 0
to = 0.1
"""


def write_rays(path, rng):
    """Beams from places of their own to a grid of points, some of them past everything."""
    x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(-0.25, 0.25, 40), np.linspace(-0.25, 0.25, 40)))
    aims = np.stack([x, 1.1 + y, np.zeros_like(x)], axis=1)
    origins = np.array([0, 1.1, 8]) + rng.normal(0, 0.01, aims.shape)
    directions = (aims - origins) * rng.uniform(0.5, 2, (len(aims), 1))
    directions[::50] *= [1, 1, -1]
    rows = [f"{chirp},{chirp * 2e-4!r}," + ",".join(repr(float(one)) for one in [*origin, *direction])
            for chirp, (origin, direction) in enumerate(zip(origins, directions))]
    path.write_text("chirp,time_s,ox_m,oy_m,oz_m,dx,dy,dz\n" + "\n".join(rows) + "\n")
    return origins, directions / np.linalg.norm(directions, axis=1, keepdims=True)


@pytest.fixture(scope="module")
def labels(tmp_path_factory):
    folder = tmp_path_factory.mktemp("labels")
    for name, albedo in ALBEDO.items():
        (folder / f"of-{name}").mkdir()
        (folder / f"of-{name}" / "material.toml").write_text(MATERIAL.format(name=f"of-{name}", albedo=albedo))
        command(folder, "add", "--from", f"of-{name}")
    for name, mesh in {"wall": (WALL, SQUARE), "plate": (BALL, BALL_FACETS), "sheet": (SHEET, SQUARE)}.items():
        write_mesh(folder / f"{name}.ply", *mesh)
    origins, directions = write_rays(folder / "rays.csv", np.random.default_rng(1))
    data = make(folder, LABELS_SCENE, LABELS)
    return SimpleNamespace(folder=folder, data=data, origins=origins, directions=directions, scans=scans_of(data), points=points_of(data))


def stand(scan):
    """Corners of all facets where a row of scans.parquet says that they stand, and the instance of each, from 1."""
    scale = {"large": 1.0, "middle": 0.8, "small": 0.6}[scan["choose.size"]]
    plate = scale * BALL @ rotation(drawn(scan, "mesh.plate.rotation_deg")).T + drawn(scan, "mesh.plate.translation_m")
    sheet = SHEET @ rotation(drawn(scan, "mesh.sheet.rotation_deg")).T + [0, 1.1, 0.45]
    meshes = [WALL[SQUARE], plate[BALL_FACETS], sheet[SQUARE]]
    return np.concatenate(meshes), np.repeat([1, 2, 3], [len(mesh) for mesh in meshes])


def cast(origins, directions, corners):
    """Möller and Trumbore: the distance of each facet along each ray, infinite where they do not meet."""
    a, to_b, to_c = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    p = np.cross(directions[:, None], to_c[None])
    determinant = (p * to_b).sum(2)
    from_a = origins[:, None] - a[None]
    u = (from_a * p).sum(2) / determinant
    q = np.cross(from_a, to_b[None])
    v = (q * directions[:, None]).sum(2) / determinant
    distance = (q * to_c).sum(2) / determinant
    return np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (distance > 0), distance, np.inf)


def passed_db(direction, normal):
    """What 0.5 mm of a dielectric let through, there and back, of an upright field at the centre frequency."""
    k, thickness, eps = 2 * np.pi * 300e9 / 299792458, 0.0005, 1.6 - 0.08j
    cosine = abs(direction @ normal)
    inside = np.sqrt(eps - (1 - cosine**2))
    across, along = (cosine - inside) / (cosine + inside), (eps * cosine - inside) / (eps * cosine + inside)
    once = np.exp(-1j * k * thickness * inside)
    t_s, t_p = [(1 - r**2) * once / (1 - r**2 * once**2) for r in (across, along)]
    upright = np.array([0, 1, 0]) - direction[1] * direction
    s = np.cross(direction, normal)
    in_s = (upright @ s) ** 2 / (upright @ upright) / max(s @ s, 1e-30)
    return 20 * np.log10(abs(t_s**2 * in_s + t_p**2 * (1 - in_s)))


def expected_returns(labels, scan):
    """The columns of points that the rays of a scan must have, a dictionary for each return."""
    corners, owner = stand(scan)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    wavelength = 299792458 / 300e9
    waist = 0.016 / np.sqrt(2 * np.log(2))
    for chirp, along in enumerate(cast(labels.origins, labels.directions, corners)):
        met = [facet for facet in np.argsort(along) if np.isfinite(along[facet])]
        opaque = [place for place, facet in enumerate(met) if owner[facet] != 3]
        path = met[: opaque[0] + 1] if opaque else met
        loss_db = 0.0
        for sheets, facet in enumerate(path):
            cosine = abs(labels.directions[chirp] @ normals[facet])
            reached = along[facet]
            radius2 = waist**2 * (1 + ((reached - 8) * wavelength / (np.pi * waist**2)) ** 2)
            share = wavelength**2 / (np.pi * radius2) * list(ALBEDO.values())[owner[facet] - 1] / np.pi * cosine**2
            level = 7 - scan["radar.system_loss_db"] - 2 * reached * scan["radar.air_loss_db_per_m"] + 10 * np.log10(share) + loss_db
            yield {"chirp": chirp, "facet": facet, "instance": owner[facet], "sheets": sheets, "true_range_m": reached,
                   "theta_deg": np.degrees(np.arccos(cosine)), "passed_db": loss_db, "mean_power_dbm": level,
                   "sight_instance": owner[path[-1]], "sight_range_m": along[path[-1]]}
            loss_db += passed_db(labels.directions[chirp], normals[facet])
        if not path:
            yield {"chirp": chirp, "facet": -1, "instance": -1, "sheets": -1, "sight_instance": -1}


def test_causes_and_powers_are_those_of_rays_that_are_cast_by_hand(labels):
    kinds = set()
    for scan in labels.scans.to_dict("records"):
        found = points_of_scan(labels.points, scan)
        expected = pd.DataFrame(expected_returns(labels, scan))
        assert len(found) == len(expected)
        for column in ["chirp", "instance", "facet", "sheets", "sight_instance"]:
            assert (found[column] == expected[column]).all(), column
        tolerances = {"true_range_m": 2e-6, "sight_range_m": 2e-6, "theta_deg": 1e-3, "passed_db": 0.02, "mean_power_dbm": 0.02}
        for column, tolerance in tolerances.items():
            np.testing.assert_allclose(found[column], expected[column], rtol=0, atol=tolerance, err_msg=column)
        # Without a sheet in front nothing is taken from one: the equation alone, to the digits of the table.
        bare = expected.sheets == 0
        np.testing.assert_allclose(found.mean_power_dbm[bare], expected.mean_power_dbm[bare], rtol=0, atol=2e-5)
        assert (found.power_dbm == found.mean_power_dbm)[bare].all(), "there is no noise and no speckle"
        kinds |= {f"{first}>{last}" for first, last in zip(expected.instance, expected.sight_instance)}
    # Every case is there: all surfaces alone, all behind the sheet, the sheet alone, and nothing.
    assert kinds == {"1>1", "2>2", "3>1", "3>2", "3>3", "-1>-1"}


def test_threats_materials_and_counts_follow_from_the_sight(labels):
    materials = re.search(r"^materials = (\[.*\])$", (labels.data / "plan.toml").read_text(), re.MULTILINE).group(1)
    number = {name: place for place, name in enumerate(json.loads(materials))}
    of_instance = {-1: -1, **{place + 1: number[f"of-{name}"] for place, name in enumerate(ALBEDO)}}
    points = labels.points
    assert (points.material == points.instance.map(of_instance)).all()
    assert (points.sight_material == points.sight_instance.map(of_instance)).all()
    assert (points.threat == (points.sight_instance == 2)).all() and points.threat.any() and not points.threat.all()
    missed = points.instance == -1
    # A spot of one ray is the beam's axis.
    assert (points.threat_share == points.threat).all()
    measured = ["x_m", "y_m", "z_m", "range_m", "power_dbm", "mean_power_dbm", "true_range_m", "theta_deg"]
    assert points.loc[missed, measured].isna().all(axis=None) and points.loc[~missed, measured].notna().all(axis=None)
    assert (points.detected == (points.power_dbm >= -50)).all() and points.detected.any() and not points.detected[~missed].all()
    for scan in labels.scans.to_dict("records"):
        own = points_of_scan(points, scan)
        hits, threats = own[own.instance > 0].chirp.nunique(), own[own.threat].chirp.nunique()
        assert (scan["chirps"], scan["hits"], scan["threat_chirps"]) == (1600, hits, threats)
        assert scan["detections"] == own.detected.sum()


# --- Images -----------------------------------------------------------------------------------------------------------------------


def pixels(png):
    image = Image.open(io.BytesIO(png))
    assert image.mode == "I;16"
    return np.array(image)


def box_of(mask):
    """Column, row, width and height of what is true."""
    rows, columns = np.nonzero(mask)
    return [int(columns.min()), int(rows.min()), int(np.ptp(columns)) + 1, int(np.ptp(rows)) + 1]


def test_boxes_enclose_the_pixels_of_their_instance(labels):
    images = images_of(labels.data)
    assert sorted(images) == sorted(labels.scans.key)
    for scan in labels.scans.to_dict("records"):
        files = images[scan["key"]]
        record, instance, material = json.loads(files["json"]), pixels(files["instance.png"]), pixels(files["material.png"])
        assert instance.shape == material.shape == (record["height"], record["width"])
        assert set(np.unique(instance)) <= {0, 1, 2, 3}
        boxes = {box["name"]: box for box in record["boxes"]}
        own = points_of_scan(labels.points, scan).drop_duplicates("chirp")
        corners, owner = stand(scan)
        for number, name in enumerate(ALBEDO, start=1):
            box, mask = boxes[name], instance == number
            assert (box["instance"], box["threat"], box["pixels"]) == (number, name == "plate", mask.sum())
            assert box["bbox"] == (box_of(mask) if mask.any() else None)
            assert box["chirps"] == (own.sight_instance == number).sum()
            np.testing.assert_allclose(box["min_m"], corners[owner == number].min((0, 1)), atol=1e-6)
            np.testing.assert_allclose(box["max_m"], corners[owner == number].max((0, 1)), atol=1e-6)
            # One more than in the table, since 0 is nothing.
            of_table = own.sight_material[own.sight_instance == number].unique()
            assert not mask.any() or set(np.unique(material[mask])) == {of_table[0] + 1}
        assert not material[instance == 0].any()
        # Where all beams within 2 cm look at one mesh, so does the pixel in their middle.
        at = own[["xt_m", "yt_m"]].to_numpy()
        column = np.floor((at[:, 0] - record["x_min_m"]) / record["pixel_m"]).astype(int)
        row = record["height"] - 1 - np.floor((at[:, 1] - record["y_min_m"]) / record["pixel_m"]).astype(int)
        sight, compared = own.sight_instance.to_numpy(), set()
        for place in range(0, len(own), 3):
            near = sight[np.hypot(*(at - at[place]).T) < 0.02]
            if len(near) > 4 and near.min() == near.max() > 0:
                assert instance[row[place], column[place]] == near[0]
                compared.add(near[0])
        assert {1, 2} <= compared


def coco_files(folder):
    return sorted(path for path in folder.rglob("*.json") if set(json.loads(path.read_text())) >= {"images", "annotations", "categories"})


@pytest.fixture(scope="module")
def published(labels):
    command(labels.folder, "dataset", "publish", "ds", "-q")
    return labels


def test_published_boxes_are_those_of_the_images(published):
    images = images_of(published.data)
    found = set()
    for path in coco_files(published.data):
        coco = json.loads(path.read_text())
        names = {category["id"]: category["name"] for category in coco["categories"]}
        keys = {image["id"]: image["file_name"].split("/")[-1].split(".")[0] for image in coco["images"]}
        for image in coco["images"]:
            record = json.loads(images[keys[image["id"]]]["json"])
            assert (image["width"], image["height"]) == (record["width"], record["height"])
        identities = [annotation["id"] for annotation in coco["annotations"]]
        assert len(set(identities)) == len(identities)
        found |= {(keys[one["image_id"]], names[one["category_id"]], *one["bbox"]) for one in coco["annotations"]}
    boxes = [(key, box) for key, files in images.items() for box in json.loads(files["json"])["boxes"]]
    expected = {(key, box["name"], *box["bbox"]) for key, box in boxes if box["bbox"]}
    assert found == expected and len(found) > 4
    in_voc = set()
    for path in published.data.rglob("voc/*.tar"):
        with tarfile.open(path) as archive:
            for name in archive.getnames():
                document = ElementTree.parse(archive.extractfile(name)).getroot()
                assert document.findtext("filename") == name.removesuffix(".xml") + ".power.exr"
                for one in document.iter("object"):
                    left, top, right, bottom = (int(one.findtext(f"bndbox/{side}")) for side in ("xmin", "ymin", "xmax", "ymax"))
                    box = (left - 1, top - 1, right - left + 1, bottom - top + 1)
                    in_voc.add((name.removesuffix(".xml"), one.findtext("name"), *box))
    assert in_voc == expected


# --- Places -----------------------------------------------------------------------------------------------------------------------

PLATE = np.array([0.05, 0.03, 0.004])
CORNERS = np.array(list(itertools.product([-0.5, 0.5], repeat=3))) * PLATE
PLACED_SCENE = """
[radar.scan]
pattern = "raster"
lines = 10
chirps_per_line = 10
width_m = 0.3
height_m = 0.3
[[mesh]]
name = "ball"
file = "ball.ply"
translation_m = [0, 1.1, 0]
[[mesh]]
name = "plate"
file = "builtin:cuboid"
size_m = [0.05, 0.03, 0.004]
[[mesh]]
name = "shell"
file = "shell.ply"
translation_m = [0, 1.1, 0]
[[region]]
name = "all"
material = "mannequin-paint"
[[region]]
name = "shell"
material = "cotton"
mesh = "shell"
thickness_m = 0.0005
"""
PLACED = """
name = "placed"
scene = "scene.toml"
scans = 100
seed = 4
images = false
licence = "CC0-1.0"
[[vary]]
keys = ["mesh.ball.rotation_deg"]
from = [-180, -90, -180]
to = [180, 90, 180]
[[place]]
mesh = "plate"
on = "ball"
under = ["shell"]
box = { min_m = [-0.1, 1.0, 0], max_m = [0.15, 1.25, 0.3] }
gap_m = 0.003
most_tilt_deg = 40
"""


def spiked(ball, facets, rng):
    """The ball with thin spikes, 6 mm high and 1 mm wide."""
    vertices, corners = list(ball), list(facets)
    radius = np.linalg.norm(ball[0])
    for tip in rng.normal(size=(60, 3)):
        tip /= np.linalg.norm(tip)
        side = np.cross(tip, [0, 1, 0]) / np.linalg.norm(np.cross(tip, [0, 1, 0]))
        foot = [0.97 * radius * tip + 0.001 * (np.cos(turn) * side + np.sin(turn) * np.cross(tip, side)) for turn in (0, 2.1, 4.2)]
        first = len(vertices)
        vertices += [*foot, (radius + 0.006) * tip]
        corners += [[first + a, first + b, first + 3] for a, b in [(0, 1), (1, 2), (2, 0)]]
    return np.array(vertices), np.array(corners)


def place(folder, ball, facets):
    """For each scan: vertices of the ball in the plate's own frame, the plate's corners about the ball, its axis and its middle."""
    write_mesh(folder / "ball.ply", ball, facets)
    write_mesh(folder / "shell.ply", *sphere(0.24, 40, 60))
    for scan in scans_of(make(folder, PLACED_SCENE, PLACED)).to_dict("records"):
        turned, middle = rotation(drawn(scan, "mesh.plate.rotation_deg")), drawn(scan, "mesh.plate.translation_m")
        stands = ball @ rotation(drawn(scan, "mesh.ball.rotation_deg")).T + [0, 1.1, 0]
        corners = CORNERS @ turned.T + middle - [0, 1.1, 0]
        yield SimpleNamespace(own=(stands - middle) @ turned, corners=corners, axis=turned[:, 2], middle=middle)


def test_a_placed_mesh_stands_off_the_surface_and_faces_outwards(tmp_path):
    ball, facets = sphere(0.2, 40, 60)
    middles = []
    for placed in place(tmp_path, ball, facets):
        # The ball is convex, so that its highest vertex along the axis is its highest point.
        gap_m = -PLATE[2] / 2 - placed.own[:, 2].max()
        # 2 %: the highest point may be that of a facet which is only partly below the plate. Its sides are up to 21 mm long.
        assert abs(gap_m - 0.003) < 0.00006
        # No corner is in the ball, and all are under the shell.
        from_centre = np.linalg.norm(placed.corners, axis=1)
        assert from_centre.min() > 0.2 and from_centre.max() < 0.24 * np.cos(np.pi / 40)
        assert placed.axis @ (placed.middle - [0, 1.1, 0]) > 0.2 * np.cos(np.radians(5))
        to_radar = np.array([0, 1.1, 8]) - placed.middle
        # The tilt is that of the surface at the foot, 5 mm below the middle.
        assert placed.axis @ to_radar / np.linalg.norm(to_radar) > np.cos(np.radians(40.5))
        foot = placed.middle - 0.005 * placed.axis
        assert (foot > [-0.101, 0.999, -0.001]).all() and (foot < [0.151, 1.251, 0.301]).all()
        middles.append(placed.middle)
    # They are all over the box.
    assert (np.ptp(middles, axis=0)[:2] > 0.18).all()


def test_a_placed_mesh_is_not_pierced(tmp_path):
    below = 0
    for placed in place(tmp_path, *spiked(*sphere(0.2, 40, 60), np.random.default_rng(2))):
        beside = (abs(placed.own[:, :2]) <= PLATE[:2] / 2).all(axis=1)
        gap_m = -PLATE[2] / 2 - placed.own[beside & (placed.own[:, 2] < 0.1), 2].max()
        assert gap_m > 0.003 - 1e-6
        below += (placed.own[beside, 2].max() + PLATE[2] / 2 + 0.003 > -1e-4) and beside[-240:].any()
    assert below > 10, "spikes are below some of the plates"


# --- Draws ------------------------------------------------------------------------------------------------------------------------

DRAWN_SCENE = """
[radar]
threshold_dbm = -60
[radar.scan]
pattern = "raster"
lines = 4
chirps_per_line = 4
width_m = 0.1
height_m = 0.1
[radar.speckle]
looks = 2
[radar.noise]
level_dbm = -80
[[mesh]]
name = "plate"
file = "builtin:plate"
size_m = [1, 1, 0]
translation_m = [0, 1.1, 0]
[[region]]
name = "all"
material = "mannequin-paint"
"""
DRAWN = """
name = "drawn"
scene = "scene.toml"
scans = 400
seed = 5
repeats = 2
images = false
licence = "CC0-1.0"
split = { train = 0.75, test = 0.25 }
[[choose]]
name = "person"
apart = true
option = [
    { name = "a", set = { "mesh.plate.scale" = 1.0 } },
    { name = "b", set = { "mesh.plate.scale" = 1.1 } },
    { name = "c", set = { "mesh.plate.scale" = 1.2 } },
    { name = "d", set = { "mesh.plate.scale" = 1.3 }, split = "test" },
]
[[choose]]
name = "pose"
option = [{ name = "left", set = { "radar.tau_deg" = 0.1 } }, { name = "right", set = { "radar.tau_deg" = -0.1 } }]
[[vary]]
keys = ["mesh.plate.rotation_deg"]
from = [-2, 10, 0]
to = [2, 20, 0]
[[vary]]
keys = ["radar.system_loss_db"]
mean = 12
sd = 2
[[vary]]
keys = ["region.all.material"]
values = ["mannequin-paint", "aluminium", "nylon"]
[[vary]]
keys = ["radar.air_loss_db_per_m"]
values = [0, 0.01]
[[effect]]
name = "drift"
share = 0.3
parameters = { slope_db = [-3, 1] }
"""


@pytest.fixture(scope="module")
def draws(tmp_path_factory):
    folder = tmp_path_factory.mktemp("draws")
    data = make(folder, DRAWN_SCENE, DRAWN)
    return SimpleNamespace(folder=folder, data=data, scans=scans_of(data), points=points_of(data))


def far_from(values, law):
    """Kolmogorov and Smirnov's distance over what one draw in a thousand exceeds."""
    values = np.sort(values)
    steps = np.arange(len(values) + 1) / len(values)
    expected = np.array([law(value) for value in values])
    return max(abs(expected - steps[1:]).max(), abs(expected - steps[:-1]).max()) * np.sqrt(len(values)) / 1.95


def uniform(lowest, highest):
    return lambda value: (value - lowest) / (highest - lowest)


def test_numbers_have_the_laws_that_are_stated(draws):
    targets = draws.scans.drop_duplicates("target")
    assert len(targets) == 200
    assert far_from(targets["mesh.plate.rotation_deg.0"], uniform(-2, 2)) < 1
    assert far_from(targets["mesh.plate.rotation_deg.1"], uniform(10, 20)) < 1
    assert far_from(targets["radar.system_loss_db"], NormalDist(12, 2).cdf) < 1
    assert abs(targets["radar.system_loss_db"].std() / 2 - 1) < 3 / np.sqrt(2 * 200)
    slopes = targets["effect.drift.slope_db"].dropna()
    assert far_from(slopes, uniform(-3, 1)) < 1
    # Three standard deviations of a share, and of a correlation between what is drawn by itself.
    assert abs(len(slopes) / 200 - 0.3) < 3 * np.sqrt(0.3 * 0.7 / 200)
    numbers = targets[["mesh.plate.rotation_deg.0", "mesh.plate.rotation_deg.1", "radar.system_loss_db"]].corr().to_numpy()
    assert abs(numbers[np.triu_indices(3, 1)]).max() < 3 / np.sqrt(200)


def test_values_and_options_are_used_alike(draws):
    targets = draws.scans.drop_duplicates("target")
    for column, count in [("region.all.material", 3), ("radar.air_loss_db_per_m", 2), ("choose.pose", 2)]:
        used = targets[column].value_counts()
        assert len(used) == count and abs(used / 200 - 1 / count).max() < 3 * np.sqrt((count - 1) / 200) / count, column


def test_splits_are_those_of_the_options_that_are_kept_apart(draws):
    scans = draws.scans
    assert scans.split.value_counts().to_dict() == {"train": 300, "test": 100}
    of_person = scans.groupby("choose.person").split.unique()
    assert all(len(splits) == 1 for splits in of_person) and of_person["d"][0] == "test" and len(of_person) == 4
    within = scans[scans.split == "train"]["choose.person"].value_counts()
    assert within.max() / within.min() < 1.5
    assert json.loads(command(draws.folder, "dataset", "check", "ds", "--json", "-q"))["complete"]


def test_repeats_differ_in_noise_alone(draws):
    same = [column for column in draws.scans if column not in ("key", "scan", "noise_seed", "detections")]
    pairs = [pair for _, pair in draws.scans.groupby("target")]
    assert all(len(pair) == 2 and len(pair[same].drop_duplicates()) == 1 for pair in pairs)
    assert draws.scans.noise_seed.nunique() == 400 and draws.scans.seed.nunique() == 200
    for pair in pairs[::10]:
        first, second = (points_of_scan(draws.points, scan) for scan in pair.to_dict("records"))
        assert first.mean_power_dbm.equals(second.mean_power_dbm) and not (first.power_dbm == second.power_dbm).any()


def cloud(path):
    """Columns of a cloud."""
    kinds = {"double": "<f8", "float": "<f4", "int": "<i4", "uchar": "u1"}
    header, _, rows = path.read_bytes().partition(b"end_header\n")
    columns = re.findall(r"^property (\w+) (\w+)$", header.decode(), re.MULTILINE)
    return np.frombuffer(rows, np.dtype([(name, kinds[kind]) for kind, name in columns]))


OPTIONS = {"a": 1.0, "b": 1.1, "c": 1.2, "d": 1.3, "left": 0.1, "right": -0.1}


def test_a_row_of_scans_is_enough_to_render_it(draws):
    drifting = draws.scans["effect.drift.slope_db"].notna().to_numpy()
    for number in [np.flatnonzero(drifting)[0], np.flatnonzero(~drifting)[1]]:
        scan = draws.scans.iloc[number]
        keys = {key: int(scan[key]) for key in ["seed", "noise_seed"]}
        keys |= {key: scan[key] for key in ["radar.system_loss_db", "radar.air_loss_db_per_m", "region.all.material"]}
        keys |= {"mesh.plate.scale": OPTIONS[scan["choose.person"]], "radar.tau_deg": OPTIONS[scan["choose.pose"]]}
        keys["mesh.plate.rotation_deg"] = drawn(scan, "mesh.plate.rotation_deg").tolist()
        if drifting[number]:
            keys["radar.effect.drift.slope_db"] = scan["effect.drift.slope_db"]
        words = [word for key, value in keys.items() for word in ("--set", f"{key}={value}")]
        command(draws.folder, "render", "scene.toml", "--all", "-o", f"scan-{number}", *words)
        rendered = cloud(draws.folder / f"scan-{number}" / "cloud.ply")
        points = points_of_scan(draws.points, scan)
        assert len(rendered) == len(points) == 16
        for column in ["chirp", "facet", "power_dbm", "range_m"]:
            np.testing.assert_array_equal(points[column], rendered[column], err_msg=column)


def bytes_of(folder):
    """All files but plan.toml, which has times."""
    paths = [path for path in folder.rglob("*") if path.is_file() and path.name != "plan.toml"]
    return {str(path.relative_to(folder)): path.read_bytes() for path in paths}


def test_the_same_specification_gives_the_same_bytes(labels):
    command(labels.folder, "dataset", "plan", "spec.toml", "-o", "again", "-q", threads=1)
    command(labels.folder, "dataset", "shard", "again", "0/1", "-q", threads=1)
    command(labels.folder, "dataset", "run", "again", "-q", threads=1)
    # What `publish` adds is left out.
    first, again = bytes_of(labels.data), bytes_of(labels.folder / "again")
    assert {name: first[name] for name in again} == again
    assert {name.split("/")[0] for name in again} == {"images", "inputs", "manifests", "points", "scans.parquet", "spec.toml"}
    other = labels.folder / "other.toml"
    other.write_text(LABELS.replace("seed = 3", "seed = 4"))
    command(labels.folder, "dataset", "run", "other.toml", "-o", "other", "-q")
    shard = f"points/{labels.scans.shard[0]}.parquet"
    assert bytes_of(labels.folder / "other")[shard] != first[shard]
    assert set(scans_of(labels.folder / "other")["radar.system_loss_db"]).isdisjoint(labels.scans["radar.system_loss_db"])


def test_work_that_was_killed_goes_on_to_the_same_bytes(draws):
    words = ["matdb", "dataset", "run", "spec.toml", "-o", "killed", "-q"]
    with subprocess.Popen(words, cwd=draws.folder, env=ENVIRONMENT) as run:
        while run.poll() is None and not list(draws.folder.glob("killed/manifests/*.json")):
            time.sleep(0.01)
        run.kill()
    command(draws.folder, "dataset", "run", "killed", "-q")
    # Hidden files are half written ones, which `check` removes once they are old.
    found = {name: content for name, content in bytes_of(draws.folder / "killed").items() if "/.matdb-" not in name}
    assert found == bytes_of(draws.data)


# --- Posterior --------------------------------------------------------------------------------------------------------------------

POSTERIOR_SCENE = DRAWN_SCENE.replace("mannequin-paint", "mine").replace("[radar.scan]", "[radar.beam]\nedge_growth = 1\n[radar.scan]")
POSTERIOR = """
name = "posterior"
scene = "scene.toml"
scans = 400
seed = 6
images = false
licence = "CC0-1.0"
[[posterior]]
material = "mine"
fit = "{fit}"
inflate = {inflate}
"""


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    """A folder with a material that was fitted to a curve of a known law, and what `show` states of the fit."""
    folder = tmp_path_factory.mktemp("fitted")
    angles = np.repeat(np.arange(0, 70, 0.5), 2)
    speckle = np.random.default_rng(7).gamma(8, 1 / 8, len(angles))
    cosine = np.cos(np.radians(angles))
    sigma = 4 * np.pi * cosine**2 * (0.004 * cosine**3 + 0.5 * np.exp(-np.tan(np.radians(angles)) ** 2 / 0.1**2) / cosine**6)
    rows = [f"{angle},{10 * np.log10(level)}" for angle, level in zip(angles, sigma * speckle)]
    (folder / "curve.csv").write_text("theta_deg,sigma0_db\n" + "\n".join(rows) + "\n")
    about = ["--name", "mine", "--class", "paint", "--kind", "synthetic", "--source", "A test", "--licence", "CC0-1.0"]
    command(folder, "add", "--from", "curve.csv", *about, "--instrument", "None", "--frequency", "300", "--threshold", "-77")
    command(folder, "fit", "mine", "--looks", "8", "--save")
    shown = json.loads(command(folder, "show", "mine", "--json", "-q"))
    return SimpleNamespace(folder=folder, shown=shown)


def law_dbm(points, k, alpha, r_s, f_lambda, m):
    """The paper's five parameters, Beckmann's facets with G1·G1, in the preset's beam without growth, 12.5 dB lost."""
    theta, wavelength, waist = np.radians(points.theta_deg.to_numpy(float)), 299792458 / 300e9, 0.016 / np.sqrt(2 * np.log(2))
    tangent, cosine = np.tan(theta), np.cos(theta)
    a = np.minimum(1 / (m * np.maximum(tangent, 1e-9)), 1.6)
    g = np.where(a < 1.6, (3.535 * a + 2.181 * a**2) / (1 + 2.276 * a + 2.577 * a**2), 1)
    facets = np.exp(-(tangent**2) / m**2) / (np.pi * m**2 * cosine**4)
    f = k * r_s * (alpha + 2) / (2 * np.pi) * cosine**alpha + (1 - k) * f_lambda * facets * g**2 / (4 * cosine**2)
    radius2 = waist**2 * (1 + ((points.true_range_m.to_numpy(float) - 8) * wavelength / (np.pi * waist**2)) ** 2)
    return 7 - 12.5 + 10 * np.log10(wavelength**2 / (np.pi * radius2) * f * cosine**2)


def test_laws_are_drawn_from_the_covariance_of_their_fit(fitted):
    [fit] = fitted.shown["material"]["fits"]
    stated = {estimate["name"]: estimate["value"] for estimate in fit["report"]["estimates"]}
    names, covariance, k = list(stated), np.array(fit["report"]["covariance"]), fit["model"]["k"]
    means, sd = np.array(list(stated.values())), np.sqrt(np.diag(covariance))
    assert names == ["R", "diffuse.alpha", "S", "specular.m"] and (sd < 0.1 * means).all()
    for inflate in [1, 2]:
        data = make(fitted.folder, POSTERIOR_SCENE, POSTERIOR.format(fit=fit["name"], inflate=inflate), f"ds-{inflate}")
        scans = scans_of(data)
        law = {name: scans[f"material.mine.{name}"] for name in ["diffuse.r_s", "diffuse.alpha", "specular.f_lambda", "specular.m"]}
        # Backscatter knows the products R and S; k is a convention, and stays.
        found = np.stack([k * law["diffuse.r_s"], law["diffuse.alpha"], (1 - k) * law["specular.f_lambda"], law["specular.m"]])
        z = (found - means[:, None]) / (inflate * sd)[:, None]
        # 3.5 standard errors of means, and of variances and covariances of a normal law.
        assert (abs(z.mean(axis=1)) < 3.5 / 20).all()
        expected = covariance / np.outer(sd, sd)
        assert (abs(np.cov(z) - expected) < 3.5 * np.sqrt((1 + expected**2) / 400)).all()
        # And they are rendered.
        points = points_of(data)
        for scan in scans.to_dict("records")[:50]:
            own = points_of_scan(points, scan)
            numbers = {name.split(".")[1]: scan[f"material.mine.{name}"] for name in law}
            np.testing.assert_allclose(own.mean_power_dbm, law_dbm(own, k=k, **numbers), rtol=0, atol=0.002)


def test_a_posterior_without_spread_is_the_fit(fitted):
    [fit] = fitted.shown["material"]["fits"]
    specification = POSTERIOR.format(fit=fit["name"], inflate=0).replace("scans = 400", "scans = 3")
    scans = scans_of(make(fitted.folder, POSTERIOR_SCENE, specification, "ds-0"))
    for part, name in [("diffuse", "alpha"), ("diffuse", "r_s"), ("specular", "f_lambda"), ("specular", "m")]:
        np.testing.assert_allclose(scans[f"material.mine.{part}.{name}"], fit["model"][part][name], rtol=1e-12)


def test_a_material_without_a_covariance_is_refused(fitted):
    specification = POSTERIOR.format(fit="stated", inflate=1).replace('"mine"', '"nylon"')
    (fitted.folder / "spec.toml").write_text(specification)
    (fitted.folder / "scene.toml").write_text(DRAWN_SCENE.replace("mannequin-paint", "nylon"))
    assert "covariance" in command(fitted.folder, "dataset", "run", "spec.toml", "-o", "ds-refused", refused=True)


# --- Readers ----------------------------------------------------------------------------------------------------------------------


def test_every_chirp_of_every_scan_has_a_row(draws, labels):
    for data in [draws, labels]:
        assert (data.points.antenna == 0).all()
        chirps = data.points.groupby(["shard", "scan"]).chirp.unique()
        assert len(chirps) == len(data.scans) and data.scans.key.nunique() == len(data.scans)
        for scan in data.scans.to_dict("records"):
            assert sorted(chirps[scan["shard"], scan["scan"]]) == list(range(scan["chirps"]))
    assert (labels.points["rank"] == 0).equals(labels.points.instance == -1) and (labels.points["rank"] == 0).any()


def test_polars_reads_what_pandas_reads(published):
    import polars as pl

    scans = pl.read_parquet(published.data / "scans.parquet")
    assert scans["key"].to_list() == list(published.scans.key) and scans["split"].to_list() == list(published.scans.split)
    points = pl.read_parquet(published.data / "points" / "*.parquet")
    columns = [column for column in published.points if column != "shard"]
    assert points.columns == columns and len(points) == len(published.points)
    for column in ["power_dbm", "instance", "threat"]:
        np.testing.assert_array_equal(points[column].to_numpy(), published.points[column])


def test_croissant_reads_what_pandas_reads(published):
    import mlcroissant

    croissant = mlcroissant.Dataset(str(published.data / "croissant.json"))
    scans = list(croissant.records("scans"))
    assert [scan["scans/key"].decode() for scan in scans] == list(published.scans.key)
    assert [scan["scans/split"].decode() for scan in scans] == list(published.scans.split)
    assert {record["split_names/name"] for record in croissant.records("split_names")} == {"train", "validation", "test"}
    # Its reader is slow: the first rows are enough.
    points = pd.DataFrame(itertools.islice(croissant.records("points"), 2000))
    for column in ["instance", "chirp", "detected", "threat"]:
        assert list(points[f"points/{column}"]) == list(published.points[column][:2000])


def test_webdataset_reads_all_images_of_a_split(published):
    import webdataset

    for split, scans in published.scans.groupby("split"):
        paths = sorted(str(path) for path in (published.data / "images").glob(f"{split}-*.tar"))
        assert {Path(path).stem for path in paths} == set(scans.shard)
        samples = list(webdataset.WebDataset(paths, shardshuffle=False).decode("rgb8", partial=True))
        assert [sample["__key__"] for sample in samples] == list(scans.key)
        kinds = {"power.exr", "range.exr", "truth.exr", "instance.png", "material.png", "json"}
        assert all({kind for kind in sample if not kind.startswith("__")} == kinds for sample in samples)
        assert all(sample["json"]["boxes"] for sample in samples)
    assert sum(len(scans) for _, scans in published.scans.groupby("split")) == 8


# --- The package ------------------------------------------------------------------------------------------------------------------


def test_the_package_makes_the_bytes_of_the_command(labels):
    import matdb as md

    db = md.open(labels.folder / "matdb.sqlite")
    data = md.dataset(labels.folder / "spec.toml", labels.folder / "by-python", db=db)
    data.run()
    assert data.check()["complete"]
    by_python, by_command = bytes_of(labels.folder / "by-python"), bytes_of(labels.data)
    assert len(by_python) > 6 and all(by_command[name] == content for name, content in by_python.items())
    data.publish()
    assert (labels.folder / "by-python" / "croissant.json").exists()


def test_what_a_node_makes_without_a_shared_folder_is_what_is_made_here(labels, tmp_path):
    from matdb import _ray

    plan = _ray._files(labels.data, _ray.PLAN)
    shards = len(list((labels.data / "points").iterdir()))
    scans = 0
    for shard in range(shards):
        made, files = _ray._of_nothing_shared(plan, shard, shards)
        _ray._write(tmp_path, files)
        scans += made
    assert scans == len(labels.scans)
    here = bytes_of(labels.data)
    made = bytes_of(tmp_path)
    assert len(made) > 2 and all(here[name] == content for name, content in made.items())


# --- What must not pass in silence --------------------------------------------------------------------------------------------------

OPTIONS_APART = 'option = [{ name = "x", set = { "mesh.plate.scale" = 1.0 } }, { name = "y", set = { "mesh.plate.scale" = 1.1 } }]'
LEAKING = f"""
split = {{ a = 0.5, b = 0.5 }}
[[choose]]
name = "object"
apart = true
{OPTIONS_APART}
[[vary]]
keys = ["mesh.plate.scale"]
values = [1.05]
"""
TWICE = """
[[vary]]
keys = ["radar.system_loss_db"]
from = 10
to = 11
[[vary]]
keys = ["radar.system_loss_db"]
from = 20
to = 21
"""
NOBODY = """
[[effect]]
name = "thin-film"
material = "nobody-has-it"
share = 1
parameters = { coverage = [0.1, 0.5] }
"""
SMALL = 'name = "small"\nscene = "scene.toml"\nscans = {scans}\nseed = 5\nimages = false\nlicence = "CC0-1.0"\n'


@pytest.mark.parametrize("part", [LEAKING, TWICE, NOBODY], ids=["shown-in-both-splits", "drawn-twice", "effect-of-no-material"])
def test_what_would_be_recorded_but_not_rendered_is_refused(part, tmp_path):
    (tmp_path / "scene.toml").write_text(DRAWN_SCENE)
    (tmp_path / "spec.toml").write_text(SMALL.format(scans=6) + part)
    command(tmp_path, "dataset", "run", "spec.toml", "-o", "ds", refused=True)


def test_a_mistake_is_told_where_it_was_made(tmp_path):
    (tmp_path / "scene.toml").write_text(DRAWN_SCENE)
    for key, values in [("mesh.plat.scale", "[1, 2]"), ("mesh.plate.rotation_deg", "[1, 2]")]:
        (tmp_path / "spec.toml").write_text(SMALL.format(scans=6) + f'[[vary]]\nkeys = ["{key}"]\nvalues = {values}\n')
        said = command(tmp_path, "dataset", "run", "spec.toml", "-o", "ds", refused=True)
        assert key in said and ".tmp" not in said


def test_what_was_planned_can_be_made(tmp_path):
    (tmp_path / "scene.toml").write_text(DRAWN_SCENE)
    (tmp_path / "spec.toml").write_text(SMALL.format(scans=3000) + '[[vary]]\nkeys = ["mesh.plate.scale"]\nmean = 1\nsd = 0.3\n')
    planned = subprocess.run(["matdb", "dataset", "plan", "spec.toml", "-o", "ds"], cwd=tmp_path, env=ENVIRONMENT, capture_output=True)
    if planned.returncode == 0:
        command(tmp_path, "dataset", "run", "ds", "-q")


def test_an_array_may_have_more_tasks_than_there_are_shards(labels):
    for task in range(4):
        command(labels.folder, "dataset", "shard", "ds", f"{task}/4", "-q")


def test_a_placed_mesh_stands_off_the_highest_point_of_steep_ground(tmp_path):
    ball, facets = sphere(0.15, 10, 16)
    second = np.vstack([ball, ball * 0.8 + [0.12, 0.05, 0.1]]), np.vstack([facets, facets + len(ball)])
    for placed in place(tmp_path, *second):
        assert abs(highest_below(placed.own[second[1]]) + PLATE[2] / 2 + 0.003) < 0.00006


def highest_below(facets):
    """Of the part of the facets that is below or above the plate: they are cut at its four sides."""
    found = -np.inf
    for polygon in facets:
        for axis, sign in itertools.product([0, 1], [-1, 1]):
            kept = []
            for a, b in zip(np.roll(polygon, 1, axis=0), polygon) if len(polygon) else []:
                over_a, over_b = sign * a[axis] - PLATE[axis] / 2, sign * b[axis] - PLATE[axis] / 2
                if (over_a > 0) != (over_b > 0):
                    kept.append(a + (b - a) * over_a / (over_a - over_b))
                if over_b <= 0:
                    kept.append(b)
            polygon = np.array(kept)
        found = max(found, polygon[:, 2].max()) if len(polygon) else found
    return found


def test_annotations_count_from_one(published):
    # pycocotools takes an annotation 0 for none.
    for path in coco_files(published.data):
        assert all(annotation["id"] > 0 for annotation in json.loads(path.read_text())["annotations"])
