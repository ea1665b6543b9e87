"""Meshes as users have them: arrays, files, objects of other packages."""

from __future__ import annotations

import os
import warnings
from typing import NamedTuple

import numpy as np

from . import _core, _device


class Surface(NamedTuple):
    """A triangle mesh: ``vertices, faces, normals = surface``."""

    vertices: np.ndarray
    """(N, 3) float64, in the shape's units."""
    faces: np.ndarray
    """(M, 3) uint32, counter-clockwise from outside."""
    normals: np.ndarray
    """(N, 3) float32, outward and of length 1."""

    def save(self, path, *, up=None, colors=None, map=None):
        """Writes the mesh by its extension, such as .ply, .glb or .3mf.

        Parameters
        ----------
        path : path-like
        up : {"x", "y", "z", "-x", "-y", "-z"}, optional
            The axis that points up, such as `Map.up`. Meshes in .glb, .usda, .stl and .3mf files
            then stand upright.
        colors : array, (N, 3), optional
            sRGB, 0 to 255, such as `Map.surface_colors` gives. All but .stl and .off hold them.
        map : Map, optional
            The map that the mesh shows. A .glb then holds it, and `Map.load` reads the file.
        """
        mesh = _core.Mesh(self.vertices, self.faces)
        if len(self.normals):
            mesh.set_normals(self.normals)
        if colors is not None:
            mesh.set_colors(colors)
        _core.write_mesh(mesh, path, up, None if map is None else map._core)


def core_of(mesh, faces=None):
    """The library's mesh of any of the forms that are accepted where a mesh is.

    These are vertices and faces, a pair of them, the path of a file, what has `vertices` and
    `faces`, and what has `points` and `cells_dict` with triangles.
    """
    if faces is not None:
        return _core.Mesh(mesh, faces)
    if isinstance(mesh, _core.Mesh):
        return mesh
    if isinstance(mesh, (str, os.PathLike)):
        return _read(mesh)[0]
    if hasattr(mesh, "vertices") and hasattr(mesh, "faces"):
        return _core.Mesh(mesh.vertices, mesh.faces)
    if hasattr(mesh, "points") and hasattr(mesh, "cells_dict"):
        if "triangle" not in mesh.cells_dict:
            raise ValueError("the mesh has no cells of the type 'triangle'; cut its cells first")
        return _core.Mesh(mesh.points, mesh.cells_dict["triangle"])
    if isinstance(mesh, (tuple, list)) and len(mesh) == 2:
        return _core.Mesh(*mesh)
    if isinstance(mesh, np.ndarray):
        raise TypeError("faces are missing; give them after the vertices")
    raise TypeError(
        "a mesh is two arrays (vertices, faces), the path of a file, or an object with vertices "
        f"and faces; not {type(mesh).__name__}"
    )


def _read(path):
    mesh, found, places = _core.read_mesh(path)
    for warning in found:
        warnings.warn(f"{os.fspath(path)}: {warning}", stacklevel=4)
    return mesh, places


def as_read(mesh, faces=None):
    """The library's mesh as the command has it: arrays as if they had been read from a file."""
    core = core_of(mesh, faces)
    if faces is None and isinstance(mesh, (str, os.PathLike)):
        return core
    core, found, _ = _core.as_if_read(core)
    for warning in found:
        warnings.warn(warning, stacklevel=4)
    return core


def read_mesh(path, *, return_index=False):
    """Reads a mesh as the command does.

    Polygons are cut into triangles, equal vertices welded, triangles without area and vertices
    without triangles left out. What is left keeps the file's order; of equal vertices the first
    stays. Warnings name the defects of the mesh.

    Parameters
    ----------
    path : path-like
        An .obj, .off, .ply, .stl, .glb, .gltf or .3mf file. A scene is read as one mesh, and a
        .ply file of points with normals (nx, ny, nz) as a small polygon for each point.
    return_index : bool, optional
        Whether to return also what became of the file's vertices. Data of these vertices are then
        carried over by
        ``mesh_data[index[index >= 0]] = file_data[index >= 0]``.

    Returns
    -------
    Surface
        Without normals: their array has no rows.
    index : array of int64
        Only with ``return_index=True``: for each vertex of the file the row of ``vertices`` that it
        became, or -1 if it was left out. An .stl file has three vertices for each triangle; of a
        file of points the array is empty.

    Raises
    ------
    InputError
        If the file cannot be used; the message says why.
    """
    mesh, index = _read(path)
    surface = Surface(*mesh.arrays())
    return (surface, index) if return_index else surface


def signed_distance(mesh, points, *, device=None, **options):
    """How far points are from a mesh, negative inside.

    Parameters
    ----------
    mesh : mesh
        See `fit` for what a mesh can be.
    points : array, (N, 3)
    precision : {"single", "double"}, optional
    device : Device or str, optional

    Returns
    -------
    array, (N,)
        In the mesh's units. Inside is where the winding number is above 1/2, so that meshes with
        holes have an inside, too.
    """
    return _core.signed_distance(_device.core_of(device), core_of(mesh), points, options)


def sample_surface(mesh, count, *, seed=1):
    """Points on a mesh, uniform by area.

    Parameters
    ----------
    mesh : mesh
        See `fit` for what a mesh can be.
    count : int
    seed : int, optional

    Returns
    -------
    points : array, (count, 3)
    normals : array, (count, 3)
        Of the points' triangles, outward and of length 1.
    """
    return _core.sample_surface(core_of(mesh), count, seed)
