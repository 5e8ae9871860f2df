#!/usr/bin/env python3
"""Checks a folder of `matdb publish` with the programs of those whose formats it holds.

    cargo build --release
    target/release/matdb add --all && target/release/matdb publish site
    python3 -m venv venv && venv/bin/pip install frictionless==5.16.1 cffconvert==2.0.0 jsonschema-rs==0.60.3 pyarrow==26.0.1
    venv/bin/python tests/peers/check_publication.py site

- Frictionless: `datapackage.json`, every table against its types, keys, references and hash;
- cffconvert: `CITATION.cff`;
- jsonschema-rs: everything below `api/v1/` and `changes.json` with the JSON Schemas that are published beside it;
- pyarrow: every Parquet table, cell for cell, with the CSV beside it;
- hashlib: every file against `SHA256SUMS`, and none that is not listed.

With `--ro-crate` and roc-validator==0.13.0 also `ro-crate-metadata.json`: that program fetches the context of
RO-Crate from w3id.org. It prints a line per check and every failure, and ends with status 1 if anything failed.
"""

import argparse
import csv
import hashlib
import json
import subprocess
import sys
from pathlib import Path


def main():
    parser = argparse.ArgumentParser(description="Checks a publication with the programs of others.")
    parser.add_argument("site", type=Path, help="what `matdb publish` wrote")
    parser.add_argument("--ro-crate", action="store_true", help="RO-Crate too, which needs a network")
    options = parser.parse_args()
    checks = {"Frictionless": frictionless, "cffconvert": cffconvert, "JSON Schema": schemas, "SHA256SUMS": sums}
    if list(options.site.glob("tables/*.parquet")):
        checks["pyarrow"] = parquet
    if options.ro_crate:
        checks["RO-Crate"] = ro_crate
    failed = False
    for name, check in checks.items():
        checked, problems = check(options.site)
        failed |= bool(problems) or not checked
        print(f"{name}: {checked} checked, {len(problems)} wrong")
        for problem in problems:
            print(f"  {problem}")
    return int(failed)


def frictionless(site):
    import frictionless

    report = frictionless.validate(str(site / "datapackage.json"))
    problems = [str(error) for error in report.errors]
    for task in report.tasks:
        problems += [f"{task.place}: {error.message}" for error in task.errors]
    return len(report.tasks), problems


def cffconvert(site):
    return said_by([program("cffconvert"), "--validate", "-i", str(site / "CITATION.cff")])


def ro_crate(site):
    return said_by([program("rocrate-validator"), "--no-interactive", "validate", "-l", "required", str(site)])


def said_by(command):
    done = subprocess.run(command, capture_output=True, text=True)
    lines = (done.stdout + done.stderr).strip().splitlines()
    return 1, [] if done.returncode == 0 else ["; ".join(lines[:3])]


def program(name):
    """A program beside this Python."""
    return str(Path(sys.executable).parent / name)


def schemas(site):
    import jsonschema_rs

    api = site / "api/v1"
    files = {"index": [api / "index.json"], "material": sorted(api.glob("materials/*.json")), "changes": [site / "changes.json"]}
    problems = []
    for schema, paths in files.items():
        of = json.loads((site / f"schema/{schema}.json").read_text(encoding="utf-8"))
        validator = jsonschema_rs.Draft202012Validator(of)
        for path in paths:
            errors = validator.iter_errors(json.loads(path.read_text(encoding="utf-8")))
            problems += [f"{path.relative_to(site)}: /{'/'.join(map(str, error.instance_path))}: {error.message}" for error in errors]
    return sum(map(len, files.values())), problems


def parquet(site):
    import pyarrow.parquet

    problems = []
    paths = sorted(site.glob("tables/*.parquet"))
    for path in paths:
        table = pyarrow.parquet.read_table(path)
        with path.with_suffix(".csv").open(encoding="utf-8", newline="") as file:
            header, *rows = csv.reader(file)
        if table.column_names != header:
            problems.append(f"{path.name} has the columns {table.column_names}")
            continue
        if table.num_rows != len(rows):
            problems.append(f"{path.name} has {table.num_rows} rows of {len(rows)}")
        for name, cells in zip(header, zip(*rows)):
            for row, (cell, value) in enumerate(zip(cells, table[name].to_pylist())):
                if not same(cell, value):
                    problems.append(f"{path.name}: {name} of row {row + 1} is {value!r}, {cell!r} in the CSV")
    return len(paths), problems


def same(cell, value):
    """Whether a cell of a CSV says a value of Parquet."""
    if value is None:
        return cell == ""
    return cell == value if isinstance(value, str) else type(value)(cell) == value


def sums(site):
    lines = (site / "SHA256SUMS").read_text(encoding="utf-8").splitlines()
    listed = {path: digest for digest, path in (line.split("  ", 1) for line in lines)}
    there = {str(path.relative_to(site)) for path in site.rglob("*") if path.is_file()} - {"SHA256SUMS"}
    problems = [f"{path} is not listed" for path in sorted(there - listed.keys())]
    problems += [f"{path} is not there" for path in sorted(listed.keys() - there)]
    for path in sorted(there & listed.keys()):
        if hashlib.sha256((site / path).read_bytes()).hexdigest() != listed[path]:
            problems.append(f"{path} has another hash")
    return len(listed), problems


if __name__ == "__main__":
    sys.exit(main())
