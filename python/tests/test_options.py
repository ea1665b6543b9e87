"""Every keyword of every function is accepted, and all but `device` change the result."""

import numpy as np
import pytest

import qjulia
from test_types import keywords_in_stub

POINTS = np.array([[0.9, 0.1, 0.2], [0.2, 0.3, 0.1], [1.4, 0.0, 0.1]])
BOX = [[-1.5, -1.5, -0.5], [1.5, 1.5, 0.6]]
SMALL = {"sample_points": 500, "factors": 16, "repeats": 1}
FEW = {"factors": 9, "max_evaluations": 2, "schedule": "fast"}
QUERY = {"n": 2, "space": "map", "precision": "double", "escape": 30}
PRINT = {"height": 40, "flat_foot": 1, "shell": 4, "drain": 2}
LOOK = {"size": (16, 12), "background": "transparent", "ground": False, "samples": 1}
OF_MAP = {"range": (0, 1), "box": [[-2, -2, -2], [2, 2, 2]], "cut": {"z": "90%"}}
SCHEDULE = """
evaluations = 2
[[level]]
name = "only"
until = 1.0
samples = 2000
band = 0.05
band_weight = 1.0
"""


def example_of(row):
    """The value of a setting's example."""
    words = row["example"].split(" ")
    if row["type"] == "bool":
        return not row["default"]
    if row["name"] == "palette":
        return [f"#{color}" for color in row["example"].split(",")]
    try:
        numbers = [int(word) if "SupportsIndex" in row["type"] else float(word) for word in words]
    except ValueError:
        return row["example"]
    return numbers[0] if len(numbers) == 1 else numbers


def examples(table):
    """A value for every setting of one of the library's tables."""
    return {row["name"]: example_of(row) for row in getattr(qjulia._core, table)()}


def noted(*_):
    """Takes progress reports and ignores them."""


def weights(points):
    return np.ones(len(points))


