"""A ball on the belly: contact, volume and return (dilorenzo2009, Fig. 3.6)."""

from __future__ import annotations

import numpy as np
import pytest

from sim.errors import ParameterError
from sim.impact import IMPACT_STEP, Impact, drop_ball
from sim.physics.ball import Ball, add_ball
from sim.resting import RestingTorso


@pytest.fixture(scope="module")
def impact(resting: RestingTorso) -> Impact:
    """5 kg of lead from half a metre."""
    return drop_ball(resting, mass=5.0, height=0.5)


def test_the_ball_strikes_when_it_has_fallen(impact: Impact) -> None:
    # free fall of 0.5 m takes 0.319 s; before that the wall does not move
    struck = impact.time[np.argmax(impact.dent > 1e-3)]
    assert struck == pytest.approx(np.sqrt(2.0 * 0.5 / 9.81), abs=0.012)
    assert impact.dent.max() > 0.03


def test_the_belly_keeps_its_volume(impact: Impact) -> None:
    # "The volume in this animation showed an error less than 0.5 percent"
    assert np.abs(impact.volume_error).max() < 0.005
    assert impact.pressure.max() > 2.0 * impact.pressure[0]


def test_the_wall_returns(impact: Impact) -> None:
    assert impact.dent[-1] < 1e-3


@pytest.mark.slow
def test_halving_the_step_changes_little(resting: RestingTorso, impact: Impact) -> None:
    fine = drop_ball(resting, mass=5.0, height=0.5, duration=0.6, step=0.5 * IMPACT_STEP)
    early = impact.time <= 0.6
    assert impact.dent[early].max() == pytest.approx(fine.dent.max(), rel=0.02)
    assert np.abs(impact.volume_error[early]).max() == pytest.approx(
        np.abs(fine.volume_error).max(), rel=0.02
    )


def test_action_and_reaction() -> None:
    rng = np.random.default_rng(3)
    x, v, f = rng.normal(0.0, 0.05, (6, 3)), rng.normal(0.0, 1.0, (6, 3)), np.zeros((6, 3))
    ball = Ball(struck=np.arange(6), reach=0.1, mass=2.0, stiffness=500.0, damping=3.0)
    state, step = np.array([0.02, 0.0, 0.01, -1.0, 0.0, 0.5]), 1e-3
    before = state.copy()
    add_ball(ball, state, np.zeros(3), step, x, v, f)
    assert np.abs(f).max() > 1.0
    np.testing.assert_allclose(2.0 * (state[3:] - before[3:]), -step * f.sum(axis=0), atol=1e-12)


def test_a_ball_of_nothing_is_refused(resting: RestingTorso) -> None:
    with pytest.raises(ParameterError, match=r"ball: 0\.0 kg from 1\.0 m"):
        drop_ball(resting, mass=0.0, height=1.0)
