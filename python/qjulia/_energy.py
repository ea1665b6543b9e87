"""The energy that fits make small, over samples of your own."""

from __future__ import annotations

from . import _core, _device
from ._map import Map


class Energy:
    """The energy of maps with K factors, as a function of their 1 + 5K unknowns.

    The unknowns `x` are S, then five arrays over the factors: exponents, and the centers' X, Y, Z
    and W in map coordinates; with ``slice=True`` then the map's slice. Steepness, paint and portals are left aside, as in a fit.

    >>> energy = qjulia.Energy(map, points, sides=sides, loss="tanh", alpha=10)
    >>> found = scipy.optimize.minimize(energy.value_and_gradient, energy.x0, jac=True)
    >>> better = energy.map_at(found.x).calibrated()

    Parameters
    ----------
    map : Map
        Of factors alone.
    points : array, (N, 3) or (N, 4)
        The samples, at least one. Four coordinates are those of the map, with ``space="map"``.
    sides : array, (N,), optional
        1 outside, -1 inside, 0 neither. Without them, all are 0.
    weights : array, (N,), optional
        Not negative. Without them, 1 / N each.
    targets : array, (N,), optional
        The wanted F_n. Without them, the map's surface level.
    loss : {"distance", "tanh"} or callable, optional
        With w the weight, t the target and s the side of a sample: w (F - t)^2 / 2, which is 0
        where a sample with a side is farther out on it; or -w s tanh(alpha (F - t)), for which
        every side is 1 or -1. Or a function that takes the field at all samples and returns two
        arrays, losses and their derivatives; they are multiplied by the weights.
    alpha : float, optional
        Of the tanh. It is 1.
    n : int, optional
        Iterations, 1 (the default) to 16.
    slice : bool, optional
        Makes the map's slice an unknown too, the last one. Samples move with it. It is False.
    space : {"shape", "map"}, optional
        Whose coordinates the points are in.
    escape : float, optional
    precision : {"single", "double"}, optional
        "double" is for optimisers that ask for more than six digits.
    device : Device or str, optional

    Raises
    ------
    InputError
        If the map is not of factors alone, or a sample cannot be used.
    """

    __slots__ = ("_core",)

    def __init__(self, map, points, *, device=None, **options):
        if not isinstance(map, Map):
            raise TypeError(f"map must be a Map, not {type(map).__name__}")
        self._core = _core.Energy(map._core, _device.core_of(device), points, options)

    @property
    def size(self):
        """How many unknowns there are, 1 + 5K or, with the slice, 2 + 5K."""
        return self._core.size

    @property
    def x0(self):
        """The unknowns of the map given, an array (size,)."""
        return self._core.unknowns()

    def value(self, x):
        """The energy at these unknowns.

        Raises
        ------
        ValueError
            If `x` is not `size` finite numbers.
        """
        return self._core.value(x)

    def value_and_gradient(self, x):
        """The energy, and its derivatives by the unknowns: an array (size,)."""
        return self._core.value_and_gradient(x)

    def field(self, x):
        """F_n at each sample, an array (N,)."""
        return self._core.field(x)

    def map_at(self, x):
        """The map given with these unknowns in place of its own."""
        return Map._of(self._core.map_at(x))

    def __repr__(self):
        return f"<qjulia.Energy of {self.size} unknowns over {self._core.samples} samples>"
