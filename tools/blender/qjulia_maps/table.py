# SPDX-License-Identifier: Apache-2.0 OR GPL-3.0-or-later
# Part of qjulia, which is under the Apache License 2.0. This add-on may be used under the GNU General
# Public License, version 3 or later, as well, which is what Blender asks of add-ons.
"""The program's table of knobs, and the text of their values in a request. Does not use Blender."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import Any, Mapping

# Settings of pictures that matter to a mesh, too.
_PICTURE_OPTIONS = ("material", "palette", "up")
_AXES = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}


@dataclass(frozen=True)
class Control:
    """A control that sets a knob or a part of it: a number between soft limits, or one of several words."""

    name: str
    label: str
    help: str
    group: str
    usual: Any
    least: float = 0.0
    most: float = 1.0
    is_whole: bool = False
    is_logarithmic: bool = False
    words: tuple[str, ...] = ()


def _control(given: Mapping[str, Any], group: str) -> Control:
    if given.get("words"):
        return Control(given["name"], given["label"], given["help"], group, given["usual"], words=tuple(given["words"]))
    return Control(given["name"], given["label"], given["help"], group, given["usual"], given["least"], given["most"],
                   given["whole"], given["log"])


def _number(value: Any) -> str:
    """As the program's page writes numbers: seven digits."""
    return value if isinstance(value, str) else f"{value:.7g}"


def _phase(degrees: list[float]) -> list[float]:
    """The unit quaternion of three angles."""
    phi, psi, chi = (math.radians(angle) for angle in degrees)
    return [math.cos(phi), math.sin(phi) * math.cos(psi), math.sin(phi) * math.sin(psi) * math.cos(chi),
            math.sin(phi) * math.sin(psi) * math.sin(chi)]


class Table:
    """The knobs that a map can have, with their usual values and ranges for this map.

    @param text JSON with "settings" and "palettes", as the program's page holds them.
    @raises ValueError, KeyError or TypeError where it is something else.
    """

    def __init__(self, text: str):
        self.text = text
        given = json.loads(text)
        self._settings = given["settings"]["map"] + [setting for setting in given["settings"]["picture"]
                                                     if setting["option"] in _PICTURE_OPTIONS]
        self._palettes = given["palettes"]
        self.controls = [_control(control, setting["group"]) for setting in self._settings
                         for control in setting["controls"]]
        for axis in _AXES:
            told = f"Per cent of the shape's box that is kept along {axis}: below 100 the set is cut open"
            self.controls.append(Control(f"cut{axis}", f"{axis} up to", told, "Cut open", 100.0, 1.0, 100.0))

    def usual(self) -> dict[str, Any]:
        return {control.name: control.usual for control in self.controls}

    def query(self, values: Mapping[str, Any]) -> dict[str, str]:
        """Names and values of a request: those that differ from the usual."""
        usual = self.usual()
        values = {**usual, **values}
        query = {}
        for setting in self._settings:
            names = [control["name"] for control in setting["controls"]]
            # The up axis turns the mesh here.
            if setting["option"] == "up" or all(_number(values[name]) == _number(usual[name]) for name in names):
                continue
            own = [values[name] for name in names]
            if setting["type"] == "phase":
                own = _phase(own)
            elif setting["type"] == "rotation":
                own = [*_AXES[own[1]], own[0]]
            query[setting["option"]] = ",".join(_number(value) for value in own)
        places = {axis: values[f"cut{axis}"] for axis in _AXES}
        if any(place != 100 for place in places.values()):
            query["cut"] = ",".join(f"{axis}={_number(place)}%" for axis, place in places.items() if place != 100)
        return query

    def up(self, values: Mapping[str, Any]) -> str:
        """The shape's axis that points up, such as "-z"."""
        return {**self.usual(), **values}.get("up", "y")

    def clay(self, values: Mapping[str, Any]) -> tuple[float, float, float]:
        """The palette's colour of clay, linear."""
        palette = {**self.usual(), **values}.get("palette")
        return tuple(self._palettes.get(palette, {}).get("clay", (0.66, 0.45, 0.32)))
