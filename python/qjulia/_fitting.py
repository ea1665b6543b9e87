"""Maps from meshes."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import List, Optional

from . import _core, _device, _mesh
from ._map import Map
from ._settings import with_settings


@dataclass(frozen=True)
class StageReport:
    """One stage of a fit, as it went.

    Energies of different stages are over different samples, and compare only within a level.
    """

    name: str
    """Its level's name."""
    evaluations: int
    """Evaluations of energy and gradient."""
    energy_before: float
    energy_after: float
    seconds: float
    iou: float
    """Intersection over union of shape and set, over 48 cells along each side of a cube: of the map
    that the fit would give if it ended with this stage."""
    n: int
    """Iterations of energies and IoU."""
    map: Optional[Map] = field(default=None, repr=False, compare=False)
    """What the fit would give if it ended here; in callbacks alone."""

    def __str__(self):
        return (
            f"{self.name}: {self.evaluations} evaluations, energy {self.energy_before:+.4f} to "
            f"{self.energy_after:+.4f}, IoU {self.iou:.4f}, {self.seconds:.1f} s"
        )


@dataclass(frozen=True)
class FitResult:
    """What a fit has reached, and how it went."""

    map: Map
    """Calibrated, in the shape's own coordinates."""
    stopped: str
    """Why the fit ended: "schedule_done", "evaluations", "time_limit", "target_iou", "converged" or
    "interrupted"."""
    evaluations: int
    """Evaluations of energy and gradient."""
    seconds: float
    mean_distance: float
    """Of the fitted surface (n = 1) from the mesh, over the diagonal of the mesh's box."""
    stages: List[StageReport]
    warnings: List[str]
    """What a user should know about the map, a sentence each."""
    summary: str = field(repr=False)
    """The same in words, a line for each stage."""

    def __str__(self):
        return self.summary


def _core_options(initial, options):
    """The options of a fit as the core takes them."""
    if initial is not None:
        if not isinstance(initial, Map):
            raise TypeError(f"initial must be a Map, not {type(initial).__name__}")
        options["initial"] = initial._core
    return options


def _result_of(found):
    found["map"] = Map._of(found["map"])
    found["stages"] = [StageReport(**stage) for stage in found["stages"]]
    return FitResult(**found)


@with_settings(_core.fit_settings())
def fit(
    vertices,
    faces=None,
    *,
    initial=None,
    device=None,
    on_stage=None,
    on_evaluation=None,
    on_progress=None,
    **options,
):
    """Fits a map to a mesh.

    Parameters
    ----------
    vertices : array (N, 3), mesh or path
        Vertices, with faces after them; or a mesh alone: a pair of vertices and faces, an object
        with `vertices` and `faces` (as trimesh has them) or with `points` and `cells_dict` (as
        meshio has them), or the path of an .obj, .off, .ply, .stl, .glb, .gltf or
        .3mf file; a .ply file may also hold points with normals (nx, ny, nz) and no faces. Arrays
        are used as a file with these numbers would be, so that the map is the same: in single
        precision, with equal vertices welded.
    faces : array (M, 3) of whole numbers, optional
        Counter-clockwise from outside.
    settings
    schedule_text : str, optional
        The text of such a file, in its place.
    initial : Map, optional
        A map to start from in place of a placement: its factors go where they are in the shape.
    weights : callable, optional
        A function that takes points in the shape's coordinates, an array (N, 3), and returns N
        numbers of 0 or more, by which the weights of samples are multiplied. It is called once per
        stage and must return the same numbers for the same points. The weights are then scaled so
        that their sum does not change.
    checkpoint : path-like, optional
        A file that the fit is kept in while it is under way.
    resume : bool, optional
        Goes on from the checkpoint, where there is one.
    device : Device or str, optional
    on_stage : callable, optional
        Called with a `StageReport` after each stage, whose `map` is what the fit would give. May
        be `print`.
    on_evaluation : callable, optional
        Called with the energy of each evaluation.
    on_progress : callable, optional
        Called with activity, fraction done, seconds left (negative when unknown) and a detail.

    Returns
    -------
    FitResult

    Raises
    ------
    InputError
        If the mesh or an option cannot be used; the message names it.
    KeyboardInterrupt
        If Ctrl-C came before there was anything to give.

    Notes
    -----
    Other Python threads run on. Callbacks run on the calling thread; when one raises, the fit ends
    and so does this call. Ctrl-C ends the fit with what it has reached: `stopped` is then
    "interrupted". A callback does the same by raising `StopIteration`.
    """
    options = _core_options(initial, options)
    # A map is wrapped as it comes: users see no other.
    watch = None
    if on_stage is not None:

        def watch(stage, map):
            on_stage(StageReport(**stage, map=Map._of(map)))

    found = _core.fit(
        _device.core_of(device),
        _mesh.as_read(vertices, faces),
        watch,
        on_evaluation,
        on_progress,
        options,
    )
    return _result_of(found)


