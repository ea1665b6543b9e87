"""Maps: what a fit gives, and what is done with them."""

from __future__ import annotations

import json
import operator
from typing import TypedDict

import numpy as np

from . import _core, _device, _mesh
from ._settings import with_settings

_FACTOR = np.dtype([("center", "<f8", (4,)), ("exponent", "<f8")])


_DEEPEST = 60
"""Map files that are nested a little deeper than this are refused when they are read."""


def _expect_json(value, at, depth):
    """Raises InputError where a map's file could not hold the value at this place."""

    def refuse(problem, advice):
        raise _core.InputError(f"{at} is {problem}; {advice}")

    if value is None or isinstance(value, bool):
        return
    if isinstance(value, str):
        try:
            value.encode()
        except UnicodeEncodeError:
            refuse(f"{value!a}, which is not Unicode text", "leave it out or repair it")
    elif isinstance(value, (int, float)):
        try:
            finite = np.isfinite(float(value))
        except OverflowError:
            refuse("a whole number above 1.7e308", "give it as a string")
        if not finite:
            refuse(f"{value}, and JSON has finite numbers only", "leave it out, or give a string")
    elif isinstance(value, (dict, list, tuple)):
        if depth > _DEEPEST:
            refuse(f"nested more than {_DEEPEST} levels deep", "make it flatter")
        pairs = value.items() if isinstance(value, dict) else enumerate(value)
        for key, member in pairs:
            if not (key is None or isinstance(key, (str, int, float))):
                refuse(f"a dict with the key {key!r}", "keys must be strings or numbers")
            if isinstance(key, str):
                _expect_json(key, f"a key of {at}", depth)
            _expect_json(member, f"{at}[{key!r}]", depth + 1)
    else:
        refuse(
            f"of the type {type(value).__name__}, which JSON does not have",
            "give None, a bool, a number, a string, a list or a dict",
        )


