"""Judge `matdb measure` on seven targets whose pose, law and symmetry are known. See README.md."""

import argparse
import csv
import json
import os
import shutil
import subprocess
import time

import numpy as np

import motions
import targets

HERE = os.path.dirname(os.path.realpath(__file__))
START_MM, START_DEG, RANGE_SD_M = 30.0, 5.0, 0.002
MOST_MM, MOST_DEG, MOST_DB = 1.0, 0.3, 0.3
MOST_APART, MOST_MISNAMED, FREE_M = 0.02, 0.015, 0.01  # numbers of a sentence have two decimals
FINE_M, COARSE_M = 0.0025, 0.005  # sides of facets: of what is rendered, and of what `measure` is given
RADAR, MIDDLE, LINES, LOOKS = np.array([0, 1.1, 8.0]), np.array([0, 1.1, 0]), 96, 4
ALBEDO, R, S, M = 0.3, 0.08, 0.05, 0.1
BEAM_RAD = 299.792458e-6 / 0.3 * np.sqrt(2 * np.log(2)) / (2 * np.pi * 0.016)  # lambda / (2 pi w0)
# The mean of the logarithm of a mean of LOOKS exponential variables: psi(LOOKS) - ln LOOKS.
LOOKS_DB = 10 / np.log(10) * (sum(1 / n for n in range(1, LOOKS)) - np.euler_gamma - np.log(LOOKS))


def law_db(name, theta):
    """4 pi f cos2: of a Lambert surface; of one with Beckmann's lobe, whose D the beam widens and whose G keeps m."""
    cos, tan = np.cos(theta), np.maximum(np.tan(theta), 1e-9)
    if name == "matt":
        return 10 * np.log10(4 * ALBEDO * cos**2)
    a, m2 = 1 / (M * tan), M**2 + BEAM_RAD**2
    g1 = np.where(a < 1.6, (3.535 * a + 2.181 * a**2) / (1 + 2.276 * a + 2.577 * a**2), 1.0)
    return 10 * np.log10(4 * R * cos**2 + S * np.exp(-(tan**2) / m2) / (m2 * cos**4) * g1**2)


