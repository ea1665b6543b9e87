# SPDX-License-Identifier: Apache-2.0 OR GPL-3.0-or-later
# Part of qjulia, which is under the Apache License 2.0. This add-on may be used under the GNU General
# Public License, version 3 or later, as well, which is what Blender asks of add-ons.
"""Handlers that keep meshes up to date when the frame changes or a file is opened."""

from __future__ import annotations

import bpy
from bpy.app.handlers import persistent

from . import bake, live, properties, server


def _follow_frame(obj, scene, depsgraph) -> None:
    """Sets the frame's mesh before it is drawn: the baked mesh, or the final mesh when rendering.
    @raises ProgramError, BakeError"""
    if obj.qjulia.uses_bake:
        bake.show_frame(obj, scene.frame_current)
        return
    if not live.is_paused and not (bpy.app.background and obj.qjulia.live):
        return  # `live.tick` makes the preview
    evaluated = obj.evaluated_get(depsgraph) if depsgraph else obj
    cells = obj.qjulia.final_cells if live.is_paused else obj.qjulia.preview_cells
    wanted = live.Wanted(obj, properties.values_of(evaluated), cells)
    is_right = obj.qjulia.shown == wanted.shown if live.is_paused else live.has_knobs(obj, wanted)
    if not is_right and not live.is_refused(obj, wanted):
        live.make(obj, wanted)


@persistent
def _on_frame(scene, depsgraph=None):
    for obj in scene.objects:
        if not properties.is_map(obj) or obj.mode != "OBJECT":
            continue
        try:
            _follow_frame(obj, scene, depsgraph)
        except (server.ProgramError, bake.BakeError) as error:
            live.tell(obj, str(error))
            print(f"qjulia: frame {scene.frame_current}, {obj.name}: {error}")


@persistent
def _on_render_begin(_scene, _depsgraph=None):
    live.is_paused = True


@persistent
def _on_render_end(_scene, _depsgraph=None):
    live.is_paused = False


@persistent
def _on_load(*_):
    live.forget()


_handlers = (("frame_change_post", _on_frame), ("render_init", _on_render_begin),
             ("render_complete", _on_render_end), ("render_cancel", _on_render_end), ("load_pre", _on_load))


def register():
    for name, handler in _handlers:
        getattr(bpy.app.handlers, name).append(handler)


def unregister():
    for name, handler in _handlers:
        if handler in getattr(bpy.app.handlers, name):
            getattr(bpy.app.handlers, name).remove(handler)
