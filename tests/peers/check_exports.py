#!/usr/bin/env python3
"""Checks what `matdb export` writes of every built-in material with the peers' own schemas and programs.

    cargo build --release
    git clone https://github.com/BiRD-project/BiRD_view
    git clone https://github.com/asam-ev/OpenMATERIAL-3D
    python3 -m venv venv && venv/bin/pip install jsonschema==4.26.0 mitsuba==3.9.1 sionna-rt==2.2.0
    venv/bin/python tests/peers/check_exports.py target/release/matdb \
        --universal-brdf BiRD_view --open-material OpenMATERIAL-3D --mitsuba --sionna

Only the peers that are named are checked. Each material goes through

- universal BRDF: the JSON Schemas of the checkout's `BRDF_JSON_schema/`;
- open material: those of its `schemas/`, the material and each of its tables;
- Mitsuba: it loads the BSDF, and its own backscatter is compared with matdb's at every degree that matdb gives
  the level of: the difference, dB rms, must be what the export says of itself;
- Sionna: it makes the radio material and evaluates the pattern, which must be finite and not negative.

It prints a line per peer, every failure, and what matdb itself refuses to write. It ends with status 1 if anything
failed, 2 if a peer that was asked for is not there.
"""

import argparse
import csv
import io
import json
import math
import re
import subprocess
import sys
import tempfile
from pathlib import Path

# An export says by how much it misses to a tenth of a decibel, and says nothing below half of that.
ROUNDING_DB = 0.06


class Absent(Exception):
    """A peer that was asked for is not there."""


class Refused(Exception):
    """matdb itself says that the format cannot hold the material."""


class Matdb:
    """The program, with a database of its built-in materials."""

    def __init__(self, program, folder):
        self.program = str(Path(program).resolve())
        self.folder = Path(folder)
        self.run("add", "--all", "--quiet")
        self.names = [line["slug"] for line in json.loads(self.run("list", "--json"))]

    def run(self, *arguments):
        command = [self.program, "--db", "builtin.sqlite", *arguments]
        done = subprocess.run(command, cwd=self.folder, capture_output=True, text=True)
        if done.returncode != 0:
            raise Refused(done.stderr.strip())
        return done.stdout

    def export(self, name, kind, ending):
        """The folder of the files that an export writes, and the first of them."""
        folder = self.folder / kind / name
        folder.mkdir(parents=True)
        file = folder / f"{name}.{ending}"
        self.run("export", name, "--as", kind, "-o", str(file), "--quiet")
        return file

    def backscatter(self, name):
        """[(angle in rad, sigma0 in dB)] of what scenes render."""
        file = self.folder / f"{name}.csv"
        self.run("export", name, "--as", "csv", "-o", str(file), "--quiet")
        lines = [line for line in file.read_text().splitlines() if not line.startswith("#")]
        rows = csv.DictReader(io.StringIO("\n".join(lines)))
        return [
            (math.radians(float(row["theta_deg"])), float(row["sigma0_db"]))
            for row in rows
            if row["censor"] == "none"
        ]


def imported(name):
    try:
        return __import__(name, fromlist=["_"])
    except ImportError as error:
        raise Absent(f"`import {name}` fails: {error}") from None


def schemas(folder):
    """A registry of the JSON Schemas in a folder by their addresses, and each by its file's name."""
    referencing, drafts = imported("referencing"), imported("referencing.jsonschema")
    if not folder.is_dir():
        raise Absent(f"{folder} is no folder; name a checkout of the peer's repository")
    registry, by_name = referencing.Registry(), {}
    for path in sorted(folder.glob("*.json")):
        try:
            schema = json.loads(path.read_text(encoding="utf-8"))
        except json.JSONDecodeError as error:
            print(f"note: {path.name} is no valid JSON and not used: {error}")
            continue
        by_name[path.name] = schema
        resource = drafts.DRAFT202012.create_resource(schema)
        registry = registry.with_resource(schema.get("$id", path.name), resource)
    return registry, by_name


def problems(schema, registry, file):
    jsonschema = imported("jsonschema")
    validator = jsonschema.validators.validator_for(schema)(schema, registry=registry)
    value = json.loads(file.read_text(encoding="utf-8"))
    return [f"{file.name}: {error.json_path}: {error.message:.200}" for error in validator.iter_errors(value)]


def universal_brdf(checkout):
    registry, by_name = schemas(Path(checkout) / "BRDF_JSON_schema")
    schema = by_name.get("brdf_json_schema_v1.0.json")
    if schema is None:
        raise Absent(f"{checkout} has no brdf_json_schema_v1.0.json")
    return lambda matdb, name: problems(schema, registry, matdb.export(name, "universal-brdf", "brdf"))


