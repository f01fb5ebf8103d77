"""The bend of the spine beside the levels: a planted one is found, none is made up."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pipeline.level_fit import fit_levels
from pipeline.model import NO_BEND

LEVELS = (0.4, 0.3, 0.0, 0.2)
BEND = tuple(np.radians([-3.0, 2.0, 5.0]))


@pytest.fixture(scope="module")
def quick(fit_settings):
    return replace(fit_settings, n_initial=24, spine=True)


def test_planted_bend_is_found(plant, quick):
    recording, signature, _ = plant.record(LEVELS, bend=BEND)
    found = fit_levels(recording, signature, plant.Model(), quick, n_evaluations=16, seed=1)
    assert np.degrees(found.bend) == pytest.approx(np.degrees(BEND), abs=0.5)
    assert found.trials.levels[found.trials.best] == pytest.approx(LEVELS, abs=0.05)


def test_straight_spine_stays_straight(plant, quick):
    recording, signature, _ = plant.record(LEVELS)
    found = fit_levels(recording, signature, plant.Model(), quick, n_evaluations=16, seed=1)
    assert np.abs(np.degrees(found.bend)).max() < 0.5


def test_no_bend_unless_asked_for_nor_lying(plant, quick):
    recording, signature, _ = plant.record(LEVELS, bend=BEND)
    model = plant.Model()
    unasked = fit_levels(
        recording, signature, model, replace(quick, spine=False), n_evaluations=0, seed=1
    )
    lying = fit_levels(
        replace(recording, posture="supine"), signature, model, quick, n_evaluations=0, seed=1
    )
    assert unasked.bend == lying.bend == NO_BEND


def test_bend_with_failing_runs_is_none(plant, quick):
    recording, signature, _ = plant.record(LEVELS, bend=BEND)

    class Stiff(plant.Model):
        """Cannot be bent."""

        def simulator(self, *args, bend=NO_BEND, **kwargs):
            made = super().simulator(*args, bend=bend, **kwargs)
            return replace(made, fails_above=-1.0) if any(bend) else made

    found = fit_levels(recording, signature, Stiff(), quick, n_evaluations=8, seed=1)
    assert found.bend == NO_BEND
