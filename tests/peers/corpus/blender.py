"""The part of make.py that Blender runs: writes meshes with its exporters.

    python blender.py GEOMETRIES.json FOLDER

It is a program of its own since Blender's Python module needs another version of NumPy than the other libraries.
"""

import json
import sys
from pathlib import Path

import bpy

AXES = {"forward_axis": "Y", "up_axis": "Z"}


def scene(name, vertices, polygons):
    """One object whose polygons have two materials by turns."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], polygons)
    for material in ("plaster", "paint"):
        mesh.materials.append(bpy.data.materials.new(material))
    for number, polygon in enumerate(mesh.polygons):
        polygon.material_index = number % 2
    mesh.uv_layers.new(name="uv")
    mesh.color_attributes.new("colour", "FLOAT_COLOR", "POINT")
    made = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(made)
    made.vertex_groups.new(name="half").add([0, 1, 2, 3], 1.0, "ADD")


def main():
    geometries = json.loads(Path(sys.argv[1]).read_text())
    folder = Path(sys.argv[2])
    scene("house", *geometries["house"])

    def write(export, name, **options):
        export(filepath=str(folder / name), **AXES, **options)

    obj, ply, stl = bpy.ops.wm.obj_export, bpy.ops.wm.ply_export, bpy.ops.wm.stl_export
    write(obj, "blender.obj")
    groups = ("object", "material", "vertex", "smooth")
    write(obj, "blender-groups.obj", export_colors=True, **{f"export_{what}_groups": True for what in groups})
    write(obj, "blender-plain.obj", export_materials=False, export_uv=False, export_normals=False)
    write(obj, "blender-triangles.obj", export_triangulated_mesh=True)
    for form, is_ascii in (("ascii", True), ("binary", False)):
        write(ply, f"blender-{form}.ply", ascii_format=is_ascii, export_uv=False)
        write(
            ply,
            f"blender-full-{form}.ply",
            ascii_format=is_ascii,
            export_normals=True,
            export_uv=True,
            export_colors="SRGB",
        )
        write(stl, f"blender-{form}.stl", ascii_format=is_ascii)


if __name__ == "__main__":
    main()
