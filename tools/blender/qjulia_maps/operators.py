# SPDX-License-Identifier: Apache-2.0 OR GPL-3.0-or-later
# Part of qjulia, which is under the Apache License 2.0. This add-on may be used under the GNU General
# Public License, version 3 or later, as well, which is what Blender asks of add-ons.
"""The operators behind buttons and menus. Errors go to Blender's reports."""

from __future__ import annotations

import os
import random

import bpy
from bpy_extras.io_utils import ExportHelper, ImportHelper

from . import bake, camera, live, properties, server


class _OfMap:
    """Base of operators on the active object, which must be a map."""

    @classmethod
    def poll(cls, context):
        return properties.is_map(context.object) and context.object.mode == "OBJECT"


class QJULIA_OT_add(bpy.types.Operator, ImportHelper):
    """Add a map of qjulia as an object with all of its knobs"""

    bl_idname = "qjulia.add"
    bl_label = "Qjulia map"
    bl_options = {"REGISTER", "UNDO"}

    filter_glob: bpy.props.StringProperty(default="*.json;*.html;*.png;*.glb", options={"HIDDEN"})

    def execute(self, context):
        path = os.path.realpath(bpy.path.abspath(self.filepath))
        try:
            table = live.servers.of(live.servers.choice(path)).table
        except server.ProgramError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        name = os.path.basename(path).split(".")[0]
        obj = bpy.data.objects.new(name, bpy.data.meshes.new(name))
        context.collection.objects.link(obj)
        obj.location = context.scene.cursor.location
        properties.set_up(obj, path, table)
        for other in context.selected_objects:
            other.select_set(False)
        obj.select_set(True)
        context.view_layer.objects.active = obj
        return _begin(self, obj, obj.qjulia.preview_cells)


def _begin(operator, obj, cells: int):
    """Starts a mesh in the background; without windows, waits for it."""
    wanted = live.Wanted(obj, properties.values_of(obj), cells)
    if not bpy.app.background:
        live.begin(obj, wanted)
        return {"FINISHED"}
    try:
        live.make(obj, wanted)
    except server.ProgramError as error:
        operator.report({"ERROR"}, str(error))
        return {"CANCELLED"}
    return {"FINISHED"}


class QJULIA_OT_final(_OfMap, bpy.types.Operator):
    """Make the final mesh for the current knobs"""

    bl_idname = "qjulia.final"
    bl_label = "Final mesh"
    bl_options = {"REGISTER"}

    def execute(self, context):
        return _begin(self, context.object, context.object.qjulia.final_cells)


class QJULIA_OT_cancel(_OfMap, bpy.types.Operator):
    """Cancel the mesh that is being made"""

    bl_idname = "qjulia.cancel"
    bl_label = "Cancel"

    def execute(self, context):
        live.cancel(context.object)
        return {"FINISHED"}


class QJULIA_OT_restart(_OfMap, bpy.types.Operator):
    """Restart the program and read the map file again. Knobs keep their values"""

    bl_idname = "qjulia.restart"
    bl_label = "Start again"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        obj = context.object
        live.forget()
        path = os.path.realpath(bpy.path.abspath(obj.qjulia.map_file))
        try:
            table = live.servers.of(live.servers.choice(path)).table
        except server.ProgramError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        properties.set_up(obj, obj.qjulia.map_file, table)
        return _begin(self, obj, obj.qjulia.preview_cells)


class QJULIA_OT_choose(_OfMap, bpy.types.Operator):
    """Choose this value"""

    bl_idname = "qjulia.choose"
    bl_label = "Choose"
    bl_options = {"REGISTER", "UNDO"}

    control: bpy.props.StringProperty()
    word: bpy.props.StringProperty()

    @classmethod
    def description(cls, context, given):
        found = [c.help for c in properties.table_of(context.object).controls if c.name == given.control]
        return found[0] if found else ""

    def execute(self, context):
        obj = context.object
        for control in properties.table_of(obj).controls:
            if control.name == self.control and self.word in control.words:
                obj[properties.key_of(control)] = self.word
                obj.update_tag()
                return {"FINISHED"}
        self.report({"ERROR"}, f"'{self.word}' is not a value of '{self.control}'")
        return {"CANCELLED"}


