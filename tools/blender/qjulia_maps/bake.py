# SPDX-License-Identifier: Apache-2.0 OR GPL-3.0-or-later
# Part of qjulia, which is under the Apache License 2.0. This add-on may be used under the GNU General
# Public License, version 3 or later, as well, which is what Blender asks of add-ons.
"""A mesh for each frame in a folder, so that animations play and render without the program."""

from __future__ import annotations

import os
import re

import bpy

from . import live, ply, properties


class BakeError(Exception):
    """A message for the user."""


def folder_of(obj) -> str:
    """@raises BakeError where none is given and the .blend file has not been saved."""
    given = obj.qjulia.bake_folder
    if not given:
        given = "//qjulia_" + re.sub(r"[^\w.-]", "_", obj.name)
    if given.startswith("//") and not bpy.data.filepath:
        raise BakeError("save the .blend file first, since baked meshes are kept beside it, or give a folder")
    return bpy.path.abspath(given)


def file_of(obj, frame: int) -> str:
    return os.path.join(folder_of(obj), f"frame_{frame:06d}.ply")


def _write(path: str, data: bytes) -> None:
    """Writes the file completely or not at all."""
    try:
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path + ".part", "wb") as file:
            file.write(data)
        os.replace(path + ".part", path)
    except OSError as error:
        raise BakeError(f"'{path}' cannot be written: {error.strerror}") from error


def frames(obj, scene):
    """Bakes the scene's frames, one per step; yields the number of finished frames and of all frames.
    @raises ProgramError, BakeError"""
    folder_of(obj)
    obj.qjulia.uses_bake, was_live = False, obj.qjulia.live
    obj.qjulia.live = False  # else each frame would be made twice
    before, numbers = scene.frame_current, range(scene.frame_start, scene.frame_end + 1)
    try:
        for done, frame in enumerate(numbers, 1):
            scene.frame_set(frame)
            wanted = live.Wanted(obj, properties.values_of(obj), obj.qjulia.final_cells)
            _write(file_of(obj, frame), live.make(obj, wanted))
            yield done, len(numbers)
        obj.qjulia.uses_bake = True
    finally:
        obj.qjulia.live = was_live
        scene.frame_set(before)


def show_frame(obj, frame: int) -> None:
    """The frame's mesh, or that of the nearest baked frame. @raises BakeError"""
    path = file_of(obj, frame)
    if not os.path.isfile(path):
        path = _nearest(obj, frame)
    values = properties.values_of(obj)
    wanted = live.Wanted(obj, values, 0)
    wanted.knobs = path
    if obj.qjulia.shown == wanted.shown:
        return
    try:
        with open(path, "rb") as file:
            made = ply.read(file.read())
    except (OSError, ValueError) as error:
        raise BakeError(f"'{path}' cannot be read: {error}; bake again") from error
    live.show(obj, made, wanted)


def _nearest(obj, frame: int) -> str:
    folder = folder_of(obj)
    names = os.listdir(folder) if os.path.isdir(folder) else []
    baked = [int(found[1]) for name in names if (found := re.fullmatch(r"frame_(-?\d+)\.ply", name))]
    if not baked:
        raise BakeError(f"nothing is baked in '{folder}': bake again, or turn 'Play what was baked' off")
    return file_of(obj, min(baked, key=lambda number: abs(number - frame)))
