"""Fields in buffers of pyopencl."""

from __future__ import annotations

from . import _core, _device
from ._device import address_of
from ._map import Map


class BufferField:
    """The field of one map at points in buffers of pyopencl, with results that stay there.

    While `Map.field` takes points from the host, this copies nothing. Arrays have ``stride(count)``
    reals for `count` points; those past the points may have any value. Points are four such arrays
    one after the other, X, Y, Z and W in map coordinates.

    >>> device = qjulia.Device.from_opencl(queue)
    >>> field = qjulia.BufferField(map, device=device)
    >>> stride = field.stride(1000)
    >>> points = pyopencl.array.zeros(queue, (4, stride), numpy.float32)
    >>> values = pyopencl.array.empty(queue, stride, numpy.float32)
    >>> field.at(points.data, 1000, values.data, n=4)

    Parameters
    ----------
    map : Map
    device : Device
        Of `Device.from_opencl`, in whose context the buffers are.
    precision : {"single", "double"}, optional
        Whether buffers hold float32 or float64.
    escape : float, optional
        Radius in map units beyond which an orbit ends. It is 20.

    Raises
    ------
    DeviceError
        If the device has too little memory, or no double precision.

    Notes
    -----
    Calls return when the work is in the queue, and buffers are retained until it is done. A buffer
    must not have been released: OpenCL offers no way to find that out.
    """

    __slots__ = ("_core",)

    def __init__(self, map, *, device, **options):
        if not isinstance(map, Map):
            raise TypeError(f"map must be a Map, not {type(map).__name__}")
        if not isinstance(device, _device.Device):
            raise TypeError(f"device must be a Device of Device.from_opencl, not {device!r}")
        self._core = _core.BufferField(map._core, device._core, options)

    def stride(self, count):
        """The length of an array for `count` points: `count`, rounded up to a multiple of the lane width."""
        return self._core.stride(count)

    def at(self, points, count, field, *, n=1):
        """Puts F_n at the points into an array, bit for bit what `Map.field` gives.

        Parameters
        ----------
        points : pyopencl.Buffer
            Four arrays.
        count : int
        field : pyopencl.Buffer
            One array.
        n : int, optional
            Iterations, 1 (the default) to 16. On a device that also draws a display, choose
            points x factors x n so that a call takes a few tenths of a second.

        Raises
        ------
        TypeError
            If an argument is no buffer of pyopencl.
        OptionError
            If a buffer is of another context or too small, or `n` or `count` is out of range.
        """
        self._core.at(_address(points, "points"), count, n, _address(field, "field"))

    def gradient_at(self, points, count, gradient):
        """Puts the derivatives of F_1 by X, Y, Z and W into four arrays.

        Points are within the escape radius. The arguments are those of `at`.
        """
        self._core.gradient_at(_address(points, "points"), count, _address(gradient, "gradient"))


def _address(buffer, argument):
    """The address of a buffer. Those of pools count too, and so the base class is asked for."""
    return address_of(buffer, "MemoryObjectHolder", argument)
