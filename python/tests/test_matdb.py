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
    running = subprocess.Popen([sys.executable, "-c", program], cwd=tmp_path, stdout=subprocess.PIPE, text=True)
    assert running.stdout.readline() == "begun\n"
    time.sleep(0.5)
    assert running.poll() is None, "the render is too short for this test"
    running.send_signal(signal.SIGINT)
    said, _ = running.communicate(timeout=20)
    assert said == "interrupted\n" and running.returncode == 0


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
    for _ in range(200):
        md.render(scene)
    assert kilobytes() - before < 8_000, "200 renders of 40 kB of files each"


def examples():
    root = Path(__file__).parent.parent.parent
    pages = [(root / page).read_text() for page in ["python/README.md", "docs/python.md"]]
    found = [example for page in pages for example in re.findall(r"```python\n(.*?)```", page, re.DOTALL)]
    assert len(found) == 6
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
    curve = md.measure(md.Cloud(scan.xyz_m, scan.points_dbm), scene)
    for axes in [scan.plot(), curve.plot(), curve.fit("lambert").plot()]:
        assert axes.get_xlabel() and axes.get_ylabel()


def test_comparing_and_calibrating_are_those_of_the_command_line(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    plate = md.load_scene("builtin:calibration-plate")
    md.render(plate).save("out")

    def said(*words):
        done = command(tmp_path, *words, "--json", "-q")
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

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
AFTERNOON = """
db    = md.open("matdb.sqlite")
scene = md.load_scene("builtin:concealed")
scan  = md.render(scene, db=db, seed=7)
img   = scan.power_dbm
cloud = scan.cloud
scan
scan.save("out/")

points = md.Cloud(scan.xyz_m, scan.points_dbm)
curve  = md.measure(points, scene, region="skin")
fit    = curve.fit("cook-torrance + blinn-phong")
db.add("my-skin", fit, source="My bench, 2026", licence="CC-BY-4.0")
why    = md.diagnose(points, scene)
"""


def test_a_first_afternoon(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    said = {"md": md}
    exec(AFTERNOON, said)
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
        done = command(tmp_path, *words, "--json", "-q")
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

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
