"""Maps between two maps."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field
from typing import Dict, List, Optional

from . import _core, _device
from ._map import Map
from ._settings import with_settings


@dataclass(frozen=True)
class MorphResult:
    """The maps on the way from one map to another, and how much their sets flicker."""

    maps: List[Map] = field(repr=False)
    """One for each step, the first and the last included."""
    factors: Dict[str, int]
    """How many factors are "matched" with one of the other map, "appearing" or "vanishing"."""
    flicker: Optional[Dict[str, float]]
    """Shares, 0 to 1, of the cells of a box: "mean" and "worst", of a step, of those that change
    sides in it and are back within two more; and "changed", of those that change sides in a step at
    all. None where flicker was not measured, or there are fewer than four steps."""


def _core_of(map, argument):
    if not isinstance(map, Map):
        raise TypeError(f"{argument} must be a Map, not {type(map).__name__}")
    return map._core


@with_settings(_core.morph_settings(), all_of_them=True)
def morph(a, b, steps=48, *, device=None, on_progress=None, **options):
    """The maps between two maps, as `qjulia morph` makes them.

    Shape, detail and grooves go from the first map to the second without a jump.

    Parameters
    ----------
    a, b : Map
        Both of `fit`, or both of `shape` with versors of one kind, without paint and portals.
    settings
    device : Device or str, optional
    on_progress : callable, optional
        See `fit`.

    Returns
    -------
    MorphResult
        Its maps are all in memory. Those of `shape` hold a grid of distances each.

    Raises
    ------
    OptionError
        If a setting is out of range.
    InputError
        If there is no way from the one map to the other; the message says why.

    Notes
    -----
    Ctrl-C ends the call with KeyboardInterrupt.
    """
    options["steps"] = steps
    ends = _core_of(a, "a"), _core_of(b, "b")
    if a.up and b.up and a.up != b.up:
        warnings.warn(
            f"{a.up} is up in the first map and {b.up} in the second, so that one of them lies on its side",
            stacklevel=2,
        )
    maps, factors, flicker = _core.morph(_device.core_of(device), *ends, on_progress, options)
    return MorphResult([Map._of(map) for map in maps], factors, flicker)


def with_versor_of(map, other, *, device=None):
    """One map's shape with another's grooves, as `qjulia convert --versor-from` makes it.

    The versor and the phase are those of the other map, made as much larger as the inradius is.
    Detail and all other knobs stay.

    Parameters
    ----------
    map : Map
        Its shape stays. A fitted map becomes one that holds the fitted shape's distances on a grid,
        192 cells along the longest side, unless the other one's versor is a noise.
    other : Map
        Where the grooves come from.
    device : Device or str, optional

    Returns
    -------
    Map

    Raises
    ------
    InputError
        If one of the maps is quadratic or does not say its inradius, or a fitted one not its box
        and detail.
    """
    ends = _core_of(map, "map"), _core_of(other, "other")
    return Map._of(_core.with_versor_of(_device.core_of(device), *ends))
