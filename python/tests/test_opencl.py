"""Contexts, queues and buffers of pyopencl, and the notebook that uses them."""

import base64
import gc
import json
import os

import numpy as np
import pytest

import qjulia

cl = pytest.importorskip("pyopencl")
pytest.importorskip("pyopencl.array")

NOTEBOOK = os.path.join(os.path.dirname(__file__), "..", "..", "examples", "python", "one_context.ipynb")
POINTS = np.random.default_rng(1).uniform(-1, 1, (1000, 4)).astype(np.float32)


def pocl_device():
    (platform,) = (one for one in cl.get_platforms() if one.name == "Portable Computing Language")
    return platform.get_devices()[0]


@pytest.fixture
def queue():
    return cl.CommandQueue(cl.Context([pocl_device()]))


def arrays(queue, stride, real=np.float32):
    """POINTS as four arrays on the device, and place for four arrays of results."""
    host = np.zeros((4, stride), real)
    host[:, : len(POINTS)] = POINTS.T
    return cl.array.to_device(queue, host), cl.array.zeros(queue, (4, stride), real)


@pytest.mark.parametrize("precision, real", [("single", np.float32), ("double", np.float64)])
def test_a_field_in_buffers_is_that_at_points(map, queue, precision, real):
    device = qjulia.Device.from_opencl(queue)
    assert device.name == pocl_device().name
    field = qjulia.BufferField(map, precision=precision, escape=15, device=device)
    points, results = arrays(queue, field.stride(len(POINTS)), real)
    plain = {"space": "map", "precision": precision, "escape": 15, "device": device}
    for n in (1, 3):
        field.at(points.data, len(POINTS), results.data, n=n)
        values = map.field(POINTS, n=n, **plain)
        assert np.array_equal(results.get()[0, : len(POINTS)], values.astype(real))
        assert len(np.unique(values)) > 900
    field.gradient_at(points.data, len(POINTS), results.data)
    _, gradients = map.field(POINTS, gradient=True, **plain)
    assert np.array_equal(results.get()[:, : len(POINTS)].T, gradients.astype(real))


def test_all_of_qjulia_works_in_the_context(torus, queue):
    """A fit, a surface and a picture there are those of the device as qjulia opens it."""
    mine = qjulia.Device.from_opencl(queue)
    theirs = qjulia.Device("cpu", tuned=False)
    found = []
    for device in (mine, theirs):
        map = qjulia.fit(*torus, factors=8, max_evaluations=5, device=device).map
        mesh = map.surface(16, device=device)
        found.append((map, mesh.vertices.tobytes(), qjulia.render(map, size=(16, 12), device=device).tobytes()))
    assert found[0] == found[1]


def test_handles_are_retained_and_released(map, queue):
    def use():
        device = qjulia.Device.from_opencl(queue)
        held = queue.reference_count, queue.context.reference_count
        field = qjulia.BufferField(map, device=device)
        points, results = arrays(queue, field.stride(len(POINTS)))
        field.at(points.data, len(POINTS), results.data)
        queue.finish()
        return held

    use()  # drivers keep references of their own after the first launch
    gc.collect()
    before = queue.reference_count, queue.context.reference_count
    held = use()
    gc.collect()
    assert (queue.reference_count, queue.context.reference_count) == before
    assert held[0] > before[0] and held[1] > before[1]


def test_a_device_outlives_the_users_own_handles(map):
    device = qjulia.Device.from_opencl(cl.CommandQueue(cl.Context([pocl_device()])))
    gc.collect()
    values = map.field(POINTS, space="map", device=device)
    assert np.array_equal(values, map.field(POINTS, space="map", device=qjulia.Device("cpu", tuned=False)))


def test_a_launch_of_ones_own_is_profiled_there(queue):
    device = qjulia.Device.from_opencl(queue)
    source = "kernel void tripled(global float* x) { x[get_global_id(0)] *= 3; }"
    kernel = cl.Program(queue.context, source).build().tripled
    count = 1 << 22
    data = cl.array.to_device(queue, np.ones(count, np.float32))

    def run():
        kernel(queue, (count,), None, data.data)
        queue.finish()

    figures = qjulia.profile_launch("tripled", run, slots=count, bytes=8 * count, repeats=3, device=device)
    assert figures["limit"] == "memory" and figures["limited_by"]
    # One run more than those timed, and others while the code is sampled.
    assert np.log(data.get()[0]) / np.log(3) >= 4


