"""The pages of the book show each command in Python, too, and these lines run, a page after the other."""

import os
import re
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import numpy as np
import pytest

import matdb as md

ROOT = Path(__file__).parent.parent.parent
PAGES = re.findall(r"\]\((.*?\.md)\)", (ROOT / "docs" / "SUMMARY.md").read_text())

# By what a command is recognised in Python.
TWINS = {
    "new": r"new_(scene|material)\(", "render": r"render\(", "radar": r"radar\(", "calibrate": r"calibrate\(", "measure": r"measure\(", "compare": r"compare\(",
    "diagnose": r"diagnose(_curve)?\(", "add": r"\.add\(", "list": r"list\(|\.materials\(", "search": r"\.search\(", "near": r"\.near\(",
    "show": r"\[\"[\w-]+\"\]", "diff": r"\.diff\(", "history": r"\.history\(", "cite": r"\.cite\(",
    "predict": r"\.predict\(", "fit": r"\bfit\(|, fit\b", "check": r"\.check\(", "rm": r"\.remove\(",
    "withdraw": r"\.withdraw\(", "publish": r"\.publish\(", "verify": r"verify\(", "import": r"\.import_catalogue\(", "export": r"\.export\(", "dataset": r"dataset\(",
}

PLATE = """
name = "plate"
[radar.scan]
pattern = "raster"
lines = 20
chirps_per_line = 20
width_m = 0.2
height_m = 0.2
[radar.speckle]
looks = 4
form = "independent"
[radar.noise]
level_dbm = -100
[[mesh]]
name = "plate"
file = "builtin:cuboid"
size_m = [0.4, 0.4, 0.01]
rotation_deg = [0, 10, 0]
translation_m = [0, 1.1, 0]
[[region]]
name = "all"
material = "mannequin-paint"
"""

WATER = """# copyright and related rights waived via CC0 1.0
REFERENCES: "Somebody, a journal, 1977"
COMMENTS: "Water"
DATA:
  - type: tabulated nk
    data: |
        666.7 2.28 0.722
        1000 2.43 0.915
        2000 3.02 1.146
"""


def blocks(page):
    """Language and text of each fenced block."""
    return re.findall(r"^```([\w,]*)\n(.*?)^```$", (ROOT / "docs" / page).read_text(), re.DOTALL | re.MULTILINE)


def commands(language, text):
    """The commands of a shell block that have a twin, with their words."""
    if language not in ("sh", "bash"):
        return []
    lines = re.sub(r"\\\n", " ", text)
    found = re.findall(r"(?:^|&& |; )\s*matdb (?:--db \S+ )?((\S+).*?)(?= && | #|$)", lines, re.MULTILINE)
    return [(name, words) for words, name in found if name in TWINS]


def test_a_command_that_has_a_twin_shows_it():
    lacking, shown = [], 0
    for page in PAGES:
        of_page = blocks(page)
        for (language, text), (after, python) in zip(of_page, [*of_page[1:], ("", "")]):
            for name, words in commands(language, text):
                shown += 1
                if after != "python" or not re.search(TWINS[name], python):
                    lacking.append(f"{page}: matdb {words}")
    assert not lacking, "no lines in Python follow\n" + "\n".join(lacking)
    assert shown > 50, "the pages are not read as they are written"


def test_every_twin_stands_in_the_table():
    table = (ROOT / "docs" / "python.md").read_text()
    rows = re.findall(r"^\| `(\w+)` \| (.*) \|$", table.split("## Commands in Python")[1], re.MULTILINE)
    assert [name for name, _ in rows] == list(TWINS)
    assert all(re.search(TWINS[name].replace(r'\"[\w-]+\"', "name"), row) for name, row in rows)


def curve(of_degrees):
    """A CSV of levels, dB."""
    rows = [f"{angle},{of_degrees(angle):.3f}" for angle in range(0, 80, 2)]
    return "theta_deg,sigma0_db\n" + "\n".join(rows) + "\n"


def prepare_measured_plate():
    receiver = '[[receiver]]\nname = "left"\nposition_m = [-0.3, 1.1, 8]\n'
    drift = '[[radar.effect]]\nname = "drift"\nslope_db = 8.0\n'
    turned = PLATE.replace("[0, 10, 0]", "[0, -5, 0]")
    Path("scene.toml").write_text(PLATE + receiver)
    md.render("scene.toml").save("out")
    for cloud, scene, seed in [("cloud", PLATE, 5), ("a", PLATE, 6), ("b", turned, 7)]:
        Path(f"{cloud}.toml").write_text(scene)
        Path("drifting.toml").write_text(scene + drift)
        md.render("drifting.toml", seed=seed).save("measured-plate")
        shutil.copy("measured-plate/cloud.ply", f"{cloud}.ply")


def prepare_calibration():
    plate = md.load_scene("builtin:calibration-plate")
    md.render(plate).save("measured-plate")
    shutil.copy("measured-plate/cloud.ply", "cloud.ply")
    Path("scene.toml").write_text(plate.text)


def prepare_curves():
    paint = md.open()["mannequin-paint"]
    for seed, name in enumerate(["curve.csv", "spring.csv", "scan.csv"]):
        scatter = np.random.default_rng(seed).normal(0, 1, 80)
        Path(name).write_text(curve(lambda angle: paint.sigma0_db([angle])[0] + scatter[angle]))
    prepare_plane("plane.csv")
    add_paint("curve.csv")


