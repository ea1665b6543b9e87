# SPDX-License-Identifier: Apache-2.0 OR GPL-3.0-or-later
# Part of qjulia, which is under the Apache License 2.0. This add-on may be used under the GNU General
# Public License, version 3 or later, as well, which is what Blender asks of add-ons.
"""The scene's camera as a table of keys for `qjulia film`."""

from __future__ import annotations

import math

import numpy

from . import ply, properties

HEAD = ("at", "azimuth", "elevation", "distance", "field-of-view", "look-at")
_MOST_ROLL = 0.5  # degrees


class CameraError(Exception):
    """Why a camera cannot be that of a film."""


def _axes(up: str) -> numpy.ndarray:
    """Rows: from where azimuth 0 looks, from where 90 does, and up; in the shape's coordinates."""
    number = "xyz".index(up[-1])
    upward = numpy.zeros(3)
    upward[number] = -1 if up.startswith("-") else 1
    front = numpy.zeros(3)
    front[(number + 1) % 3] = 1
    return numpy.array([front, numpy.cross(upward, front), upward])


def _field_of_view(camera, scene) -> float:
    """Degrees, vertical."""
    if camera.data.type != "PERSP":
        raise CameraError(f"'{camera.name}' is no perspective camera; films have no other")
    corners = camera.data.view_frame(scene=scene)
    height = max(corner.y for corner in corners) - min(corner.y for corner in corners)
    return 2 * math.degrees(math.atan(height / 2 / -corners[0].z))


def _row(obj, scene, up: str) -> list:
    """The camera in this frame: azimuth, elevation, distance, field of view and the point that it looks at."""
    camera = scene.camera
    placed = numpy.array(obj.matrix_world.inverted() @ camera.matrix_world)
    to_shape = ply.turned_upright(numpy.eye(3), up)  # rows times it
    eye = to_shape @ placed[:3, 3]
    right, back = (to_shape @ (placed[:3, i] / numpy.linalg.norm(placed[:3, i])) for i in (0, 2))
    front, side, upward = _axes(up)
    if abs(math.degrees(math.asin(max(-1, min(1, right @ upward))))) > _MOST_ROLL:
        raise CameraError(f"'{camera.name}' is tilted to one side in frame {scene.frame_current}; cameras of films "
                          "stand upright")
    # The point on the axis that is nearest to the middle of the set.
    middle = to_shape @ numpy.mean(numpy.array(obj.bound_box), 0)
    distance = float((eye - middle) @ back)
    if distance <= 0:
        raise CameraError(f"'{camera.name}' looks away from '{obj.name}' in frame {scene.frame_current}")
    azimuth = math.degrees(math.atan2(back @ side, back @ front))
    elevation = math.degrees(math.asin(max(-1, min(1, back @ upward))))
    return [azimuth, elevation, distance, _field_of_view(camera, scene), eye - distance * back]


def table(obj, scene) -> str:
    """The keys of all frames of the scene, with commas between them."""
    if scene.camera is None:
        raise CameraError("the scene has no camera")
    up = properties.table_of(obj).up(properties.values_of(obj))
    now = scene.frame_current
    rows = []
    try:
        for frame in range(scene.frame_start, scene.frame_end + 1):
            scene.frame_set(frame)
            rows.append(_row(obj, scene, up))
    finally:
        scene.frame_set(now)
    turns = numpy.degrees(numpy.unwrap(numpy.radians([row[0] for row in rows])))
    rate = scene.render.fps / scene.render.fps_base
    lines = [",".join(HEAD)]
    for number, (azimuth, (_, *others, look_at)) in enumerate(zip(turns, rows)):
        numbers = [number / rate, azimuth, *others]
        lines.append(",".join(f"{value:.9g}" for value in numbers) + "," + " ".join(f"{x:.9g}" for x in look_at))
    return "\n".join(lines) + "\n"
