# SPDX-License-Identifier: Apache-2.0 OR GPL-3.0-or-later
# Part of qjulia, which is under the Apache License 2.0. This add-on may be used under the GNU General
# Public License, version 3 or later, as well, which is what Blender asks of add-ons.
"""Remakes meshes when knobs change: requests run in threads, results are used in Blender's main thread."""

from __future__ import annotations

import json
import os
import threading
import time
import traceback

import bpy

from . import ply, properties, server, shapes

_SECONDS_BETWEEN = 0.1

servers = server.Servers(properties.how_to_start)
_is_busy = False  # its value when the panel was last drawn
is_paused = False  # while frames are rendered, which `frames` makes meshes for


class _Job(threading.Thread):
    """A request for one mesh. Does not use Blender."""

    def __init__(self, wanted: "Wanted"):
        super().__init__(daemon=True)
        self.wanted = wanted
        self.request = server.Request()
        self.mesh: ply.Mesh | None = None
        self.data = b""
        self.error = ""

    def run(self) -> None:
        try:
            self.data = servers.mesh(self.wanted.choice, self.wanted.query, self.wanted.cells, self.request)
            self.mesh = ply.read(self.data)
            if self.mesh.colors is None and "material" in self.wanted.query:
                self.error = "this qjulia is too old: it makes meshes without colours; update it, or choose clay"
        except server.Cancelled:
            pass
        except (server.ProgramError, ValueError) as error:
            self.error = str(error)
        except Exception as error:  # pylint: disable=broad-except
            traceback.print_exc()
            self.error = f"the add-on failed: {error!r}; the console says where"


class Wanted:
    """The mesh that an object should have."""

    def __init__(self, obj, values: dict, cells: int):
        table = properties.table_of(obj)
        self.choice = servers.choice(os.path.realpath(bpy.path.abspath(obj.qjulia.map_file)))
        self.query = table.query(values)
        self.up, self.clay, self.cells = table.up(values), table.clay(values), cells
        # Equal for meshes that differ only in their resolution.
        self.knobs = json.dumps([os.path.basename(self.choice[1]), self.query, self.up, self.clay])

    @property
    def shown(self) -> str:
        """The text by which the object remembers that it has this mesh."""
        return f"{self.cells} {self.knobs}"


class _State:
    """The state of an object, stored by the object's name."""

    def __init__(self) -> None:
        self.job: _Job | None = None
        self.message = ""  # the last error
        self.refused = ""  # the knobs that caused it


_states: dict[str, _State] = {}


def _state(obj) -> _State:
    return _states.setdefault(obj.name_full, _State())


def is_refused(obj, wanted: Wanted) -> bool:
    """Whether the program has refused to make exactly this mesh."""
    return _state(obj).refused == wanted.shown


def tell(obj, text: str) -> None:
    """Shows an error in the object's panel."""
    _state(obj).message = text


def message(obj) -> str:
    return _state(obj).message


def progress(obj) -> tuple[float, str] | None:
    """The progress of the mesh that is being made, if any."""
    job = _state(obj).job
    return (job.request.share, job.request.activity) if job else None


def is_current(obj) -> bool:
    """Whether the object has the final mesh of its current knobs."""
    return obj.qjulia.shown == Wanted(obj, properties.values_of(obj), obj.qjulia.final_cells).shown


def has_knobs(obj, wanted: Wanted) -> bool:
    """Whether the object has the mesh that is wanted, at any resolution."""
    return obj.qjulia.shown.partition(" ")[2] == wanted.knobs


def show(obj, made: ply.Mesh, wanted: Wanted) -> None:
    shapes.fill(obj.data, made, wanted.up, wanted.clay)
    if not obj.data.materials:
        obj.data.materials.append(shapes.material())
    obj.qjulia.shown = wanted.shown


def _report(text: str) -> None:
    """Shows a text in Blender's reports, if there is a window."""
    windows = bpy.context.window_manager.windows
    if not bpy.app.background and windows:
        with bpy.context.temp_override(window=windows[0]):
            bpy.ops.qjulia.report("INVOKE_DEFAULT", text=text)


def _take(obj, job: _Job) -> None:
    """Uses the result of a finished job."""
    state = _state(obj)
    if job.mesh is not None:
        show(obj, job.mesh, job.wanted)
    if job.error and job.error != state.message:
        _report(job.error)
    state.message = job.error
    state.refused = job.wanted.shown if job.mesh is None else ""


def begin(obj, wanted: Wanted) -> None:
    """Starts a mesh and cancels the one that is being made."""
    cancel(obj)
    job = _state(obj).job = _Job(wanted)
    job.start()


def cancel(obj) -> None:
    state = _state(obj)
    if state.job:
        state.job.request.cancel()
        state.job = None


def make(obj, wanted: Wanted) -> bytes:
    """Makes a mesh and waits for it. @return its file @raises ProgramError"""
    cancel(obj)
    job = _Job(wanted)
    job.run()
    _take(obj, job)
    if job.error:
        raise server.ProgramError(job.error)
    return job.data


def _follow_live(obj) -> None:
    state = _state(obj)
    if obj.mode != "OBJECT":
        return  # Blender is using the mesh
    if state.job and not state.job.is_alive():
        job, state.job = state.job, None
        _take(obj, job)
    if state.job or not obj.qjulia.live or obj.qjulia.uses_bake:
        return  # previews are not cancelled, else none would be shown while a knob is dragged
    wanted = Wanted(obj, properties.values_of(obj), obj.qjulia.preview_cells)
    if not has_knobs(obj, wanted) and not is_refused(obj, wanted):
        begin(obj, wanted)


def _follow_safely(obj) -> None:
    """An error in one object must not end `tick`, which Blender would not call again."""
    try:
        _follow_live(obj)
    except Exception as error:  # pylint: disable=broad-except
        traceback.print_exc()
        tell(obj, f"the add-on failed: {error}; see the console for details")


def _drop_stale() -> None:
    """Ends the work for objects that were deleted or have another name now; a renamed one begins afresh."""
    names = {obj.name_full for obj in bpy.data.objects}
    for name in [name for name in _states if name not in names]:
        state = _states.pop(name)
        if state.job:
            state.job.request.cancel()


def tick() -> float:
    """Runs regularly in the main thread."""
    if not is_paused:
        _drop_stale()
        for obj in bpy.data.objects:
            if properties.is_map(obj):
                _follow_safely(obj)
    _redraw()
    return _SECONDS_BETWEEN


def _redraw() -> None:
    """Redraws panels while a mesh is being made, and once after it."""
    global _is_busy
    was_busy, _is_busy = _is_busy, any(state.job for state in _states.values())
    if not (was_busy or _is_busy):
        return
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in {"VIEW_3D", "PROPERTIES"}:
                area.tag_redraw()


def wait(seconds: float = 120) -> None:
    """Waits until no mesh is being made, for use without windows. @raises TimeoutError"""
    until = time.monotonic() + seconds
    tick()
    while any(state.job for state in _states.values()):
        if time.monotonic() > until:
            raise TimeoutError(f"meshes are still not made after {seconds:g} s")
        time.sleep(0.02)
        tick()


def forget() -> None:
    """Ends all work and all programs."""
    for state in _states.values():
        if state.job:
            state.job.request.cancel()
    _states.clear()
    servers.stop()


def register():
    bpy.app.timers.register(tick, persistent=True)


def unregister():
    if bpy.app.timers.is_registered(tick):
        bpy.app.timers.unregister(tick)
    forget()
