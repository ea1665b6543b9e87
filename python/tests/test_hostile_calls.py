"""Calls that no function can make sense of: each raises, and none ends the process."""

import threading

import numpy as np
import pytest

import qjulia

EXPECTED = (TypeError, ValueError, OverflowError, MemoryError, qjulia.Error)

# What is given in place of a number, a word, an array.
JUNK = [
    "",
    "x",
    b"x",
    -1,
    0,
    2**40,
    10**30,
    -(10**30),
    1e300,
    float("nan"),
    float("inf"),
    1j,
    [],
    {},
    (),
    object(),
    [[]],
    [[1]],
    np.zeros((2, 2)),
    np.array("x"),
    np.array([object()]),
    "\ud800",
    True,
    lambda: 1,
    ValueError,
    np.float64("nan"),
    np.zeros((0, 3)),
    "\0",
]


def calls(map, torus, device):
    vertices, faces = torus
    good = np.zeros((3, 3))
    functions = {
        "field's points": lambda x: map.field(x, device=device),
        "field's n": lambda x: map.field(good, n=x, device=device),
        "field's escape": lambda x: map.field(good, escape=x, device=device),
        "field's space": lambda x: map.field(good, space=x, device=device),
        "orbits' n": lambda x: map.orbits(good, n=x, device=device),
        "vertices": lambda x: qjulia.shape(x, faces, resolution=32, device=device),
        "faces": lambda x: qjulia.shape(vertices, faces=x, resolution=32, device=device),
        "a mesh": lambda x: qjulia.compare(map, x, n=1, resolution=8, device=device),
        "compare's n": lambda x: qjulia.compare(map, torus, n=x, resolution=8, device=device),
        "factors": lambda x: qjulia.fit(*torus, factors=x, max_evaluations=1, device=device),
        "seed": lambda x: qjulia.fit(*torus, factors=8, seed=x, max_evaluations=1, device=device),
        "detail": lambda x: map.with_knobs(detail=x, device=device),
        "phase": lambda x: map.with_knobs(phase=x, device=device),
        "rotate": lambda x: map.with_knobs(rotate=x, device=device),
        "drift": lambda x: map.with_knobs(drift=x, device=device),
        "resolution": lambda x: map.sample(x, n=1, device=device),
        "box": lambda x: map.sample(4, n=1, box=x, device=device),
        "refine": lambda x: map.surface(4, n=1, refine=x, device=device),
        "coloured mesh": lambda x: map.surface_colors(x, n=1, device=device),
        "colours' material": lambda x: map.surface_colors(torus, material=x, n=1, device=device),
        "size": lambda x: qjulia.render(map, size=x, device=device),
        "palette": lambda x: qjulia.render(map, size=(4, 4), palette=x, device=device),
        "cut": lambda x: qjulia.render(map, size=(4, 4), cut=x, device=device),
        "new factors": lambda x: map.with_factors(x),
        "a path": lambda x: qjulia.load(x),
        "a map's text": lambda x: qjulia.Map.from_json(x),
        "an image": lambda x: qjulia.save_png(x, "/nowhere/image.png"),
        "a device": lambda x: map.field(good, device=x),
        "a device's name": lambda x: qjulia.Device(x),
        "balls": lambda x: map.paint(balls=x, device=device),
        "ramp": lambda x: map.paint(ramp=x, device=device),
        "a morph's steps": lambda x: qjulia.morph(map, map, x, device=device),
        "a morph's end": lambda x: qjulia.morph(map, x, 2, device=device),
        "flicker_cells": lambda x: qjulia.morph(map, map, 2, flicker_cells=x, device=device),
        "grooves": lambda x: qjulia.with_versor_of(map, x, device=device),
        "a roughness' mesh": lambda x: map.with_roughness(x, target_area=1.1, target_resolution=64, device=device),
        "count": lambda x: qjulia.sample_surface(torus, x),
        "samples": lambda x: qjulia.Energy(map, x, device=device),
        "sides": lambda x: qjulia.Energy(map, good, sides=x, device=device),
        "loss": lambda x: qjulia.Energy(map, good, loss=x, device=device),
        "unknowns": lambda x: qjulia.Energy(map, good, device=device).value(x),
        "c": lambda x: qjulia.quadratic_map(x),
        "a queue": lambda x: qjulia.Device.from_opencl(x),
        "a buffer": lambda x: qjulia.BufferField(map, device=device).at(x, 3, x),
        "a stride": lambda x: qjulia.BufferField(map, device=device).stride(x),
        "kernels": lambda x: qjulia.profile(kernels=x, sample_points=64, time_limit=1e-9, device=device),
        "jobs": lambda x: qjulia.profile(jobs=x, sample_points=64, time_limit=1e-9, device=device),
        "sample_points": lambda x: qjulia.profile(sample_points=x, time_limit=1e-9, kernels="energy", device=device),
        "programs": lambda x: qjulia.doctor(programs=("reduce.cl", x), device=device),
        "a launch": lambda x: qjulia.profile_launch("f", x, repeats=1, device=device),
        "a launch's slots": lambda x: qjulia.profile_launch("f", int, slots=x, repeats=1, device=device),
    }
    # A launch that is accepted first measures the device for seconds.
    accepted = {
        "a launch": callable,
        "a launch's slots": lambda x: type(x) in (int, float) and 0 <= x < np.inf,
    }
    return [
        (f"{name} = {value!r:.40}", function, value)
        for name, function in functions.items()
        for value in JUNK
        if not (name in accepted and accepted[name](value))
    ]


