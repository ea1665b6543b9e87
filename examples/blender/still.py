"""Renders a mesh of qjulia in Blender: blender -b -P still.py -- MESH.glb PICTURE.png [WIDTHxHEIGHT [SAMPLES]]

The mesh stands on a floor, in a soft light from above and a warm one from the side, and keeps its own colors.
"""

import sys
from math import radians

import bpy
import numpy
from mathutils import Vector

# The glTF importer of Debian 12's Blender takes it from NumPy, whose version there has it no more.
numpy.bool = bool

mesh, picture, *more = sys.argv[sys.argv.index("--") + 1:]
width, height = (int(side) for side in (more[0] if more else "640x640").split("x"))

bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.gltf(filepath=mesh)
bpy.context.view_layer.update()
scene = bpy.context.scene
thing = next(one for one in scene.objects if one.type == "MESH")
corners = [thing.matrix_world @ Vector(corner) for corner in thing.bound_box]
low = Vector([min(corner[i] for corner in corners) for i in range(3)])
high = Vector([max(corner[i] for corner in corners) for i in range(3)])
middle, size = (low + high) / 2, (high - low).length

bpy.ops.mesh.primitive_plane_add(size=40 * size, location=(middle.x, middle.y, low.z))
floor = bpy.data.materials.new("floor")
floor.use_nodes = True
floor.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (0.55, 0.57, 0.6, 1)
floor.node_tree.nodes["Principled BSDF"].inputs["Roughness"].default_value = 0.9
bpy.context.object.data.materials.append(floor)


def light(name, azimuth, elevation, energy, color, width):
    data = bpy.data.lights.new(name, "AREA")
    data.energy, data.color, data.size = energy * size * size, color, width * size
    lamp = bpy.data.objects.new(name, data)
    scene.collection.objects.link(lamp)
    place(lamp, azimuth, elevation, 2.2)


def place(thing, azimuth, elevation, distance):
    """Puts it at a distance in the mesh's diagonals, looking at the mesh."""
    a, e = radians(azimuth), radians(elevation)
    way = Vector((numpy.sin(a) * numpy.cos(e), -numpy.cos(a) * numpy.cos(e), numpy.sin(e)))
    thing.location = middle + distance * size * way
    thing.rotation_euler = (-way).to_track_quat("-Z", "Y").to_euler()


light("key", -50, 40, 90, (1, 0.86, 0.72), 0.7)
light("rim", 140, 35, 70, (0.7, 0.82, 1), 0.7)
scene.world = bpy.data.worlds.new("sky")
scene.world.use_nodes = True
scene.world.node_tree.nodes["Background"].inputs[0].default_value = (0.75, 0.8, 0.9, 1)
scene.world.node_tree.nodes["Background"].inputs[1].default_value = 0.45

camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
scene.collection.objects.link(camera)
camera.data.lens = 70
camera.data.clip_end = 100 * size
place(camera, 25, 14, 1.75)
scene.camera = camera

scene.render.engine = "CYCLES"
scene.cycles.samples = int(more[1]) if len(more) > 1 else 64
scene.cycles.use_denoising = False
scene.render.resolution_x, scene.render.resolution_y = width, height
scene.render.filepath = picture
bpy.ops.render.render(write_still=True)
