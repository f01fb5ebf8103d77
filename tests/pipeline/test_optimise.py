"""The search: bounds, starts in step, failures, and the words for its end."""

import threading

import numpy as np
import pytest

from pipeline.optimise import (
    ALGORITHMS,
    Stop,
    bound_warnings,
    effect_warnings,
    minimise,
    sobol_points,
)
from sim.errors import ParameterError

TRUTH = np.array([0.3, 0.1, 0.6, 0.2])
LOWER, UPPER = np.zeros(4), np.ones(4)


def bowl(points):
    return 1e-3 * np.sum((points - TRUTH) ** 2 * [1, 2, 3, 1], axis=1)


def search(evaluate=bowl, **changes):
    options = {
        "lower": LOWER,
        "upper": UPPER,
        "starts": np.array([[0.5, 0.5, 0.5, 0.5], [0.1, 0.9, 0.1, 0.9]]),
        "step": np.array([0.1, 0.1]),
        "algorithm": "bobyqa",
        "max_evaluations": 400,
        "tolerance": 1e-5,
        "penalty": 1.0,
        "seed": 5,
    }
    return minimise(evaluate, **(options | changes))


@pytest.mark.parametrize(
    ("algorithm", "budget", "tolerance"),
    [
        ("bobyqa", 200, 1e-3),
        ("cobyla", 400, 1e-2),
        ("sbplx", 800, 1e-2),
        ("nelder_mead", 800, 1e-2),
        ("crs2", 3000, 1e-2),
        ("direct", 3000, 3e-2),
    ],
)
def test_every_algorithm_finds_the_bottom(algorithm, budget, tolerance):
    found = search(algorithm=algorithm, max_evaluations=budget)
    assert np.abs(found.best - TRUTH).max() < tolerance
    # a start may finish the step in which its budget ends
    assert len(found.trace) == len(found.trace_cost) <= budget + 4


def test_no_algorithm_is_left_untested():
    assert set(ALGORITHMS) == {"bobyqa", "cobyla", "sbplx", "nelder_mead", "crs2", "direct"}


@pytest.mark.parametrize("algorithm", sorted(ALGORITHMS))
def test_failed_runs_cost_the_penalty_and_lose_nothing(algorithm):
    def half_broken(points):
        return np.where(points[:, 0] > 0.5, np.nan, bowl(points))

    found = search(half_broken, algorithm=algorithm, max_evaluations=1500)
    assert found.failed.any()
    assert np.isfinite(found.trace_cost).all()
    assert (found.trace_cost[found.failed] == 1.0).all()
    assert found.cost < 1e-4


def test_a_model_that_always_fails_is_a_result_not_an_exception():
    found = search(lambda points: np.full(len(points), np.nan), max_evaluations=30)
    assert found.stop is Stop.FAILED
    assert found.failed.all()


def test_the_best_point_is_the_best_of_the_whole_log():
    found = search(max_evaluations=40)
    assert found.stop is Stop.BUDGET
    assert found.cost == found.trace_cost.min() == bowl(found.best[None])[0]


def test_all_points_lie_between_the_bounds():
    found = search(lambda points: -points.sum(axis=1), max_evaluations=200)
    assert (found.trace >= LOWER).all()
    assert (found.trace <= UPPER).all()
    assert np.allclose(found.best, 1, atol=1e-3)


@pytest.mark.parametrize("algorithm", ["bobyqa", "crs2"])
def test_same_seed_same_points_and_another_seed_others(algorithm):
    first, again = search(algorithm=algorithm), search(algorithm=algorithm)
    assert np.array_equal(first.trace, again.trace)
    if algorithm == "crs2":
        assert not np.array_equal(first.trace, search(algorithm=algorithm, seed=6).trace)


def test_starts_move_in_step_so_that_batches_do_not_depend_on_time():
    sizes = []

    def counted(points):
        sizes.append(len(points))
        threading.Event().wait(0.001 * (len(sizes) % 3))
        return bowl(points)

    found = search(counted, max_evaluations=60)
    assert sizes[0] == 2
    assert sizes == sorted(sizes, reverse=True)
    assert sum(sizes) == len(found.trace)


def test_an_error_of_the_model_comes_through_and_leaves_no_thread_behind():
    def broken(points):
        raise ZeroDivisionError

    before = threading.active_count()
    with pytest.raises(ZeroDivisionError):
        search(broken)
    assert threading.active_count() == before


def test_unknown_algorithm_names_the_known_ones():
    with pytest.raises(ParameterError, match="bobyqa"):
        search(algorithm="newton")


def test_warnings_name_what_is_at_a_bound_and_what_does_nothing():
    lines = bound_warnings(("a", "b", "c", "d"), np.array([0.0, 0.5, 1.0, 0.01]), LOWER, UPPER)
    assert [line.split(" is at its ")[0] for line in lines] == ["a", "c"]
    assert "upper" in lines[1]
    lines = effect_warnings(("a", "b"), np.array([1.0, 1e-9]), 0.05, 1e-6)
    assert len(lines) == 1
    assert lines[0].startswith("b has no effect")


def test_sobol_points_fill_the_box_the_same_way_each_time():
    points = sobol_points(64, LOWER, 2 * UPPER, 3)
    assert np.array_equal(points, sobol_points(64, LOWER, 2 * UPPER, 3))
    assert ((points < 1).sum(axis=0) == 32).all()
