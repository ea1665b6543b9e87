"""The energy over one's own samples, for optimisers of one's own."""

import numpy as np
import pytest

import qjulia


@pytest.fixture(scope="module")
def samples():
    """Points about a torus, and their signed distances from it."""
    points = np.random.default_rng(4).uniform(-1, 1, (3000, 3)) * [1.6, 1.6, 0.6]
    distance = np.hypot(np.hypot(points[:, 0], points[:, 1]) - 1, points[:, 2]) - 0.35
    return points, distance


def test_values_are_what_the_formula_says(map, samples, device):
    points, distance = samples
    energy = qjulia.Energy(
        map, points, sides=np.sign(distance), loss="tanh", alpha=2, device=device
    )
    assert energy.size == 1 + 5 * 24 and energy.x0.shape == (energy.size,)
    field = energy.field(energy.x0)
    assert np.allclose(field, map.field(points, device=device), atol=1e-4)
    expected = -np.mean(np.sign(distance) * np.tanh(2 * (field - map.surface_level)))
    assert energy.value(energy.x0) == pytest.approx(expected, abs=1e-5)
    assert energy.value_and_gradient(energy.x0)[0] == pytest.approx(expected, abs=1e-5)


@pytest.mark.parametrize("slice", [False, True])
@pytest.mark.parametrize("loss", ["distance", "tanh", "own"])
def test_gradients_are_slopes(map, samples, device, loss, slice):
    points, distance = samples
    own = lambda field: (
        np.logaddexp(0, -np.sign(distance) * field),
        -np.sign(distance) / (1 + np.exp(np.sign(distance) * field)),
    )
    energy = qjulia.Energy(
        map,
        points,
        sides=np.sign(distance) if loss == "tanh" else None,
        targets=distance,
        loss=own if loss == "own" else loss,
        slice=slice,
        precision="double",
        device=device,
    )
    assert energy.size == 1 + 5 * 24 + slice
    value, gradient = energy.value_and_gradient(energy.x0)
    assert gradient.shape == (energy.size,)
    direction = np.random.default_rng(5).normal(size=energy.size)
    direction /= np.linalg.norm(direction)
    step = 1e-5
    slope = (
        energy.value(energy.x0 + step * direction) - energy.value(energy.x0 - step * direction)
    ) / (2 * step)
    assert direction @ gradient == pytest.approx(slope, rel=1e-3, abs=1e-6)


def test_maps_of_unknowns(map, samples, device):
    energy = qjulia.Energy(map, samples[0], device=device)
    assert energy.map_at(energy.x0) == map
    with_slice = qjulia.Energy(map, samples[0], slice=True, device=device)
    assert with_slice.map_at(np.append(energy.x0, 0.25)).slice == 0.25
    moved = energy.x0
    moved[1:25] *= 1.1
    assert energy.map_at(moved).degree == pytest.approx(1.1 * map.degree)
    assert np.array_equal(energy.map_at(moved).factors["center"], map.factors["center"])


def test_a_loss_that_fails_says_so(map, samples, device):
    def raises(field):
        raise RuntimeError("mine")

    energy = qjulia.Energy(map, samples[0], loss=raises, device=device)
    with pytest.raises(RuntimeError, match="mine"):
        energy.value(energy.x0)
    for wrong in (
        lambda field: field,
        lambda field: (field, field[:-1]),
        lambda field: None,
        lambda field: (field, field * np.nan),
    ):
        with pytest.raises((TypeError, ValueError), match="loss"):
            qjulia.Energy(map, samples[0], loss=wrong, device=device).value(energy.x0)


def test_scipy_gets_as_far_as_the_program(torus, samples, device, capsys):
    optimize = pytest.importorskip("scipy.optimize")
    points, distance = samples
    placed = []
    result = qjulia.fit(
        *torus,
        factors=64,
        max_evaluations=120,
        device=device,
        on_stage=lambda stage: placed.append(stage.map),
    )

    def energy(map):
        return qjulia.Energy(
            map, points, sides=np.sign(distance), loss="tanh", alpha=10, device=device
        )

    program = energy(result.map).value(energy(result.map).x0)
    start = energy(placed[0])
    found = optimize.minimize(
        start.value_and_gradient, start.x0, jac=True, method="L-BFGS-B", options={"maxiter": 100}
    )
    with capsys.disabled():
        print(
            f"\nenergy: {start.value(start.x0):.4f} placed, {found.fun:.4f} by SciPy after "
            f"{found.nfev} evaluations, {program:.4f} by the program"
        )
    assert found.fun < program + 0.05 * abs(program)
    assert start.map_at(found.x).calibrated(device=device).field(points, device=device).shape == (
        3000,
    )
