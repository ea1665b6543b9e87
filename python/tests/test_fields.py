"""Fields, gradients and orbits."""

import time

import numpy as np
import pytest

import qjulia


@pytest.fixture
def points():
    return np.random.default_rng(2).uniform(-1, 1, (200, 3)) * [1.3, 1.3, 0.5]


def by_hand(map, points):
    """F_1 of a map of factors, as docs/theory/maps.md says it, of points in map coordinates."""
    factors = map.factors
    offsets = points[:, None, :] - factors["center"]
    return map.log_scale + np.log(np.linalg.norm(offsets, axis=2)) @ factors["exponent"]


def test_the_potential_is_what_the_formula_says(map, points, device):
    with_w = np.column_stack([map.to_map(points), np.full(len(points), map.slice)])
    expected = by_hand(map, with_w)
    outside = expected > map.surface_level
    expected[outside] += (map.steepness - 1) * (expected[outside] - map.surface_level)
    assert np.allclose(map.field(points, device=device), expected, atol=1e-4)
    assert np.allclose(
        map.field(with_w, space="map", precision="double", device=device), expected, atol=1e-9
    )


@pytest.mark.parametrize("n", [1, 2])
def test_gradients_are_slopes(map, points, device, n):
    # Orbits that would begin to escape between two points have no slope there.
    step = 1e-6
    values, gradients = map.field(points, n=n, gradient=True, precision="double", device=device)
    assert values.shape == (200,) and gradients.shape == (200, 3)
    for axis in range(3):
        shift = step * np.eye(3)[axis]
        slope = (
            map.field(points + shift, n=n, precision="double", device=device)
            - map.field(points - shift, n=n, precision="double", device=device)
        ) / (2 * step)
        close = np.abs(slope - gradients[:, axis]) <= 1e-3 * (1 + np.abs(slope))
        assert close.mean() > 0.95


def test_gradients_follow_the_space(map, points, device):
    in_shape = map.field(points, gradient=True, device=device)[1]
    in_map = map.field(map.to_map(points), gradient=True, space="map", device=device)[1]
    scale = np.ptp(map.to_map(map.box)[:, 0]) / np.ptp(map.box[:, 0])
    assert np.allclose(in_shape, scale * in_map, rtol=1e-5, atol=1e-5)
    four = map.field(
        np.column_stack([map.to_map(points), np.zeros(200)]),
        gradient=True,
        space="map",
        device=device,
    )[1]
    assert four.shape == (200, 4) and np.allclose(four[:, :3], in_map, rtol=1e-5, atol=1e-5)


def test_orbits_images_versors_and_counts_agree(map, points, device):
    n = 4
    orbits = map.orbits(points, n=n, device=device)
    images = map.images(points, n=n, device=device)
    counts = map.escape_counts(points, n=n, device=device)
    assert orbits.shape == (200, n + 1, 4) and images.shape == (200, 4) and counts.shape == (200,)
    assert np.allclose(orbits[:, 0, :3], map.to_map(points))
    assert np.array_equal(orbits[:, -1], images)
    norms = np.linalg.norm(images, axis=1)
    assert np.allclose(np.log(norms), map.field(points, n=n, device=device), atol=1e-4)
    inside = np.linalg.norm(orbits[:, :n], axis=2) < 20
    expected = np.where(inside.all(1), n, np.argmin(inside, axis=1))
    assert np.array_equal(counts, expected)
    versors = map.versors(points, device=device)
    assert np.allclose(np.linalg.norm(versors, axis=1), 1, atol=1e-5)
    first = orbits[:, 1] / np.linalg.norm(orbits[:, 1], axis=1, keepdims=True)
    moved = counts > 0
    assert np.allclose(versors[moved], first[moved], atol=1e-4)


def test_strides_orders_and_types_do_not_matter(map, points, device):
    expected = map.field(points, n=2, device=device)
    wide = np.zeros((400, 6))
    wide[::2, ::2] = points
    for same in (
        wide[::2, ::2],
        np.asfortranarray(points),
        points.tolist(),
        points[::-1][::-1],
        points.astype(">f8"),
    ):
        assert np.array_equal(map.field(same, n=2, device=device), expected)
    assert np.array_equal(
        map.field(points.astype("f4"), device=device),
        map.field(points.astype("f4").astype("f8"), device=device),
    )
    assert map.field(np.zeros((2, 3), int), device=device).shape == (2,)


def test_nothing_in_nothing_out(map, device):
    values, gradients = map.field(np.zeros((0, 3)), n=3, gradient=True, device=device)
    assert values.shape == (0,) and gradients.shape == (0, 3)
    assert map.orbits(np.zeros((0, 3)), n=2, device=device).shape == (0, 3, 4)


def test_many_points_are_the_same_as_few(map, points, device):
    many = np.tile(points, (2000, 1))  # so many that the work is watched
    assert np.array_equal(
        map.field(many, n=6, device=device).reshape(2000, -1),
        np.tile(map.field(points, n=6, device=device), (2000, 1)),
    )


def test_settings_of_a_call_do_not_stay(map, points, device):
    single = map.field(points, n=3, device=device)
    double = map.field(points, n=3, precision="double", device=device)
    assert 0 < np.abs(double - single).max()
    near = map.field(points, n=3, escape=2.0, device=device)
    assert not np.array_equal(near, single)
    assert np.array_equal(map.field(points, n=3, device=device), single)


def test_a_thousand_points_are_quick(map, device, capsys):
    points = np.random.default_rng(3).uniform(-1, 1, (1000, 3))
    best = best_empty = np.inf
    for _ in range(200):
        start = time.perf_counter()
        map.field(points, device=device)
        best = min(best, time.perf_counter() - start)
        start = time.perf_counter()
        map.field(points[:0], device=device)
        best_empty = min(best_empty, time.perf_counter() - start)
    with capsys.disabled():
        print(f"\n1,000 points take {1e6 * best:.0f} us, none {1e6 * best_empty:.1f} us")


def test_distances_and_samples_of_a_mesh(torus, device):
    on_it, normals = qjulia.sample_surface(torus, 500, seed=2)
    assert np.allclose(np.linalg.norm(normals, axis=1), 1)
    assert np.abs(qjulia.signed_distance(torus, on_it, device=device)).max() < 1e-5
    away = on_it + 0.1 * normals
    distances = qjulia.signed_distance(torus, away, device=device)
    assert np.allclose(distances, 0.1, atol=0.01)
    assert (qjulia.signed_distance(torus, on_it - 0.1 * normals, device=device) < 0).all()