def prepare_plane(path):
    lines = ["theta_i_deg,theta_s_deg,brdf_per_sr"]
    for receiver in range(-75, 76, 3):
        for incidence in [20, 50]:
            lines.append(f"{incidence},{receiver},{0.01 + 0.1 * np.exp(-((receiver - incidence) / 20) ** 2)}")
    Path(path).write_text("\n".join(lines))


def add_paint(path):
    md.open().add(files=[path], name="my-paint", material_class="paint", kind="measured", source="Another bench, 2025",
                  licence="CC-BY-4.0", instrument="Our radar", frequency_ghz=300, threshold_dbm=-77)


def prepare_two_revisions():
    prepare_curves()
    Path("again.csv").write_text(curve(lambda angle: -angle / 2))
    add_paint("again.csv")


def prepare_foreign_files():
    prepare_curves()
    Path("Afsar-19C.yml").write_text(WATER)
    md.open().export("ptfe", "paint.brdf", format="universal-brdf")


def thin(name, lines, width_m):
    """A scene of fewer chirps and rays: what it shows is tested elsewhere."""
    scan = f'[radar.scan]\npattern = "raster"\nlines = {lines}\nchirps_per_line = {lines}\n'
    scan += f"width_m = {width_m}\nheight_m = {width_m}\n"
    scene = Path(f"scenes/{name}.toml")
    text = re.sub(r"rays = \d+", "rays = 1", scene.read_text())
    scene.write_text(text.replace("[radar.speckle]", scan + "[radar.speckle]"))


def prepare_thin_mannequins():
    for name in ["concealed", "bench"]:
        thin(name, 30, 0.6)


def prepare_data_set(scans):
    """The data set of the pages, with fewer scans of fewer chirps."""
    shutil.copytree(ROOT / "examples" / "datasets", "examples/datasets")
    for name, before, after in [("torso", "rays = 16\n", "rays = 1\n[radar.scan]\nchirps = 600\nturns = 15\n"), ("concealed", "scans = 1000\n", f"scans = {scans}\n")]:
        path = Path("examples/datasets") / f"{name}.toml"
        text = path.read_text()
        assert before in text
        path.write_text(text.replace(before, after))


PREPARED = {
    "calibrating.md": prepare_calibration,
    "own-cloud.md": prepare_thin_mannequins,
    "why-does-my-model-miss.md": prepare_thin_mannequins,
    "measuring.md": prepare_thin_mannequins,
    "instrument.md": lambda: thin("showcase", 10, 0.9),
    "fitting-a-curve.md": prepare_curves,
    "diagnosing.md": prepare_measured_plate,
    "diagnosing-a-curve.md": lambda: prepare_plane("coating.csv"),
    "finding-materials.md": prepare_two_revisions,
    "exchange.md": prepare_foreign_files,
    "built-in-materials.md": lambda: shutil.copytree("materials/pvdf", "pvdf"),
    "database.md": lambda: md.open().add("cotton"),
    "data-sets.md": lambda: prepare_data_set(10),
    "training-set.md": lambda: prepare_data_set(1000),
}
# The files of these pages, by the languages and the order of their blocks.
FILES = {
    "first-image.md": {"toml": ["first.toml"]},
    "place-your-radar.md": {"toml": ["mine.toml"]},
    "instrument.md": {"toml": ["beat.toml"]},
    "publishing.md": {"csv": ["scan.csv"], "toml": ["about.toml"]},
    "lab-to-doi.md": {"csv": ["scan.csv"], "toml": ["about.toml"]},
    "levels.md": {"toml": ["plate.toml"]},
}
# Python's own page is tested with the functions that it describes.
RUN = [page for page in PAGES if page != "python.md" and any(language == "python" for language, _ in blocks(page))]


def shell(lines):
    """Runs lines that Python does not replace, with the program of this package."""
    path = f"{sysconfig.get_path('scripts')}{os.pathsep}{os.environ['PATH']}"
    environment = {**os.environ, "PATH": path}
    done = subprocess.run(["sh", "-euc", lines], env=environment, capture_output=True, text=True)
    assert done.returncode == 0, f"{lines}\n{done.stdout}{done.stderr}"


@pytest.mark.parametrize("page", RUN)
@pytest.mark.filterwarnings("ignore::UserWarning")
def test_the_lines_of_a_page_run(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "agg")
    for part in ["scenes", "examples/lab", "tests/fixtures/mitsuba", "materials"]:
        shutil.copytree(ROOT / part, part)
    of_page = blocks(page)
    for language, names in FILES.get(page, {}).items():
        texts = [text for own, text in of_page if own == language]
        for name, text in zip(names, texts):
            Path(name).write_text(text)
    PREPARED.get(page, lambda: None)()
    names = {}
    for language, text in of_page:
        if language == "python":
            exec(compile(text, page, "exec"), names)
        # What needs other programs, such as another version, is left out.
        elif language == "sh" and not commands(language, text) and re.match(r"(matdb|sed|mkdir|tar|python3 examples/lab)\b", text):
            shell(text)


def test_the_page_of_all_names_is_that_of_the_package():
    made = subprocess.run([sys.executable, Path(__file__).parent / "api_page.py"], capture_output=True, text=True, check=True)
    assert made.stdout == (ROOT / "docs" / "python-api.md").read_text(), "python python/tests/api_page.py > docs/python-api.md"
