"""The examples run, at small sizes, and write what they say."""

import os
import re
import subprocess
import sys
import types

import pytest

import qjulia
from conftest import torus_mesh, write_obj

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
EXAMPLES = os.path.join(ROOT, "examples", "python")


@pytest.fixture
def run(tmp_path, torus_file):
    def run(script, *arguments):
        done = subprocess.run(
            [sys.executable, os.path.join(EXAMPLES, script), *map(str, arguments)],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            timeout=300,
            env={**os.environ, "MPLBACKEND": "Agg", "QJULIA_DEVICE": "cpu"},
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    return run


def test_every_example_is_tested():
    with open(__file__) as file:
        text = file.read()
    for script in os.listdir(EXAMPLES):
        assert script in text or not script.endswith(".py"), script
    with open(os.path.join(os.path.dirname(__file__), "test_opencl.py")) as file:
        text = file.read()
    for notebook in os.listdir(EXAMPLES):
        assert notebook in text or not notebook.endswith(".ipynb"), notebook


def test_fit_and_draw(run, torus_file, tmp_path):
    assert "wide band" in run(
        "fit_and_draw.py", torus_file, "--factors", 8, "--width", 80, "--schedule", "fast"
    )
    assert len(qjulia.read_mesh(tmp_path / "shape.ply").faces) > 100
    assert (tmp_path / "shape.png").read_bytes().startswith(b"\x89PNG")
    assert len(qjulia.load(tmp_path / "shape.qjulia.json").factors) == 8


def test_own_optimiser(run, torus_file, tmp_path):
    pytest.importorskip("scipy")
    said = run(
        "own_optimiser.py", torus_file, "--factors", 24, "--samples", 3000, "--iterations", 80
    )
    assert float(said.split("IoU ")[1]) > 0.7
    assert len(qjulia.load(tmp_path / "own.qjulia.json").factors) == 24


def test_knobs(run, torus_file, tmp_path):
    pytest.importorskip("matplotlib")
    run("knobs.py", torus_file, "--steps", 2, "--resolution", 16)
    assert (tmp_path / "knobs.png").stat().st_size > 1000


def test_idea(run, map, torus_file, tmp_path):
    pytest.importorskip("matplotlib")
    map.save(tmp_path / "torus.qjulia.json")
    run("idea.py", torus_file, "torus.qjulia.json", "idea.png", "--size", 48)
    assert (tmp_path / "idea.png").stat().st_size > 1000


def test_looks(run, map, tmp_path):
    pytest.importorskip("matplotlib")
    map.save(tmp_path / "torus.qjulia.json")
    said = run("looks.py", "torus.qjulia.json", "torus.qjulia.json", "looks.png", "--size", 16, 12)
    assert said.split() == [look for look in qjulia.looks() if look != "clay"]
    assert len(set(qjulia.looks().values())) >= 16
    assert (tmp_path / "looks.png").stat().st_size > 1000


def test_all_devices(run, torus_file, tmp_path):
    write_obj(tmp_path / "other.obj", *torus_mesh(minor=0.5))
    said = run(
        "all_devices.py", torus_file, tmp_path / "other.obj", "--factors", 8, "--schedule", "fast"
    )
    assert said.count("IoU") == 2
    assert qjulia.load(tmp_path / "other.qjulia.json").kind == "rational"


def test_morph(run, torus_file, tmp_path):
    pytest.importorskip("scipy")
    write_obj(tmp_path / "other.obj", *torus_mesh(minor=0.5))
    run(
        "morph.py",
        torus_file,
        tmp_path / "other.obj",
        "--factors",
        8,
        "--frames",
        2,
        "--width",
        32,
        "--schedule",
        "fast",
    )
    assert (tmp_path / "morph.png").stat().st_size > 500


def test_orbits(run, map, tmp_path):
    map.save(tmp_path / "torus.qjulia.json")
    run("orbits.py", "torus.qjulia.json", "--width", 60)
    assert (tmp_path / "orbits.png").stat().st_size > 1000


def test_the_documentation_runs(torus, tmp_path, monkeypatch):
    """All of docs/guide/python.md, one block after the other, with smaller numbers."""
    names = {}
    pytest.importorskip("numpy")
    pytest.importorskip("scipy.optimize")
    pytest.importorskip("scipy.spatial")
    pytest.importorskip("matplotlib")
    pytest.importorskip("pyopencl")
    with open(os.path.join(ROOT, "docs", "guide", "python.md")) as file:
        blocks = re.findall("```python\n(.*?)```", file.read(), re.DOTALL)
    assert len(blocks) >= 5
    smaller = {
        "factors=331": "factors=16, max_evaluations=30",
        "(256": "(24",
        "size=(640, 480)": "size=(64, 48)",
        "sample(128)": "sample(12)",
        "20_000": "500",
        "n=[1, 6]": "n=[1, 6], resolution=16",
        "resolution=64": "resolution=16",
        "[0.005, 0.01, 0.02, 0.03]": "[0.01, 0.03]",
    }
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    write_obj(tmp_path / "bunny.obj", *torus)

    pandas = types.ModuleType("pandas")  # which need not be installed
    pandas.DataFrame = list
    monkeypatch.setitem(sys.modules, "pandas", pandas)
    for block in blocks:
        for given, used in smaller.items():
            block = block.replace(given, used)
        exec(block, names)
    assert names["image"].shape == (48, 64, 3)
    assert names["orbits"].shape == (1000, 7, 4)
    assert (tmp_path / "iou.png").stat().st_size > 1000
    assert names["better"].kind == "rational" and len(names["table"]) == 2