def test_no_call_ends_the_process(map, torus, device):
    given = calls(map, torus, device)
    assert len(given) > 200
    raised = 0
    for name, function, value in given:
        try:
            function(value)
        except EXPECTED as error:
            raised += 1
            assert str(error), name
        except OSError:
            raised += 1
    # What is left means something: 0 or 2**40 may be a seed.
    assert raised > 0.8 * len(given)


MESSAGES = [
    (
        lambda m, t, d: m.field(np.zeros((5, 2)), device=d),
        ValueError,
        r"points must have shape \(N, 3\) or \(N, 4\), not \(5, 2\)",
    ),
    (
        lambda m, t, d: m.field(np.zeros(5), device=d),
        ValueError,
        r"points must have shape .* \(5,\)",
    ),
    (lambda m, t, d: m.field(np.zeros((5, 4)), device=d), ValueError, 'space="map"'),
    (
        lambda m, t, d: m.field([[0, 0, 0], [0, np.nan, 0]], device=d),
        ValueError,
        r"points\[1\] is not finite",
    ),
    (
        lambda m, t, d: m.field(np.zeros((2, 3), complex), device=d),
        TypeError,
        "points .*complex128",
    ),
    (
        lambda m, t, d: m.field(np.zeros((2, 3)), n=2.0, device=d),
        TypeError,
        "n must be a whole number",
    ),
    (lambda m, t, d: m.field(np.zeros((2, 3)), n=17, device=d), ValueError, "n: .*1 to 16"),
    (lambda m, t, d: m.field(np.zeros((2, 3)), iterations=2, device=d), TypeError, "mean 'n'"),
    (
        lambda m, t, d: qjulia.fit(t[0], t[1] + 500, device=d),
        ValueError,
        r"faces\[\d+\] has the index \d+, and there are 512 vertices",
    ),
    (
        lambda m, t, d: qjulia.fit(t[0], t[1] - 1, device=d),
        ValueError,
        r"faces\[\d+\] has the index -1",
    ),
    (
        lambda m, t, d: qjulia.fit(t[0], t[1][:, :2], device=d),
        ValueError,
        r"faces must have shape \(N, 3\)",
    ),
    (lambda m, t, d: qjulia.fit(t[0], t[1].astype(float), device=d), TypeError, "faces .* whole"),
    (
        lambda m, t, d: qjulia.fit(np.full((3, 3), np.inf), [[0, 1, 2]], device=d),
        ValueError,
        "vertices.* not finite",
    ),
    (lambda m, t, d: qjulia.fit(t[0], device=d), TypeError, "faces are missing"),
    (lambda m, t, d: qjulia.fit(t[0][:0], t[1][:0], device=d), qjulia.InputError, "."),
    (lambda m, t, d: qjulia.fit("nowhere.obj", device=d), qjulia.InputError, "nowhere.obj"),
    (lambda m, t, d: qjulia.fit(*t, factor=9, device=d), TypeError, "did you mean 'factors'"),
    (lambda m, t, d: qjulia.fit(*t, factors=3, device=d), qjulia.OptionError, "factors: 3 .* 8 to"),
    (lambda m, t, d: qjulia.fit(*t, detail="fine", device=d), ValueError, "detail must be one of"),
    (lambda m, t, d: qjulia.morph(m, m, 1, device=d), qjulia.OptionError, "steps: 1 .*2 to 9999"),
    (lambda m, t, d: qjulia.morph(m, m, flicker_cells=3, device=d), qjulia.OptionError, "flicker_cells: 3 .*8 to 256"),
    (lambda m, t, d: qjulia.morph(m, m, 2, flicker=9, device=d), TypeError, "did you mean 'flicker_cells'"),
    (lambda m, t, d: qjulia.morph(m, m.to_json(), device=d), TypeError, "b must be a Map, not str"),
    (lambda m, t, d: qjulia.morph(m, qjulia.quadratic_map((0, 0.5, 0, 0)), device=d), qjulia.InputError, "fit"),
    (lambda m, t, d: qjulia.with_versor_of(m, None, device=d), TypeError, "other must be a Map"),
    (lambda m, t, d: m.with_roughness(device=d), qjulia.InputError, "give an area or a dimension"),
    (
        lambda m, t, d: m.with_roughness(target_area=2, target_dimension=2.1, device=d),
        qjulia.OptionError,
        "target_dimension: .*give one of them",
    ),
    (
        lambda m, t, d: m.with_roughness(target_area=90, target_resolution=64, device=d),
        qjulia.OptionError,
        "target_area: 90 cannot be reached: .* at most",
    ),
    (lambda m, t, d: m.with_roughness(faces=t[1], target_area=2, device=d), TypeError, "without vertices"),
    (lambda m, t, d: m.with_knobs(detial=0.1, device=d), TypeError, "did you mean 'detail'"),
    (lambda m, t, d: m.with_knobs(steepness=200, device=d), qjulia.InputError, "steepness: .*100"),
    (
        lambda m, t, d: m.with_knobs(phase=[1, 0, 0], device=d),
        ValueError,
        "phase must be 4 numbers",
    ),
    (lambda m, t, d: qjulia.render(m, size=(0, 4), device=d), ValueError, "size: 0"),
    (lambda m, t, d: qjulia.render(m, material="gold", device=d), ValueError, "'clay'"),
    (lambda m, t, d: qjulia.render(m, zom=2, device=d), TypeError, "did you mean 'zoom'"),
    (
        lambda m, t, d: qjulia.Energy(m, np.zeros((2, 3)), sides=[1], device=d),
        ValueError,
        "sides must have length 2, not 1",
    ),
    (
        lambda m, t, d: qjulia.Energy(m, np.zeros((2, 3)), device=d).value([1]),
        ValueError,
        "x must have length 121, not 1",
    ),
    (
        lambda m, t, d: qjulia.Energy(
            qjulia.quadratic_map([0, 0, 0, 0]), np.zeros((2, 3)), device=d
        ),
        qjulia.InputError,
        "quadratic",
    ),
    (lambda m, t, d: qjulia.Device("no such device"), qjulia.NoDeviceError, "no such device"),
    (lambda m, t, d: qjulia.Device("cpu", layout="x"), qjulia.InputError, "x"),
    (lambda m, t, d: m.save("/nowhere/map.qjulia.json"), OSError, "/nowhere"),
    (lambda m, t, d: qjulia.Map(), TypeError, "qjulia.fit"),
]


