# SPDX-License-Identifier: Apache-2.0 OR GPL-3.0-or-later
# Part of qjulia, which is under the Apache License 2.0. This add-on may be used under the GNU General
# Public License, version 3 or later, as well, which is what Blender asks of add-ons.
"""Maps of qjulia as objects: every knob in a panel, live, and key-framed."""

bl_info = {
    "name": "Qjulia maps",
    "author": "qjulia developers",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "Add > Mesh > Qjulia map; sidebar > Qjulia",
    "description": "Filled Julia sets with the shape of a mesh, live",
    "support": "COMMUNITY",
    "category": "Add Mesh",
}

from . import frames, interface, live, operators, properties

_parts = (properties, operators, interface, frames, live)


def register():
    for part in _parts:
        part.register()


def unregister():
    for part in reversed(_parts):
        part.unregister()
