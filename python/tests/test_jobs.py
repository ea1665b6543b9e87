"""Jobs: files are made again, and jobs are run, as by the command."""

import json
import warnings

import pytest

import qjulia


@pytest.fixture(scope="module")
def map_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("maps") / "set.qjulia.json"
    qjulia.quadratic_map((-0.2, 0.6, 0.2, 0.2)).save(path)
    return path


@pytest.fixture(scope="module")
def pictured(map_file, tmp_path_factory):
    """A small picture, made by a job."""
    folder = tmp_path_factory.mktemp("jobs")
    job = {
        "command": "render",
        "options": {"map": str(map_file), "size": "48x36", "samples": 1, "zoom": 2},
    }
    picture = folder / "picture.png"
    report = qjulia.run(job, picture)
    assert report["width"] == 48
    return picture


def test_a_picture_is_made_again(pictured, map_file, tmp_path):
    again = tmp_path / "again.png"
    qjulia.run(pictured, again, inputs=map_file.parent)
    assert again.read_bytes() == pictured.read_bytes()


def test_changes_change_it(pictured, map_file, tmp_path):
    larger = tmp_path / "larger.png"
    report = qjulia.run(pictured, larger, changes={"size": "64x48", "zoom": None}, inputs=map_file.parent)
    assert report["width"] == 64
    with pytest.raises(qjulia.InputError, match="zom"):
        qjulia.run(pictured, larger, changes={"zom": 2}, inputs=map_file.parent)


def test_a_map_and_a_mesh_are_jobs(map_file, tmp_path):
    smooth = tmp_path / "smooth.qjulia.json"
    qjulia.run({"command": "convert", "options": {"in": str(map_file), "steepness": 2}}, smooth)
    assert json.loads(smooth.read_text())["steepness"] == 2
    mesh = tmp_path / "mesh.ply"
    report = qjulia.run({"command": "surface", "options": {"map": str(smooth), "resolution": 24}}, mesh)
    assert report["triangles"] > 100 and mesh.stat().st_size > 1000


def test_mistakes_are_named(map_file, tmp_path):
    with pytest.raises(qjulia.InputError, match="explore"):
        qjulia.run({"command": "explore", "options": {"map": str(map_file)}})
    with pytest.raises(qjulia.InputError, match="none.qjulia.json"):
        qjulia.run({"command": "render", "options": {"map": "none.qjulia.json"}}, tmp_path / "a.png")
    with pytest.raises(qjulia.InputError, match="siz"):
        qjulia.run({"command": "render", "options": {"map": str(map_file), "siz": "9x9"}}, tmp_path / "a.png")
    with pytest.raises(TypeError, match="dict"):
        qjulia.run({"command": "render", "options": {}}, changes={"zoom": 2})
    assert not (tmp_path / "a.png").exists()


def test_warnings_and_progress_are_told(map_file, tmp_path):
    said = []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        qjulia.run(
            {"command": "surface", "options": {"map": str(map_file), "resolution": 24}},
            tmp_path / "mesh.stl",
            on_progress=lambda *progress: said.append(progress),
        )
    assert said
    assert all(issubclass(one.category, UserWarning) for one in caught)
