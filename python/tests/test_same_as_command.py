"""What Python computes equals what the command writes, bit for bit."""

import json

import numpy as np
import pytest

import qjulia
from conftest import FIT


def same_bits(a, b):
    return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()


def read_ply(path):
    """Vertices, faces and normals of a file of the command."""
    data = path.read_bytes()
    header, body = data.split(b"end_header\n", 1)
    counts = [int(line.split()[2]) for line in header.splitlines() if line.startswith(b"element")]
    vertex = np.dtype([("position", "<f4", (3,)), ("normal", "<f4", (3,))])
    vertices = np.frombuffer(body, vertex, counts[0])
    face = np.dtype([("count", "u1"), ("corners", "<u4", (3,))])
    faces = np.frombuffer(body, face, counts[1], vertices.nbytes)
    return vertices["position"], faces["corners"], vertices["normal"]


@pytest.fixture(scope="session")
def fitted_file(command, torus_file, tmp_path_factory):
    path = tmp_path_factory.mktemp("maps") / "torus.qjulia.json"
    command(
        "fit",
        torus_file,
        "-o",
        path,
        "--factors",
        FIT["factors"],
        "--max-evaluations",
        FIT["max_evaluations"],
    )
    return path


def test_a_fit_gives_the_same_map(fitted_file, torus_file, map, device):
    theirs = qjulia.load(fitted_file)
    assert same_bits(map.factors, theirs.factors)
    assert map == theirs
    assert qjulia.fit(torus_file, **FIT, device=device).map == theirs


