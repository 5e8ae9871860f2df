"""The bindings: the bytes of the command line, arrays that fit them, errors, interruption, threads and memory."""

import html
import json
import pickle
import re
import resource
import signal
import subprocess
import sys
import threading
import time
import types
import warnings
from pathlib import Path

import numpy as np
import pytest

import matdb as md

SCENE = """
name = "plate"
seed = 1
[radar.scan]
pattern = "raster"
lines = 12
chirps_per_line = 12
width_m = 0.2
height_m = 0.2
[radar.speckle]
looks = 4
form = "independent"
[[mesh]]
name = "plate"
file = "builtin:plate"
size_m = [1, 1, 0]
translation_m = [0, 1.1, 0]
[[region]]
name = "all"
material = "mannequin-paint"
"""
COMMAND = "import sys, matdb; sys.exit(matdb._main())"


def command(folder, *words):
    return subprocess.run([sys.executable, "-c", COMMAND, *words], cwd=folder, capture_output=True, text=True)


def said_by_command(folder, *words):
    done = command(folder, *words, "--json", "-q")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture
def scene(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("plate.toml").write_text(SCENE)
    return md.load_scene("plate.toml")


def files(folder):
    return {path.name: path.read_bytes() for path in Path(folder).iterdir()}


def test_the_bytes_are_those_of_the_command_line(scene, tmp_path):
    said = command(tmp_path, "render", "plate.toml", "-o", "by-command")
    assert said.returncode == 0, said.stderr
    scan = md.render(scene)
    scan.save("by-python")
    assert files("by-python") == files("by-command")
    assert sorted(files("by-python")) == sorted(scan.file_names)
    assert md.render(scene, seed=2).file("cloud.ply") != scan.file("cloud.ply")


def test_arrays_are_what_the_files_hold(scene):
    scan = md.render(scene)
    assert scan.power_dbm.dtype == np.float32
    assert scan.power_dbm.shape == (len(scan.y_m), len(scan.x_m)) == scan.range_m.shape
    assert np.all(np.diff(scan.x_m) > 0) and np.all(np.diff(scan.y_m) < 0)
    assert scan.xyz_m.shape == (len(scan.points_dbm), 3)
    detections = scan.record["counts"]["detections"]
    assert len(scan.points_dbm) == detections > 0
    assert f"{detections} detections of 144 chirps" in repr(scan)
    with pytest.raises(ValueError):
        scan.power_dbm[0, 0] = 0.0
    with pytest.raises(ValueError):
        scan.points_dbm[0] = 0.0
    # What is detected is in the image: the brightest pixel holds no more than the brightest point.
    assert np.nanmax(scan.power_dbm) <= scan.points_dbm.max() + 1e-4
    assert scan._repr_png_() == scan.file("power.png")


def test_errors_are_the_sentences_of_the_command_line(scene, tmp_path):
    with pytest.raises(md.SceneError) as refused:
        md.load_scene("builtin:nothing")
    said = command(tmp_path, "render", "builtin:nothing", "-o", "out")
    assert said.returncode == 1
    assert said.stderr.splitlines()[-1] == f"error: {refused.value}"
    with pytest.raises(md.SceneError, match="unknown key `nonsense`"):
        scene.replace(radar__nonsense=1)
    with pytest.raises(md.UsageError, match="give it whole"):
        scene.replace(name__of="x")
    with pytest.raises(TypeError, match="no such value"):
        scene.replace(seed=None)
    with pytest.raises(md.SceneError, match="did you mean `plate`"):
        scene.with_changes({"mesh.plat.scale": 2})
    changes = {"seed": 9, "mesh.plate.rotation_deg": np.array([0, 4, 0]), "radar.effect.drift.slope_db": 8}
    changed = scene.with_changes(changes).to_dict()
    assert (changed["seed"], changed["mesh"][0]["rotation_deg"]) == (9, [0, 4, 0])
    assert changed["radar"]["effect"] == [{"name": "drift", "slope_db": 8}]
    with pytest.raises(md.MaterialError, match="nothing-such"):
        md.render(md.Scene.from_text(SCENE.replace("mannequin-paint", "nothing-such"), "plate.toml"))
    Path("foreign.sqlite").write_text("This is another program's file.")
    with pytest.raises(md.StoreError):
        md.open("foreign.sqlite")
    assert issubclass(md.SceneError, md.Error)
    with pytest.raises(md.UnknownMaterialError) as unknown:
        md.open()["coton"]
    assert isinstance(unknown.value, md.MaterialError) and isinstance(unknown.value, KeyError)
    assert unknown.value.hint == "did you mean `cotton`?" and not str(unknown.value).startswith("'")
    Path("out.ply").write_bytes(b"ply\nend_header\n")
    with pytest.raises(md.CloudError) as cloud:
        md.Cloud.load("out.ply")
    assert cloud.value.file == Path("out.ply") and cloud.value.hint
    assert md.UsageError("a word").hint is None


def test_a_database_is_a_mapping_of_materials(scene):
    db = md.open()
    assert len(db) == 0 and not Path("matdb.sqlite").exists()
    assert db["cotton"].revision is None
    assert db.add("cotton", "ptfe") == ["cotton@1", "ptfe@1"]
    assert list(db) == ["cotton", "ptfe"] and "cotton" in db and "steel" not in db
    cotton = db["cotton@1"]
    assert (cotton.name, cotton.revision) == ("cotton", 1)
    assert cotton.to_dict()["slug"] == "cotton"
    levels = cotton.sigma0_db(np.array([0, 10, 20]))
    assert levels.shape == (3,) and np.all(np.isfinite(levels))
    assert cotton.sigma0_db([10.0]) == levels[1:2]
    with pytest.raises(KeyError, match="did you mean `cotton`"):
        db["coton"]
    assert db.search("cotton")[0]["slug"] == "cotton"
    assert md.render(scene, db=db).name == "plate"


def test_scenes_and_databases_can_be_pickled(scene):
    other = pickle.loads(pickle.dumps(scene.replace(seed=9)))
    assert other.to_dict()["seed"] == 9
    assert md.render(other).file("cloud.ply") == md.render(scene, seed=9).file("cloud.ply")
    assert pickle.loads(pickle.dumps(md.open("a.sqlite"))).path == Path("a.sqlite")
    scan = md.render(scene)
    again = pickle.loads(pickle.dumps(scan))
    assert repr(again) == repr(scan) and all(again.file(name) == scan.file(name) for name in scan.file_names)
    assert np.array_equal(again.power_dbm, scan.power_dbm, equal_nan=True) and again.show().html == scan.show().html
    points = md.Cloud(scan.xyz_m, scan.points_dbm, chirp=scan.cloud["chirp"])
    copy = pickle.loads(pickle.dumps(points))
    assert np.array_equal(copy.xyz_m, points.xyz_m) and np.array_equal(copy.chirp, points.chirp)
    assert np.array_equal(copy.power_dbm, points.power_dbm) and np.all(np.isnan(copy.range_m))


def test_threads_render_the_same(scene):
    expected = md.render(scene).file("cloud.ply")
    found = []
    threads = [threading.Thread(target=lambda: found.append(md.render(scene).file("cloud.ply"))) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == [expected] * 4


def test_an_interruption_ends_a_long_render(tmp_path):
    # Thirty million rays.
    program = """
import matdb as md
scene = md.load_scene("builtin:calibration-sphere").replace(
    radar__scan={"pattern": "raster", "lines": 680, "chirps_per_line": 680, "width_m": 0.3, "height_m": 0.3},
    spot__rays=64)
print("begun", flush=True)
try:
    md.render(scene)
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""
    took_s = []
    # The machine may be busy with other things: the best of three counts.
    while len(took_s) < 3 and min(took_s, default=9) > 1:
        running = subprocess.Popen([sys.executable, "-c", program], cwd=tmp_path, stdout=subprocess.PIPE, text=True)
        assert running.stdout.readline() == "begun\n"
        time.sleep(0.5)
        assert running.poll() is None, "the render is too short for this test"
        sent_s = time.monotonic()
        running.send_signal(signal.SIGINT)
        assert running.stdout.readline() == "interrupted\n"
        took_s.append(time.monotonic() - sent_s)
        assert running.wait(timeout=20) == 0
    assert min(took_s) < 1, took_s


def test_an_interruption_ends_the_command(scene, tmp_path):
    words = ["diagnose", "out/cloud.ply", "--scene", "builtin:concealed", "-o", "why"]
    md.render(md.load_scene("builtin:concealed")).save("out")
    running = subprocess.Popen([sys.executable, "-c", COMMAND, *words], cwd=tmp_path, stderr=subprocess.DEVNULL)
    time.sleep(4)
    running.send_signal(signal.SIGINT)
    assert running.wait(timeout=5) == -signal.SIGINT and not Path("why").exists()


def plate_of(side_m):
    """Two triangles that face a radar in front of z = 0."""
    half = side_m / 2
    vertices = np.array([[-half, -half, 0], [half, -half, 0], [half, half, 0], [-half, half, 0]])
    return vertices, np.array([[0, 1, 2], [0, 2, 3]])


def test_a_scene_is_made_of_arrays(scene, tmp_path):
    tables = {key: scene.to_dict()[key] for key in ["seed"]}
    radar = {"scan": {"pattern": "raster", "lines": 12, "chirps_per_line": 12, "width_m": 0.2, "height_m": 0.2},
             "speckle": {"looks": 4, "form": "independent"}}
    at = {"translation_m": np.array([0, 1.1, 0])}
    arrays = md.Scene(meshes={"plate": {"mesh": plate_of(1.0), **at}}, materials="mannequin-paint", name="plate", radar=radar,
                      **tables)
    assert arrays.regions == ["plate"] and arrays.chirps == 144
    expected = md.render(scene).power_dbm
    assert np.allclose(md.render(arrays).power_dbm, expected, atol=1e-3, equal_nan=True)
    again = pickle.loads(pickle.dumps(arrays))
    assert md.render(again).file("cloud.ply") == md.render(arrays).file("cloud.ply")
    arrays.replace(seed=3).save("kept/scene.toml")
    assert sorted(path.name for path in Path("kept").iterdir()) == ["mesh-0.ply", "scene.toml"]
    said = command(tmp_path, "render", "kept/scene.toml", "-o", "by-command")
    assert said.returncode == 0, said.stderr
    assert files("by-command")["power.exr"] == md.render(arrays, seed=3).file("power.exr")
    # As libraries of meshes have them, beside a built-in one.
    import trimesh

    vertices, facets = plate_of(1.0)
    solid = trimesh.Trimesh(vertices, facets, process=False)
    both = md.Scene(meshes={"plate": {"mesh": solid, **at}, "ball": {"mesh": "builtin:sphere", "size_m": [0.1] * 3}},
                    materials={"plate": "mannequin-paint", "ball": "steel"}, radar=radar)
    assert both.regions == ["plate", "ball"]
    # The names that Open3D has for the same.
    other = types.SimpleNamespace(vertices=vertices, triangles=facets)
    assert md.Scene(meshes={"plate": other}, materials="steel", radar=radar).chirps == 144
    with pytest.raises(md.UsageError, match="nothing for mesh .ball."):
        md.Scene(meshes={"ball": "builtin:sphere"}, materials={"plate": "steel"})
    with pytest.raises(TypeError, match="a mesh is"):
        md.Scene(meshes={"ball": 7}, materials="steel")
    with pytest.raises(md.UsageError, match="facet 0"):
        md.Scene(meshes={"plate": (vertices, facets - 1)}, materials="steel")
    with pytest.raises(md.UsageError, match="vertex 9"):
        md.Scene(meshes={"plate": (vertices, [[0, 1, 9]])}, materials="steel")
    with pytest.raises(md.SceneError, match="a program gives"):
        md.Scene.from_text(arrays.text, "scene.toml")


def test_points_of_arrays_are_checked_as_those_of_files(scene):
    scan = md.render(scene)
    for watts in [10 ** (scan.points_dbm.astype(float) / 10 - 3), np.full(len(scan.points_dbm), 1e-8)]:
        with pytest.raises(md.CloudError, match="these are watts, not dBm"):
            md.Cloud(scan.xyz_m, watts)
    for chirp in [-1, 1.7, 2**33]:
        with pytest.raises(md.CloudError, match="chirp number"):
            md.Cloud(scan.xyz_m[:1], [-60], chirp=[chirp])
    cloud = md.Cloud(scan.xyz_m[:2], [-60, -61], chirp=[np.nan, 3], range_m=[8.0, np.nan])
    assert np.array_equal(cloud.chirp, [np.nan, 3], equal_nan=True)
    assert np.array_equal(cloud.range_m, [8.0, np.nan], equal_nan=True)
    Path("relative.csv").write_text("X,Y,Z,Intensity\n100,1100,0,-3\n0,1100,0,0\n")
    names = {"X": "x_mm", "Y": "y_mm", "Z": "z_mm", "Intensity": "power_db"}
    relative = md.Cloud.load("relative.csv", columns=names)
    assert relative.is_relative and np.allclose(relative.power_dbm, [-3, 0]) and relative.xyz_m[0, 0] == 0.1
    assert pickle.loads(pickle.dumps(relative)).is_relative
    with pytest.raises(md.UsageError, match="unit = .cm. is not known"):
        md.Cloud.load("relative.csv", unit="cm")
    with pytest.raises(TypeError, match="give a matdb.Cloud, a matdb.Scan or the path"):
        md.measure(7, scene)
    with pytest.raises(TypeError, match="give a matdb.Scene, or the path"):
        md.render(7)


def test_memory_does_not_grow(scene):
    def kilobytes():
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

    for _ in range(50):
        md.render(scene)
    before = kilobytes()
    for _ in range(1000):
        md.render(scene)
    assert kilobytes() - before < 8_000, "1000 renders of 40 kB of files each"


def examples():
    root = Path(__file__).parent.parent.parent
    pages = [(root / page).read_text() for page in ["README.md", "python/README.md", "docs/python.md"]]
    found = [example for page in pages for example in re.findall(r"```python\n(.*?)```", page, re.DOTALL)]
    assert len(found) >= 11
    return found


def test_the_examples_of_the_pages_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for example in examples():
        exec(example, {})


def test_a_fit_is_that_of_the_command_line(scene, tmp_path):
    fitted = md.fit("cotton", seed=3)
    done = command(tmp_path, "fit", "cotton", "--seed", "3", "--json", "-q")
    said = json.loads(done.stdout)
    assert {key: said[key] for key in fitted.to_dict()} == fitted.to_dict()
    assert said["sentences"] == fitted.verdict
    levels = fitted.sigma0_db(np.linspace(0, 60, 5))
    assert levels.shape == (5,) and np.all(np.diff(levels) < 0)
    held = md.fit("cotton", fixed={"diffuse.alpha": 4.0})
    assert held.parameters["diffuse.alpha"] == 4.0
    with pytest.raises(md.Error, match="the model has no parameter `alpha`"):
        md.fit("cotton", fixed={"alpha": 4.0})
    tail = md.fit("cotton", method="tls-tail", fixed={"diffuse.alpha": 3.0})
    assert tail.parameters["diffuse.alpha"] == 3.0
    with pytest.raises(md.UsageError, match="hold it"):
        md.fit("cotton", method="tls-tail")
    with pytest.raises(md.UsageError, match="method = .guess. is not known; give censored"):
        md.fit("cotton", method="guess")


def test_a_measurement_is_that_of_the_command_line(scene, tmp_path):
    md.render(scene).save("out")
    measured = md.measure("out/cloud.ply", scene)
    measured.save("by-hand")
    done = command(tmp_path, "measure", "out/cloud.ply", "--scene", "plate.toml", "-o", "by-command", "-q")
    assert done.returncode == 0, done.stderr
    assert files("by-hand") == files("by-command")
    assert len(measured) == len(measured.theta_deg) == len(measured.sigma0_db) == len(measured.threshold_db) == 144
    assert np.isfinite(measured.sigma0_db).sum() > 100
    fitted = md.fit("by-hand/curve.csv", model="lambert")
    assert set(fitted.parameters) == {"albedo"}
    with pytest.raises(md.Error, match="`nowhere`"):
        md.measure("out/cloud.ply", scene, region="nowhere")


def test_a_diagnosis_is_that_of_the_command_line(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    md.render(md.load_scene("builtin:concealed")).save("out")
    Path("bench.toml").write_text(md.load_scene("builtin:bench").text)
    why = md.diagnose("out/cloud.ply", "bench.toml", effects=["drift", "foreign-patch"], controls=False)
    assert why.verdict == "explained" and [effect["name"] for effect in why.effects] == ["foreign-patch"]
    assert why.after["rmse_db"] < why.before["rmse_db"]
    assert repr(why) == "<matdb.Diagnosis: explained foreign-patch>"
    why.save("why")
    words = ["diagnose", "out/cloud.ply", "--scene", "bench.toml", "-o", "by-command", "--no-controls", "--json", "-q",
             "--effects", "drift,foreign-patch"]
    done = command(tmp_path, *words)
    assert json.loads(done.stdout) == why.to_dict()
    of_words = ["report.html", "after.toml"]  # these name the folder
    by_hand, by_command = files("why"), files("by-command")
    assert by_hand.keys() == by_command.keys()
    assert all(by_hand[name] == by_command[name] for name in by_hand if name not in of_words)
    # The points alone, and a scene that is in no file.
    points = md.Cloud.load("out/cloud.ply")
    scan = md.render(md.load_scene("builtin:concealed"))
    arrays = md.Cloud(scan.xyz_m, scan.points_dbm, chirp=scan.cloud["chirp"], range_m=scan.cloud["range_m"])
    assert len(points) == len(arrays) and np.allclose(points.xyz_m, arrays.xyz_m, atol=1e-6)
    again = md.diagnose(arrays, md.load_scene("builtin:bench").replace(name="Bench of arrays"), effects=["foreign-patch"],
                        controls=False)
    assert [effect["name"] for effect in again.effects] == ["foreign-patch"]
    again.report("pages/of arrays.html")
    assert "Bench of arrays" in Path("pages/of arrays.html").read_text() and len(files("pages")) == 1
    with pytest.raises(md.Error, match="nothing.ply"):
        md.diagnose("nothing.ply", "bench.toml")
    with pytest.raises(md.UsageError, match="there is no effect `patch`"):
        md.diagnose("out/cloud.ply", "bench.toml", effects=["patch"])
    with pytest.raises(ValueError, match="give \\(n, 3\\)"):
        md.Cloud([[0, 0, 1]], [-40, -50])
    with pytest.raises(md.CloudError, match="the cloud has no points"):
        md.Cloud(np.zeros((0, 3)), [])
    with pytest.raises(md.DiagnoseError):
        md.diagnose(md.Cloud(scan.xyz_m[:40], scan.points_dbm[:40]), "bench.toml", controls=False)
    # The answer stays what it was when cloud and folder have changed.
    Path("out/cloud.ply").write_bytes(b"")
    monkeypatch.chdir(tmp_path / "why")
    why.save("../again")
    assert files("../again")["residuals.csv"] == by_hand["residuals.csv"]


def test_a_fit_of_arrays_becomes_a_material(scene):
    scan = md.render(scene)
    curve = md.measure(md.Cloud(scan.xyz_m, scan.points_dbm), scene, region="all")
    fit = curve.fit("lambert", seed=2)
    assert fit.names[0] == "albedo" and fit.covariance.shape == (len(fit.names),) * 2
    assert np.all(np.isfinite(fit.covariance))
    db = md.open("mine.sqlite")
    assert db.add("my-plate", fit, source="A test, 2026", licence="CC0-1.0", kind="synthetic") == ["my-plate@1"]
    assert db["my-plate"].kind == "synthetic" and db["my-plate"].material_class == "sample"
    assert db.add("of-a-scan", md.measure(scan, scene).fit("lambert"), source="A test", licence="CC0-1.0") == ["of-a-scan@1"]
    assert db["of-a-scan"].kind == "synthetic"
    with pytest.raises(md.UsageError, match="has a class and a description"):
        db.add("my-plate", fit, source="A test", licence="CC0-1.0", kind="synthetic", material_class="paint")
    with pytest.raises(md.UsageError, match="a fit is added alone"):
        db.add("another", fit, files=["x.csv"])
    with pytest.raises(md.UsageError, match="details belong to a file or a fit"):
        db.add("cotton", source="A test, 2026")
    # A fit of a material's own curve stays in it.
    with pytest.raises(md.UsageError, match="belongs to `cotton`"):
        db.add("my-cotton", md.fit("cotton", db=db))
    assert db.add("cotton", md.fit("cotton", db=db)) == ["cotton@1"]
    curve.save("measured")
    details = {"source": "A file, 2026", "licence": "CC0-1.0", "kind": "synthetic", "frequency_ghz": 300}
    assert db.add(files=["measured/curve.csv"], name="of-a-file", material_class="paint", **details) == ["of-a-file@1"]
    of_file = md.fit("measured/curve.csv", model="lambert")
    assert db.add("fit-of-a-file", of_file, **details) == ["fit-of-a-file@1"]
    assert [one["name"] for one in db.history("fit-of-a-file")[0]["activity"]["inputs"]] == ["curve.csv"]
    with pytest.raises(md.Error, match="kind"):
        db.add("without-a-kind", of_file, source="A file, 2026", licence="CC0-1.0")
    assert db["my-plate"].sigma0_db([10])[0] == fit.sigma0_db([10])[0]
    assert db.add("my-plate", curve.fit("lambert", seed=3), source="A test, 2026", licence="CC0-1.0", kind="synthetic")
    assert db.check()["findings"] == []
    with pytest.raises(md.Error, match="licence"):
        db.add("another", fit, source="A test, 2026")
    with pytest.raises(md.UsageError, match="kind"):
        db.add("another", fit, source="A test, 2026", licence="CC0-1.0", kind="guessed")
    assert "another" not in db
    both = curve.fit("cook-torrance + blinn-phong", fixed={"diffuse.alpha": 1.0})
    assert "specular.m" in both.parameters


def test_another_program_opens_a_scan(scene):
    import trimesh

    scan = md.render(scene)
    opened = trimesh.load_scene(trimesh.util.wrap_as_stream(scan.glb()), file_type="glb")
    assert set(opened.geometry) == {"cloud", "all"} and opened.metadata["unit"] == "m"
    cloud, plate = opened.geometry["cloud"], opened.geometry["all"]
    assert np.allclose(cloud.vertices, scan.xyz_m, atol=1e-6)
    strongest, weakest = cloud.colors[np.argmax(scan.points_dbm)], cloud.colors[np.argmin(scan.points_dbm)]
    assert strongest[0] > 200 > weakest[0] and (cloud.colors[:, 3] == 255).all()
    assert np.allclose(plate.bounds, [[-0.5, 0.6, 0], [0.5, 1.6, 0]]) and plate.visual.material.name == "mannequin-paint"
    with pytest.raises(md.UsageError, match="view"):
        scan.glb(view="another")


def test_a_scan_is_shown_and_plotted(scene):
    import matplotlib

    matplotlib.use("Agg")
    scan = md.render(scene)
    page = scan.show()
    assert page.html.lower().startswith("<!doctype html>") and "https://" not in page.html and "mannequin-paint" in page.html
    page.save("pages/view.html")
    assert Path("pages/view.html").read_text() == page.html
    assert page._repr_html_().startswith("<iframe srcdoc=")
    said = command(Path.cwd(), "render", "plate.toml", "-o", "out", "--view")
    assert said.returncode == 0, said.stderr
    assert Path("out/view.html").exists()
    said = command(Path.cwd(), "render", "plate.toml", "-o", "out", "--glb")
    assert said.returncode == 0 and "cloud.glb" in said.stdout, said.stderr
    assert Path("out/cloud.glb").exists()
    curve = md.measure(md.Cloud(scan.xyz_m, scan.points_dbm), scene)
    for axes in [scan.plot(), curve.plot(), curve.fit("lambert").plot()]:
        assert axes.get_xlabel() and axes.get_ylabel()


def test_comparing_and_calibrating_are_those_of_the_command_line(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    plate = md.load_scene("builtin:calibration-plate")
    md.render(plate).save("out")

    def said(*words):
        return said_by_command(tmp_path, *words)

    where = ["out/cloud.ply", "--scene", "builtin:calibration-plate"]
    assert md.calibrate("out/cloud.ply", plate) == said("calibrate", *where)
    compared = md.compare("out/cloud.ply", plate)
    assert compared.record == said("compare", *where, "-o", "by-command")
    compared.save("by-hand")
    assert files("by-hand") == files("by-command")
    assert compared.measured_dbm.shape == compared.simulated_dbm.shape
    with pytest.raises(md.UsageError, match="give dB from 6 to 60"):
        md.calibrate("out/cloud.ply", plate, within_db=1)
    db = md.open()
    assert db.predict("cotton", [0, 10, 20]) == said("predict", "cotton", "--angles", "0,10,20")
    with pytest.raises(md.UsageError, match="90"):
        db.predict("cotton", [95.0])


# The lines of a first afternoon, in an empty folder.
def test_a_first_afternoon(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    notebook = Path(__file__).parent.parent.parent / "examples" / "notebooks" / "first_afternoon.ipynb"
    cells = json.loads(notebook.read_text())["cells"]
    import matplotlib.pyplot as plt

    plt.switch_backend("Agg")
    said = {}
    exec("\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"), said)
    plt.close("all")
    assert list(said["db"]) == ["my-skin"] and said["why"].verdict == "no-missing-effect"


def test_types_are_those_that_the_stubs_say(tmp_path):
    for number, example in enumerate(examples()):
        (tmp_path / f"example_{number}.py").write_text(example)
    for words in [["mypy", "--strict", *(str(path) for path in tmp_path.glob("*.py"))], ["mypy.stubtest", "matdb"]]:
        done = subprocess.run([sys.executable, "-m", *words], cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr


def test_a_database_says_and_does_what_the_command_line_does(scene, tmp_path):
    db = md.open()
    db.add("cotton", "ptfe", "steel", "mannequin-paint")

    def said(*words):
        return said_by_command(tmp_path, *words)

    assert db.history("cotton") == said("history", "cotton")
    assert db.diff("cotton", "ptfe") == said("diff", "cotton", "ptfe")
    assert db.cite("mannequin-paint") == said("cite", "mannequin-paint")
    assert db.near("cotton", most=3) == said("near", "--material", "cotton", "--limit", "3")
    assert db.check()["findings"] == []
    exported = db.export("cotton", "cotton.csv", format="csv")
    assert exported == said("export", "cotton", "--as", "csv", "-o", "cotton.csv")
    assert db.withdraw("steel", "The plate was bent.", superseded_by="ptfe") == 2
    assert db["steel"].to_dict()["status"]["is"] == "superseded"
    published = db.publish("site")
    assert published["materials"] == 4 and Path("site/index.html").exists()
    other = md.open("other.sqlite")
    planned = other.import_catalogue("site", dry_run=True)
    assert planned["dry_run"] and not Path("other.sqlite").exists()
    other.import_catalogue("site")
    assert other.names() == db.names()
    assert other.history("steel")[1]["activity"]["origin"]["revision"] == 2
    assert other.remove("steel", "ptfe") == [{"slug": "steel", "revisions": 2}, {"slug": "ptfe", "revisions": 1}]
    with pytest.raises(md.Error, match="`steel`"):
        other.remove("steel")
    with pytest.raises(md.UsageError, match="format = .xml. is not known; give csv"):
        db.export("cotton", "cotton.xml", format="xml")
    with pytest.raises(md.StoreError, match="none.sqlite"):
        md.open("none.sqlite").publish("nowhere")
    assert not Path("nowhere").exists()
    # What a page of the catalogue tells a reader to type.
    page = Path("site/material/cotton.html").read_text(encoding="utf-8")
    snippet = html.unescape(re.search(r'id="use-python">(.*?)</code>', page, re.DOTALL)[1])
    done = subprocess.run([sys.executable, "-c", snippet], cwd="site", capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "cotton@1" in done.stdout and "[" in done.stdout


def test_materials_are_chosen_as_by_the_command_line(scene, tmp_path):
    db = md.open()
    db.add("cotton", "ptfe", "steel", "mannequin-paint")
    curve = md.measure(md.render(scene), scene)
    curve.save("measured")
    for keywords, flags in [
        ({"frequency_ghz": 300}, ["--frequency", "300"]),
        ({"kind": "measured", "fitted": False}, ["--kind", "measured", "--not-fitted"]),
        ({"material_class": "polymer", "status": "active"}, ["--class", "polymer", "--status", "active"]),
        ({"fitted": True, "tag": None}, ["--fitted"]),
        ({"tag": "paint"}, ["--tag", "paint"]),
    ]:
        assert db.materials(**keywords) == said_by_command(tmp_path, "list", *flags)
        assert db.search("a", most=9, **keywords) == said_by_command(tmp_path, "search", "a", "--limit", "9", *flags)
        assert db.near("cotton", **keywords) == said_by_command(tmp_path, "near", "--material", "cotton", *flags)
    assert len(db.materials()) == 4 and len(db.materials(most=1)) == 1
    assert {one["slug"] for one in db.search("a", frequency_ghz=300)} < {one["slug"] for one in db.search("a", most=99)}
    assert db.search("paint", frequency_ghz=0.001) == []
    near = said_by_command(tmp_path, "near", "--curve", "measured/curve.csv", "--measured-at", "300")
    assert db.near(curve="measured/curve.csv", measured_at_ghz=300) == near
    same = db.near(curve=curve, measured_at_ghz=300)
    assert [one["slug"] for one in same["materials"]] == [one["slug"] for one in near["materials"]]
    with pytest.raises(TypeError, match="unexpected keyword .class.; materials are chosen by frequency_ghz, tag"):
        db.search("paint", **{"class": "paint"})
    with pytest.raises(md.UsageError, match="status = .new. is not known; give active"):
        db.materials(status="new")
    with pytest.raises(md.UsageError, match="-3 GHz is not a frequency"):
        db.materials(frequency_ghz=-3)
    with pytest.raises(md.UsageError, match="give a material, or a curve"):
        db.near("cotton", curve=curve)


def test_effects_and_publications_are_those_of_the_command_line(scene, tmp_path):
    assert md.effects() == said_by_command(tmp_path, "effects")
    assert md.effects("drift") == said_by_command(tmp_path, "effects", "drift")
    with pytest.raises(md.UsageError, match="there is no effect `drifts`"):
        md.effects("drifts")
    db = md.open()
    db.add("cotton")
    db.publish("site")
    assert md.verify("site") == said_by_command(tmp_path, "verify", "site")
    Path("site/catalogue.sqlite").write_bytes(b"")
    assert md.verify("site")["problems"]
    with pytest.raises(md.CatalogueError):
        md.verify("nowhere")


@pytest.mark.parametrize("keyword, flags", [
    ({"all_hits": True}, ["--all"]),
    ({"view": True, "glb": True}, ["--view", "--glb"]),
    ({"crop": True}, ["--crop", "auto"]),
    ({"uncompressed": True}, ["--uncompressed"]),
    ({"tracer": "brute"}, ["--tracer", "brute"]),
    ({"beat": True}, ["--beat"]),
], ids=lambda one: "-".join(one))
def test_renderings_have_the_options_of_the_command_line(scene, tmp_path, keyword, flags):
    if "beat" in keyword:
        scene = scene.replace(radar__receiver={}, radar__speckle={"looks": 1})
        Path("plate.toml").write_text(scene.text)
    done = command(tmp_path, "render", "plate.toml", "-o", "by-command", *flags)
    assert done.returncode == 0, done.stderr
    md.render(scene, **keyword).save("by-python")
    assert files("by-python") == files("by-command")


def test_options_of_a_rendering_are_checked(scene):
    with pytest.raises(md.UsageError, match="tracer = .fast. is not known; give pinhole"):
        md.render(scene, tracer="fast")
    with pytest.raises(md.UsageError, match="a radar without a receiver has no beat signals"):
        md.render(scene, beat=True)


def test_a_seed_loads_no_mesh_again(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    import trimesh

    trimesh.Trimesh(*plate_of(1.0), process=False).export("plate.ply")
    Path("plate.toml").write_text(SCENE.replace("builtin:plate", "plate.ply").replace("size_m = [1, 1, 0]\n", ""))
    scene = md.load_scene("plate.toml")
    expected = md.render(scene.replace(seed=5)).file("cloud.ply")
    Path("plate.ply").unlink()
    assert md.render(scene, seed=5).file("cloud.ply") == expected != md.render(scene).file("cloud.ply")
    assert scene.replace(radar__speckle={"looks": 2, "form": "independent"}).chirps == 144
    with pytest.raises(md.SceneError, match="plate.ply"):
        scene.replace(mesh=[{"name": "plate", "file": "plate.ply", "scale": 2}])


@pytest.mark.parametrize("keywords, flags", [
    ({"pose": (0.002, 0, 0.001, 0, 0.5, 0), "refine": True}, ["--pose", "0.002,0,0.001,0,0.5,0", "--refine"]),
    ({"pose": [0.001, 0, 0], "keep_pose": True}, ["--pose", "0.001,0,0", "--keep-pose"]),
    ({"metric": "point-to-plane", "edge_margin_m": 0.03, "exact_mesh": True},
     ["--metric", "point-to-plane", "--edge-margin", "0.03", "--exact-mesh"]),
], ids=["refine", "keep", "metric"])
def test_measurements_have_the_options_of_the_command_line(scene, tmp_path, keywords, flags):
    md.render(scene).save("out")
    md.measure("out/cloud.ply", scene, **keywords).save("by-hand")
    done = command(tmp_path, "measure", "out/cloud.ply", "--scene", "plate.toml", "-o", "by-command", "-q", *flags)
    assert done.returncode == 0, done.stderr
    assert files("by-hand") == files("by-command")


def test_options_of_a_measurement_are_checked(scene):
    scan = md.render(scene)
    for wanted, keywords in [
        ("leave refine or keep_pose out", {"refine": True, "keep_pose": True}),
        ("there is no pose to keep", {"pose": "auto", "keep_pose": True}),
        ("metric = .best. is not known", {"metric": "best"}),
        ("edge_margin_m = 7 is not a margin", {"edge_margin_m": 7}),
        ("is not a pose; give", {"pose": [1, 2]}),
        ("unexpected keyword argument .gauge.", {}),
    ]:
        with pytest.raises((md.UsageError, TypeError), match=wanted):
            measured = md.measure(scan, scene, **keywords)
            measured.fit(gauge=3)
    with pytest.raises(TypeError, match="or a pose.json"):
        md.measure(scan, scene, pose=7.0)
    with pytest.raises(md.UsageError, match="needs a registration"):
        md.compare(scan, scene, pose="auto")
    moved = md.compare(scan, scene, pose=[0, 0, 0.05]).record
    assert moved != md.compare(scan, scene).record


def test_settings_of_a_fit_are_those_of_the_command_line(scene, tmp_path):
    tls = md.fit("cotton", method="tls", theta_sd_deg=0.5, level_sd_db=2, fit_name="mine")
    said = said_by_command(tmp_path, "fit", "cotton", "--method", "tls", "--theta-sd-deg", "0.5", "--level-sd-db", "2")
    assert {key: said[key] for key in tls.to_dict()} == tls.to_dict() and tls.name == "mine"
    pieces = md.fit("cotton", method="mse", split_deg=10)
    said = said_by_command(tmp_path, "fit", "cotton", "--method", "mse", "--split-deg", "10")
    assert {key: said[key] for key in pieces.to_dict()} == pieces.to_dict()
    Path("theirs.csv").write_text("inc,NRCS\n" + "".join(f"{angle},{-0.3 * angle}\n" for angle in range(0, 60, 2)))
    renamed = md.fit("theirs.csv", model="lambert", columns={"inc": "theta_deg", "NRCS": "sigma0_db"})
    assert set(renamed.parameters) == {"albedo"}
    curve = md.measure(md.render(scene), scene)
    assert curve.fit("lambert", seed=4).to_dict() == md.fit(curve, model="lambert", seed=4).to_dict()
    cotton = md.open()["cotton"]
    assert md.fit(cotton, seed=3).to_dict() == md.fit("cotton", seed=3).to_dict()
    assert cotton.plot().get_ylabel() == "σ⁰, dB"
    with pytest.raises(TypeError, match="give a matdb.Measurement, a matdb.Material"):
        md.fit(7)


def test_a_material_of_a_file_has_its_details(scene, tmp_path):
    Path("theirs.csv").write_text("inc,NRCS\n" + "".join(f"{angle},{-0.3 * angle}\n" for angle in range(0, 60, 2)))
    details = {"source": "A test", "licence": "CC0-1.0", "kind": "synthetic", "instrument": "None", "frequency_ghz": 300,
               "threshold_dbm": -77, "material_class": "paint"}
    db = md.open()
    db.add(files=["theirs.csv"], name="theirs", columns={"inc": "theta_deg", "NRCS": "sigma0_db"}, title="Paint of others",
           tags=["matt"], authors=["Doe, Jane"], year=2025, curve="spring", model="mixture", **details)
    theirs = db["theirs"].to_dict()
    assert theirs["name"] == "Paint of others" and theirs["tags"] == ["matt"] and theirs["curves"][0]["name"] == "spring"
    assert theirs["sources"][0]["citation"] == {"authors": ["Doe, Jane"], "year": 2025} and theirs["fits"]
    rendered = theirs["render"]
    kept = md.fit("theirs", db=db, model="lambert")
    assert db.add("theirs", kept, keep_render=True) == ["theirs@2"] and db["theirs"].to_dict()["render"] == rendered
    with pytest.raises(md.UsageError, match="model = .soot. is not known; give blinn-phong"):
        db.add(files=["theirs.csv"], model="soot", **details)


def test_hints_are_python(scene, tmp_path):
    db = md.open()
    Path("bare.csv").write_text("theta_deg,sigma0_db\n0,-3\n10,-5\n20,-8\n")
    with pytest.raises(md.Error) as bare:
        db.add(files=["bare.csv"], name="bare")
    assert 'material_class="paint"' in bare.value.hint and "threshold_dbm=-77" in bare.value.hint
    assert 'source="who measured it, where, when"' in bare.value.hint and "--" not in str(bare.value)
    Path("cloud.csv").write_text("X,Y,Z,Intensity\n100,1100,0,-3\n")
    with pytest.raises(md.CloudError) as cloud:
        md.Cloud.load("cloud.csv")
    assert 'columns={"' in cloud.value.hint and '": "' in cloud.value.hint and "--" not in str(cloud.value)
    with pytest.raises(md.StoreError) as missing:
        md.open("none.sqlite").search("paint")
    assert "--db" not in str(missing.value) and "`matdb add NAME` makes one" in str(missing.value)
    with pytest.raises(md.UsageError) as tail:
        md.fit("cotton", method="tls-tail")
    assert str(tail.value).endswith("(fixed, method)")
    with pytest.raises(md.UnknownMaterialError) as unknown:
        db["zzzzzzzz"]
    assert "`matdb add --from FILE`" in str(unknown.value), "a command stays one"
    meshes = {"plate": {"mesh": plate_of(1.0), "translation_m": [0, 1.1, 0]}, "ball": {"mesh": "builtin:sphere",
              "size_m": [0.1] * 3, "translation_m": [0, 3, 0]}}
    mixed = md.Scene(meshes=meshes, materials={"plate": "cotton", "ball": "steel"}, radar=scene.to_dict()["radar"])
    notices = md.measure(md.render(mixed), mixed).notices
    assert any("choose one with region: " in notice for notice in notices)


def test_answers_can_be_pickled(scene, tmp_path):
    def again(one):
        return pickle.loads(pickle.dumps(one))

    scan = md.render(scene)
    curve = md.measure(scan, scene)
    other = again(curve)
    assert repr(other) == repr(curve) and other.record == curve.record and other.notices == curve.notices
    assert np.array_equal(other.sigma0_db, curve.sigma0_db, equal_nan=True)
    curve.save("curve")
    other.save("other")
    assert files("curve") == files("other")
    fit = curve.fit("cook-torrance + blinn-phong")
    assert other.fit("cook-torrance + blinn-phong").to_dict() == fit.to_dict()
    back = again(fit)
    assert back.to_dict() == fit.to_dict() and back.verdict == fit.verdict and back.parameters == fit.parameters
    assert np.array_equal(back.covariance, fit.covariance) and np.array_equal(back.sigma0_db([10]), fit.sigma0_db([10]))
    assert back.names == fit.names and np.array_equal(back.levels_db, fit.levels_db, equal_nan=True)
    details = {"source": "A test, 2026", "licence": "CC0-1.0"}
    lambert = curve.fit("lambert")
    for name, one in [("a.sqlite", lambert), ("b.sqlite", again(lambert))]:
        assert md.open(name).add("mine", one, **details) == ["mine@1"]
    assert md.open("a.sqlite")["mine"].content_hash == md.open("b.sqlite")["mine"].content_hash
    assert again(md.open("a.sqlite")["mine"]).to_dict() == md.open("b.sqlite")["mine"].to_dict()
    # A fit of a material's own curve goes back into it.
    db = md.open("c.sqlite")
    db.add("cotton")
    assert db.add("cotton", again(md.fit("cotton", db=db))) == ["cotton@2"]
    assert again(scan.cloud)["chirp"][3] == scan.cloud["chirp"][3]


def test_a_pickled_diagnosis_has_its_report_and_its_files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    import trimesh

    # A mesh in a file, which after.toml names from every folder.
    Path("in").mkdir()
    trimesh.creation.box((0.1, 0.1, 0.1)).export("in/box.ply")
    box = '\n[[mesh]]\nname = "box"\nfile = "box.ply"\ntranslation_m = [3, 0, -3]\n'
    Path("in/bench.toml").write_text(md.load_scene("builtin:bench").text + box)
    cloud = md.render(md.load_scene("builtin:concealed"))
    scene = md.load_scene("in/bench.toml")
    why = md.diagnose(cloud, scene, effects=["foreign-patch"], controls=False)
    back = pickle.loads(pickle.dumps(why))
    assert repr(back) == repr(why) and back.to_dict() == why.to_dict() and back.before == why.before
    why.save("why")
    # Elsewhere, as in another process.
    Path("elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    back.save("why")
    back.report("page.html")
    assert files("why").keys() == files("../why").keys()
    assert all(files("why")[name] == files("../why")[name] for name in files("why") if name != "after.toml")
    assert md.load_scene("why/after.toml").chirps == scene.chirps
    with pytest.raises(md.Error, match="no diagnosis wrote it"):
        Path("mine").mkdir()
        Path("mine/after.toml").write_text("name = 'mine'\n")
        back.save("mine")


def test_tables_go_out_by_arrow(scene):
    import pandas as pd
    import polars as pl

    # It needs numpy 2.
    pa = pytest.importorskip("pyarrow", exc_type=ImportError)
    scan = md.render(scene)
    strong = scan.points_dbm > np.median(scan.points_dbm)
    points = md.Cloud(scan.xyz_m, scan.points_dbm, chirp=np.where(strong, scan.cloud["chirp"], np.nan))
    # Half of the chirps are silent.
    deaf = scene.replace(radar__threshold_dbm=float(np.median(scan.points_dbm)))
    curve = md.measure(md.render(deaf), deaf)
    for table, names in [
        (scan.cloud, ["x_m", "y_m", "z_m", "power_dbm", "chirp", "incidence_deg"]),
        (points, ["x_m", "y_m", "z_m", "power_dbm", "chirp", "range_m"]),
        (curve, ["theta_deg", "sigma0_db", "threshold_db", "power_dbm", "chirp"]),
    ]:
        arrow, polars, pandas = pa.table(table), pl.DataFrame(table), pd.DataFrame.from_arrow(table)
        arrow.validate(full=True)
        assert arrow.equals(table.to_arrow())
        rows = len(table.get("x_m")) if isinstance(table, md.Table) else len(table)
        assert arrow.num_rows == len(polars) == len(pandas) == rows
        assert set(names) <= set(arrow.column_names) and arrow.column_names == polars.columns == list(pandas.columns)
        assert polars.equals(pl.from_arrow(arrow)) and pandas.equals(pd.DataFrame.from_arrow(arrow))
    assert pa.table(scan.cloud)["x_m"].to_numpy().tolist() == scan.cloud["x_m"].tolist() == scan.xyz_m[:, 0].tolist()
    assert pa.table(scan.cloud)["power_dbm"].type == pa.float32() and pa.table(scan.cloud)["chirp"].type == pa.int32()
    # What is not there is null.
    chirps = pa.table(points)["chirp"]
    assert chirps.type == pa.uint32() and chirps.null_count == np.isnan(points.chirp).sum()
    assert [one is None for one in chirps.to_pylist()] == np.isnan(points.chirp).tolist()
    assert pa.table(points)["range_m"].null_count == len(points)
    levels = pa.table(curve)["sigma0_db"]
    assert levels.null_count == np.isnan(curve.sigma0_db).sum() > 0
    assert np.array_equal(levels.to_numpy(), curve.sigma0_db, equal_nan=True)
    # And back again.
    pl.DataFrame(points).write_csv("points.csv")
    assert np.allclose(md.Cloud.load("points.csv").xyz_m, points.xyz_m)
    pl.DataFrame(curve).drop("theta_sd_deg").write_csv("curve.csv")
    # A capsule that nobody reads, and a stream that outlives its table.
    del table
    capsule = scan.cloud.__arrow_c_stream__()
    del capsule
    reader = pa.RecordBatchReader.from_stream(md.Cloud([[0, 0, 1]], [-40]))
    assert reader.schema.names[0] == "x_m" and reader.read_all().num_rows == 1
    half = pa.RecordBatchReader.from_stream(curve)
    half.read_next_batch().column(0)
    del half


def test_a_table_is_a_mapping_of_arrays(scene):
    from collections.abc import Mapping

    scan = md.render(scene)
    table = scan.cloud
    assert isinstance(table, Mapping) and isinstance(table, md.Table)
    assert list(table) == table.keys() and "x_m" in table and "x" not in table and len(table) == len(table.keys())
    assert dict(table)["chirp"] is table["chirp"] and table.get("x") is None and table.get("x", 7) == 7
    assert dict(table.items()).keys() == dict(**table).keys() and len(table.values()) == len(table)
    assert repr(table).startswith(f"<matdb.Table of {len(scan.points_dbm)} rows: x_m, y_m")
    with pytest.raises(KeyError):
        table["x"]
    with pytest.raises(ValueError):
        table["x_m"][0] = 1.0


def test_memory_of_tables_does_not_grow(scene):
    pa = pytest.importorskip("pyarrow", exc_type=ImportError)

    def kilobytes():
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

    points = md.Cloud(np.tile(md.render(scene).xyz_m, (300, 1)), np.tile(md.render(scene).points_dbm, 300))
    for _ in range(20):
        pa.table(points)
    before = kilobytes()
    for _ in range(200):
        pa.table(points)
    assert kilobytes() - before < 16_000, "200 tables of 1.7 MB each"


def test_a_function_is_a_material(scene):
    def lobe(theta_deg):
        return 10 * np.log10(np.exp(-((theta_deg / 6) ** 2)) + 0.003 * np.cos(np.radians(theta_deg)) ** 2)

    law = md.Material("my-lobe", lobe)
    assert repr(law) == "<matdb.Material my-lobe, of a function>" and law.kind == "synthetic"
    assert law.sampling_error_db <= 0.01 and md.open()["cotton"].sampling_error_db is None
    angles = np.linspace(0, 88.9, 777)
    assert np.abs(law.sigma0_db(angles) - lobe(angles)).max() < 0.02
    own = scene.with_materials({"all": law})
    scan = md.render(own)
    assert "given:my-lobe" in own.text and scan.record["materials"][0]["name"] == "my-lobe"
    again = pickle.loads(pickle.dumps(own))
    assert md.render(again).file("cloud.ply") == scan.file("cloud.ply") != md.render(scene).file("cloud.ply")
    assert np.array_equal(pickle.loads(pickle.dumps(law)).sigma0_db(angles), law.sigma0_db(angles))
    curve = md.measure(md.render(own.replace(radar__speckle={"looks": 64, "form": "independent"})), own)
    seen = np.isfinite(curve.sigma0_db)
    assert np.abs(np.mean(curve.sigma0_db[seen] - lobe(curve.theta_deg[seen]))) < 0.5
    assert md.fit(law, model="mixture-ggx", method="mse").parameters
    arrays = md.Scene(meshes={"plate": {"mesh": plate_of(1.0), "translation_m": [0, 1.1, 0]}}, materials={"plate": law},
                      radar=scene.to_dict()["radar"], seed=1)
    assert np.allclose(md.render(arrays).points_dbm, scan.points_dbm, atol=1e-3)
    assert abs(np.nanmean(md.compare(scan, own).simulated_dbm) - np.nanmean(scan.power_dbm)) < 3
    # Saved with its material, which a database takes.
    own.save("kept/scene.toml")
    db = md.open("kept.sqlite")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        db.add(files=["kept/material-my-lobe.toml"])
    kept = md.render(md.load_scene("kept/scene.toml"), db=db)
    assert np.allclose(kept.points_dbm, scan.points_dbm, atol=1e-3)
    # A material of a database is kept, too, whatever that has later.
    cotton = db["cotton"]
    assert md.render(scene.with_materials({"all": cotton})).file("power.png") == md.render(
        scene.with_materials({"all": "cotton"})).file("power.png")
    with pytest.raises(md.UsageError, match="region = .sleeve. is not known; give all"):
        scene.with_materials({"sleeve": law})
    with pytest.raises(md.UsageError, match="two materials of the scene are called my-lobe"):
        own.with_materials({"all": md.Material("my-lobe", lambda theta_deg: -10)})


def test_a_function_that_is_no_curve_is_said_so():
    with pytest.warns(UserWarning, match=r"step: .* off the function, at (29|30)\."):
        step = md.Material("step", lambda theta_deg: np.where(theta_deg < 30, 0, -10))
    assert step.sampling_error_db > 1
    silent = md.Material("silent", lambda theta_deg: np.where(theta_deg < 40, -3.0, -np.inf))
    assert silent.sigma0_db([50])[0] == -np.inf and abs(silent.sigma0_db([30])[0] + 3) < 1e-9
    with pytest.raises(md.UsageError, match="is not a material name"):
        md.Material("My Paint", lambda theta_deg: -10)
    with pytest.raises(md.MaterialError, match="gives inf dB at 0.0000°"):
        md.Material("loud", lambda theta_deg: np.inf)
    with pytest.raises(ZeroDivisionError):
        md.Material("broken", lambda theta_deg: 1 / 0)
    with pytest.raises(md.UsageError, match=r"shape \(3,\) for 1025 angles; give one number for each, or one for all"):
        md.Material("short", lambda theta_deg: theta_deg[:3])
    with pytest.raises(md.UsageError, match=r"2.0 to 1.0 is no range; give \(start, low, high\)|2 to 1 is no range"):
        md.Material("own", lambda theta_deg, m: -m, parameters={"m": (1, 2, 1)})
    law = md.open()["cotton"]
    for outside in [95, -1, np.nan, np.inf]:
        with pytest.raises(md.UsageError, match="is out of the range; give angles of incidence from 0 to 90"):
            law.sigma0_db([10, outside])
    assert law.sigma0_db(10).shape == (1,) and law.sigma0_db([]).shape == (0,)
    with pytest.raises(ValueError, match=r"theta_deg has the shape \(1, 2\); give an array of one dimension"):
        law.sigma0_db([[1, 2]])


def test_values_that_are_no_real_numbers_are_refused(scene):
    places = np.ones((4, 3))
    for powers in [np.array(["1"] * 4), np.ones(4, bool), np.ones(4) * 1j, np.arange(4).astype("M8[s]")]:
        with pytest.raises(TypeError, match="power_dbm has values of type .*; give real numbers"):
            md.Cloud(places, powers)
    masked = np.ma.masked_array(np.full(4, -60.0), mask=[1, 0, 0, 0])
    with pytest.raises(md.Error, match="power"):
        md.Cloud(places, masked)
    hidden = np.ma.masked_array(places, mask=[[1, 1, 1]] + [[0, 0, 0]] * 3)
    assert len(md.Cloud(hidden, np.full(4, -60.0)).power_dbm) == 3
    with pytest.raises(ValueError, match=r"xyz_m has the shape \(4,\); give \(n, 3\)"):
        md.Cloud(np.ones(4), np.ones(4))
    endless = {}
    endless["a"] = endless
    for value in [endless, [endless]]:
        with pytest.raises(md.UsageError, match="has more than 32 levels, or contains itself"):
            scene.replace(radar=value)
    with pytest.raises(md.UsageError, match="added as a file"):
        md.open().add(md.Material("mine", lambda theta_deg: -theta_deg))


def test_a_process_that_was_forked_says_so(tmp_path):
    program = """
import os, matdb as md
md.render("builtin:calibration-plate")
child = os.fork()
if child == 0:
    try:
        md.render("builtin:calibration-plate")
    except md.UsageError as refused:
        print(refused, flush=True)
    os._exit(0)
os.waitpid(child, 0)
"""
    done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert "was forked after matdb was loaded" in done.stdout and "spawn" in done.stdout


def test_a_function_is_a_base_model_of_a_diagnosis():
    bench = md.load_scene("builtin:bench")
    name = bench.to_dict()["region"][0]["material"]
    known = md.open()[name]
    law = md.Material("mine", lambda theta_deg: known.sigma0_db(theta_deg))
    own = bench.with_materials({region: law for region in bench.regions})
    why = md.diagnose(md.render(md.load_scene("builtin:concealed")), own, effects=["foreign-patch", "drift"], controls=False)
    assert [effect["name"] for effect in why.effects] == ["foreign-patch"]


def sideways(shots, slope_db):
    return slope_db * shots.xt_m / 0.2


def test_an_effect_of_a_function_is_rendered_and_found(tmp_path):
    bench = md.load_scene("builtin:bench")
    own = md.Effect("sideways", sideways, {"slope_db": (-20, 20)}, level="instrument")
    assert repr(own) == "<matdb.Effect sideways(slope_db)>"
    places_m = {}

    def watched(shots, slope_db):
        places_m.update(zip(shots.chirp.tolist(), shots.xt_m.tolist()))
        return sideways(shots, slope_db)

    watched = md.Effect("watched", watched, {"slope_db": (-20, 20)}, level="instrument")
    with_it, without = md.render(bench.with_effects({watched: {"slope_db": 6}})), md.render(bench)
    assert any("no file can declare: watched" in notice for notice in with_it.notices) and without.notices != with_it.notices
    powers_dbm = [dict(zip(one.cloud["chirp"].tolist(), one.points_dbm.tolist())) for one in (with_it, without)]
    both = powers_dbm[0].keys() & powers_dbm[1].keys()
    gains_db = [powers_dbm[0][chirp] - powers_dbm[1][chirp] for chirp in both]
    # The noise of the receiver is no part of the echo.
    errors_db = np.subtract(gains_db, [6 * places_m[chirp] / 0.2 for chirp in both])
    assert len(both) > 1000 and np.quantile(np.abs(errors_db), 0.9) < 0.05
    scan = md.render(bench.with_effects({own: {"slope_db": 6}}))
    compared = [md.compare(scan, one) for one in (bench.with_effects({own: {"slope_db": 6}}), bench)]
    scatter_db = [np.nanstd(one.simulated_dbm - one.measured_dbm) for one in compared]
    assert scatter_db[0] < scatter_db[1] - 0.3, scatter_db
    again = pickle.loads(pickle.dumps(bench.with_effects({own: {"slope_db": 6}})))
    assert md.render(again).file("cloud.ply") == scan.file("cloud.ply") != md.render(bench).file("cloud.ply")
    why = md.diagnose(scan, bench, effects=["foreign-patch", "drift"], own_effects=[own], controls=False)
    assert why.verdict == "explained" and [effect["name"] for effect in why.effects] == ["sideways"]
    found = why.effects[0]["parameters"]["slope_db"]
    assert abs(found["value"] - 6) < 3 * found["sd"] < 3
    why.save(tmp_path)
    assert "sideways" not in (tmp_path / "after.toml").read_text()
    assert "no file can declare: sideways" in (tmp_path / "report.html").read_text()


def test_an_effect_of_a_function_is_checked(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    bench = md.load_scene("builtin:bench")
    for name, function, parameters, options, said in [
        ("drift", sideways, {"slope_db": (-1, 1)}, {}, "the library has an effect `drift`"),
        ("Side Ways", sideways, {"slope_db": (-1, 1)}, {}, "is not a material name|is not a name"),
        ("own", sideways, {}, {}, "at least one parameter"),
        ("own", sideways, {"slope_db": (1, -1)}, {}, "is no range"),
        ("own", sideways, {"slope_db": (1, 2)}, {}, "with the value 0 at which the effect is absent"),
        ("own", sideways, {"slope_db": (1,)}, {}, "has 1 numbers"),
        ("own", sideways, {"slope db": (-1, 1)}, {}, "no name of an argument"),
        ("own", sideways, {"slope_db": (-1, 1)}, {"level": "sky"}, "give instrument, material or scene"),
        ("own", sideways, {"slope_db": (-1, 1)}, {"starts": [{"slope": 1}]}, "give slope_db"),
        ("own", sideways, {"slope_db": (-1, 1)}, {"starts": [{"slope_db": 2}]}, "out of range; give a value from -1 to 1"),
    ]:
        with pytest.raises(md.UsageError, match=said):
            md.Effect(name, function, parameters, **options)
    with pytest.raises(TypeError, match="is a function"):
        md.Effect("own", 3, {"slope_db": (-1, 1)})

    def of(function):
        return md.Effect("own", function, {"slope_db": (-20, 20)})

    for function, kind, said in [
        (lambda shots, slope_db: 1 / 0, ZeroDivisionError, "division"),
        (lambda shots, slope_db: np.nan, md.UsageError, "effect `own` gives NaN"),
        (lambda shots, slope_db: np.inf, md.UsageError, "or more than 300 dB"),
        (lambda shots, slope_db: np.zeros(len(shots) + 1), md.UsageError, "array of the shape .* for .* chirps; give one number for each"),
        (lambda shots, slope_db: None, md.UsageError, "gives None for .* chirps"),
        (lambda shots, slope_db: 1j, TypeError, "complex128; give real numbers"),
        (lambda shots, slope_db: md.render(bench) and 0, md.UsageError, "cannot render, fit or diagnose itself"),
        (lambda shots: 0.0, TypeError, "slope_db"),
    ]:
        with pytest.raises(kind, match=said):
            md.render(bench.with_effects({of(function): {}}))
        with pytest.raises(kind, match=said):
            md.diagnose(md.render(bench), bench, own_effects=[of(function)], effects=["drift"], controls=False)
    with pytest.raises(md.UsageError, match="two effects are called own"):
        bench.with_effects({of(sideways): {}, of(sideways): {}})
    both = bench.with_effects({of(sideways): {}}).with_effects(types.MappingProxyType(
        {md.Effect("other", sideways, {"slope_db": (-20, 20)}): {}}))
    assert repr(both).endswith("facets, with own, with other>")
    with pytest.warns(UserWarning, match="the file does not say effect `other`"):
        both.save("both/scene.toml")
    with pytest.raises(md.UsageError, match="beside effects of one's own cannot be stored"):
        md.diagnose(md.render(bench), both, db=md.open("own.sqlite"), add=True)
    with pytest.raises(md.UsageError, match="slope_db = 30.* out of range"):
        bench.with_effects({of(sideways): {"slope_db": 30}})


def lobe(theta_deg, r_s, alpha):
    return 10 * (np.log10(2 * r_s * (alpha + 2)) + (alpha + 2) * np.log10(np.cos(np.radians(theta_deg))))


def test_the_parameters_of_a_function_are_fitted(scene, tmp_path):
    curve = md.measure(md.render(md.load_scene("builtin:bench")), "builtin:bench")
    own = md.Material("own-lobe", lobe, parameters={"r_s": (0.1, 1e-4, 1), "alpha": (20, 0.1, 1000)})
    # A slope alone is found, too.
    falling = md.Material("falling", lambda theta_deg, a, b: a + b * theta_deg, parameters={"a": (-20, -80, 10), "b": (-0.5, -5, 0)})
    assert md.fit("cotton", model=falling, fixed={"a": -8.4}).parameters["b"] == pytest.approx(-0.41, abs=0.01)
    assert np.allclose(own.sigma0_db([10]), lobe(10, 0.1, 20), atol=0.02)
    found = curve.fit(pickle.loads(pickle.dumps(own)))
    known = curve.fit("blinn-phong")
    assert found.name == "own-lobe-censored" and found.names == ["r_s", "alpha", "looks"]
    assert abs(found.to_dict()["objective"] - known.to_dict()["objective"]) < 0.01
    for name in ["r_s", "alpha"]:
        assert found.parameters[name] == pytest.approx(known.parameters[name], rel=1e-3)
    assert pickle.loads(pickle.dumps(found)).parameters == found.parameters
    held = md.fit(curve, model=own, fixed={"alpha": 5})
    assert held.parameters["alpha"] == 5 and held.names == ["r_s", "looks"]
    assert np.allclose(held.sigma0_db([10, 40]), lobe(np.array([10, 40]), held.parameters["r_s"], 5), atol=0.02)
    db = md.open("own.sqlite")
    with pytest.raises(md.UsageError, match="cannot be stored; save the Material"):
        db.add("mine", found)
    # The way that this names.
    best = md.Material("mine", lobe, parameters={"r_s": (0.1, 1e-4, 1), "alpha": (20, 0.1, 1000)}).at(**found.parameters)
    best.save(tmp_path / "mine.toml")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert db.add(files=[tmp_path / "mine.toml"]) == ["mine@1"]
    assert np.allclose(db["mine"].sigma0_db([10, 40]), found.sigma0_db([10, 40]), atol=0.02)
    with pytest.raises(md.UsageError, match="no parameters to fit"):
        curve.fit(md.Material("mine", lambda theta_deg: -theta_deg))
    with pytest.raises(md.UsageError, match="give r_s, alpha"):
        best.at(beta=1)
    with pytest.raises(md.UsageError, match="alpha = 0 is out of range"):
        best.at(alpha=0)
    with pytest.raises(md.UsageError, match="no parameter `beta`.* there are: r_s, alpha"):
        curve.fit(own, fixed={"beta": 1})
    with pytest.raises(md.UsageError, match="cannot be called `looks`"):
        md.Material("own", lambda theta_deg, looks: -looks, parameters={"looks": (1, 0, 2)})
    with pytest.raises(md.UsageError, match="gives NaN dB at 0.0000° with {'m': "):
        curve.fit(md.Material("own", lambda theta_deg, m: -m if m == 1 else np.nan, parameters={"m": (1, 0, 2)}))
    with pytest.raises(md.UsageError, match="columns is for the name of a material or of a file; leave it out"):
        md.fit(curve, columns={"a": "theta_deg"})
    with pytest.raises(md.UsageError, match="curve is for a material; leave it out"):
        md.diagnose_curve(curve, curve="wet")
    with pytest.raises(md.UsageError, match="m = 2 is out of range; give a value from 0 to 1"):
        md.Material("own", lambda theta_deg, m: -m, parameters={"m": (2, 0, 1)})
    with pytest.raises(TypeError, match="is .start, low, high."):
        md.Material("own", lambda theta_deg, m: -m, parameters={"m": (2, 0)})

    calls = []

    def failing(theta_deg, m):
        calls.append(m)
        if len(calls) > 20:
            raise ZeroDivisionError
        return -m * np.ones_like(theta_deg)

    with pytest.raises(ZeroDivisionError):
        curve.fit(md.Material("own", failing, parameters={"m": (10, 0, 100)}))


def test_what_is_missing_is_said(scene, monkeypatch):
    scan = md.render(scene)
    for package, call in [("open3d", scan.to_open3d), ("rerun", scan.to_rerun), ("pyarrow", scan.cloud.to_arrow)]:
        with monkeypatch.context() as there:
            there.setitem(sys.modules, package, None)
            with pytest.raises(ModuleNotFoundError, match="this needs .*; pip install"):
                call()


def test_a_seed_out_of_range_is_refused_in_a_sentence(scene):
    for given in [-1, 2**64]:
        with pytest.raises(md.UsageError, match=rf"seed = {given} is out of range; give a whole number from 0 to 18446744073709551615"):
            md.render(scene, seed=given)
    with pytest.raises(TypeError, match="seed"):
        md.render(scene, seed=1.5)


def test_a_database_stays_the_same_file_in_another_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    db = md.open("lab.sqlite")
    assert str(db.path) == "lab.sqlite"
    db.add("cotton")
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir("elsewhere")
    assert db.names() == ["cotton"] and db.path == tmp_path / "lab.sqlite"
    db.add("steel")
    assert pickle.loads(pickle.dumps(db)).names() == ["cotton", "steel"]
    assert not (tmp_path / "elsewhere" / "lab.sqlite").exists()
    with pytest.raises(md.UsageError, match="name of the database is empty; give a file"):
        md.open("")


def test_a_scan_is_a_cloud_of_open3d(scene):
    pytest.importorskip("open3d", reason="open3d is not installed", exc_type=ImportError)
    scan = md.render(scene)
    cloud = scan.to_open3d()
    assert np.array_equal(cloud.point["positions"].numpy(), scan.xyz_m)
    assert np.array_equal(cloud.point["power_dbm"].numpy()[:, 0], scan.points_dbm)
    assert cloud.point["chirp"].numpy()[2, 0] == scan.cloud["chirp"][2]
    assert cloud.to_legacy().has_colors()
    # And back.
    assert len(md.Cloud(cloud.point["positions"].numpy(), cloud.point["power_dbm"].numpy()[:, 0])) == len(scan.points_dbm)


def test_a_scan_is_logged_to_rerun(scene):
    rr = pytest.importorskip("rerun", reason="rerun is not installed", exc_type=ImportError)
    scan = md.render(scene)
    with pytest.raises(RuntimeError, match="call rerun.init"):
        scan.to_rerun()
    rr.init("test")
    rr.save("scan.rrd")
    scan.to_rerun("plate")
    rr.disconnect()
    assert Path("scan.rrd").stat().st_size > 1000


TILTED = SCENE.replace("= 12", "= 18").replace('file = "builtin:plate"', 'file = "builtin:plate"\nrotation_deg = [0, 8, 0]')
DRIFT = '[[radar.effect]]\nname = "drift"\nslope_db = 8.0\n'


@pytest.fixture
def drifting(tmp_path, monkeypatch):
    """Two clouds of one plate, whose radar drifts as the scenes do not say."""
    monkeypatch.chdir(tmp_path)
    for name, scene, seed in [("a", TILTED, 5), ("b", TILTED.replace("[0, 8, 0]", "[0, -6, 0]"), 6)]:
        Path(f"{name}.toml").write_text(scene)
        Path("drifting.toml").write_text(scene + DRIFT)
        md.render("drifting.toml", seed=seed).save("out")
        Path(f"{name}.ply").write_bytes(Path("out/cloud.ply").read_bytes())
    return {"effects": ["drift", "compression"], "controls": False}


# Flags of the command for the settings of the fixture.
QUICK = ["--effects", "drift,compression", "--no-controls"]


def test_several_clouds_are_diagnosed_as_by_the_command_line(drifting, tmp_path):
    why = md.diagnose(["a.ply", "b.ply"], ["a.toml", "b.toml"], **drifting)
    said = said_by_command(tmp_path, "diagnose", "a.ply", "b.ply", "--scene", "a.toml", "--scene", "b.toml", "-o", "by-command",
                           *QUICK)
    assert why.to_dict() == said and [cloud["name"] for cloud in said["clouds"]] == ["a.ply", "b.ply"]
    assert [effect["name"] for effect in why.effects] == ["drift"]
    why.save("why")
    of_words = ["report.html"]  # it names the folder
    by_hand, by_command = files("why"), files("by-command")
    assert by_hand.keys() == by_command.keys() and {"after.toml", "after-2.toml"} < by_hand.keys()
    assert all(by_hand[name] == by_command[name] for name in by_hand if name not in of_words)
    # Objects, among them two scenes of one file.
    a = md.load_scene("a.toml")
    b = a.replace(mesh=md.load_scene("b.toml").to_dict()["mesh"])
    again = md.diagnose([md.Cloud.load("a.ply"), md.Cloud.load("b.ply")], (a, b), **drifting)
    assert [cloud["name"] for cloud in again.to_dict()["clouds"]] == ["points-1", "points-2"]
    assert again.effects == why.effects and again.after == why.after
    again.save("again")
    assert "-6" in Path("again/after-2.toml").read_text() and "-6" not in Path("again/after.toml").read_text()
    # One scene for all repeats.
    md.render("drifting.toml", seed=9).save("repeat")
    repeats = md.diagnose(["b.ply", "repeat/cloud.ply"], "b.toml", **drifting)
    repeats.save("repeats")
    assert len(repeats.to_dict()["clouds"]) == 2 and "after-2.toml" not in files("repeats")


def test_several_clouds_are_checked(drifting, tmp_path):
    def said(*words):
        done = command(tmp_path, "diagnose", *words, "-o", "by-command")
        assert done.returncode == 1
        return done.stderr.splitlines()[-1].removeprefix("error: ")

    with pytest.raises(md.UsageError) as number:
        md.diagnose(["a.ply", "b.ply", "out/cloud.ply"], ["a.toml", "b.toml"])
    flags = ["--scene", "a.toml", "--scene", "b.toml"]
    assert str(number.value) == said("a.ply", "b.ply", "out/cloud.ply", *flags).replace("--scene", "scene")
    with pytest.raises(md.UsageError) as twice:
        md.diagnose(["a.ply", "a.ply"], "a.toml")
    assert str(twice.value) == said("a.ply", "a.ply", "--scene", "a.toml")
    cloud = md.Cloud.load("a.ply")
    for same in [md.Cloud.load("a.ply"), "a.ply"]:
        with pytest.raises(md.UsageError, match="the clouds .* and .* have the same powers; give each measurement once"):
            md.diagnose([cloud, same], "a.toml")
    with pytest.raises(md.UsageError, match="there is no cloud"):
        md.diagnose([], "a.toml")
    with pytest.raises(TypeError, match="give a matdb.Cloud"):
        md.diagnose([cloud, 7], "a.toml")
    law, other = [md.Material("mine", lambda theta_deg, at=at: 0 * theta_deg - at) for at in (10, 20)]
    scenes = [md.load_scene(f"{name}.toml").with_materials({"all": one}) for name, one in [("a", law), ("b", other)]]
    with pytest.raises(md.UsageError, match="one material in a scene and another one in the next"):
        md.diagnose(["a.ply", "b.ply"], scenes)


def kept(name):
    """What a database has, without when it was stored."""
    db = md.open(name)
    revisions = {(one, line["revision"]): line for one in db.names() for line in db.history(one)}
    timeless = {key: {word: value for word, value in line.items() if word != "added_at"} for key, line in revisions.items()}
    return timeless, {key: db[f"{key[0]}@{key[1]}"].content_hash for key in revisions}


def test_what_is_found_is_stored_as_by_the_command_line(drifting, tmp_path):
    db = md.open("by-hand.sqlite")
    why = md.diagnose("a.ply", "a.toml", db=db, add=True, **drifting)
    assert not list(Path().glob("*-after.toml"))
    said_by_command(tmp_path, "diagnose", "a.ply", "--scene", "a.toml", "-o", "by-command", "--add",
                    *QUICK)
    assert why.stored == ["mannequin-paint@2"] and kept("by-hand.sqlite") == kept("matdb.sqlite")
    [after] = why.scenes_after
    assert after.text == Path("a-after.toml").read_text() and 'name = "drift"' in after.text
    why.save("why")
    of_words = ["report.html"]  # it names the folder and the database
    by_hand, by_command = files("why"), files("by-command")
    assert by_hand.keys() == by_command.keys()
    assert all(by_hand[name] == by_command[name] for name in by_hand if name not in of_words)
    assert b"after.toml -o rendered" in by_hand["report.html"] and b"a-after.toml" not in by_hand["report.html"]
    back = pickle.loads(pickle.dumps(why))
    assert back.stored == why.stored and [scene.text for scene in back.scenes_after] == [after.text]
    # Nothing is missing any more, and that is stored, too: the same diagnosis twice is one revision.
    for _ in range(2):
        again = md.diagnose("a.ply", after, db=db, add=True, **drifting)
        assert again.stored == ["mannequin-paint@3"] and again.scenes_after == [] and again.effects == []
    # Without `add`, nothing is.
    alone = md.diagnose("a.ply", "a.toml", db=db, **drifting)
    assert alone.stored == [] == alone.scenes_after and db["mannequin-paint"].revision == 3


def test_scenes_of_arrays_have_what_was_found(drifting):
    db = md.open()
    meshes = {"plate": {"mesh": plate_of(1.0), "translation_m": [0, 1.1, 0], "rotation_deg": [0, 8, 0]}}
    radar = md.load_scene("a.toml").to_dict()["radar"]
    scene = md.Scene(meshes=meshes, materials="mannequin-paint", radar=radar)
    scan = md.render(scene.replace(radar__effect=[{"name": "drift", "slope_db": 8.0}]), seed=5)
    why = md.diagnose(scan, scene, db=db, add=True, **drifting)
    [after] = why.scenes_after
    assert [effect["name"] for effect in after.to_dict()["radar"]["effect"]] == ["drift"]
    assert md.render(after, db=db).record["counts"] and why.stored == ["mannequin-paint@2"]


def test_nothing_is_stored_where_something_is_refused(drifting):
    db = md.open("mine.sqlite")
    with pytest.raises(md.UsageError, match="give db"):
        md.diagnose("a.ply", "a.toml", add=True, **drifting)
    with pytest.raises(md.UsageError, match="the scene has no material `cotton`"):
        md.diagnose("a.ply", "a.toml", db=db, add=True, material="cotton", **drifting)
    given = md.load_scene("a.toml").with_materials({"all": md.Material("mine", lambda theta_deg: 0 * theta_deg - 10)})
    with pytest.raises(md.UsageError, match="`given:mine` .*; add it to the database, if"):
        md.diagnose("a.ply", given, db=db, add=True, **drifting)
    few = md.Cloud.load("a.ply")
    few = md.Cloud(few.xyz_m[:40], few.power_dbm[:40])
    with pytest.raises(md.DiagnoseError):
        md.diagnose(few, "a.toml", db=db, add=True, **drifting)
    assert len(db) == 0


def test_an_answer_outlives_a_database_that_cannot_be_written(drifting):
    db = md.open("mine.sqlite")
    db.add("mannequin-paint")
    # Locks are those of processes.
    hold = """
import sqlite3
held = sqlite3.connect("mine.sqlite")
held.execute("BEGIN IMMEDIATE")
print("held", flush=True)
input()
"""
    with subprocess.Popen([sys.executable, "-c", hold], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as other:
        assert other.stdout.readline() == "held\n"
        with pytest.raises(md.StoreError, match="locked|another program|busy") as refused:
            md.diagnose("a.ply", "a.toml", db=db, add=True, **drifting)
        other.communicate("done\n")
    why = refused.value.diagnosis
    assert [effect["name"] for effect in why.effects] == ["drift"] and why.stored == [] == why.scenes_after
    why.save("why")
    assert 'name = "drift"' in Path("why/after.toml").read_text() and db["mannequin-paint"].revision == 1


def levels(scatter_db, bump_db=0.0):
    """A curve of 80 levels about a lobe and a flat part, with a bump that no law has."""
    angles = np.arange(0, 80.0)
    level = 10 * np.log10(10 * np.exp(-((angles / 4) ** 2)) + 0.03 * np.cos(np.radians(angles)) ** 2)
    level += bump_db * np.exp(-(((angles - 40) / 6) ** 2)) + np.random.default_rng(3).normal(0, scatter_db, 80)
    return "theta_deg,sigma0_db\n" + "".join(f"{angle},{one}\n" for angle, one in zip(angles, level))


def test_a_curve_is_diagnosed_as_by_the_command_line(scene, tmp_path):
    Path("curve.csv").write_text(levels(0.3, bump_db=3.0))
    why = md.diagnose_curve("curve.csv", model="mixture", noise_db=0.3, seed=2)
    words = ["diagnose", "--curve", "curve.csv", "--model", "mixture", "--noise-db", "0.3", "--seed", "2", "-o", "by-command"]
    assert why.to_dict() == said_by_command(tmp_path, *words)
    why.save("why")
    assert files("why") == files("by-command")
    why.report("page.html")
    assert Path("page.html").read_bytes() == files("why")["report.html"]
    # Their names of columns, and some effects.
    Path("theirs.csv").write_text(levels(0.3).replace("theta_deg", "inc"))
    few = md.diagnose_curve("theirs.csv", columns={"inc": "theta_deg"}, effects=["stray-light", "stray-light"], noise_db=0.3)
    flags = ["--columns", "inc=theta_deg", "--effects", "stray-light", "--noise-db", "0.3", "-o", "few"]
    assert few.to_dict() == said_by_command(tmp_path, "diagnose", "--curve", "theirs.csv", *flags)
    # A material's curve is that of its export, and a measurement the file that it saves.
    db = md.open()
    db.add(files=["curve.csv"], name="mine", material_class="paint", kind="measured", source="A test", licence="CC0-1.0",
           instrument="Ours", frequency_ghz=300, threshold_dbm=-77)
    db.export("mine", "mine.csv", format="csv", curve="curve")
    said = said_by_command(tmp_path, "diagnose", "--curve", "mine.csv", "--noise-db", "0.3", "-o", "of-material")
    for given in ["mine", db["mine"]]:
        own = md.diagnose_curve(given, db=db, noise_db=0.3)
        # The export has 15 digits.
        assert own.verdict == said["verdict"] and own.before["rmse_db"] == pytest.approx(said["error"]["before"]["rmse_db"], 1e-6)
    ball = TILTED.replace("builtin:plate", "builtin:sphere").replace("size_m = [1, 1, 0]", "size_m = [0.4, 0.4, 0.4]")
    ball = md.Scene.from_text(ball.replace("= 0.2", "= 0.4"), "ball.toml")
    measured = md.measure(md.render(ball), ball)
    measured.save("measured")
    said = said_by_command(tmp_path, "diagnose", "--curve", "measured/curve.csv", "-o", "of-measurement")
    own = md.diagnose_curve(measured)
    assert own.to_dict() == said and pickle.loads(pickle.dumps(own)).verdict == own.verdict


def test_a_curve_that_cannot_be_diagnosed_is_refused(scene, tmp_path):
    Path("curve.csv").write_text(levels(0.3))
    with pytest.raises(md.UsageError, match="a curve has no model `mixtur`; did you mean `mixture`"):
        md.diagnose_curve("curve.csv", model="mixtur")
    with pytest.raises(md.UsageError, match="a curve has no effect `drift`"):
        md.diagnose_curve("curve.csv", effects=["drift"])
    with pytest.raises(md.FileError, match="nothing.csv"):
        md.diagnose_curve("nothing.csv")
    with pytest.raises(md.UnknownMaterialError):
        md.diagnose_curve("nothing")
    with pytest.raises(TypeError):
        md.diagnose_curve(7)
    Path("short.csv").write_text("".join(levels(0.3).splitlines(keepends=True)[:12]))
    with pytest.raises(md.DiagnoseError) as short:
        md.diagnose_curve("short.csv")
    said = command(tmp_path, "diagnose", "--curve", "short.csv", "-o", "short")
    assert said.returncode == 1 and said.stderr.splitlines()[-1] == f"error: {short.value}"
    with pytest.raises(md.Error, match="read"):
        Path("residuals.csv").write_text(levels(0.3))
        md.diagnose_curve("residuals.csv", noise_db=0.3, effects=["stray-light"]).save(".")


def test_a_radar_is_shown_as_by_the_command_line(scene, tmp_path):
    said = said_by_command(tmp_path, "radar", "plate.toml", "-o", "by-command")
    del said["output"]
    for number, given in enumerate(["plate.toml", Path("plate.toml"), scene]):
        shown = md.radar(given)
        shown.save(f"by-hand-{number}")
        assert shown.to_dict() == said and files(f"by-hand-{number}") == files("by-command")
    assert shown._repr_png_() == files("by-command")["scan.png"] and repr(shown) == "<matdb.Radar upm-300ghz: 144 chirps>"
    assert pickle.loads(pickle.dumps(shown)).to_dict() == said
    assert md.radar("upm-300ghz").to_dict()["chirps"] > 144
    with pytest.raises(md.SceneError) as unknown:
        md.radar("upm")
    assert command(tmp_path, "radar", "upm", "-o", "none").stderr == f"error: {unknown.value}\n"
    with pytest.raises(TypeError, match="give a matdb.Scene"):
        md.radar(7)


def test_files_to_begin_with_are_those_of_the_command_line(scene, tmp_path):
    md.render(scene).save("out")
    words = ["new", "scene", "--cloud", "out/cloud.ply", "--mesh", "builtin:plate", "--radar-at", "0,1.1,8", "--look-at", "0,1.1,0",
             "--frequency", "280"]
    assert command(tmp_path, *words, "-o", "by-command/scene.toml").returncode == 0
    with pytest.warns(UserWarning, match=r"beside the mesh: .* is pose=\("):
        made = md.new_scene("out/cloud.ply", "builtin:plate", "by-hand/scene.toml", radar_at_m=(0, 1.1, 8),
                            look_at_m=(0, 1.1, 0), frequency_ghz=280)
    assert files("by-hand") == files("by-command")
    assert made.text == Path("by-hand/scene.toml").read_text() and made.chirps == len(md.Cloud.load("out/cloud.ply"))
    points = md.Cloud(md.Cloud.load("out/cloud.ply").xyz_m, md.Cloud.load("out/cloud.ply").power_dbm)
    with pytest.raises(md.UsageError) as nowhere:
        md.new_scene(points, "builtin:plate", "points/scene.toml")
    assert nowhere.value.hint == "say where the radar stood, as in radar_at_m=(0, 1.2, 3)"
    with pytest.raises(md.UsageError, match="radar_at_m = .* is not a place"):
        md.new_scene(points, "builtin:plate", "points/scene.toml", radar_at_m=(0, 1, np.nan))
    assert not Path("points").exists()
    assert md.new_scene(points, "builtin:plate", "points/scene.toml", radar_at_m=[0, 1.1, 8]).chirps == len(points)
    with pytest.raises(md.UsageError, match="exists already; name another"):
        md.new_scene(points, "builtin:plate", "by-hand/scene.toml", radar_at_m=[0, 1.1, 8])
    assert files("by-hand") == files("by-command")
    assert command(tmp_path, "new", "material", "my-paint", "-o", "paint-by-command").returncode == 0
    assert md.new_material("my-paint") == Path("my-paint")
    assert files("my-paint") == files("paint-by-command")
    with pytest.raises(md.UsageError, match="exists already"):
        Path("my-paint/scan.csv").write_text("mine")
        md.new_material("my-paint")
    with pytest.raises(md.UsageError):
        md.new_material("My Paint")
    with pytest.warns(UserWarning):
        assert md.open().add(files=[md.new_material("my-other", "elsewhere")]) == ["my-other@1"]
