"""Levels planted in the real torso come back through half a millimetre of marker noise."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pipeline.model import GROUPS


@pytest.mark.slow
def test_planted_levels_of_the_real_torso_come_back(planted, fit_settings):
    found = planted.recover(20, fit_settings, planted.prepare(2))
    assert found["planted"].shape == (20, 4)
    assert list(found["median_error"]) == list(GROUPS)
    for group, error in found["median_error"].items():
        assert error <= 0.05, group
    for key in ("correlation", "chest_correlation"):
        assert len(found[key]) == 6
        assert all(abs(value) < 1 for value in found[key].values()), key


@pytest.mark.slow
def test_one_and_two_workers_give_the_same_bits_on_the_real_torso(
    planted, fit_settings, monkeypatch
):
    for name, value in (("INSPIRATION", 0.6), ("EXPIRATION", 0.9), ("PAUSE", 0.1)):
        monkeypatch.setattr(planted, name, value)
    monkeypatch.setattr(planted, "N_DESIGN", 22)
    monkeypatch.setattr(planted, "N_POLISH", 8)
    _, torso, still = planted.prepare(1)
    truth, fits = planted.draw_levels(1)[0], []
    for workers in (1, 2):
        simulator = dataclasses.replace(torso.simulator, workers=workers)
        fresh = planted.Remembered(simulator=simulator, known={}, time=np.empty(0))
        fits.append(planted.fit_draw(truth, 0, fresh, still, fit_settings))
    one, two = fits
    assert len(one.cost) == 22 + 8
    assert np.array_equal(one.levels, two.levels)
    assert np.array_equal(one.cost, two.cost)
    assert np.array_equal(one.displacement(), two.displacement())
