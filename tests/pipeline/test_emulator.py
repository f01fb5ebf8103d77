"""The emulator beside the plant it stands in for."""

import numpy as np
import pytest

from pipeline.emulator import build_emulator, held_out_error, predict
from pipeline.optimise import sobol_points
from sim.errors import InputError


def displacement(plant, levels):
    _, points, _ = plant.markers()
    positions = plant.Simulator(points, 1.6, 2.4, 10.0, 1, 2.0).run(levels).positions
    return positions - positions.mean(axis=1, keepdims=True)


def design(n, seed=1):
    return sobol_points(n, np.zeros(4), np.ones(4), seed) ** 2


@pytest.fixture
def emulator(plant):
    levels = design(60)
    return build_emulator(levels, displacement(plant, levels))


def test_new_levels_are_predicted_far_below_the_instrument(plant, emulator):
    new = design(40, seed=2)
    error = predict(emulator, new) - displacement(plant, new)
    # a quarter of the 0.1 mm that an instrument is believed to
    assert np.sqrt(np.mean(error**2)) < 2.5e-5
    assert np.sqrt(np.mean(displacement(plant, new) ** 2)) > 1e-3


def test_held_out_error_is_that_on_new_runs(plant):
    levels, new = 0.1 + 0.3 * design(80), 0.1 + 0.3 * design(80, seed=2)
    rng = np.random.default_rng(4)
    # noise in the runs is an error that no process can learn
    runs, others = (
        clean + 1e-4 * rng.normal(size=clean.shape)
        for clean in (displacement(plant, levels), displacement(plant, new))
    )
    fresh = np.sqrt(np.mean((predict(build_emulator(levels, runs), new) - others) ** 2))
    held_out = held_out_error(levels, runs, np.arange(0, 80, 4), 2)
    assert held_out > 1e-4
    assert held_out == pytest.approx(fresh, rel=0.2)


def test_components_are_orthonormal_and_runs_are_reproduced(plant, emulator):
    identity = emulator.basis @ emulator.basis.T
    assert np.allclose(identity, np.eye(len(identity)))
    again = predict(emulator, emulator.levels)
    assert np.abs(again - displacement(plant, emulator.levels)).max() < 1e-4


def test_same_runs_same_emulator(plant, emulator):
    again = build_emulator(emulator.levels, displacement(plant, emulator.levels))
    assert np.array_equal(again.weights, emulator.weights)


def test_too_few_runs_are_refused_with_a_remedy(plant):
    with pytest.raises(InputError, match=r"fit\.n_initial"):
        build_emulator(design(8), displacement(plant, design(8)))
