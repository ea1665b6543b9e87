"""The stubs say what the package has, and the library's tables are what they list."""

import ast
import glob
import inspect
import os
import re
import subprocess
import sys

import numpy as np
import pytest

import qjulia
from qjulia import _core

FOLDER = os.path.dirname(qjulia.__file__)
EXAMPLES = os.path.join(os.path.dirname(__file__), "..", "..", "examples", "python")


def keywords_in_stub():
    """Names of keyword-only arguments by function, as "Map.field"; overloads together."""
    with open(os.path.join(FOLDER, "__init__.pyi")) as file:
        tree = ast.parse(file.read())
    found = {}

    def visit(body, prefix):
        for node in body:
            if isinstance(node, ast.ClassDef):
                visit(node.body, node.name + ".")
            elif isinstance(node, ast.FunctionDef):
                names = found.setdefault(prefix + node.name, set())
                names.update(argument.arg for argument in node.args.kwonlyargs)

    visit(tree.body, "")
    return found


def keywords_known(call):
    """What the function says it takes when it is given a keyword that it does not know."""
    with pytest.raises(TypeError, match="it takes") as raised:
        call(qqqqqq=1)
    return set(str(raised.value).split("it takes ")[1].split(", "))


PYTHONS_OWN = {"device", "on_progress", "on_stage", "on_evaluation", "layers", "framed", "faces", "jobs", "kernels", "host_name", "keep"}


def test_stubs_list_every_keyword(map, torus, device):
    stub = keywords_in_stub()
    points = np.zeros((1, 3))
    known = {
        "Map.with_knobs": keywords_known(map.with_knobs),
        "Map.field": keywords_known(lambda **k: map.field(points, **k)),
        "Map.orbits": keywords_known(lambda **k: map.orbits(points, **k)),
        "Map.sample": keywords_known(lambda **k: map.sample(**k)) - {"resolution"},
        "Map.surface": keywords_known(lambda **k: map.surface(**k)) - {"resolution"},
        "Map.surface_colors": keywords_known(lambda **k: map.surface_colors(torus, **k)),
        "Map.paint": keywords_known(lambda **k: map.paint(**k)),
        "Map.portals": keywords_known(lambda **k: map.portals(**k)) - {"count"},
        "Map.with_roughness": keywords_known(lambda **k: map.with_roughness(**k)),
        "morph": keywords_known(lambda **k: qjulia.morph(map, map, **k)) - {"steps"},
        "render": keywords_known(lambda **k: qjulia.render(map, **k)),
        "compare": keywords_known(lambda **k: qjulia.compare(map, torus, **k)),
        "fit": keywords_known(lambda **k: qjulia.fit(*torus, **k)),
        "Fit.__init__": keywords_known(lambda **k: qjulia.Fit(*torus, **k)),
        "shape": keywords_known(lambda **k: qjulia.shape(*torus, **k))
        | keywords_known(lambda **k: qjulia.shape(*torus, versor="noise", **k)),
        "signed_distance": keywords_known(lambda **k: qjulia.signed_distance(torus, points, **k)),
        "Energy.__init__": keywords_known(lambda **k: qjulia.Energy(map, points, **k)),
        "BufferField.__init__": keywords_known(
            lambda **k: qjulia.BufferField(map, device=qjulia.Device("cpu"), **k)
        ),
        "profile": keywords_known(qjulia.profile),
        "tune": keywords_known(qjulia.tune),
        "profile_launch": keywords_known(lambda **k: qjulia.profile_launch("f", print, **k)),
    }
    for name, keywords in known.items():
        assert stub[name] - PYTHONS_OWN == keywords - PYTHONS_OWN - {"versor"} | (
            {"versor"} if name == "shape" else set()
        ), name


def test_stubs_have_the_keywords_of_the_tables():
    sys.path.append(os.path.join(os.path.dirname(__file__), ".."))
    import stubs

    with open(os.path.join(FOLDER, "__init__.pyi")) as file:
        text = file.read()
    assert stubs.with_keywords(text) == text, "cmake --build --preset release --target reference"
    assert text.count("# end of ") == 18


TABLES = {
    "fit_settings": qjulia.fit,
    "surface_settings": qjulia.Map.surface,
    "print_settings": qjulia.Map.surface,
    "selection_settings": qjulia.Map.surface,
    "sample_settings": qjulia.Map.sample,
    "compare_settings": qjulia.compare,
    "paint_settings": qjulia.Map.paint,
    "exact_settings": qjulia.shape,
    "picture_settings": qjulia.render,
    "knob_table": qjulia.Map.with_knobs,
    "portal_settings": qjulia.Map.portals,
    "target_settings": qjulia.Map.with_roughness,
    "morph_settings": qjulia.morph,
    "profile_settings": qjulia.profile,
    "tune_settings": qjulia.tune,
}


