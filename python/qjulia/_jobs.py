"""Jobs: commands as data, as files hold them."""

from __future__ import annotations

import json
import os
import warnings

from . import _core, _device


def run(job, output=None, *, changes=None, inputs=None, device=None, on_progress=None):
    """Make again what a command made, or run a job, as `qjulia run` does.

    The same bytes come out on the same device, but for times in fitted maps.

    Parameters
    ----------
    job : path or dict
        A picture, mesh, map or field that a command or `run` wrote, a file with a job (.json,
        .toml), or a job itself, such as
        ``{"command": "render", "options": {"map": "bunny.qjulia.json", "zoom": 6}}``. Options have
        the command's names with underscores. The commands are fit, shape, paint, portals, surface,
        render, sample, compare and convert.
    output : path, optional
        The file to write. By default the command names it, in the current folder.
    changes : dict, optional
        Options of a file's job that get another value; None leaves one out.
    inputs : path, optional
        The folder where the files lie that a file's job reads. They are also looked for beside the
        file and in the current folder.
    device : Device or str, optional
    on_progress : callable, optional
        See `fit`.

    Returns
    -------
    dict or None
        What the command prints with ``--json``. Its warnings are given as UserWarning.

    Raises
    ------
    InputError, OutputError
        Where the job or a file of it cannot be used, before anything is written.
    """
    if not isinstance(job, dict):
        options = {"file": os.path.abspath(job)}
        if changes:
            options["changes"] = [f"{name}={_text(value)}" for name, value in changes.items()]
        if inputs is not None:
            options["inputs"] = os.path.abspath(inputs)
        if output is not None:
            options["output"] = os.path.abspath(output)
            output = None
        job = {"command": "run", "options": options}
    elif changes or inputs is not None:
        raise TypeError("changes and inputs are for the job of a file; change the dict instead")
    path = "" if output is None else os.fspath(output)
    report, said = _core.run(json.dumps(job), path, _device.core_of(device), on_progress)
    for warning in said:
        warnings.warn(warning, stacklevel=2)
    return json.loads(report)


def _text(value):
    """A value as `qjulia run` takes it after NAME=."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (list, tuple)):
        return " ".join(_text(part) for part in value)
    return str(value)