class Map:
    """A map R(q) = e^F(q) U(q) of quaternions, and where the shape that it was made for lies.

    Maps come from `fit`, `shape`, `load`, `quadratic_map` and from other maps. They never change:
    each method that turns something gives another map. Maps are equal if all that decides about
    their sets is equal, whatever their provenance. They can be copied and pickled.
    """

    __slots__ = ("_core", "_numbers", "_png")

    def __init__(self, *_, **__):
        raise TypeError("maps come from qjulia.fit, qjulia.shape, qjulia.load and other maps")

    @classmethod
    def _of(cls, core):
        self = object.__new__(cls)
        self._core, self._numbers, self._png = core, core.numbers(), None
        return self

    @classmethod
    def load(cls, path):
        """Reads a map file (.qjulia.json), or a page (.html), picture (.png) or scene (.glb) that
        holds one.

        Raises
        ------
        InputError
            If the file cannot be used; the message names the key.
        """
        return cls._of(_core.load_map(path))

    def save(self, path):
        """Writes the map file, under a temporary name that is renamed in the end."""
        self._core.save(path)

    @classmethod
    def from_json(cls, text):
        """The map of a map file's text."""
        if not isinstance(text, str):
            raise TypeError(f"text must be a string, not {type(text).__name__}")
        return cls._of(_core.map_from_json(text))

    def to_json(self):
        """The text of the map's file."""
        return self._core.json()

    @property
    def factors(self):
        """The factors (q - center)^exponent in product order, as a structured array.

        Its fields are ``center``, 4 numbers in map coordinates, and ``exponent``, which is positive
        for a root and negative for a pole. The array is a copy: `with_factors` makes a map of it.
        """
        return self._core.factors().view(_FACTOR)[:, 0]

    def with_factors(
        self, factors, *, log_scale=None, surface_level=None, calibrate=False, device=None
    ):
        """The map with other factors.

        Parameters
        ----------
        factors : array
            As `factors` has them, or (N, 5): centers and exponents.
        log_scale, surface_level : float, optional
            Other values than the map's own.
        calibrate : bool, optional
            Moves the scale and the level so that the set's boundary lies on the surface F_1 = L.
            Do it where the factors' surface has moved.
        device : Device or str, optional
        """
        factors = np.asarray(factors)
        if factors.dtype.names is not None:
            if set(factors.dtype.names) != {"center", "exponent"}:
                raise ValueError(
                    "factors must have the fields center and exponent, not "
                    + ", ".join(factors.dtype.names)
                )
            factors = np.column_stack([factors["center"], factors["exponent"]])
        core = self._core.with_factors(factors, log_scale, surface_level)
        return Map._of(core.calibrated(_device.core_of(device)) if calibrate else core)

    def calibrated(self, *, device=None):
        """The map with its scale and level moved alike, so that the set lies on F_1 = L."""
        return Map._of(self._core.calibrated(_device.core_of(device)))

    @with_settings(_core.knob_table(), all_of_them=True)
    def with_knobs(self, *, device=None, **knobs):
        """The map with knobs turned, in the order in which they stand here.

        Parameters
        ----------
        settings
        device : Device or str, optional

        Returns
        -------
        Map

        Notes
        -----
        `detail` may also be "auto", "smooth", "clear" or "wild", as for `fit`. The value is then chosen for
        the map's own shape, which takes about as long as its surface at n = 1.

        Raises
        ------
        TypeError
            If there is no such knob; the message has the nearest name.
        InputError
            If a value is out of range, or the map does not bear the knob.
        """
        return Map._of(_core.with_knobs(self._core, _device.core_of(device), knobs))

    def field(self, points, *, device=None, **options):
        """F_n, the logarithm of the last iterate's norm, at points.

        A point is inside at n where F_n is below `surface_level`.

        Parameters
        ----------
        points : array, (N, 3) or (N, 4)
            Four coordinates are those of the map; three are on the map's slice.
        n : int, optional
            Iterations, 1 (the default) to 16.
        gradient : bool, optional
            Whether the gradient is wanted, too.
        space : {"shape", "map"}, optional
            Whose coordinates points and gradients are in. (N, 4) need ``"map"``.
        precision : {"single", "double"}, optional
        escape : float, optional
            Radius in map units beyond which an orbit ends. It is 20.
        device : Device or str, optional

        Returns
        -------
        values : array, (N,)
        gradient : array of the points' shape
            Only with ``gradient=True``.
        """
        return _core.field(self._core, _device.core_of(device), points, options)

    def versors(self, points, *, device=None, **options):
        """U at points: the unit quaternions of R(q) = e^F(q) U(q), as an array (N, 4).

        Parameters
        ----------
        points, space, precision, device
            See `field`.
        """
        return _core.versors(self._core, _device.core_of(device), points, options)

    def images(self, points, *, device=None, **options):
        """The last points of orbits, in map coordinates, as an array (N, 4).

        Their norms are e^F_n: an orbit ends where it escapes, and after n iterates at the latest.

        Parameters
        ----------
        points, n, space, escape, precision, device
            See `field`.
        """
        return _core.images(self._core, _device.core_of(device), points, options)

    def orbits(self, points, *, device=None, **options):
        """All points of orbits, in map coordinates, as an array (N, n + 1, 4).

        An orbit begins with its point, and repeats its last point after it has escaped.

        Parameters
        ----------
        points, n, space, escape, precision, device
            See `field`.
        """
        return _core.orbits(self._core, _device.core_of(device), points, options)

    def escape_counts(self, points, *, device=None, **options):
        """How many iterates orbits have before they escape, as an array (N,) of int32.

        Where none of the first n points of an orbit has escaped it is n.

        Parameters
        ----------
        points, n, space, escape, precision, device
            See `field`.
        """
        return _core.escape_counts(self._core, _device.core_of(device), points, options)

    @with_settings(_core.sample_settings(), all_of_them=True)
    def sample(self, resolution=128, *, device=None, on_progress=None, **options):
        """F_n at the centres of a box's cells.

        Parameters
        ----------
        settings
        device : Device or str, optional
        on_progress : callable, optional
            See `fit`.

        Returns
        -------
        values : array, [x][y][z]
            float32, or float64 in double precision.
        box : array, (2, 3)
            The box's corners, in the shape's units.
        """
        options["resolution"] = resolution
        return _core.sample(self._core, _device.core_of(device), on_progress, options)

    @with_settings([*_core.surface_settings(), *_core.print_settings(), *_core.selection_settings()])
    def surface(self, resolution=256, *, device=None, on_progress=None, **options):
        """The set as a triangle mesh, in the shape's own coordinates.

        Parameters
        ----------
        settings
        device : Device or str, optional
        on_progress : callable, optional
            See `fit`.

        Returns
        -------
        Surface
            ``vertices, faces, normals``. It has no faces where the box holds nothing of the set,
            or the set is too thin for the cells.
        """
        options["resolution"] = resolution
        return _mesh.Surface(
            *_core.surface(self._core, _device.core_of(device), on_progress, options)
        )

    def surface_colors(self, mesh, *, device=None, on_progress=None, **options):
        """Colours of the vertices of the set's mesh, as pictures of the map have them.

        Parameters
        ----------
        mesh : mesh
            What `surface` returned. See `fit` for what else a mesh can be.
        material : {"iterations", "trap", "groove", "height", "factor"}, optional
            See `render`. It is "iterations".
        palette : str or sequence of str, optional
            See `render`.
        range : sequence of float, optional
            See `render`.
        n : int, optional
            As for `surface`. It is 6.
        escape : float, optional
        precision : {"single", "double"}, optional
        device : Device or str, optional
        on_progress : callable, optional
            See `fit`.

        Returns
        -------
        array, (N, 3)
            uint8, sRGB, for `Surface.save`.
        """
        return _core.surface_colors(
            self._core, _device.core_of(device), _mesh.core_of(mesh), on_progress, options
        )

    @with_settings(_core.paint_settings())
    def paint(self, mesh=None, shares=None, *, device=None, on_progress=None, **options):
        """The map with other shares of its detail in other places: wild here and smooth there.

        Parameters
        ----------
        mesh : mesh, optional
            A mesh whose vertices have shares; see `fit` for what a mesh can be.
        shares : array, (N,), optional
            Its vertices' shares of the detail, 0 to 1.
        balls : array, (K, 5), optional
            X, Y, Z, radius and share of balls in which all places have this share.
        blocks : array, (K, 7), optional
            X0, Y0, Z0, X1, Y1, Z1 and share of boxes.
        ramp : (str, float, float), optional
            An axis and the shares at its low and its high end, such as ``("y", 1, 0.1)``.
        settings
        device : Device or str, optional
        on_progress : callable, optional

        Returns
        -------
        Map
        """
        if (mesh is None) != (shares is None):
            raise ValueError("mesh and shares belong together; give both or none")
        core = None if mesh is None else _mesh.core_of(mesh)
        return Map._of(
            _core.paint(self._core, _device.core_of(device), core, shares, on_progress, options)
        )

    @with_settings(_core.portal_settings(), all_of_them=True)
    def portals(self, count=3, *, device=None, on_progress=None, **options):
        """The map with copies of its set on its own tips.

        Parameters
        ----------
        settings
        device : Device or str, optional
        on_progress : callable, optional

        Returns
        -------
        Map
        """
        options["count"] = count
        return Map._of(_core.portals(self._core, _device.core_of(device), on_progress, options))

    @with_settings(_core.target_settings(), all_of_them=True)
    def with_roughness(self, mesh=None, faces=None, *, device=None, on_progress=None, **options):
        """The map with the detail at which its set has a given area or box-counting dimension.

        It is what ``--target-area`` and the options beside it do to the map of ``shape``, ``fit``
        and ``convert``.

        Parameters
        ----------
        mesh, faces
            What areas and volumes are measured against, as the commands ``shape`` and ``fit`` do it
            with their mesh; see `fit` for what a mesh can be. Without a mesh it is the map's smooth
            set, its surface at n = 1, as of ``convert``.
        settings
        device : Device or str, optional
        on_progress : callable, optional
            See `fit`.

        Returns
        -------
        Map
            Its `detail` is the one that was found.

        Raises
        ------
        OptionError
            If an area and a dimension are given, or what is asked for cannot be reached: the
            message says what can be.
        InputError
            If neither is given, the map's detail cannot change, or the mesh cannot be used.
        """
        if mesh is None and faces is not None:
            raise TypeError("faces are given without vertices; give them as mesh")
        triangles = None if mesh is None else _mesh.as_read(mesh, faces)
        core = _device.core_of(device)
        return Map._of(_core.with_roughness(self._core, core, triangles, on_progress, options))

    def without_paint(self):
        """The map with the same detail everywhere."""
        return Map._of(self._core.without_paint())

    def without_portals(self):
        """The map without copies of its set."""
        return Map._of(self._core.without_portals())

    @property
    def provenance(self):
        """How the map was made, as its file records it: a dict of JSON's types. It is a copy."""
        return json.loads(self._core.provenance())

    def with_provenance(self, provenance):
        """The map with this provenance.

        Parameters
        ----------
        provenance : dict
            It must be convertible to JSON.

        Raises
        ------
        InputError
            If it is not a dict, or a value in it cannot be converted to JSON; the message names
            its key.
        """
        if not isinstance(provenance, dict):
            raise _core.InputError(
                f"provenance must be a dict, not {type(provenance).__name__}; give one"
            )
        _expect_json(provenance, "provenance", 1)
        return Map._of(self._core.with_provenance(json.dumps(provenance)))

    @property
    def kind(self):
        """``"rational"``, ``"quadratic"``, ``"distance/factors"`` and so on."""
        return self._numbers["kind"]

    @property
    def degree(self):
        """What F grows with far out: the sum of the exponents of a map of factors."""
        return self._numbers["degree"]

    @property
    def log_scale(self):
        """S, added to F."""
        return self._numbers["log_scale"]

    @property
    def surface_level(self):
        """L: a point is inside at n where F_n < L."""
        return self._numbers["surface_level"]

    @property
    def slice(self):
        """The fourth map coordinate of points with three."""
        return self._numbers["slice"]

    @property
    def phase(self):
        """p, the unit quaternion in front of the map."""
        return np.array(self._numbers["phase"])

    @property
    def detail(self):
        """The shell's thickness as a fraction of the shape's diagonal, or None."""
        return self._numbers["detail"]

    @property
    def diagonal(self):
        """Diagonal of the shape's own box, which turning does not change, shape units, or None."""
        return self._numbers["diagonal"]

    @property
    def steepness(self):
        """How many times as steep F is outside the shape."""
        return self._numbers["steepness"]

    @property
    def inradius(self):
        """The shape's, in its own units, or None."""
        return self._numbers["inradius"]

    @property
    def up(self):
        """The axis that points up, such as ``"y"``, or None."""
        return self._numbers["up"]

    @property
    def box(self):
        """(2, 3), the corners of the shape's box in its own units, or None."""
        box = self._numbers["box"]
        return None if box is None else np.array(box)

    @property
    def is_painted(self):
        """Whether places have different shares of the detail."""
        return self._numbers["is_painted"]

    @property
    def portal_count(self):
        """How many portals the map has."""
        return self._numbers["portal_count"]

    def to_map(self, points):
        """Points (..., 3) of the shape's coordinates in the map's."""
        points = np.asarray(points, dtype=float)
        return self._numbers["scale"] * points + self._numbers["translation"]

    def to_shape(self, points):
        """Points (..., 3) of the map's coordinates in the shape's."""
        points = np.asarray(points, dtype=float)
        return (points - self._numbers["translation"]) / self._numbers["scale"]

    def __eq__(self, other):
        if not isinstance(other, Map):
            return NotImplemented
        return self._core is other._core or self._core.content() == other._core.content()

    def __hash__(self):
        return hash(self._core.content())

    def __copy__(self):
        return self

    def __deepcopy__(self, memo):
        return self

    def __reduce__(self):
        return Map.from_json, (self.to_json(),)

    def __repr__(self):
        parts = [self.kind]
        count = len(self._core.factors())
        if count:
            parts.append(f"{count} factors")
        if self.detail is not None:
            parts.append(f"detail {self.detail:.3g}")
        if self.is_painted:
            parts.append("painted")
        if self.portal_count:
            parts.append(f"{self.portal_count} portals")
        return f"<qjulia.Map {', '.join(parts)}>"

    def _repr_png_(self):
        """A small picture, for notebooks."""
        if self._png is None:
            self._png = _core.png(render(self, size=(320, 240), samples=1))
        return self._png