@pytest.mark.parametrize("call, kind, message", MESSAGES)
def test_messages_name_what_is_wrong(map, torus, device, call, kind, message):
    with pytest.raises(kind, match=message):
        call(map, torus, device)


def test_errors_are_of_the_kinds_that_python_knows():
    assert issubclass(qjulia.OptionError, qjulia.InputError)
    assert issubclass(qjulia.InputError, ValueError)
    assert issubclass(qjulia.NoDeviceError, RuntimeError)
    assert issubclass(qjulia.OutputError, OSError)
    assert issubclass(qjulia.DeviceError, qjulia.Error)


def test_calls_from_threads_that_end(map, torus, device):
    """A thread that ends takes nothing with it that another needs."""
    kept = []
    thread = threading.Thread(
        target=lambda: kept.append(qjulia.Energy(map, np.ones((4, 3)), device=device))
    )
    thread.start()
    thread.join()
    assert np.isfinite(kept[0].value(kept[0].x0))


@pytest.mark.parametrize(
    "value, name",
    [
        ({"a": float("inf")}, r"provenance\['a'\] is inf"),
        ({"a": [{"b": float("nan")}]}, r"provenance\['a'\]\[0\]\['b'\] is nan"),
        ({"a": 10**400}, r"provenance\['a'\] is a whole number"),
        ({"a": {1, 2}}, r"provenance\['a'\] is of the type set"),
        ({"a": np.float32(1)}, r"provenance\['a'\] is of the type float32"),
        ({"a": "\ud800"}, r"provenance\['a'\] is '.ud800'"),
        ({"\ud800": 1}, "a key of provenance"),
        ({(1, 2): 1}, r"provenance is a dict with the key \(1, 2\)"),
        ([1, 2], "provenance must be a dict, not list"),
        (None, "provenance must be a dict, not NoneType"),
    ],
)
def test_provenance_that_no_file_holds_is_refused_by_its_key(map, value, name):
    with pytest.raises(qjulia.InputError, match=name):
        map.with_provenance(value)


def test_provenance_that_is_accepted_can_be_written_and_read(map, tmp_path):
    deep, value = [], {"a": [1, -0.5, True, None, "\u00e9"], "b": {"c": (1, 2)}}
    for level in range(58):
        deep = [deep]
    value["deep"] = deep
    map.with_provenance(value).save(tmp_path / "map.json")
    read = qjulia.load(tmp_path / "map.json").provenance
    assert read["a"] == value["a"] and read["b"] == {"c": [1, 2]} and read["deep"] == deep
    cycle = {}
    cycle["a"] = cycle
    for wrong in (cycle, {"a": [[deep]]}):
        with pytest.raises(qjulia.InputError, match="nested more than"):
            map.with_provenance(wrong)