class Calls:
    """Calls of each function, with the keywords of each call."""

    def ran(self, **keywords):
        """A picture that is made again from a picture."""
        first, again = self.folder / "first.png", self.folder / "again.png"
        if not first.exists():
            self.map.save(self.folder / "map.qjulia.json")
            options = {"map": str(self.folder / "map.qjulia.json"), "size": "8x6", "samples": 1}
            qjulia.run({"command": "render", "options": options}, first)
        qjulia.run(first, again, **keywords)
        return again.read_bytes()

    def __init__(self, map, torus, folder):
        self.map, self.torus, self.folder = map, torus, folder
        self.mesh = map.surface(16)
        self.picture = qjulia.render(map, size=(8, 6), samples=1)

    def saved(self, name, **options):
        path = self.folder / name
        self.mesh.save(path, **options)
        return path.read_bytes()

    def mesh_file(self):
        path = self.folder / "mesh.ply"
        self.mesh.save(path)
        return path

    def saved_picture(self, **options):
        path = self.folder / "picture.png"
        qjulia.save_png(self.picture, path, **options)
        return path.read_bytes()

    def of(self, device):
        """For each function, what to call, and the keywords of each call."""
        use = {"device": device}
        hear = {**use, "on_progress": noted}
        map, torus, queue = self.map, self.torus, opencl_queue()
        turned, exact = map.with_knobs(rotate=(1, 0, 0, 60)), qjulia.shape(*torus, resolution=32)
        colors = np.full((len(self.mesh.vertices), 3), 9, np.uint8)
        fit = {**hear, "on_evaluation": noted}
        fits = [
            {
                **fit,
                **{name: value for name, value in examples("fit_settings").items() if name != "max_factors"},
                "weights": weights,
                "checkpoint": str(self.folder / "checkpoint"),
                "resume": True,
            },
            {"max_factors": 9, "max_evaluations": 2, "schedule_text": SCHEDULE},
            {"initial": map, "max_evaluations": 2},
        ]
        return {
            "Device.__init__": (qjulia.Device, [{"layout": "gpu", "tuned": False}]),
            "Surface.save": (lambda **k: self.saved("a.glb", **k), [{"up": "y", "colors": colors, "map": map}]),
            "sample_surface": (lambda **k: qjulia.sample_surface(torus, 9, **k), [{"seed": 7}]),
            "signed_distance": (
                lambda **k: qjulia.signed_distance(torus, POINTS, **k),
                [{**use, "precision": "double"}],
            ),
            "Map.with_factors": (
                lambda **k: map.with_factors(map.factors, **k),
                [{"log_scale": 0.5}, {"surface_level": 0.5}, {**use, "calibrate": False, "log_scale": 0.1}],
            ),
            "Map.calibrated": (map.calibrated, [use]),
            "Map.with_knobs": (
                map.with_knobs,
                [{name: value} for name, value in examples("knob_table").items()] + [{**use, **examples("knob_table")}],
            ),
            "Map.field": (lambda **k: map.field(POINTS, **k), [{**use, **QUERY}, {"gradient": True}]),
            "Map.versors": (
                lambda **k: map.versors(POINTS, **k),
                [{**use, "space": "map", "precision": "double"}],
            ),
            "Map.images": (lambda **k: map.images(POINTS, **k), [{**use, **QUERY}]),
            "Map.orbits": (lambda **k: map.orbits(POINTS, **k), [{**use, **QUERY}]),
            "Map.escape_counts": (lambda **k: map.escape_counts(POINTS, **k), [{**use, **QUERY}]),
            "Map.sample": (
                lambda **k: map.sample(8, **k),
                [{**hear, "n": 2, "box": BOX, "escape": 30, "precision": "double"}],
            ),
            "Map.surface": (
                lambda **k: map.surface(16, **k),
                [
                    {**hear, "n": 2, "box": BOX, "exact": True, "refine": 3, "escape": 30, "precision": "double"},
                    {"n": 1, "dense": True, "keep_loose": True},
                    PRINT,
                    {"longest": 40, "min_wall": 1, "largest_component": True},
                    {"max_triangles": 200, "max_error": 0.5, "min_component": 0.5},
                    {"cut": "z=90%"},
                ],
            ),
            "Map.surface_colors": (
                lambda **k: map.surface_colors(self.mesh, **k),
                [
                    {
                        **hear,
                        "material": "trap",
                        "palette": ["#102030", "#405060"],
                        "range": (0, 1),
                        "n": 3,
                        "escape": 30,
                        "precision": "double",
                    }
                ],
            ),
            "Map.paint": (
                lambda **k: map.paint(**k),
                [
                    {
                        **hear,
                        "balls": [[1, 0, 0, 0.3, 0.5]],
                        "blocks": [[0, 0, 0, 1, 1, 1, 0.2]],
                        "ramp": ("x", 0, 1),
                        "thickness": 0.15,
                        "elsewhere": 0.5,
                    }
                ],
            ),
            "read_mesh": (lambda **k: qjulia.read_mesh(self.mesh_file(), **k), [{"return_index": True}]),
            "Map.portals": (
                lambda **k: map.portals(1, **k),
                [{**hear, **{name: value for name, value in examples("portal_settings").items() if name != "count"}}],
            ),
            "Map.with_roughness": (
                lambda **k: map.with_roughness(**{"target_resolution": 64, **(k or {"target_area": 1.1})}),
                [{**hear, "target_area": 1.15, "target_volume": 1, "target_resolution": 65}, {"target_dimension": 2.04}],
            ),
            "morph": (
                lambda **k: morphed(map, turned, **k),
                [{**hear, "flicker_cells": 9}],
            ),
            "with_versor_of": (lambda **k: qjulia.with_versor_of(exact, map, **k), [use]),
            "render": (
                lambda **k: qjulia.render(map, **{"size": (8, 6), **k}),
                [{**hear, **examples("picture_settings"), **LOOK, **OF_MAP}, {"layers": True}],
            ),
            "render of a mesh": (lambda **k: qjulia.render(torus, **{"size": (8, 6), **k}), [{"framed": BOX}]),
            "save_png": (self.saved_picture, [{"map": map}]),
            "compare": (
                lambda **k: qjulia.compare(map, torus, **{"resolution": 16, **k}),
                [
                    {
                        **hear,
                        "n": [1, 2],
                        "resolution": 20,
                        "box": BOX,
                        "escape": 30,
                        "precision": "double",
                    },
                    {"limbs": True},
                ],
            ),
            "fit": (
                lambda **k: qjulia.fit(*torus, **(k or FEW)).map,
                [{**fits[0], "on_stage": noted}, *fits[1:]],
            ),
            "Fit.__init__": (lambda **k: finished(qjulia.Fit(*torus, **(k or FEW))), fits),
            "shape": (
                lambda **k: qjulia.shape(*torus, **{"resolution": 32, **k}),
                [
                    {
                        **hear,
                        "versor": "random",
                        "roots": 8,
                        "seed": 2,
                        **examples("exact_settings"),
                        "thickness": 0.15,
                        "phase": (0.8, 0.6, 0, 0),
                    },
                    {"versor": "noise", "octaves": 3, "scale": 8},
                ],
            ),
            "run": (
                lambda **k: self.ran(**k),
                [{**hear, "changes": {"size": "16x12"}, "inputs": self.folder}],
            ),
            "profile": (
                lambda **k: settings_of_profile(qjulia.profile(**(k or {"repeats": 1, "time_limit": 1e-6}))),
                [{**hear, **examples("profile_settings"), "jobs": "fit", "kernels": "energy*", "host_name": True}],
            ),
            "tune": (
                lambda **k: settings_of_tuning(qjulia.tune(**{**SMALL, "keep": False, **k})),
                [{**hear, **examples("tune_settings"), "keep": False, "host_name": True}],
            ),
            "doctor": (
                lambda **k: [check["program"] for check in qjulia.doctor(**(k or {"programs": "reduce.cl"}))["programs"]],
                [{**hear, "programs": ["builtins.cl"]}],
            ),
            "profile_launch": (
                lambda **k: settings_of_kernel(qjulia.profile_launch("f", noted, **{"repeats": 1, **k})),
                [{**use, "slots": 1e6, "bytes": 1e3, "at_most": True, "precision": "double", "repeats": 2}],
            ),
            "BufferField.__init__": (
                lambda **k: in_buffers(map, queue, {}, **k),
                [{"device": queue and qjulia.Device.from_opencl(queue), "precision": "double", "escape": 1.2}],
            ),
            "BufferField.at": (lambda **k: in_buffers(map, queue, k), [{"n": 2}]),
            "Energy.__init__": (
                lambda **k: energy_of(map, **k),
                [
                    {
                        **use,
                        "sides": [1, -1, 1],
                        "weights": [1, 2, 3],
                        "targets": [0.1, -0.1, 0.2],
                        "loss": "tanh",
                        "alpha": 2,
                        "n": 2,
                        "slice": True,
                        "space": "map",
                        "escape": 30,
                        "precision": "double",
                    }
                ],
            ),
        }


