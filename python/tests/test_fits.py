"""Fits that are taken stage by stage, and weights of their samples."""

import gc
import threading
import weakref

import numpy as np
import pytest

import qjulia
from conftest import FIT
from test_calls import press_ctrl_c_after


def test_stages_are_those_of_a_fit(torus, result, device):
    fit = qjulia.Fit(*torus, **FIT, device=device)
    assert fit.stopped is None and fit.stages == []
    maps = []
    for stage in fit:
        assert isinstance(stage, qjulia.StageReport) and stage == fit.stages[-1]
        maps.append(fit.map)
    assert len(fit.stages) == len(result.stages)
    for mine, theirs in zip(fit.stages, result.stages):
        assert (mine.name, mine.energy_after) == (theirs.name, theirs.energy_after)
    assert fit.stopped == "evaluations" and fit.step() is None
    whole = fit.result()
    assert whole.map == result.map == maps[-1]
    assert whole.stopped == result.stopped and whole.evaluations == result.evaluations
    assert "2 stages" in repr(fit) or f"{len(maps)} stages" in repr(fit)


def test_a_loop_may_be_left_and_gone_on_with(torus, device):
    options = {"factors": 16, "max_evaluations": 130, "device": device}
    fit = qjulia.Fit(*torus, **options)
    placed = fit.map
    for stage in fit:
        break
    first = fit.map
    assert placed != first and len(fit.stages) == 1
    assert sum(1 for stage in fit) > 0
    assert fit.result().map == qjulia.fit(*torus, **options).map


def test_a_fit_that_is_ended_gives_what_it_has(torus, device):
    fit = qjulia.Fit(*torus, factors=16, device=device)
    fit.step()
    result = fit.result()
    assert result.stopped == fit.stopped == "interrupted" and len(result.stages) == 1
    assert list(fit) == []


def test_ctrl_c_ends_the_loop(torus, device):
    pressed = []

    def press(energy):
        if not pressed:
            pressed.append(press_ctrl_c_after(0.2))

    fit = qjulia.Fit(*torus, factors=64, device=device, on_evaluation=press)
    for stage in fit:
        pass
    assert fit.stopped == "interrupted"
    assert np.isfinite(fit.result().map.field(np.zeros((1, 3)), device=device)).all()


def test_ctrl_c_at_any_moment_ends_the_loop(torus, device):
    # Stages take some milliseconds, so that some of these come when one is about to end.
    qjulia.fit(*torus, factors=12, max_evaluations=60, device=device)  # builds kernels
    for i in range(20):
        pressed = []

        def press(energy):
            if not pressed:
                pressed.append(press_ctrl_c_after(0.02 + 0.01 * i))

        fit = qjulia.Fit(*torus, factors=12, device=device, on_evaluation=press)
        for stage in fit:
            pass
        assert fit.stopped == "interrupted"
        pressed[0].join()


def test_a_fit_is_for_one_call_at_a_time(torus, device):
    problems = []

    def calls(energy):
        for use in (fit.step, fit.result, lambda: fit.map, lambda: fit.stages):
            try:
                use()
            except RuntimeError as error:
                problems.append(str(error))

    fit = qjulia.Fit(*torus, factors=16, max_evaluations=3, device=device, on_evaluation=calls)
    fit.step()
    assert len(problems) == 4 * 3 and all("another call" in text for text in problems)
    assert fit.stopped == "evaluations"


def test_a_callback_that_raises_ends_a_step(torus, device):
    def fails(energy):
        raise LookupError("enough")

    fit = qjulia.Fit(*torus, factors=16, device=device, on_evaluation=fails)
    with pytest.raises(LookupError, match="enough"):
        fit.step()
    assert fit.step() is None and fit.stopped == "interrupted"


def test_a_fit_that_its_callback_refers_to_is_collected(torus, device):
    class Holder:
        def look(self, energy):
            pass

    holder = Holder()
    holder.fit = qjulia.Fit(*torus, factors=16, device=device, on_evaluation=holder.look)
    gone = weakref.ref(holder)
    del holder
    gc.collect()
    assert gone() is None


def side_error(map, torus, device):
    """The mean |F_1 - L| over the torus where x > 0, over that where x < 0."""
    points, _ = qjulia.sample_surface(torus, 4000, seed=3)
    error = np.abs(map.field(points, device=device) - map.surface_level)
    return error[points[:, 0] > 0].mean() / error[points[:, 0] < 0].mean()


def test_weights_say_where_a_fit_follows_the_shape(torus, device):
    options = {"factors": 24, "max_evaluations": 100, "device": device}
    seen = []

    def weights(points):
        seen.append((threading.get_ident(), points))
        return np.where(points[:, 0] > 0, 1, 0.001)

    plain = qjulia.fit(*torus, **options)
    weighted = qjulia.fit(*torus, weights=weights, **options)
    assert side_error(weighted.map, torus, device) < 0.5 * side_error(plain.map, torus, device)
    assert len(seen) == len(weighted.stages)
    for thread, points in seen:
        assert thread == threading.get_ident()
        assert points.dtype == np.float64 and points.shape == (len(points), 3)
        # The torus reaches 1.35 from the axis, and points are up to a side's length beyond it.
        assert 1.2 < np.abs(points).max() < 4
    same = qjulia.fit(*torus, weights=lambda points: np.full(len(points), 2), **options)
    assert same.map == plain.map
    stepped = qjulia.Fit(*torus, weights=weights, **options)
    for stage in stepped:
        pass
    assert stepped.result().map == weighted.map


def test_wrong_weights_are_refused(torus, device):
    def attempt(weights):
        qjulia.fit(*torus, factors=16, max_evaluations=5, device=device, weights=weights)

    with pytest.raises(TypeError, match="weights must be a function"):
        attempt(np.ones(512))
    for wrong in (
        lambda points: points,
        lambda points: np.ones(3),
        lambda points: None,
        lambda points: np.full(len(points), np.nan),
        lambda points: np.full(len(points), -1.0),
        lambda points: np.zeros(len(points)),
    ):
        with pytest.raises((TypeError, ValueError), match="weights"):
            attempt(wrong)

    def fails(points):
        raise LookupError("mine")

    with pytest.raises(LookupError, match="mine"):
        attempt(fails)
