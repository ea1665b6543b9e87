# SPDX-License-Identifier: Apache-2.0 OR GPL-3.0-or-later
# Part of qjulia, which is under the Apache License 2.0. This add-on may be used under the GNU General
# Public License, version 3 or later, as well, which is what Blender asks of add-ons.
"""Makes Blender's meshes and materials from the program's files."""

from __future__ import annotations

import bpy
import numpy

from . import ply

COLORS = "Color"  # the vertex colours' name
_MATERIAL = "Qjulia colours"


def _linear(srgb: numpy.ndarray) -> numpy.ndarray:
    part = srgb.astype(numpy.float32) / 255
    return numpy.where(part <= 0.04045, part / 12.92, ((part + 0.055) / 1.055) ** 2.4)


def _paint(mesh, colors, clay) -> None:
    count = len(mesh.vertices)
    rgba = numpy.ones((count, 4), numpy.float32)
    rgba[:, :3] = clay if colors is None else _linear(colors)
    layer = mesh.color_attributes.get(COLORS)
    if layer is None or layer.domain != "POINT" or len(layer.data) != count:
        if layer is not None:
            mesh.color_attributes.remove(layer)
        layer = mesh.color_attributes.new(COLORS, "BYTE_COLOR", "POINT")
    layer.data.foreach_set("color", rgba.ravel())


def fill(mesh, made: ply.Mesh, up: str, clay: tuple[float, float, float]) -> None:
    """Replaces the contents of a mesh, upright, smooth and coloured; its materials stay."""
    count = len(made.triangles)
    mesh.clear_geometry()
    mesh.vertices.add(len(made.vertices))
    mesh.vertices.foreach_set("co", ply.turned_upright(made.vertices, up).ravel())
    mesh.loops.add(3 * count)
    mesh.loops.foreach_set("vertex_index", made.triangles.astype(numpy.int32).ravel())
    mesh.polygons.add(count)
    mesh.polygons.foreach_set("loop_start", numpy.arange(0, 3 * count, 3, dtype=numpy.int32))
    if bpy.app.version < (4, 0, 0):  # later versions derive it from the loop starts
        mesh.polygons.foreach_set("loop_total", numpy.full(count, 3, numpy.int32))
    mesh.polygons.foreach_set("use_smooth", numpy.ones(count, bool))
    _paint(mesh, made.colors, clay)
    mesh.update(calc_edges=True)


def material():
    """The material that shows vertex colours. All maps share it until the user assigns another."""
    made = bpy.data.materials.get(_MATERIAL)
    if made is not None:
        return made
    made = bpy.data.materials.new(_MATERIAL)
    made.use_nodes = True
    nodes = made.node_tree.nodes
    shader = next(node for node in nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Roughness"].default_value = 0.6
    colors = nodes.new("ShaderNodeVertexColor")
    colors.layer_name = COLORS
    colors.location = (shader.location.x - 250, shader.location.y)
    made.node_tree.links.new(colors.outputs["Color"], shader.inputs["Base Color"])
    return made
