"""Maps of quaternions whose Julia sets have a given shape.

>>> import qjulia
>>> result = qjulia.fit("bunny.obj", factors=100, on_stage=print)
>>> vertices, faces, normals = result.map.with_knobs(detail=0.02).surface(256)
>>> picture = qjulia.render(result.map, size=(640, 480))
"""

from ._core import (
    DeviceError,
    Error,
    InputError,
    KernelBuildError,
    NoDeviceError,
    OptionError,
    OutputError,
    __version__,
)
from ._device import Device, DeviceInfo, devices
from ._energy import Energy
from ._fitting import Fit, FitResult, StageReport, fit, shape
from ._jobs import run
from ._map import Comparison, Map, compare, looks, quadratic_map, render, save_png
from ._mesh import Surface, read_mesh, sample_surface, signed_distance
from ._morph import MorphResult, morph, with_versor_of
from ._opencl import BufferField
from ._profiles import doctor, profile, profile_launch, tune


def load(path):
    """The map of a map file, or of a page that holds one; as `Map.load`."""
    return Map.load(path)


__all__ = [
    "BufferField",
    "Comparison",
    "Device",
    "DeviceError",
    "DeviceInfo",
    "Energy",
    "Error",
    "Fit",
    "FitResult",
    "InputError",
    "KernelBuildError",
    "Map",
    "MorphResult",
    "NoDeviceError",
    "OptionError",
    "OutputError",
    "StageReport",
    "Surface",
    "__version__",
    "compare",
    "devices",
    "doctor",
    "fit",
    "load",
    "looks",
    "morph",
    "profile",
    "profile_launch",
    "quadratic_map",
    "read_mesh",
    "render",
    "run",
    "sample_surface",
    "save_png",
    "shape",
    "signed_distance",
    "tune",
    "with_versor_of",
]

# Users see one module, whatever file something is written in.
for _name in __all__:
    if getattr(globals()[_name], "__module__", "").startswith("qjulia."):
        globals()[_name].__module__ = "qjulia"
del _name
