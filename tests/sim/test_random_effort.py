"""No activation in [0, 1] makes the torso diverge or its belly lose its volume."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from sim.model.muscles import MUSCLE_GROUPS
from sim.random_effort import KINDS, random_effort
from sim.resting import RestingTorso
from sim.simulate import BREATH_STEP, simulate

N_SETS = 50


def test_efforts_are_activations_of_every_kind() -> None:
    efforts = np.stack([random_effort(seed, step=0.01) for seed in range(60)])
    assert efforts.shape == (60, 100, len(MUSCLE_GROUPS))
    assert efforts.min() == 0.0
    assert 0.95 < efforts.max() <= 1.0
    rising = [np.ptp(np.diff(efforts[k], axis=0)) for k in range(len(KINDS))]
    assert len(set(rising)) == len(KINDS)
    np.testing.assert_array_equal(efforts[7], random_effort(7, step=0.01))


@pytest.mark.slow
def test_no_effort_diverges(resting: RestingTorso) -> None:
    def one(seed: int) -> tuple[float, bool]:
        run = simulate(resting, random_effort(seed, step=BREATH_STEP), posture="upright")
        finite = all(np.isfinite(part).all() for part in (run.qpos, run.soft, run.lung))
        return float(np.abs(run.abdomen / run.abdomen[0] - 1.0).max()), finite

    with ThreadPoolExecutor(2) as pool:
        found = list(pool.map(one, range(N_SETS)))
    assert all(finite for _, finite in found)
    # a maximal cough may cost 2 %
    assert max(error for error, _ in found) < 0.02