class Fit:
    """A fit that is run stage by stage.

    >>> fit = qjulia.Fit(vertices, faces, factors=331)
    >>> for stage in fit:
    ...     print(stage, fit.map.field(points).mean())
    >>> result = fit.result()

    Its maps are those of `qjulia.fit`, bit for bit, unless there is a time limit, which includes
    the time between stages. A loop may be left with ``break``, and another loop may continue the fit.

    Parameters
    ----------
    vertices, faces, initial, device, on_evaluation, on_progress, **options
        As for `qjulia.fit`, and with the same exceptions.

    Notes
    -----
    Ctrl-C during a stage ends the fit, and so the loop, with what the fit has reached: `stopped` is
    then "interrupted".
    """

    __slots__ = ("_callbacks", "_core")

    def __init__(
        self,
        vertices,
        faces=None,
        *,
        initial=None,
        device=None,
        on_evaluation=None,
        on_progress=None,
        **options,
    ):
        options = _core_options(initial, options)
        # The core only borrows what it calls, so that cycles through this object can be collected.
        self._callbacks = (on_evaluation, on_progress, options)
        self._core = _core.Fit(
            _device.core_of(device),
            _mesh.as_read(vertices, faces),
            on_evaluation,
            on_progress,
            options,
        )

    def step(self):
        """Runs the next stage.

        Returns
        -------
        StageReport or None
            None if there was no further stage.

        Raises
        ------
        RuntimeError
            If another call of this fit has not returned yet. The other methods raise it, too.
        """
        stage = self._core.step()
        return None if stage is None else StageReport(**stage)

    def __iter__(self):
        return self

    def __next__(self):
        stage = self.step()
        if stage is None:
            raise StopIteration
        return stage

    @property
    def map(self):
        """The map that the fit would give if it ended here. Takes some tenths of a second."""
        return Map._of(self._core.map())

    @property
    def stages(self):
        """The reports of all stages so far, a list."""
        return [StageReport(**stage) for stage in self._core.stages()]

    @property
    def stopped(self):
        """Why the fit has ended, like `FitResult.stopped`; None while there are further stages."""
        return self._core.stopped()

    def result(self):
        """Ends the fit; if there are further stages, it counts as "interrupted".

        Returns
        -------
        FitResult
        """
        return _result_of(self._core.result())

    def __repr__(self):
        return f"<qjulia.Fit after {len(self.stages)} stages>"


@with_settings(_core.exact_settings())
def shape(vertices, faces=None, *, versor=None, device=None, on_progress=None, **options):
    """A map that has a mesh's exact shape, without a fit.

    Parameters
    ----------
    vertices, faces
        See `fit`.
    versor : {"random", "noise", "noise4"} or Map, optional
        What gives the grooves their pattern: roots at random places; gradient noise, in three
        components or four; or a fitted map's factors. It is "random".
    roots : int, optional
        Of "random", 1 to 1000. There are 60.
    octaves : int, optional
        Of a noise, 1 to 8. There are 2.
    scale : float, optional
        A noise's cells along the shape's longest side. They are 9.
    seed : int, optional
        Of the roots or the noise.
    settings
    thickness : float, optional
        Paints the map, as `Map.paint` does.
    phase : array, (4,), optional
    device : Device or str, optional
    on_progress : callable, optional

    Returns
    -------
    Map
    """
    options["versor"] = versor._core if isinstance(versor, Map) else versor
    return Map._of(
        _core.shape(_device.core_of(device), _mesh.as_read(vertices, faces), on_progress, options)
    )
