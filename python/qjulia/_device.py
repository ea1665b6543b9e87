"""Devices: what there is, and which one is used."""

from __future__ import annotations

import json
import sys
import threading
import warnings

from typing import TypedDict

from . import _core


class DeviceInfo(TypedDict):
    """What OpenCL says about a device: a dict, as `devices` and `Device.info` give it.

    Sizes are bytes. "pci_address" and "uuid" are None where the driver does not report them, and
    "same_as" is the "id" of the same GPU on another platform.
    """

    id: str
    kind: str
    name: str
    vendor: str
    platform: str
    driver: str
    opencl: str
    compute_units: int
    clock_mhz: int
    native_float_lanes: int
    global_memory: int
    largest_allocation: int
    local_memory: int
    largest_work_group: int
    double_precision: bool
    shares_memory: bool
    draws_screen: bool
    pci_address: str | None
    uuid: str | None
    estimated_speed: float
    rank: int
    same_as: str | None
    layout: str


class Device:
    """An OpenCL device, ready to run kernels.

    Parameters
    ----------
    name : str, optional
        ``"gpu"``, ``"cpu"``, ``"P:D"`` (platform and device number, the ``"id"`` of `devices`) or
        part of a name, in any case. Without it, the environment's ``QJULIA_DEVICE``, else the
        device that ranks first.
    layout : str, optional
        How kernels are cut into work-items: ``"cpu"``, ``"gpu"`` or ``"auto"``, which suits the
        device.
    tuned : bool, optional
        Whether settings count that ``qjulia profile tune`` has found for the device.

    Raises
    ------
    NoDeviceError
        If no device matches.
    InputError
        If the layout is none of those above.

    Notes
    -----
    One thread at a time uses a device; others wait. For work side by side, open a device in each
    thread. A process that was forked cannot use the devices of its parent: with `multiprocessing`,
    use the start method ``"spawn"``.
    """

    __slots__ = ("_core", "_info")

    def __init__(self, name="", *, layout="", tuned=True):
        for argument, value in (("name", name), ("layout", layout)):
            if not isinstance(value, str):
                raise TypeError(f"{argument} must be a string, not {value!r}")
        self._core, warning = _core.open_device(name, layout, bool(tuned))
        self._info = json.loads(self._core.info)
        if warning:
            warnings.warn(warning, stacklevel=2)

    @classmethod
    def from_opencl(cls, queue):
        """The device of a queue of pyopencl, which qjulia then works in.

        Buffers of the queue's context can be shared (`BufferField`). All that qjulia computes runs in
        this queue, after what was put there before. The queue, its context and its device are
        retained, and released with the last thing that uses the device.

        Parameters
        ----------
        queue : pyopencl.CommandQueue
            It runs commands in order. One with ``PROFILING_ENABLE`` is faster where there are many
            short launches.

        Returns
        -------
        Device
            With the default settings of its layout, not with tuned ones.

        Raises
        ------
        TypeError
            If `queue` is no queue of pyopencl.
        InputError
            If it runs commands out of order.
        """
        self = object.__new__(cls)
        queue_address = address_of(queue, "CommandQueue", "queue")
        self._core = _core.device_of_queue(queue.context.int_ptr, queue.device.int_ptr, queue_address)
        self._info = json.loads(self._core.info)
        return self

    @property
    def name(self):
        """The device's name, as OpenCL has it."""
        return self._info["name"]

    @property
    def info(self):
        """What OpenCL says about the device, a `DeviceInfo`."""
        return dict(self._info)

    @property
    def layout(self):
        """``"cpu"`` or ``"gpu"``."""
        return self._core.layout

    def __repr__(self):
        return f"<qjulia.Device {self._info['id']} {self.name}, {self.layout} layout>"


def devices():
    """Every usable device of every platform.

    Returns
    -------
    list of DeviceInfo
        The ``"id"`` of each is a name for `Device`.
    """
    return json.loads(_core.list_devices())


def address_of(thing, kind, argument):
    """The address of the OpenCL object that an object of pyopencl holds.

    Other objects are refused, because the address of anything else would end the process.
    """
    pyopencl = sys.modules.get("pyopencl")
    if pyopencl is None or not isinstance(thing, getattr(pyopencl, kind)):
        name = "Buffer" if kind == "MemoryObjectHolder" else kind
        hint = "; give its .data" if hasattr(thing, "base_data") else ""
        raise TypeError(f"{argument} must be a pyopencl.{name}, not {type(thing).__name__}{hint}")
    return thing.int_ptr


_default = None
_opening = threading.Lock()


def core_of(device):
    """The device to use where `device` is a Device, a name, or None for the usual one."""
    global _default
    if isinstance(device, Device):
        return device._core
    if isinstance(device, str):
        return Device(device)._core
    if device is not None:
        raise TypeError(f"device must be a Device or its name, not {device!r}")
    with _opening:
        if _default is None:
            _default = Device()
        return _default._core