def open_material(checkout):
    registry, by_name = schemas(Path(checkout) / "schemas")
    if "material_schema.json" not in by_name:
        raise Absent(f"{checkout} has no schemas/material_schema.json")

    def check(matdb, name):
        first = matdb.export(name, "open-material", "xomp")
        found = problems(by_name["material_schema.json"], registry, first)
        for table in sorted(first.parent.glob("*.xompt")):
            kind = table.stem.rsplit("_", 1)[-1]
            found += problems(by_name[f"material_{kind}_schema.json"], registry, table)
        return found

    return check


def mitsuba():
    mi = imported("mitsuba")
    mi.set_variant("scalar_rgb")

    def backscatter_db(bsdf, theta_rad):
        interaction = mi.SurfaceInteraction3f()
        interaction.wi = mi.Vector3f(math.sin(theta_rad), 0.0, math.cos(theta_rad))
        back = bsdf.eval(mi.BSDFContext(), interaction, interaction.wi)
        # Mitsuba's value is f cos(theta), and sigma0 = 4 pi f cos^2(theta).
        return 10.0 * math.log10(4.0 * math.pi * float(back[0]) * math.cos(theta_rad))

    def check(matdb, name):
        text = matdb.export(name, "mitsuba", "xml").read_text(encoding="utf-8")
        bsdf = mi.load_string(text)
        said = re.search(r"miss its backscatter by ([0-9.]+) dB rms", text)
        said_db = float(said.group(1)) if said else 0.0
        levels = [(at, db) for at, db in matdb.backscatter(name) if math.cos(at) > 1e-6]
        off_db = [backscatter_db(bsdf, at) - db for at, db in levels]
        rms_db = math.sqrt(sum(off * off for off in off_db) / len(off_db))
        if abs(rms_db - said_db) > ROUNDING_DB:
            return [f"misses matdb's backscatter by {rms_db:.2f} dB rms, and says {said_db:.1f} dB"]
        return []

    return check


def sionna():
    mi = imported("mitsuba")
    mi.set_variant("llvm_ad_mono_polarized")
    rt = imported("sionna.rt")

    def check(matdb, name):
        file = matdb.export(name, "sionna", "py")
        made = {}
        exec(compile(file.read_text(encoding="utf-8"), file.name, "exec"), made)
        material = made["material"]
        if not isinstance(material, rt.RadioMaterial):
            return ["is no RadioMaterial"]
        if material.name != name:
            return [f"is called {material.name}"]
        back = mi.Vector3f(math.sin(0.5), 0.0, math.cos(0.5))
        value = [float(v) for v in list(material.scattering_pattern(-back, back))]
        sound = all(math.isfinite(v) and v >= 0.0 for v in value)
        return [] if value and sound else [f"its pattern is {value} at 0.5 rad"]

    return check


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("matdb", help="the program")
    parser.add_argument("--universal-brdf", metavar="CHECKOUT", help="of BiRD-project/BiRD_view")
    parser.add_argument("--open-material", metavar="CHECKOUT", help="of asam-ev/OpenMATERIAL-3D")
    parser.add_argument("--mitsuba", action="store_true", help="as this Python imports it")
    parser.add_argument("--sionna", action="store_true", help="sionna.rt as this Python imports it")
    asked = parser.parse_args()
    peers = {}
    if asked.universal_brdf:
        peers["universal BRDF"] = lambda: universal_brdf(asked.universal_brdf)
    if asked.open_material:
        peers["open material"] = lambda: open_material(asked.open_material)
    if asked.mitsuba:
        peers["Mitsuba"] = mitsuba
    if asked.sionna:
        peers["Sionna"] = sionna
    if not peers:
        parser.error("name a peer, such as --mitsuba")
    status = 0
    with tempfile.TemporaryDirectory() as folder:
        matdb = Matdb(asked.matdb, folder)
        for peer, find in peers.items():
            try:
                check = find()
            except Absent as absent:
                print(f"{peer}: not checked: {absent}")
                status = 2
                continue
            failed, refused = 0, []
            for name in matdb.names:
                try:
                    found = check(matdb, name)
                except Refused as refusal:
                    refused.append(name)
                    print(f"{peer}: {name}: refused: {refusal}")
                    continue
                except Exception as error:  # Whatever a peer raises is a failure of this material.
                    found = [f"{type(error).__name__}: {error}"]
                failed += bool(found)
                for problem in found:
                    print(f"{peer}: {name}: {problem}")
            passed = len(matdb.names) - failed - len(refused)
            print(f"{peer}: {passed} of {len(matdb.names)} pass, {failed} fail, {len(refused)} are refused by matdb")
            status = status or int(failed > 0 or passed == 0)
    return status


if __name__ == "__main__":
    sys.exit(main())
