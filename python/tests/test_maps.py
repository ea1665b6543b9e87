"""Maps as Python's objects."""

import copy
import pickle

import numpy as np
import pytest

import qjulia


def test_copies_files_and_pickles_are_equal(map, tmp_path, device):
    assert copy.copy(map) == map and copy.deepcopy(map) == map
    assert pickle.loads(pickle.dumps(map)) == map
    map.save(tmp_path / "map.qjulia.json")
    assert qjulia.load(str(tmp_path / "map.qjulia.json")) == map
    assert qjulia.Map.load(tmp_path / "map.qjulia.json").factors.tobytes() == map.factors.tobytes()
    assert hash(qjulia.Map.from_json(map.to_json())) == hash(map)
    assert map != map.with_knobs(scale=1.1, device=device)
    assert map != "map"


def test_provenance_does_not_count(map):
    noted = map.with_provenance({"by": ["hand", 1]})
    assert noted.provenance == {"by": ["hand", 1]}
    assert noted == map


def test_factors_are_a_structured_array_and_make_a_map(map):
    factors = map.factors
    assert factors.dtype.names == ("center", "exponent")
    assert factors["center"].shape == (24, 4)
    assert map.with_factors(factors) == map
    factors["exponent"] *= 1.5
    assert map.factors["exponent"][0] != factors["exponent"][0]
    other = map.with_factors(np.column_stack([factors["center"], factors["exponent"]]))
    assert other.degree == pytest.approx(1.5 * map.degree)


def test_calibration_moves_scale_and_level_alike(map, device):
    factors = map.factors
    factors["center"] *= 1.02  # the origin stays inside
    log_scale = map.log_scale + 0.05
    moved = map.with_factors(factors, log_scale=log_scale)
    calibrated = map.with_factors(factors, log_scale=log_scale, calibrate=True, device=device)
    assert moved.log_scale == log_scale and moved.surface_level == map.surface_level
    assert calibrated == moved.calibrated(device=device)
    shift = calibrated.log_scale - moved.log_scale
    assert shift != 0
    assert calibrated.surface_level - moved.surface_level == pytest.approx(shift)


def test_coordinates_lead_there_and_back(map):
    points = np.random.default_rng(1).normal(size=(5, 3))
    assert np.allclose(map.to_shape(map.to_map(points)), points)
    assert np.ptp(map.to_map(map.box), axis=0).max() == pytest.approx(3)


def test_it_says_what_it_is(map, device):
    assert repr(map).startswith("<qjulia.Map rational, 24 factors, detail ")
    assert map.kind == "rational" and map.up in ("x", "y", "z", "-x", "-y", "-z")
    assert map.phase.tolist() == [1, 0, 0, 0] and map.slice == 0
    quadratic = qjulia.quadratic_map([-0.2, 0.6, 0.2, 0.2])
    assert quadratic.kind == "quadratic" and quadratic.degree == 2 and quadratic.box is None
    assert len(quadratic.factors) == 0
    painted = map.paint(elsewhere=0.5, device=device)
    assert painted.is_painted and not painted.without_paint().is_painted
    assert painted.without_paint() == map


def test_a_notebook_shows_a_picture(map):
    assert map._repr_png_().startswith(b"\x89PNG")


def test_meshes_of_every_form_give_the_same_map(torus, torus_file, device):
    vertices, faces = torus

    class Trimesh:
        pass

    class Meshio:
        points = vertices
        cells_dict = {"triangle": faces}

    trimesh = Trimesh()
    trimesh.vertices, trimesh.faces = vertices, faces
    maps = [
        qjulia.shape(mesh, resolution=32, device=device)
        for mesh in (torus, list(torus), trimesh, Meshio(), torus_file, str(torus_file))
    ]
    wide = np.zeros((len(vertices), 6))
    wide[:, ::2] = vertices
    maps.append(
        qjulia.shape(
            wide[:, ::2], np.asfortranarray(faces[:, ::-1])[:, ::-1], resolution=32, device=device
        )
    )
    maps.append(
        qjulia.shape(
            vertices.astype("float32"),
            faces.astype("uint8", casting="unsafe"),
            resolution=32,
            device=device,
        )
        if len(vertices) < 256
        else maps[0]
    )
    assert all(other == maps[0] for other in maps)


def test_surfaces_are_meshes_too(map, tmp_path, device):
    surface = map.surface(24, device=device)
    for name in ("set.ply", "set.glb"):
        surface.save(tmp_path / name, up="y")
        read = qjulia.read_mesh(tmp_path / name)
        assert len(read.vertices) == len(surface.vertices) and len(read.normals) == 0
        assert len(read.faces) == len(surface.faces)
    (row,) = qjulia.compare(map, surface, n=6, resolution=24, device=device)
    assert row["iou"] > 0.8


def test_a_surface_has_colours(map, tmp_path, device):
    surface = map.surface(24, device=device)
    colors = map.surface_colors(surface, material="height", palette="ember", device=device)
    assert colors.shape == (len(surface.vertices), 3) and colors.dtype == np.uint8
    assert len(np.unique(colors, axis=0)) > 50
    surface.save(tmp_path / "set.ply", colors=colors)
    assert b"property uchar red" in (tmp_path / "set.ply").read_bytes()[:2000]
    with pytest.raises(ValueError, match="colours"):
        surface.save(tmp_path / "set.ply", colors=colors[:-1])
    with pytest.raises(ValueError, match="255"):
        surface.save(tmp_path / "set.ply", colors=colors + np.int64(300))


def test_pictures_have_layers_and_meshes_are_drawn(map, torus, device):
    image, layers = qjulia.render(map, size=(40, 30), layers=True, device=device)
    assert image.shape == (30, 40, 3) and image.dtype == np.uint8
    assert layers["depth"].shape == (30, 40) and layers["normal"].shape == (30, 40, 3)
    seen = np.isfinite(layers["depth"])
    assert 0.05 < seen.mean() < 0.9
    assert np.allclose(np.linalg.norm(layers["normal"][seen], axis=1), 1, atol=1e-5)
    drawn = qjulia.render(torus, size=(40, 30), framed=map, device=device)
    assert drawn.shape == (30, 40, 3) and np.std(drawn) > 0


def test_devices_are_listed():
    assert {"id", "name", "kind"} <= set(qjulia.devices()[0])
    device = qjulia.Device(qjulia.devices()[0]["id"])
    assert device.info["name"] == device.name and device.layout in ("cpu", "gpu")
