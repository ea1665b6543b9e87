# SPDX-License-Identifier: Apache-2.0 OR GPL-3.0-or-later
# Part of qjulia, which is under the Apache License 2.0. This add-on may be used under the GNU General
# Public License, version 3 or later, as well, which is what Blender asks of add-ons.
"""An object's settings, and its knobs as custom properties, which can be key-framed and driven."""

from __future__ import annotations

import bpy

from .table import Control, Table

_tables: dict[str, Table] = {}  # by their JSON texts


class QjuliaMap(bpy.types.PropertyGroup):
    """Settings of an object; the object is a map if `map_file` is not empty."""

    map_file: bpy.props.StringProperty(name="Map", subtype="FILE_PATH", options=set())
    table: bpy.props.StringProperty(options={"HIDDEN"})
    live: bpy.props.BoolProperty(name="Live", default=True, options=set(),
                                 description="Make a preview when a knob is turned or the frame changes")
    preview_cells: bpy.props.IntProperty(
        name="Preview cells", default=64, min=16, max=1024, soft_max=256, options=set(),
        description="Cells along the longest side, for previews")
    final_cells: bpy.props.IntProperty(
        name="Final cells", default=256, min=16, max=1024, options=set(),
        description="Cells along the longest side for final meshes, rendered animations and baking: "
                    "more show finer grooves, and take longer")
    # Of the mesh that the object has now.
    shown: bpy.props.StringProperty(options={"HIDDEN"})
    bake_folder: bpy.props.StringProperty(
        name="Folder", subtype="DIR_PATH", options=set(),
        description="Folder for the meshes of frames. Empty: a folder beside the .blend file")
    uses_bake: bpy.props.BoolProperty(name="Play what was baked", options=set(),
                                      description="Read the meshes of frames from the folder, without the program")


class QjuliaPreferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    program: bpy.props.StringProperty(name="Program", subtype="FILE_PATH",
                                      description="Path of qjulia. Empty: the one in PATH")
    device: bpy.props.StringProperty(name="Device",
                                     description="As for 'qjulia --device': cpu, gpu, or a name of 'qjulia devices'. "
                                                 "Empty: the fastest")

    def draw(self, _context):
        self.layout.prop(self, "program")
        self.layout.prop(self, "device")


def how_to_start() -> tuple[str, str]:
    """The program and the device, from the preferences."""
    addon = bpy.context.preferences.addons.get(__package__)
    if addon is None or addon.preferences is None:
        return "", ""
    program = addon.preferences.program
    return bpy.path.abspath(program) if program else "", addon.preferences.device


def is_map(obj) -> bool:
    """Whether it is a map's object, and of this file: the full names of linked objects name their file, too."""
    return obj is not None and obj.type == "MESH" and obj.name_full == obj.name and obj.qjulia.map_file != "" \
        and obj.qjulia.table != ""


def table_of(obj) -> Table:
    text = obj.qjulia.table
    if text not in _tables:
        _tables[text] = Table(text)
    return _tables[text]


def key_of(control: Control) -> str:
    """The name of a control's custom property."""
    return "qjulia_" + control.name


def values_of(obj) -> dict:
    """The controls' values, of an object or its evaluated copy."""
    return {control.name: obj[key_of(control)] for control in table_of(obj).controls if key_of(control) in obj}


def _offer(obj, control: Control) -> None:
    key = key_of(control)
    kind = str if control.words else int if control.is_whole else float
    if not isinstance(obj.get(key), kind) or (control.words and obj[key] not in control.words):
        obj[key] = kind(control.usual)
    about = obj.id_properties_ui(key)
    if control.words:
        about.update(description=control.help, default=control.usual)
        return
    more = {} if control.is_whole else {"precision": 4 if control.is_logarithmic else 3}
    about.update(description=control.help, default=kind(control.usual), soft_min=kind(control.least),
                 soft_max=kind(control.most), **more)


def set_up(obj, map_file: str, table: str) -> None:
    """Gives an object the knobs of a map; knobs that it already has keep their values."""
    old = {key_of(control) for control in table_of(obj).controls} if obj.qjulia.table else set()
    obj.qjulia.map_file, obj.qjulia.table = map_file, table
    controls = table_of(obj).controls
    for key in old - {key_of(control) for control in controls}:
        if key in obj:
            del obj[key]
    for control in controls:
        _offer(obj, control)


def register():
    bpy.utils.register_class(QjuliaMap)
    bpy.utils.register_class(QjuliaPreferences)
    bpy.types.Object.qjulia = bpy.props.PointerProperty(type=QjuliaMap)


def unregister():
    del bpy.types.Object.qjulia
    bpy.utils.unregister_class(QjuliaPreferences)
    bpy.utils.unregister_class(QjuliaMap)
    _tables.clear()