def write_ply(path, vertices, triangles):
    with open(path, "wb") as file:
        xyz = "".join(f"property double {n}\n" for n in "xyz")
        file.write(f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n{xyz}"
                   f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n".encode())
        file.write(vertices.astype("<f8").tobytes())
        faces = np.empty(len(triangles), [("count", "u1"), ("corners", "<i4", 3)])
        faces["count"], faces["corners"] = 3, triangles
        file.write(faces.tobytes())


def read_cloud(path):
    """The columns of the vertices, which are all that the file holds."""
    with open(path, "rb") as file:
        content = file.read()
    header, _, body = content.partition(b"end_header\n")
    kinds = {"double": "<f8", "float": "<f4", "int": "<i4", "uchar": "u1"}
    words = [line.split() for line in header.decode().splitlines()]
    columns = [(w[2], kinds[w[1]]) for w in words if w[0] == "property"]
    count = next(int(w[2]) for w in words if w[:2] == ["element", "vertex"])
    return np.frombuffer(body, columns, count)


def write_scene(path, mesh, rotation, translation, common):
    angles = np.degrees([np.arctan2(rotation[2, 1], rotation[2, 2]), -np.arcsin(rotation[2, 0]),
                         np.arctan2(rotation[1, 0], rotation[0, 0])])
    with open(f"{HERE}/scene.toml") as form, open(path, "w") as file:
        file.write(form.read().format(lines=LINES, looks=LOOKS, range_sd_m=RANGE_SD_M, mesh=mesh, rotation=angles.tolist(),
                                      translation=translation.tolist(), **common))


def best_sd(target, turned, at, about, cloud, seen):
    """Standard deviations to which gaps along the rays tell the shift of a point, mm, and the turn, degrees. It uses the facets
    that were hit, but those that are hardly more than grazed, and single rays. Also that of the gaps themselves, m."""
    vertices, triangles = target.mesh(FINE_M)
    a, b, c = (vertices[triangles[cloud["facet"], i]] @ turned.T + at for i in range(3))
    normal, ray = np.cross(b - a, c - a), seen - RADAR
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    ray /= np.linalg.norm(ray, axis=1, keepdims=True)
    cos = (normal * ray).sum(1)
    use = np.abs(cos) > 0.2
    gaps = ((normal * (seen - a)).sum(1) / cos)[use]
    across, turns = motions.complement(target.shifts @ turned.T), motions.complement(target.turns @ turned.T)
    moves = motions.displacements(seen[use], about) @ motions.both(across.T, turns.T)
    slopes = (normal[use, :, None] * moves).sum(1) / cos[use, None]
    variance, count = np.linalg.inv(slopes.T @ slopes) * RANGE_SD_M**2, across.shape[1]
    parts = variance[:count, :count], variance[count:, count:]
    sd_m, sd_rad = (np.sqrt(np.linalg.norm(part, 2)) if part.size else 0.0 for part in parts)
    return 1e3 * sd_m, np.degrees(sd_rad), np.std(gaps)


def off_by(target, point, found, found_at, turned, at):
    """Shift of a point in mm and turn in degrees from where the target is to where it was found, without what its symmetry
    leaves open. A turn is that of the only axis of symmetry, where there is one."""
    shift = motions.complement(target.shifts @ found.T).T @ (found @ point + found_at - turned @ point - at)
    error = found @ turned.T
    sine = np.linalg.norm(error - error.T) / np.sqrt(8)
    if len(target.turns):
        sine = np.linalg.norm(np.cross(target.turns @ found.T, target.turns @ turned.T)) if len(target.turns) == 1 else 0
    return 1e3 * np.linalg.norm(shift), np.degrees(np.arcsin(min(sine, 1)))


def judge(program, name, seed, rays, folder):
    """What is wrong, as sentences; the numbers of a case; and whether the right motions are named free."""
    os.makedirs(folder, exist_ok=True)
    rng = np.random.default_rng([seed, list(targets.ALL).index(name)])
    target, material = targets.ALL[name](rng), "lobed" if name == "sphere" else "matt"
    write_ply(f"{folder}/fine.ply", *target.mesh(FINE_M))
    write_ply(f"{folder}/coarse.ply", *target.mesh(COARSE_M))
    turned = motions.turn(motions.direction(rng), START_DEG) @ target.rotation
    at = MIDDLE + 1e-3 * START_MM * motions.direction(rng)
    common = dict(seed=seed, rays=rays, material=material, width=target.field_m[0], height=target.field_m[1])
    write_scene(f"{folder}/true.toml", "fine.ply", turned, at, common)
    write_scene(f"{folder}/start.toml", "coarse.ply", target.rotation, MIDDLE, common)
    program("render", f"{folder}/true.toml", "-o", f"{folder}/scan")
    program("measure", f"{folder}/scan/cloud.ply", "--scene", f"{folder}/start.toml", "-o", f"{folder}/measured")
    with open(f"{folder}/measured/pose.json") as file:
        said = json.load(file)
    with open(f"{folder}/measured/curve.csv") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))

    # The pose, by a point that is on every axis of symmetry and in every plane, or else in the middle of what is seen.
    cloud = read_cloud(f"{folder}/scan/cloud.ply")
    seen = np.stack([cloud[n] for n in "xyz"], 1)
    point = turned.T @ (seen.mean(0) - at)
    if len(target.turns):
        point = target.shifts.T @ (target.shifts @ point)
    about = turned @ point + at
    motion, shift = np.array(said["pose"]["rotation_rows"]), np.array(said["pose"]["translation_m"])
    off_mm, off_deg = off_by(target, point, motion @ target.rotation, motion @ MIDDLE + shift, turned, at)
    sd_mm, sd_deg, noise = best_sd(target, turned, at, about, cloud, seen)
    assert rays > 1 or abs(noise / RANGE_SD_M - 1) < 0.1, f"the judge does not know the target: {noise} m"

    # The free motions, in sentences and as the space of large variances, in the size of the displacements of what is seen.
    fields = motions.displacements(seen, about)
    size = np.linalg.cholesky(np.einsum("nci,ncj->ij", fields, fields) / len(seen)).T
    symmetry = target.shifts @ turned.T, target.turns @ turned.T
    here = size @ motions.seen_from(np.array(said["covariance"]["about_m"]), about)
    variance, axes = np.linalg.eigh(here @ np.array(said["covariance"]["matrix"]) @ here.T)
    apart = motions.apart(size @ motions.both(*symmetry), axes[:, variance > FREE_M**2])
    misnamed = motions.misnamed(said["free"], *symmetry, about)
    free = misnamed <= MOST_MISNAMED and apart <= MOST_APART

    theta, sigma, silent = (np.array([float(r[n]) for r in rows]) for n in ("theta_deg", "sigma0_db", "censored"))
    off_db = np.mean((sigma - law_db(material, np.radians(theta)))[silent == 0]) - LOOKS_DB

    wrong = []
    if not said["converged"]:
        wrong.append(f"not converged: {said['stop']}")
    if not off_mm <= MOST_MM:
        wrong.append(f"{off_mm:.2f} mm off (the data tell it to {sd_mm:.2f} mm)")
    if not off_deg <= MOST_DEG:
        wrong.append(f"{off_deg:.2f}° off (the data tell it to {sd_deg:.2f}°)")
    if not abs(off_db) <= MOST_DB:
        wrong.append(f"curve {off_db:+.2f} dB off")
    if not free:
        wrong.append(f"free: {'; '.join(said['free']) or 'nothing'} (misnamed by {misnamed:.3f}, {apart:.3f} apart)")
    return wrong, (off_mm, off_deg, abs(off_db), sd_mm, sd_deg), free