def quadratic_map(c):
    """The map R(q) = q^2 + c.

    Parameters
    ----------
    c : array, (4,)
    """
    return Map._of(_core.quadratic_map(c))


@with_settings(_core.picture_settings(), all_of_them=True)
def render(subject, *, layers=False, framed=None, device=None, on_progress=None, **options):
    """A picture of a map's set, or of a mesh in the same light.

    Parameters
    ----------
    subject : Map or mesh
        See `fit` for what a mesh can be.
    settings
    layers : bool, optional
        Whether what the pixels show is wanted, too.
    framed : array, (2, 3), or Map, optional
        The camera frames the part of a mesh that lies in this box. Without a box it frames all of
        the mesh.
    device : Device or str, optional
    on_progress : callable, optional
        See `fit`.

    Returns
    -------
    image : array of uint8, (height, width, 3)
        Or 4 with a transparent background. `save_png` writes it.
    layers : dict
        Only with ``layers=True``: "depth", "normal" and "position", float32, in the shape's units.
    """
    core = _device.core_of(device)
    if isinstance(subject, Map):
        if framed is not None:
            raise ValueError("framed is for meshes; give frame to look at a part of a map's set")
        draw = _core.render_layers if layers else _core.render
        return draw(subject._core, core, on_progress, options)
    if layers:
        raise ValueError("layers are of maps, not of meshes")
    if isinstance(framed, Map):
        framed = framed.box
    return _core.render_mesh(_mesh.core_of(subject), core, on_progress, framed, options)