def morphed(a, b, **options):
    result = qjulia.morph(a, b, 5, **options)
    return [*result.maps, result.flicker]


def finished(fit):
    for _ in fit:
        pass
    return fit.map


def opencl_queue():
    """A queue of pyopencl on the device that the tests use; None without pyopencl."""
    try:
        import pyopencl
    except ImportError:
        return None
    name = qjulia.Device("cpu").name
    devices = [one for platform in pyopencl.get_platforms() for one in platform.get_devices() if one.name == name]
    return pyopencl.CommandQueue(pyopencl.Context(devices[:1]))


def in_buffers(map, queue, at, **options):
    """The field at POINTS by BufferField."""
    pytest.importorskip("pyopencl")
    import pyopencl.array

    field = qjulia.BufferField(map, **{"device": qjulia.Device.from_opencl(queue), **options})
    real = np.float64 if options.get("precision") == "double" else np.float32
    host = np.zeros((4, field.stride(len(POINTS))), real)
    host[:3, : len(POINTS)] = POINTS.T
    points, values = pyopencl.array.to_device(queue, host), pyopencl.array.to_device(queue, host[0])
    field.at(points.data, len(POINTS), values.data, **at)
    return values.get()[: len(POINTS)]


def settings_of_kernel(figures):
    """What a kernel's figures say of how it was measured: times differ from run to run."""
    names = ("kernel", "samples", "factors", "iterations", "width", "precision", "work_is_at_most", "slots", "memory_bytes")
    return [repr(figures[name]) for name in names] + [str(len(figures["runs"]["seconds"]))]


def settings_of_profile(report):
    return [settings_of_kernel(figures) for figures in report["kernels"]] + sorted(report["made"])


def settings_of_tuning(report):
    return [report["precision"], str(report["tolerance"]), *sorted(report["made"])]


def energy_of(map, **options):
    energy = qjulia.Energy(map, POINTS, **options)
    return energy.value_and_gradient(energy.x0)


def arrays_of(thing):
    """The result of a call, as arrays that can be compared."""
    if isinstance(thing, qjulia.Map):
        return [np.frombuffer(thing.to_json().encode(), np.uint8)]
    if isinstance(thing, qjulia.Device):
        return [np.frombuffer(thing.layout.encode(), np.uint8)]
    if isinstance(thing, bytes):
        return [np.frombuffer(thing, np.uint8)]
    if isinstance(thing, (tuple, list)):
        return [array for part in thing for array in arrays_of(part)]
    if isinstance(thing, dict):
        return [array for part in thing.values() for array in arrays_of(part)]
    return [np.asarray(thing)]


def are_same(one, other):
    one, other = arrays_of(one), arrays_of(other)
    return len(one) == len(other) and all(np.array_equal(a, b) for a, b in zip(one, other))


@pytest.fixture(scope="module")
def calls(map, torus, device, tmp_path_factory):
    return Calls(map, torus, tmp_path_factory.mktemp("calls")).of(device)


def function_of(call):
    """ "render of a mesh" is a call of "render"."""
    return call.split(" ")[0]


def test_every_keyword_has_a_value(calls):
    stub = {name: keywords for name, keywords in keywords_in_stub().items() if keywords}
    given = {}
    for name, (_, keywords) in calls.items():
        given.setdefault(function_of(name), set()).update(*keywords)
    assert given == stub


@pytest.mark.parametrize(
    "name", [name for name, keywords in keywords_in_stub().items() if keywords] + ["render of a mesh"]
)
def test_keywords_are_accepted_and_change_what_comes(calls, name):
    call, several = calls[name]
    plain = call()
    for keywords in several:
        same_by_intent = set(keywords) <= {"device"}
        assert are_same(call(**keywords), plain) == same_by_intent, keywords


def test_a_height_is_along_the_up_axis_of_pictures(device):
    """Uses a map that does not say which way is up."""
    map = qjulia.quadratic_map((0.285, 0.485, 0, 0))
    assert map.up is None
    vertices = map.surface(24, height=10, device=device).vertices
    assert np.ptp(vertices[:, 1]) == pytest.approx(10)


def test_messages_name_the_keyword(map, device):
    with pytest.raises(qjulia.OptionError, match="^height: "):
        map.surface(16, height=-1, device=device)
    with pytest.raises(qjulia.OptionError, match="^size: "):
        qjulia.render(map, size=(8, 100000), device=device)