def test_help_names_every_setting_with_its_default_and_range():
    for table, function in TABLES.items():
        parameters = inspect.signature(function).parameters
        for row in getattr(_core, table)():
            name = row["name"]
            if (table, name) == ("compare_settings", "n"):
                continue  # several are compared
            assert parameters[name].default == row["default"], (table, name)
            parameters_text = function.__doc__.split("Returns\n")[0]
            (line,) = re.findall(rf"(?m)^ *{name} : (.*)$", parameters_text)
            assert row["unit"] in line, (table, name)
            assert "optional" in line if row["default"] is None else repr(row["default"]) in line
            if row["range"]:
                words = " ".join(parameters_text.split())
                assert row["range"][1:] in words, (table, name)


def test_settings_have_their_usual_values(torus):
    """A call with every default of the signature says what a call without any says."""
    mesh = qjulia.read_mesh(os.path.join(os.path.dirname(__file__), "..", "..", "tests", "data", "icosahedron.obj"))
    usual = {
        name: parameter.default
        for name, parameter in inspect.signature(qjulia.shape).parameters.items()
        if name in {row["name"] for row in _core.exact_settings()}
    }
    assert set(usual) == {row["name"] for row in _core.exact_settings()}
    usual["resolution"] = 32
    said, unsaid = qjulia.shape(mesh, **usual), qjulia.shape(mesh, resolution=32)
    assert said.field(np.zeros((1, 3)), n=2) == unsaid.field(np.zeros((1, 3)), n=2)


def test_everything_public_is_documented():
    for name in qjulia.__all__:
        thing = getattr(qjulia, name)
        if name == "__version__":
            continue
        assert thing.__doc__, name
        assert thing.__module__ == "qjulia", name
        if isinstance(thing, type) and not issubclass(thing, Exception):
            for member, value in vars(thing).items():
                if not member.startswith("_") and (callable(value) or isinstance(value, property)):
                    assert value.__doc__, f"{name}.{member}"


def run_mypy(*arguments, tmp_path):
    pytest.importorskip("mypy")
    path = os.path.dirname(FOLDER)
    done = subprocess.run(
        [sys.executable, "-m", *arguments],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        env={**os.environ, "MYPYPATH": path, "PYTHONPATH": path},
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_stubs_and_examples_are_clean(tmp_path):
    scripts = sorted(glob.glob(os.path.join(os.path.abspath(EXAMPLES), "*.py")))
    options = ["mypy", "--strict", "--ignore-missing-imports"]
    run_mypy(*options, os.path.join(FOLDER, "__init__.pyi"), tmp_path=tmp_path)
    for script in scripts:
        run_mypy(*options, script, tmp_path=tmp_path)


def test_stubs_agree_with_the_package(tmp_path):
    allowed = tmp_path / "allowed"
    # mypy 1.0 says of every TypedDict that its metaclass differs, and Python 3.13 gives it members of its own.
    members = "(\\.__(mutable|readonly)_keys__)?"
    allowed.write_text(f"qjulia\\._.*\nqjulia\\.(Comparison|DeviceInfo){members}\n")
    options = ["--allowlist", str(allowed), "--ignore-unused-allowlist"]
    run_mypy("mypy.stubtest", "qjulia", *options, tmp_path=tmp_path)


def test_dicts_are_of_their_types(map, torus, device, tmp_path):
    (row,) = qjulia.compare(map, torus, n=1, resolution=16, device=device)
    assert set(row) == set(qjulia.Comparison.__required_keys__)
    (row,) = qjulia.compare(map, torus, n=1, resolution=16, limbs=True, device=device)
    assert set(row) == set(qjulia.Comparison.__annotations__)
    assert set(qjulia.devices()[0]) == set(device.info) == set(qjulia.DeviceInfo.__annotations__)
    # A key that is not there, and a value taken for another type, are errors; what is right is none.
    script = tmp_path / "uses.py"
    right = """
import qjulia
map = qjulia.load("a.json")
name: str = qjulia.devices()[0]["name"]
memory: int = qjulia.Device().info["global_memory"]
iou: float = qjulia.compare(map, "a.obj")[0]["iou"]
row: qjulia.Comparison = qjulia.compare(map, "a.obj", limbs=True)[0]
kept: int = row["limbs_kept"]
mesh, index = qjulia.read_mesh("a.obj", return_index=True)
faces = qjulia.read_mesh("a.obj").faces
"""
    script.write_text(right)
    run_mypy("mypy", "--strict", str(script), tmp_path=tmp_path)
    for wrong in (
        'qjulia.devices()[0]["nmae"]',
        'memory = qjulia.devices()[0]["name"]',
        'row["iuo"]',
        'name = row["iou"]',
    ):
        script.write_text(right + wrong + "\n")
        with pytest.raises(AssertionError, match=f"uses.py:{right.count(chr(10)) + 1}: error"):
            run_mypy("mypy", "--strict", str(script), tmp_path=tmp_path)
