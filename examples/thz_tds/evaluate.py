"""Complex permittivity of a sheet from terahertz time-domain transmission, as a material for `matdb add --from`.

    python evaluate.py PVDF_520um.thz --out pvdf --slug pvdf --name "PVDF sheet" --source "Who measured it" --licence MIT

Reads a dotTHz file: each measurement has the trace of the sheet and one of the empty path. See README.md for the method.
"""

import argparse
import os
import sys

import numpy as np

import sheet


def read(path, given_mm=None):
    """Traces of the sheet and of the empty path, s and arbitrary units, of each measurement, and thicknesses, m: those of the
    file, or the one that is given."""
    import h5py

    runs, thicknesses = [], [] if given_mm is None else [metres("--thickness-mm", given_mm)]
    try:
        file = h5py.File(path)
    except OSError as error:
        raise SystemExit(f"{path}: not a dotTHz file: {error}; give an HDF5 file with traces")
    with file:
        for name, group in file.items():
            words = group.attrs.get("dsDescription", [""])
            words = np.ravel(words)[0]
            roles = dict(part.strip().split(":") for part in str(words).split(",") if ":" in part)
            named = {role.strip().lower(): key for key, role in roles.items()}
            sample = next((key for role, key in named.items() if role.startswith("sam")), None)
            reference = next((key for role, key in named.items() if role.startswith("ref")), None)
            if sample is None or reference is None:
                raise SystemExit(
                    f"{path}: {name}: its description {str(words)!r} names no sample with a reference; measure the empty path, "
                    "and write dsDescription as 'ds1:Sample, ds2:Ref'"
                )
            missing = [key for key in (sample, reference) if key not in group]
            if missing:
                raise SystemExit(f"{path}: {name}: there is no trace {missing[0]}, which its description names; check the export")
            runs.append([trace(path, name, group[key][()]) for key in (sample, reference)])
            if given_mm is None and "hickness" in str(np.ravel(group.attrs.get("mdDescription", [""]))[0]):
                thicknesses.append(metres(f"{path}: {name}: md1", group.attrs.get("md1")))
    if not runs:
        raise SystemExit(f"{path}: there is no measurement in it; check the export")
    return runs, thicknesses


def metres(what, value_mm):
    try:
        found_mm = float(np.ravel(value_mm)[0])
    except (TypeError, ValueError):
        found_mm = float("nan")
    if not found_mm > 0:
        raise SystemExit(f"{what} is {value_mm}, and a thickness is above 0, in mm; give it by --thickness-mm")
    return 1e-3 * found_mm


def trace(path, name, table):
    if table.ndim == 2 and table.shape[1] != 2:
        table = table.T
    if table.ndim != 2 or table.shape[1] != 2 or len(table) < 100 or not np.isfinite(table).all():
        raise SystemExit(f"{path}: {name}: a trace is no table of times and signals; check the export")
    return table * [1e-12, 1.0]


