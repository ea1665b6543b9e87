# SPDX-License-Identifier: Apache-2.0 OR GPL-3.0-or-later
# Part of qjulia, which is under the Apache License 2.0. This add-on may be used under the GNU General
# Public License, version 3 or later, as well, which is what Blender asks of add-ons.
"""The panel with all knobs, in the sidebar and in the object's properties, and the menu entry."""

from __future__ import annotations

import textwrap

import bpy

from . import live, properties


def _draw_state(layout, obj) -> None:
    made = live.progress(obj)
    row = layout.row(align=True)
    if made:
        share, activity = made
        row.label(text=f"{round(100 * share)} % {activity}", icon="SORTTIME")
        row.operator("qjulia.cancel", text="", icon="X")
    else:
        row.operator("qjulia.final", icon="CHECKMARK" if live.is_current(obj) else "MESH_DATA")
    if live.message(obj):
        for number, line in enumerate(textwrap.wrap(live.message(obj), 48)):
            layout.label(text=line, icon="ERROR" if number == 0 else "BLANK1")


def _draw_knobs(layout, obj) -> None:
    boxes = {}
    for control in properties.table_of(obj).controls:
        key = properties.key_of(control)
        if key not in obj:
            continue
        if control.group not in boxes:
            boxes[control.group] = layout.box()
            boxes[control.group].label(text=control.group)
        box = boxes[control.group]
        if not control.words:
            box.prop(obj, f'["{key}"]', text=control.label)
            continue
        box.label(text=control.label)
        grid = box.grid_flow(columns=3 if max(map(len, control.words)) < 8 else 2, align=True)
        for word in control.words:
            button = grid.operator("qjulia.choose", text=word, depress=obj[key] == word)
            button.control, button.word = control.name, word


class _Panel:
    bl_label = "Qjulia map"

    @classmethod
    def poll(cls, context):
        return properties.is_map(context.object)

    def draw(self, context):
        obj, layout = context.object, self.layout
        layout.prop(obj.qjulia, "live")
        column = layout.column(align=True)
        column.prop(obj.qjulia, "preview_cells")
        column.prop(obj.qjulia, "final_cells")
        _draw_state(layout, obj)
        row = layout.row(align=True)
        row.operator("qjulia.surprise")
        row.operator("qjulia.reset")
        _draw_knobs(layout, obj)
        box = layout.box()
        box.label(text="Animation")
        box.prop(obj.qjulia, "bake_folder")
        box.operator("qjulia.bake")
        box.prop(obj.qjulia, "uses_bake")
        box.operator("qjulia.camera")
        layout.prop(obj.qjulia, "map_file")
        layout.operator("qjulia.restart")


class QJULIA_PT_sidebar(_Panel, bpy.types.Panel):
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Qjulia"


class QJULIA_PT_object(_Panel, bpy.types.Panel):
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "object"


def _draw_menu(self, _context):
    self.layout.operator("qjulia.add", text="Qjulia map...", icon="MESH_MONKEY")


def register():
    bpy.utils.register_class(QJULIA_PT_sidebar)
    bpy.utils.register_class(QJULIA_PT_object)
    bpy.types.VIEW3D_MT_mesh_add.append(_draw_menu)


def unregister():
    bpy.types.VIEW3D_MT_mesh_add.remove(_draw_menu)
    bpy.utils.unregister_class(QJULIA_PT_object)
    bpy.utils.unregister_class(QJULIA_PT_sidebar)