def mistakes(map, queue):
    """What each call must raise, and how its message begins."""
    device = qjulia.Device.from_opencl(queue)
    field = qjulia.BufferField(map, device=device)
    points, results = arrays(queue, field.stride(len(POINTS)))
    at = {"points": points.data, "count": len(POINTS), "field": results.data}
    out_of_order = cl.command_queue_properties.OUT_OF_ORDER_EXEC_MODE_ENABLE
    foreign = cl.Buffer(cl.Context([pocl_device()]), cl.mem_flags.READ_WRITE, 1 << 16)
    small = cl.Buffer(queue.context, cl.mem_flags.READ_WRITE, 16)
    pixel = cl.ImageFormat(cl.channel_order.RGBA, cl.channel_type.FLOAT)
    image = cl.Image(queue.context, cl.mem_flags.READ_WRITE, pixel, shape=(64, 64))
    own = qjulia.Device.from_opencl
    return [
        (lambda: own(queue.context), TypeError, "queue must be a pyopencl.CommandQueue, not Context"),
        (lambda: own(points.data), TypeError, "queue must be a pyopencl.CommandQueue, not Buffer"),
        (lambda: own(queue.int_ptr), TypeError, "queue must be a pyopencl.CommandQueue, not int"),
        (
            lambda: own(cl.CommandQueue(queue.context, properties=out_of_order)),
            qjulia.InputError,
            "the queue runs commands out of order; make one without",
        ),
        (lambda: field.at(**{**at, "points": queue}), TypeError, "points must be a pyopencl.Buffer, not CommandQueue"),
        (lambda: field.at(**{**at, "points": points}), TypeError, "points must be a pyopencl.Buffer, not Array; give its"),
        (lambda: field.at(**{**at, "field": POINTS}), TypeError, "field must be a pyopencl.Buffer, not ndarray"),
        (lambda: field.at(**{**at, "points": small}), qjulia.OptionError, "points: has 16 bytes; give at least 16128"),
        (lambda: field.at(**{**at, "field": small}), qjulia.OptionError, "field: has 16 bytes; give at least 4032"),
        (lambda: field.at(**{**at, "field": foreign}), qjulia.OptionError, "field: belongs to another context"),
        (lambda: field.at(**{**at, "points": image}), qjulia.OptionError, "points: is an image; give a buffer"),
        (lambda: field.at(**at, n=17), qjulia.OptionError, "n: 17 is out of range; give 1 to 16"),
        (lambda: field.at(**{**at, "count": 2**31}), qjulia.OptionError, "count: 2147483648 are too many"),
        (lambda: field.at(**{**at, "count": -1}), ValueError, "count "),
        (lambda: field.stride(1.5), TypeError, "count "),
        (
            lambda: field.gradient_at(points.data, len(POINTS), small),
            qjulia.OptionError,
            "gradient: has 16 bytes; give at least 16128",
        ),
        (lambda: qjulia.BufferField(map, device="cpu"), TypeError, "device must be a Device of Device.from_opencl"),
        (lambda: qjulia.BufferField("map", device=device), TypeError, "map must be a Map, not str"),
        (lambda: qjulia.BufferField(map, device=device, escpe=3), TypeError, r"BufferField\(\) has no argument 'escpe'"),
    ]


def test_mistakes_are_named(map, queue):
    for call, error, message in mistakes(map, queue):
        with pytest.raises(error, match=f"^{message}"):
            call()


def text_of(cell):
    return "".join(output["data"].get("text/plain", "") for output in cell["outputs"] if "data" in output)


def test_the_notebook_runs(tmp_path, monkeypatch):
    """Every cell, in a kernel of its own, with what it computes compared with qjulia's own device."""
    pytest.importorskip("ipykernel")
    nbclient = pytest.importorskip("nbclient")
    import nbformat

    for name in ("IPYTHONDIR", "JUPYTER_RUNTIME_DIR", "JUPYTER_CONFIG_DIR"):
        monkeypatch.setenv(name, str(tmp_path / name))
    monkeypatch.setenv("PYOPENCL_CTX", pocl_device().platform.name)
    monkeypatch.delenv("MPLBACKEND", raising=False)  # notebooks have one of their own
    notebook = nbformat.read(NOTEBOOK, 4)
    assert not any(cell.get("outputs") for cell in notebook.cells), "clear its outputs before you commit it"
    check = """
import json
map.save("map.qjulia.json")
np.save("values.npy", values.get()[:count])
np.save("points.npy", points.get()[:, :count])
print(json.dumps({"queues": [queue.int_ptr, is_inside.queue.int_ptr], "share": share, "figures": figures}))
"""
    notebook.cells.append(nbformat.v4.new_code_cell(check))
    # The kernel is this Python, whatever the machine's list of kernels says.
    manager = __import__("jupyter_client").KernelManager(kernel_name="python3")
    nbclient.NotebookClient(
        notebook, km=manager, timeout=300, resources={"metadata": {"path": str(tmp_path)}}
    ).execute()
    said = json.loads("".join(output["text"] for output in notebook.cells[-1]["outputs"]))

    map = qjulia.load(tmp_path / "map.qjulia.json")
    points, values = np.load(tmp_path / "points.npy"), np.load(tmp_path / "values.npy")
    side = 256
    column = (np.arange(side) + 0.5) / side
    x, y = np.meshgrid(3.2 * column - 1.6, 1.6 - 3.2 * column)
    expected = map.to_map(np.stack([x, y, np.zeros_like(x)], -1).reshape(-1, 3))
    assert np.allclose(points[:3].T, expected, atol=1e-6) and np.all(points[3] == np.float32(map.slice))
    own = map.field(points.T, n=4, space="map", device=qjulia.Device("cpu", tuned=False))
    assert np.array_equal(values, own.astype(np.float32))
    assert said["share"] == np.mean(values < np.float32(map.surface_level))
    # The ring that the torus cuts out of the plane, and no more than a tenth of the square besides.
    ring = np.abs(np.hypot(x, y).ravel() - 1) < 0.35
    assert np.mean((values < map.surface_level) != ring) < 0.1
    assert said["queues"][0] == said["queues"][1]
    assert said["figures"]["median_seconds"] > 0

    (image,) = (
        output["data"]["image/png"] for cell in notebook.cells for output in cell.get("outputs", [])
        if "image/png" in output.get("data", {})
    )
    picture = base64.b64decode(image)
    assert picture.startswith(b"\x89PNG") and len(picture) > 10_000
    assert "qjulia.Device" in text_of(notebook.cells[3])