def toml(slug, name, licence, source, thickness, rows, note):
    """The material: its constants at every frequency, and at the one nearest to 300 GHz what scenes render."""
    at = min(rows, key=lambda row: abs(row["f"] - 300e9))
    permittivities = "\n".join(
        f'[[permittivity]]\nkey = "{slug}"\nfrequency_ghz = {row["f"] / 1e9:.6g}\nreal = {row["real"]:.4f}\n'
        f'imaginary = {row["imag"]:.4f}\nreal_sd = {row["real_sd"]:.4f}\nimaginary_sd = {row["imag_sd"]:.4f}\nsource = "measured"\n'
        for row in rows
    )
    low, high = (1e-9 * pick(row["f"] for row in rows) for pick in (min, max))
    f = at["f"] / 1e9
    return f'''slug = "{slug}"
name = "{name}"
class = "polymer"
description = """
A sheet of {1e3 * thickness[0]:.3f} mm in air, as it was measured in transmission by terahertz time-domain spectroscopy.
Rendered as a smooth sheet whose two sides interfere, with the constants at {f:.4g} GHz.
"""
licence = "{licence}"
tags = ["polymer", "measured", "time-domain"]
frequency_ghz = [{max(low, f - 10):.6g}, {min(high, f + 10):.6g}]
theta_deg = [0, 5]
render = "stated"
unknown = [
    "The backscatter itself: the measurement is one of transmission at normal incidence.",
    "The diffuse return, and with it everything beyond 5°: the entry holds the mirror part of a smooth flat piece alone.",
    "The roughness of the surface.",
]

[[source]]
key = "measured"
kind = "measured"
title = "{source}"
licence = "{licence}"
making = "computed"
note = "{note}"

[[source]]
key = "fresnel"
kind = "modelled"
title = "Interference of a smooth sheet in air"
licence = "CC0-1.0"
making = "computed"
note = "Computed from the permittivity and the thickness: the mirror part alone."

[[layer]]
name = "{name}"
thickness_mm = {1e3 * thickness[0]:.4f}
permittivity = "{slug}"
source = "measured"

[[layer]]
name = "air"
permittivity = "air"

{permittivities}
[[permittivity]]
key = "air"
frequency_ghz = {f:.6g}
real = 1
imaginary = 0
source = "fresnel"

[[fit]]
name = "stated"
estimator = "stated"
source = "fresnel"
parameter_source = {{ "layers.0.eps_imag" = "measured", "layers.0.eps_real" = "measured", "layers.0.thickness_m" = "measured" }}

[fit.scattering]
model = "layered"
layers = [{{ thickness_m = {thickness[0]:.6g}, eps_real = {at["real"]:.4f}, eps_imag = {at["imag"]:.4f} }}]
eps_real = 1.0
eps_imag = 0.0
frequency_hz = {at["f"]:.6g}
'''


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file")
    parser.add_argument("--out", required=True, help="folder to write")
    parser.add_argument("--slug", required=True)
    parser.add_argument("--name", required=True)
    parser.add_argument("--source", required=True, help="who measured it, where and when")
    parser.add_argument("--licence", required=True, help="SPDX identifier")
    parser.add_argument("--thickness-mm", type=float, help="thickness [default: that of the file]")
    parser.add_argument("--thickness-sd-mm", type=float, help="its standard deviation [default: from the echoes in the sheet]")
    arguments = parser.parse_args()
    runs, thicknesses = read(arguments.file, arguments.thickness_mm)
    if thicknesses and np.ptp(thicknesses) > 0.02 * np.mean(thicknesses):
        stated = ", ".join(f"{1e3 * one:.4g}" for one in thicknesses)
        raise SystemExit(f"{arguments.file}: its measurements are of sheets of {stated} mm; give one sheet, or --thickness-mm")
    if not thicknesses:
        raise SystemExit(f"{arguments.file}: it does not state the thickness; give --thickness-mm")
    sd = arguments.thickness_sd_mm and 1e-3 * arguments.thickness_sd_mm
    result = sheet.evaluate(runs, float(np.mean(thicknesses)), sd)
    step = 50e9
    wanted = np.arange(np.ceil(result.f[0] / step) * step, min(result.f[-1], 1e12) + 1, step)
    rows = [result.at(f) for f in wanted]
    if not rows:
        raise SystemExit(f"{arguments.file}: no frequency is above the noise by enough; average more traces")
    echoes = "the echoes in the sheet show none within 15 %"
    if np.isfinite(result.echo_thickness):
        echoes = f"the echoes in the sheet alone say {1e3 * result.echo_thickness:.3f} mm"
    for_people = (
        f"{len(runs)} measurements; thickness {1e3 * result.thickness[0]:.3f} +- {1e3 * result.thickness[1]:.3f} mm "
        f"({result.thickness_from}; {echoes}); "
        f"useful from {result.f[0] / 1e9:.0f} to {result.f[-1] / 1e9:.0f} GHz"
    )
    os.makedirs(arguments.out, exist_ok=True)
    text = toml(arguments.slug, arguments.name, arguments.licence, arguments.source, result.thickness, rows, for_people + ".")
    with open(os.path.join(arguments.out, "material.toml"), "w") as file:
        file.write(text)
    columns = ("f", "real", "real_sd", "imag", "imag_sd", "n", "n_sd", "absorption", "absorption_sd")
    with open(os.path.join(arguments.out, "constants.csv"), "w") as file:
        print("frequency_hz,eps_real,eps_real_sd,eps_imag,eps_imag_sd,n,n_sd,absorption_per_m,absorption_sd_per_m", file=file)
        for f in result.f:
            row = result.at(f)
            print(*(f"{row[column]:.6g}" for column in columns), sep=",", file=file)
    print(for_people)
    at = result.at(min(wanted, key=lambda f: abs(f - 300e9)))
    print(
        f"at {at['f'] / 1e9:.0f} GHz: eps' {at['real']:.3f} +- {at['real_sd']:.3f}, eps'' {at['imag']:.4f} +- {at['imag_sd']:.4f}, "
        f"n {at['n']:.4f} +- {at['n_sd']:.4f}, absorption {at['absorption'] / 100:.2f} +- {at['absorption_sd'] / 100:.2f} /cm"
    )
    print(f"wrote material.toml and constants.csv to {arguments.out}: matdb add --from {arguments.out}")


if __name__ == "__main__":
    sys.exit(main())
