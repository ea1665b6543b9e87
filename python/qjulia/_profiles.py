"""How fast kernels run, which settings suit a device, and whether it computes what it should."""

from __future__ import annotations

import json

from . import _core, _device, _mesh
from ._map import Map
from ._settings import with_settings


def _measured(map, mesh, faces):
    """What is measured, as the core takes it."""
    if map is not None and not isinstance(map, Map):
        raise TypeError(f"map must be a Map, not {type(map).__name__}")
    if mesh is None:
        if faces is not None:
            raise TypeError("faces are given without vertices; give them as mesh")
        return None if map is None else map._core, None
    return None if map is None else map._core, _mesh.as_read(mesh, faces)


def _names(given, argument):
    """Patterns, of which a string has several between commas."""
    names = given.split(",") if isinstance(given, str) else given
    try:
        names = list(names)
    except TypeError:
        raise TypeError(f"{argument} must be names, not {given!r}") from None
    if not all(isinstance(name, str) for name in names):
        raise TypeError(f"{argument} must be names, not {given!r}")
    return [name for name in names if name]


@with_settings(_core.profile_settings(), all_of_them=True)
def profile(
    map=None,
    mesh=None,
    faces=None,
    *,
    jobs=(),
    kernels=(),
    host_name=False,
    device=None,
    on_progress=None,
    **options,
):
    """Measure how fast each kernel runs against the device's limits, as `qjulia profile measure`.

    Parameters
    ----------
    map : Map, optional
        Measure every kernel that a fit, a surface and a picture of it launch. Without it, the eight
        jobs of a fit are measured with a map that is made up.
    mesh, faces
        What distances are measured to, in place of a sphere. See `fit`.
    jobs : str or sequence of str, optional
        Only these jobs, each with its kernels: "fit" for those of a fit with one iterate, or names as
        `qjulia profile measure --help` has them.
    kernels : str or sequence of str, optional
        Only jobs and kernels of these names, with * and ?: "energy*,gauss*". "*" is every kernel.
    settings
    host_name : bool, optional
        Whether the report says this host's name.
    device : Device or str, optional
    on_progress : callable, optional
        See `fit`.

    Returns
    -------
    dict
        What the command prints with ``--json``: "limits", "kernels" and more. Times are seconds, and
        shares are fractions of a limit. A share is None where its "share_verdict" is not "judged".

    Raises
    ------
    InputError
        If an option is out of range, or no kernel has such a name.
    """
    core, triangles = _measured(map, mesh, faces)
    report = _core.profile(
        _device.core_of(device),
        core,
        triangles,
        _names(jobs, "jobs"),
        _names(kernels, "kernels"),
        bool(host_name),
        on_progress,
        options,
    )
    return json.loads(report)


@with_settings(_core.tune_settings(), all_of_them=True)
def tune(
    map=None,
    mesh=None,
    faces=None,
    *,
    keep=True,
    host_name=False,
    device=None,
    on_progress=None,
    **options,
):
    """Find the settings that are fastest on a device, as `qjulia profile tune`.

    It takes a minute or two, and the machine should do nothing else.

    Parameters
    ----------
    map : Map, optional
        Measure with its factors, in its box, in place of a map that is made up.
    mesh, faces
        See `profile`.
    keep : bool, optional
        Whether settings that are certainly 3 % faster are kept for this device, its driver and this
        program. Every command, and every `Device` that is opened later, then uses them.
    settings
    host_name : bool, optional
        Whether the report says this host's name.
    device : Device or str, optional
    on_progress : callable, optional
        See `fit`.

    Returns
    -------
    dict
        What the command prints with ``--json``: settings "before", "tuning" and, where they stay,
        "why_kept"; "time_ratio" is new time over old.

    Raises
    ------
    InputError
        If an option is out of range.
    OutputError
        If the settings cannot be kept.
    """
    core, triangles = _measured(map, mesh, faces)
    report = _core.tune(
        _device.core_of(device), core, triangles, bool(keep), bool(host_name), on_progress, options
    )
    return json.loads(report)


def doctor(*, programs=(), device=None, on_progress=None):
    """Check that a device computes what it should, as `qjulia doctor`.

    The command runs its checks in processes of their own; here they run in this one, which ends
    with a driver that crashes.

    Parameters
    ----------
    programs : str or sequence of str, optional
        Only programs of these names, with * and ?: "energy.cl,gradient*".
    device : Device or str, optional
    on_progress : callable, optional
        See `fit`.

    Returns
    -------
    dict
        What the command prints with ``--json``: "passed", "programs" with what each was compared
        with, "driver" and "findings". A program that does not build has a "build_log", the file of
        the compiler's log. No exception is raised for a program that failed.

    Raises
    ------
    NoDeviceError
        If there is no such device.
    InputError
        If no program has such a name.
    """
    names = ",".join(_names(programs, "programs"))
    return json.loads(_core.doctor(_device.core_of(device), names, on_progress))


def profile_launch(kernel, run, *, device=None, **options):
    """Measure a kernel of your own as `profile` measures those of qjulia.

    >>> def run():
    ...     scaled(queue, (n,), None, buffer)  # a kernel of pyopencl
    ...     queue.finish()
    >>> qjulia.profile_launch("scaled", run, bytes=8 * n, device=device)["limited_by"]

    Parameters
    ----------
    kernel : str
        The kernel's name in its source. PoCL's machine code is found by it.
    run : callable
        Launches the kernel on the device and waits until it has ended. It is called as often as
        measuring needs. Calling it adds some tens of microseconds to its seconds.
    device : Device or str, optional
        Where it runs, such as `Device.from_opencl` gives it. Limits are measured there.
    slots : float, optional
        How many multiply-adds, multiplications and divisions a run has. The default, 0, says that
        the number is not known.
    bytes : float, optional
        How many bytes a run reads and writes at least. The default, 0, says that the number is not
        known.
    at_most : bool, optional
        Whether a run may end before it has done all of it.
    precision : {"single", "double"}, optional
        Of its multiply-adds.
    repeats : int, optional
        Timed runs, 1 to 1000, after one that is not timed. It is 5.

    Returns
    -------
    dict
        The figures of one kernel, as `profile` has them under "kernels". Seconds are those of the
        clock on the wall, from the beginning of `run` to its end.

    Raises
    ------
    InputError
        If a number is out of range. What `run` raises is raised.
    """
    if not isinstance(kernel, str):
        raise TypeError(f"kernel must be a name, not {kernel!r}")
    return json.loads(_core.profile_launch(_device.core_of(device), kernel, run, options))
