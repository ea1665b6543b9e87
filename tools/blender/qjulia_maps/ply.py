# SPDX-License-Identifier: Apache-2.0 OR GPL-3.0-or-later
# Part of qjulia, which is under the Apache License 2.0. This add-on may be used under the GNU General
# Public License, version 3 or later, as well, which is what Blender asks of add-ons.
"""Reads the binary .ply files that the program writes. Does not use Blender."""

from __future__ import annotations

from dataclasses import dataclass

import numpy

_TYPES = {"float": "<f4", "double": "<f8", "uchar": "u1", "uint": "<u4", "int": "<i4"}


@dataclass
class Mesh:
    vertices: numpy.ndarray  # (V, 3), single precision
    triangles: numpy.ndarray  # (T, 3), numbers of vertices
    colors: numpy.ndarray | None  # (V, 3), sRGB, 0 ... 255


def _header(data: bytes) -> tuple[list[list[str]], int]:
    """The header's lines, split into words, and the offset of the data."""
    mark = b"end_header\n"
    end = data.find(mark)
    if not data.startswith(b"ply\n") or end < 0:
        raise ValueError("this is not a .ply file")
    return [line.split() for line in data[:end].decode("ascii", "replace").splitlines()], end + len(mark)


def _layout(lines: list[list[str]]) -> tuple[dict[str, int], list[tuple[str, str]]]:
    """The numbers of elements, and names and types of a vertex's properties. @raises ValueError"""
    counts: dict[str, int] = {}
    fields: list[tuple[str, str]] = []
    try:
        for words in filter(None, lines):
            if words[0] == "element":
                counts[words[1]] = int(words[2])
            elif words[0] == "property" and words[1] != "list":
                fields.append((words[2], _TYPES[words[1]]))
    except (IndexError, KeyError, ValueError) as error:
        raise ValueError(f"this .ply file has a header line that cannot be read: '{' '.join(words)}'") from error
    names = {name for name, _ in fields}
    if not names >= {"x", "y", "z"} or ("red" in names and not names >= {"green", "blue"}):
        raise ValueError("this .ply file's vertices lack a coordinate or a colour")
    if min(counts.values(), default=0) < 0:
        raise ValueError("this .ply file has a negative number of elements")
    return counts, fields


def read(data: bytes) -> Mesh:
    """@raises ValueError for a file of another form, or one that is cut short."""
    lines, begin = _header(data)
    if ["format", "binary_little_endian", "1.0"] not in lines:
        raise ValueError("this .ply file is not binary")
    counts, fields = _layout(lines)
    if list(counts) != ["vertex", "face"] or ["property", "list", "uchar", "uint", "vertex_indices"] not in lines:
        raise ValueError("this .ply file holds something other than vertices and triangles")
    vertex, face = numpy.dtype(fields), numpy.dtype([("count", "u1"), ("corners", "<u4", 3)])
    if len(data) != begin + counts["vertex"] * vertex.itemsize + counts["face"] * face.itemsize:
        raise ValueError("this .ply file is cut short")
    points = numpy.frombuffer(data, vertex, counts["vertex"], begin)
    faces = numpy.frombuffer(data, face, counts["face"], begin + points.nbytes)
    if (faces["count"] != 3).any() or (faces["corners"] >= max(1, len(points))).any():
        raise ValueError("this .ply file has faces that are not triangles")

    def columns(*names: str) -> numpy.ndarray:
        return numpy.stack([points[name] for name in names], axis=1)

    has_colors = "red" in (points.dtype.names or ())
    return Mesh(columns("x", "y", "z").astype(numpy.float32), faces["corners"],
                columns("red", "green", "blue") if has_colors else None)


def turned_upright(vertices: numpy.ndarray, up: str) -> numpy.ndarray:
    """The vertices, rotated by quarter turns so that the axis "x", "-x" ... becomes z."""
    z = numpy.array([0, 0, 1])
    axis = numpy.zeros(3, int)
    axis["xyz".index(up[-1])] = -1 if up.startswith("-") else 1
    if (axis == -z).all():
        return vertices * numpy.array([1, -1, -1], numpy.float32)
    about = numpy.cross(axis, z)
    turn = numpy.array([[0, -about[2], about[1]], [about[2], 0, -about[0]], [-about[1], about[0], 0]])
    rotation = numpy.eye(3, dtype=int) + turn + (turn @ turn if about.any() else 0)
    return (vertices @ rotation.T).astype(numpy.float32)