class Program:
    """The program with a database of the two laws."""

    def __init__(self, path, out):
        self.path = os.path.abspath(path) if os.path.exists(path) else path
        self.db = f"{out}/laws.sqlite"
        matt = f'{{ model = "lambert", albedo = {ALBEDO} }}'
        lobed = (f'{{ model = "lambert", albedo = {R} }}, {{ model = "cook-torrance", distribution = "beckmann", '
                 f'shadowing = "separable", f_lambda = {S}, m = {M} }}')
        for slug, parts in (("matt", matt), ("lobed", lobed)):
            os.makedirs(f"{out}/{slug}", exist_ok=True)
            with open(f"{HERE}/material.toml") as form, open(f"{out}/{slug}/material.toml", "w") as file:
                file.write(form.read().format(slug=slug, parts=parts))
            self("add", "--from", f"{out}/{slug}")

    def __call__(self, *words):
        run = subprocess.run([self.path, "--db", self.db, *words], capture_output=True, text=True)
        if run.returncode:
            raise RuntimeError(f"{words[0]}: status {run.returncode}, {run.stderr.strip()}")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--matdb", default="matdb")
    parser.add_argument("--out", required=True)
    parser.add_argument("--seeds", default="1..20", help="FIRST..LAST")
    parser.add_argument("--targets", nargs="+", choices=targets.ALL, default=list(targets.ALL))
    parser.add_argument("--rays", type=int, default=1, help="rays per spot")
    parser.add_argument("--strict", action="store_true", help="status 1 unless all is met")
    a = parser.parse_args()
    first, last = map(int, a.seeds.split(".."))
    os.makedirs(a.out, exist_ok=True)
    program = Program(a.matdb, a.out)
    table, met, start = [], True, time.monotonic()
    for name in a.targets:
        numbers, right, free = [], 0, 0
        for seed in range(first, last + 1):
            folder = f"{a.out}/{name}-{seed}"
            try:
                wrong, mine, freed = judge(program, name, seed, a.rays, folder)
                numbers.append(mine)
                free += freed
            except (RuntimeError, ValueError) as error:
                wrong = [str(error)]
            if wrong:
                print(f"{name}, seed {seed}: {'; '.join(wrong)}", flush=True)
            else:
                shutil.rmtree(folder)
                right += 1
        count = last + 1 - first
        met &= right == count
        worst = np.max(numbers, 0) if numbers else np.full(5, np.nan)
        columns = name, f"{right} of {count}", *(f"{w:.2f}" for w in worst), f"{free} of {count}"
        table.append("{:9}{:>11}{:>11}{:>10}{:>10}{:>14}{:>7}{:>12}".format(*columns))
    print("target    all right   worst mm   worst °  worst dB    told to mm      °  free right", *table, sep="\n")
    print(f"{(time.monotonic() - start) / len(a.targets) / count:.1f} s for each")
    raise SystemExit(a.strict and not met)


if __name__ == "__main__":
    main()
