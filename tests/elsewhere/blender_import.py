"""Runs in Blender: imports each file after "--" and prints what came, one line of JSON each."""

import json
import sys

import bpy
import numpy
from mathutils import Vector

# The glTF importer of Debian 12's Blender takes it from NumPy, whose version there has it no more.
numpy.bool = bool


def imported(kind, path):
    """By the add-on of Blender 3, else by the importer that Blender 4 has instead."""
    if kind in dir(bpy.ops.import_mesh):
        getattr(bpy.ops.import_mesh, kind)(filepath=path)
    else:
        getattr(bpy.ops.wm, f"{kind}_import")(filepath=path)


IMPORTERS = {
    "glb": lambda path: bpy.ops.import_scene.gltf(filepath=path),
    "ply": lambda path: imported("ply", path),
    "obj": lambda path: bpy.ops.wm.obj_import(filepath=path),
    "stl": lambda path: imported("stl", path),
    "vdb": lambda path: bpy.ops.object.volume_import(filepath=path),
}


def described(path):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    IMPORTERS[path.rsplit(".", 1)[1]](path)
    bpy.context.view_layer.update()
    thing = next(o for o in bpy.context.scene.objects if o.type in ("MESH", "VOLUME"))
    corners = [thing.matrix_world @ Vector(corner) for corner in thing.bound_box]
    found = {
        "object": thing.name,
        "data": thing.data.name,
        "size": [max(c[i] for c in corners) - min(c[i] for c in corners) for i in range(3)],
    }
    if thing.type == "VOLUME":
        thing.data.grids.load()
        found["grids"] = [grid.name for grid in thing.data.grids]
        return found
    mesh = thing.data
    found["vertices"], found["triangles"] = len(mesh.vertices), len(mesh.polygons)
    found["colors"] = len(mesh.color_attributes)
    found["materials"] = len(mesh.materials)
    found["smooth"] = all(polygon.use_smooth for polygon in mesh.polygons)
    # Where half the vertices are below, as a share of the height: it tells a mesh from one on its head.
    heights = sorted((thing.matrix_world @ v.co).z for v in mesh.vertices)
    found["median_height"] = (heights[len(heights) // 2] - heights[0]) / (heights[-1] - heights[0])
    return found


for name in sys.argv[sys.argv.index("--") + 1:]:
    print("IMPORTED", json.dumps(described(name)))