class QJULIA_OT_reset(_OfMap, bpy.types.Operator):
    """Set all knobs back to the values of the map"""

    bl_idname = "qjulia.reset"
    bl_label = "Reset knobs"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        for control in properties.table_of(context.object).controls:
            key = properties.key_of(control)
            context.object[key] = type(context.object[key])(control.usual)
        context.object.update_tag()
        return {"FINISHED"}


class QJULIA_OT_surprise(_OfMap, bpy.types.Operator):
    """Set a random phase and order, which make another pattern of grooves on the same shape"""

    bl_idname = "qjulia.surprise"
    bl_label = "Surprise me"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        for control in properties.table_of(context.object).controls:
            if control.group == "Pattern" and not control.words:
                value = random.uniform(control.least, control.most)
                context.object[properties.key_of(control)] = round(value) if control.is_whole else value
        context.object.update_tag()
        return {"FINISHED"}


class QJULIA_OT_bake(_OfMap, bpy.types.Operator):
    """Make and keep a mesh for each frame of the scene, so that it plays and renders without the program. Esc ends it"""

    bl_idname = "qjulia.bake"
    bl_label = "Bake"
    bl_options = {"REGISTER"}

    def invoke(self, context, _event):
        self._steps = bake.frames(context.object, context.scene)
        self._timer = context.window_manager.event_timer_add(0.01, window=context.window)
        context.window_manager.progress_begin(0, 1)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type == "ESC":
            return self._end(context, {"CANCELLED"})
        if event.type != "TIMER":
            return {"RUNNING_MODAL"}
        try:
            done, count = next(self._steps)
        except StopIteration:
            return self._end(context, {"FINISHED"})
        except (server.ProgramError, bake.BakeError) as error:
            self.report({"ERROR"}, str(error))
            return self._end(context, {"CANCELLED"})
        context.window_manager.progress_update(done / count)
        return {"RUNNING_MODAL"}

    def _end(self, context, result):
        self._steps.close()
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        return result

    def execute(self, context):
        try:
            for _ in bake.frames(context.object, context.scene):
                pass
        except (server.ProgramError, bake.BakeError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}


class QJULIA_OT_camera(_OfMap, bpy.types.Operator, ExportHelper):
    """Write the scene's camera as a table of keys for 'qjulia film': keys = "camera.csv" in its script"""

    bl_idname = "qjulia.camera"
    bl_label = "Camera to film"
    bl_options = {"REGISTER"}

    filename_ext = ".csv"
    filter_glob: bpy.props.StringProperty(default="*.csv", options={"HIDDEN"})

    def execute(self, context):
        try:
            text = camera.table(context.object, context.scene)
            with open(bpy.path.abspath(self.filepath), "w", encoding="utf-8") as file:
                file.write(text)
        except (camera.CameraError, OSError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}


class QJULIA_OT_report(bpy.types.Operator):
    """Show a text in Blender's reports"""

    bl_idname = "qjulia.report"
    bl_label = "Qjulia"
    bl_options = {"INTERNAL"}

    text: bpy.props.StringProperty()

    # What an operator reports at once goes to the script that called it, as an exception.
    def invoke(self, context, _event):
        self._timer = context.window_manager.event_timer_add(0.01, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        context.window_manager.event_timer_remove(self._timer)
        self.report({"ERROR"}, self.text)
        return {"FINISHED"}


_classes = (QJULIA_OT_add, QJULIA_OT_final, QJULIA_OT_cancel, QJULIA_OT_restart, QJULIA_OT_choose, QJULIA_OT_reset,
            QJULIA_OT_surprise, QJULIA_OT_bake, QJULIA_OT_camera, QJULIA_OT_report)


def register():
    for each in _classes:
        bpy.utils.register_class(each)


def unregister():
    for each in reversed(_classes):
        bpy.utils.unregister_class(each)