def test_a_fit_of_arrays_is_that_of_a_file_with_their_numbers(command, tmp_path, device):
    # Doubles that single precision does not hold, the first row of vertices twice, and a triangle
    # without area.
    turn, tube = np.meshgrid(
        2 * np.pi * np.arange(33) / 32, 2 * np.pi * np.arange(17) / 16, indexing="ij"
    )
    radius = 0.9 + 0.3 * np.cos(tube)
    vertices = np.stack([radius * np.cos(turn), radius * np.sin(turn), 0.3 * np.sin(tube)], -1)
    vertices[-1], vertices[:, -1] = vertices[0], vertices[:, 0]
    vertices = vertices.reshape(-1, 3)[::-1]
    i, j = (a.ravel() for a in np.meshgrid(np.arange(32), np.arange(16), indexing="ij"))
    corners = [len(vertices) - 1 - ((i + a) * 17 + j + b) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
    faces = np.concatenate([np.stack([corners[k] for k in t], -1) for t in ((0, 1, 2), (0, 2, 3))])
    faces = np.concatenate([faces, [[5, 5, 6]]])
    mesh, path = tmp_path / "mesh.obj", tmp_path / "map.qjulia.json"
    with open(mesh, "w") as file:
        file.writelines("v {!r} {!r} {!r}\n".format(*x) for x in vertices.tolist())
        file.writelines("f {} {} {}\n".format(*t) for t in (faces + 1).tolist())
    command("fit", mesh, "-o", path, "--factors", 24, "--max-evaluations", 40)
    with pytest.warns(UserWarning, match="1 triangles without area are left out"):
        result = qjulia.fit(vertices, faces, **FIT, device=device)
    theirs = qjulia.load(path)
    assert same_bits(result.map.factors, theirs.factors) and result.map == theirs
    with pytest.warns(UserWarning, match="without area"):
        read, index = qjulia.read_mesh(mesh, return_index=True)
    assert len(read.vertices) == 512 and np.array_equal(
        read.vertices[index], vertices.astype(np.float32).astype(float)
    )
    assert np.array_equal(read.faces, index[faces[:-1]])
    first = np.unique(index, return_index=True)[1]
    assert np.all(np.diff(first) > 0)  # the file's order
    assert qjulia.fit(read.vertices, read.faces, **FIT, device=device).map == theirs


def test_an_exact_map_is_the_same(command, torus_file, torus, tmp_path, device):
    for words, options in (
        ("random:20:7", {"roots": 20, "seed": 7}),
        ("noise:3:8:5", {"versor": "noise", "octaves": 3, "scale": 8, "seed": 5}),
    ):
        path = tmp_path / "exact.qjulia.json"
        command("shape", torus_file, "-o", path, "--resolution", 32, "--versor", words)
        assert qjulia.shape(*torus, resolution=32, **options, device=device) == qjulia.load(path)


@pytest.mark.parametrize("word", ["auto", "smooth", "clear", "wild"])
def test_words_for_detail_mean_the_same(command, fitted_file, map, tmp_path, device, word):
    path = tmp_path / "mesh.ply"
    command("surface", fitted_file, "-o", path, "--resolution", 32, "--detail", word)
    turned = map.with_knobs(detail=word, device=device)
    vertices, faces, _ = read_ply(path)
    mine = turned.surface(32, device=device)
    assert np.array_equal(mine.vertices.astype(np.float32), vertices)
    assert np.array_equal(mine.faces, faces)
    assert turned.detail != map.detail or word == "auto"


def test_knobs_turn_alike(command, fitted_file, map, tmp_path, device):
    knobs = {
        "detail": 0.02,
        "order_seed": 3,
        "phase": (1, 0.5, 0, 0.2),
        "drift": 0.1,
        "rotate": (0, 0, 1, 30),
        "steepness": 2,
    }
    options = []
    for name, value in knobs.items():
        options += ["--" + name.replace("_", "-"), *np.atleast_1d(value)]
    command("sample", fitted_file, "-o", tmp_path / "field.npy", "--resolution", 24, *options)
    turned = map.with_knobs(**knobs, device=device)
    values, _ = turned.sample(24, device=device)
    assert same_bits(values, np.load(tmp_path / "field.npy"))
    assert turned.diagonal == map.diagonal
    assert np.linalg.norm(turned.box[1] - turned.box[0]) > map.diagonal


def test_a_field_is_the_same_on_a_grid_and_at_points(command, fitted_file, map, tmp_path, device):
    box = np.array([[-1.2, -1.2, -0.4], [1.2, 1.2, 0.4]])
    command(
        "sample",
        fitted_file,
        "-o",
        tmp_path / "field.npy",
        "--resolution",
        12,
        "--box",
        *box.ravel(),
        "--iterations",
        3,
    )
    theirs = np.load(tmp_path / "field.npy")
    values, its_box = map.sample(12, box=box, n=3, device=device)
    assert same_bits(values, theirs)
    assert np.array_equal(its_box, box)
    cell = (box[1] - box[0]) / theirs.shape
    centers = np.stack(
        np.meshgrid(
            *[box[0][i] + cell[i] * (np.arange(n) + 0.5) for i, n in enumerate(theirs.shape)],
            indexing="ij",
        ),
        -1,
    )
    at_points = map.field(centers.reshape(-1, 3), n=3, device=device).astype(np.float32)
    # Centres are computed in another order of sums; one rounding of them shows.
    assert np.mean(at_points == theirs.ravel()) > 0.5
    assert np.allclose(at_points, theirs.ravel(), atol=1e-4)


def test_a_surface_is_the_same(command, fitted_file, map, tmp_path, device):
    for resolution, options, keywords in ((40, [], {}), (24, ["--iterations", 1], {"n": 1})):
        command(
            "surface", fitted_file, "-o", tmp_path / "set.ply", "--resolution", resolution, *options
        )
        vertices, faces, normals = read_ply(tmp_path / "set.ply")
        ours = map.surface(resolution, **keywords, device=device)
        assert same_bits(ours.vertices.astype(np.float32), vertices)
        assert same_bits(ours.faces, faces)
        assert same_bits(ours.normals, normals)


def test_a_picture_is_the_same(command, fitted_file, map, tmp_path, device):
    image = pytest.importorskip("PIL.Image")
    command(
        "render",
        fitted_file,
        "-o",
        tmp_path / "set.png",
        "--size",
        "64x48",
        "--azimuth",
        50,
        "--material",
        "trap",
        "--palette",
        "ice",
        "--lamp",
        "-40,30,1.5,3200K",
        "--lamp",
        "100,20,0.5",
        "--metal",
        0.5,
        "--background",
        "transparent",
        "--cut",
        "z=50%",
    )
    ours = qjulia.render(
        map,
        size=(64, 48),
        azimuth=50,
        material="trap",
        palette="ice",
        lamp=[(-40, 30, 1.5, "3200K"), "100,20,0.5"],
        metal=0.5,
        background="transparent",
        cut={"z": "50%"},
        device=device,
    )
    assert np.array_equal(ours, np.asarray(image.open(tmp_path / "set.png")))
    qjulia.save_png(ours, tmp_path / "ours.png")
    assert np.array_equal(ours, np.asarray(image.open(tmp_path / "ours.png")))
    # The command's picture holds the map that it shows, and so does ours where it is told to.
    assert qjulia.load(tmp_path / "set.png") == map
    with pytest.raises(qjulia.InputError, match="holds no map"):
        qjulia.load(tmp_path / "ours.png")
    qjulia.save_png(ours, tmp_path / "ours.png", map=map)
    assert qjulia.load(tmp_path / "ours.png") == map
    assert np.array_equal(ours, np.asarray(image.open(tmp_path / "ours.png")))
    map.surface(24, device=device).save(tmp_path / "ours.glb", map=map)
    assert qjulia.load(tmp_path / "ours.glb") == map


def test_figures_are_the_same(command, fitted_file, torus_file, map, torus, device):
    theirs = json.loads(
        command("compare", fitted_file, torus_file, "--resolution", 24, "--json", "--iterations", 4)
    )["metrics"]
    ours = qjulia.compare(map, torus, n=[4, 1], resolution=24, device=device)
    assert [row["n"] for row in ours] == [4, 1]
    for row, expected in zip(reversed(ours), theirs):
        for name in set(row) - {"n"}:
            assert row[name] == expected[name], name


def expect_same_morph(command, files, folder, device):
    report = json.loads(command("morph", *files, "-o", folder, "--steps", 5, "--flicker-cells", 16, "--json"))
    ours = qjulia.morph(*(qjulia.load(file) for file in files), 5, flicker_cells=16, device=device)
    assert len(ours.maps) == 5
    for step, mine in enumerate(ours.maps, 1):
        theirs = qjulia.load(folder / f"step_{step:04}.qjulia.json")
        assert mine == theirs and same_bits(mine.factors, theirs.factors)
        assert mine.provenance["morph"] == theirs.provenance["morph"]
    assert ours.maps[0] != ours.maps[4]
    assert ours.factors == report["factors"]
    assert ours.flicker == report["flicker"] and ours.flicker["changed"] > 0


def test_a_morph_is_the_same(command, fitted_file, torus_file, tmp_path, device):
    turned = tmp_path / "turned.qjulia.json"
    command("convert", fitted_file, turned, "--rotate", 1, 0, 0, 60)
    expect_same_morph(command, (fitted_file, turned), tmp_path / "fitted", device)
    assert qjulia.morph(qjulia.load(turned), qjulia.load(turned), 2, flicker_cells=0, device=device).flicker is None
    exact = [tmp_path / "first.qjulia.json", tmp_path / "second.qjulia.json"]
    for path, detail in zip(exact, (0.01, 0.05)):
        command("shape", torus_file, "-o", path, "--resolution", 32, "--versor", "random:20:7", "--detail", detail)
    expect_same_morph(command, exact, tmp_path / "exact", device)


def test_maps_that_stand_otherwise_are_told_of(map, torus, device):
    lying, standing = (qjulia.shape(*torus, resolution=32, up=up, device=device) for up in ("x", "z"))
    with pytest.warns(UserWarning, match="x is up in the first map and z in the second"):
        qjulia.morph(lying, standing, 2, flicker_cells=0, device=device)


def test_borrowed_grooves_are_the_same(command, fitted_file, torus_file, tmp_path, device):
    exact, path = tmp_path / "exact.qjulia.json", tmp_path / "grooves.qjulia.json"
    for words in ("random:20:7", "noise:3:8:5"):
        command("shape", torus_file, "-o", exact, "--resolution", 32, "--versor", words)
        for shape, grooves in ((fitted_file, exact), (exact, fitted_file)):
            command("convert", shape, path, "--versor-from", grooves)
            ours = qjulia.with_versor_of(qjulia.load(shape), qjulia.load(grooves), device=device)
            assert ours == qjulia.load(path) and ours != qjulia.load(shape)


def test_a_roughness_that_is_asked_for_is_the_same(command, fitted_file, map, torus_file, torus, tmp_path, device):
    path = tmp_path / "rough.qjulia.json"
    command("convert", fitted_file, path, "--target-area", 1.1, "--target-resolution", 64)
    assert map.with_roughness(target_area=1.1, target_resolution=64, device=device) == qjulia.load(path)
    # Against the mesh, which the shape's smooth set differs from.
    command("shape", torus_file, "-o", path, "--resolution", 32, "--target-area", 1.2, "--target-resolution", 64)
    exact = qjulia.shape(*torus, resolution=32, device=device)
    asked = {"target_area": 1.2, "target_resolution": 64, "device": device}
    theirs = qjulia.load(path)
    assert exact.with_roughness(*torus, **asked) == theirs
    assert exact.with_roughness(**asked) != theirs


def test_paint_and_portals_are_the_same(command, fitted_file, map, tmp_path, device):
    path = tmp_path / "edited.qjulia.json"
    command("paint", fitted_file, "-o", path, "--ramp", "y=1:0.1", "--ball", 1, 0, 0, 0.3, 0)
    assert map.paint(ramp=("y", 1, 0.1), balls=[[1, 0, 0, 0.3, 0]], device=device) == qjulia.load(
        path
    )
    command("portals", fitted_file, "-o", path, "--count", 1, "--size", 0.2)
    assert map.portals(1, size=0.2, device=device) == qjulia.load(path)