def looks():
    """The looks that `render` knows by name.

    Returns
    -------
    dict
        What each look shows, by its name.
    """
    return _core.looks()


def save_png(image, path, *, map=None):
    """Writes an array of uint8, (height, width, 3 or 4), as a PNG file.

    Parameters
    ----------
    image : array
    path : path-like
    map : Map, optional
        The map that the picture shows. The file then holds it, and `Map.load` reads the file.
    """
    if map is not None and not isinstance(map, Map):
        raise TypeError("map must be a Map")
    data = _core.png(image, None if map is None else map._core)
    with open(path, "wb") as file:
        file.write(data)


class _Figures(TypedDict):
    n: int
    iou: float
    mean_distance: float
    distance_95: float
    hausdorff_distance: float
    energy: float
    roughness: float
    slope_variation: float


class Comparison(_Figures, total=False):
    """How well a map's set fits a mesh at one number of iterations: a dict, as `compare` gives it.

    Distances are fractions of the mesh's box diagonal. "limbs" and "limbs_kept" are there only
    where they were asked for. Figures that are undefined are NaN.
    """

    limbs: int
    limbs_kept: int


@with_settings([row for row in _core.compare_settings() if row["name"] != "n"], all_of_them=True)
def compare(map, mesh, faces=None, *, n=(1, 6), device=None, on_progress=None, **options):
    """How well a map's set fits a mesh.

    Parameters
    ----------
    map : Map
    mesh, faces
        See `fit`.
    n : int or sequence of int, optional
        Iterations of the sets that are compared.
    settings
    device : Device or str, optional
    on_progress : callable, optional

    Returns
    -------
    list of Comparison
        One for each n, in the order given. pandas makes a table of it.
    """
    if not isinstance(map, Map):
        raise TypeError(f"map must be a Map, not {type(map).__name__}")
    try:
        wanted = [operator.index(number) for number in (n if np.iterable(n) else [n])]
    except TypeError:
        raise TypeError(f"n must be a whole number or several, not {n!r}") from None
    core, triangles = _device.core_of(device), _mesh.as_read(mesh, faces)
    found = {}
    for number in sorted(set(wanted), reverse=True):
        if number in found:
            continue
        for row in _core.compare(map._core, core, triangles, on_progress, {**options, "n": number}):
            found[row["n"]] = row
    return [dict(found[number]) for number in wanted]
