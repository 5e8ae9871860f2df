"""Build the six bases with Mitsuba 3: its rays, its shapes, its BSDFs. Writes bases/NAME.npz."""

import functools
import os
import sys
import tempfile

import mitsuba as mi
import numpy as np

import scan
import targets

mi.set_variant("scalar_rgb")
ANGLES = np.radians(np.concatenate([np.arange(0, 40, 0.1), np.arange(40, 89.6, 0.25)]))


def grey(x):
    return {"type": "rgb", "value": [x, x, x]}


def bsdf(material, part):
    """Mitsuba's BSDF of a material: all of it, or only the specular part."""
    spec, diffuse = 1.0, float(part == "all")
    if material["kind"] == "plastic":
        return {
            "type": "roughplastic", "distribution": material["distribution"], "alpha": material["m"],
            "int_ior": material["eta"], "ext_ior": 1.0, "nonlinear": False,
            "diffuse_reflectance": grey(material["r"] * diffuse), "specular_reflectance": grey(spec),
        }
    lobe = {
        "type": "roughconductor", "material": "none", "distribution": material["distribution"],
        "alpha": material["m"], "specular_reflectance": grey(material["f"]),
    }
    return {
        "type": "blendbsdf", "weight": material["k"],
        "first": lobe, "second": {"type": "diffuse", "reflectance": grey(material["r"] * diffuse)},
    }


def shapes(name, folder):
    """Mitsuba's shapes of a target: its own where it has them, else the mesh with flat facets."""
    t = mi.ScalarTransform4f
    if name == "sphere":
        return [{"type": "sphere", "center": list(targets.BALL[0]), "radius": targets.BALL[1]}]
    if name == "cylinder":
        return [{"type": "cylinder", "p0": list(targets.TUBE[0]), "p1": list(targets.TUBE[1]), "radius": targets.TUBE[2]}]
    if name == "box":
        c, h, d = targets.BOX
        turn = t().translate(list(c)).rotate([0, 0, 1], d[2]).rotate([0, 1, 0], d[1]).rotate([1, 0, 0], d[0]).scale(list(h))
        return [{"type": "cube", "to_world": turn},
                {"type": "sphere", "center": list(targets.UNDER[0]), "radius": targets.UNDER[1]}]
    out = []
    for number, (v, f) in enumerate(targets.MESHES[name]()):
        path = os.path.join(folder, f"{name}-{number}.ply")
        targets.write_ply(path, v, f)
        out.append({"type": "ply", "filename": path, "face_normals": True})
    return out


def backscatter(b, theta):
    """f in 1/sr with source and receiver in one direction; Mitsuba's eval has the receiver's cosine in it."""
    si = mi.SurfaceInteraction3f()
    si.wi = mi.Vector3f(np.sin(theta), 0, np.cos(theta))
    return float(b.eval(mi.BSDFContext(), si, si.wi)[0]) / np.cos(theta)


def trace(scene, order, origins, directions, evaluate):
    """Range, incidence normal, piece, facet and f cos(theta) of the first hit of each ray; range 0 where none."""
    n = len(directions)
    out = dict(range=np.zeros(n), normal=np.zeros((n, 3)), piece=np.full(n, -1), facet=np.full(n, -1), fcos=np.zeros(n))
    context = mi.BSDFContext()
    for i, (o, d) in enumerate(zip(np.broadcast_to(origins, (n, 3)).tolist(), directions.tolist())):
        si = scene.ray_intersect(mi.Ray3f(o, d))
        if not si.is_valid():
            continue
        normal = si.n
        out["normal"][i] = normal.x, normal.y, normal.z
        out["range"][i] = si.t
        out["piece"][i] = order[si.shape.id()]
        out["facet"][i] = si.prim_index
        if evaluate:
            if np.array(si.wi)[2] < 0:
                si.wi = -si.wi
            out["fcos"][i] = si.bsdf().eval(context, si, si.wi)[0]
    out["normal"] *= np.where(np.sum(out["normal"] * directions, 1) < 0, 1.0, -1.0)[:, None]
    return out


@functools.lru_cache
def load(name):
    """Mitsuba's scene of a target, and the number of each of its shapes."""
    record = {"type": "scene"}
    inner = bsdf(targets.MATERIALS[name], "all")
    with tempfile.TemporaryDirectory() as folder:
        for number, shape in enumerate(shapes(name, folder)):
            record[f"s{number}"] = {**shape, "bsdf": {"type": "twosided", "inner": inner}}
        scene = mi.load_dict(record, optimize=False)  # merged meshes have no names
    return scene, {f"s{i}": i for i in range(len(record) - 1)}


def met(name, pattern="once"):
    """What each chirp of a scan meets, as a base holds it."""
    aim, _ = scan.aims(pattern)
    chirps = trace(*load(name), scan.ORIGIN, scan.directions(aim), True)
    return dict(
        range_m=chirps["range"], normal=chirps["normal"].astype("f4"), piece=chirps["piece"].astype("i1"),
        facet=chirps["facet"].astype("i4"), f_cos=chirps["fcos"].astype("f4"))


def build(name):
    material = targets.MATERIALS[name]
    scene, order = load(name)
    chirps = met(name)
    x, y = scan.grid()
    raster = np.stack(np.meshgrid(x, y), -1).reshape(-1, 2)
    field = trace(scene, order, scan.ORIGIN, scan.directions(raster), False)
    total, lobe = mi.load_dict(bsdf(material, "all")), mi.load_dict(bsdf(material, "specular"))
    table = np.array([[backscatter(total, a), backscatter(lobe, a)] for a in ANGLES])
    np.savez_compressed(
        f"bases/{name}.npz", **chirps,
        angle_rad=ANGLES, f_all=table[:, 0], f_lobe=table[:, 1],
        grid_range_m=field["range"].astype("f4"), grid_piece=field["piece"].astype("i1"),
        grid_normal=np.round(field["normal"] * 32000).astype("i2"),
    )
    hit = chirps["range_m"] > 0
    print(f"{name}: {hit.mean():.2f} of the chirps hit; {os.path.getsize(f'bases/{name}.npz') / 1e3:.0f} kB")


if __name__ == "__main__":
    for name in sys.argv[1:] or targets.MATERIALS:
        build(name)
