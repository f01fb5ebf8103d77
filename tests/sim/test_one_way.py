"""The papers' lung against what its equations say."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.errors import ParameterError
from sim.model.muscles import MUSCLE_GROUPS
from sim.physics.one_way import one_way_run, pressure_drop
from sim.physics.types import Floats
from sim.resting import RestingTorso
from sim.simulate import BREATH_STEP, group_activation, simulate
from sim.tables import parameters

ATMOSPHERE, RECOIL = 101325.0, 490.0


def follow(chest: Floats, step: float) -> Floats:
    p, out = parameters(), np.empty((len(chest), 4))
    one_way_run(
        chest, step, p["one_way_share"], p["one_way_compliance"], RECOIL, p["one_way_k"],
        ATMOSPHERE, out,
    )  # fmt: skip
    return out


def breathing(step: float, litres: float, rate: float) -> Floats:
    t = np.arange(round(4.0 / step)) * step
    return 4.5e-3 + 0.5e-3 * litres * (1.0 - np.cos(2.0 * np.pi * rate * t))


def test_it_starts_at_eighty_percent_and_the_pressure_of_the_mouth() -> None:
    out = follow(np.full(10, 4e-3), 1e-3)
    np.testing.assert_allclose(out[:, 0], 3.2e-3, rtol=1e-9)
    np.testing.assert_allclose(out[:, 1], 0.0, atol=1e-3)
    np.testing.assert_allclose(out[:, 2], -RECOIL, atol=1e-3)


@given(st.floats(0.1, 2.5), st.floats(0.1, 5.0))
def test_flow_follows_the_pressure_drop_with_its_sign(litres: float, rate: float) -> None:
    step, k = 1e-3, parameters()["one_way_k"]
    out = follow(breathing(step, litres, rate), step)
    assert np.isfinite(out).all()
    # Eq. 6.4 holds at the end of every step; a flow is known to one part in the volume's digits
    drop = out[1:, 1]
    flow = np.sign(drop) * np.sqrt(np.abs(drop) / k)
    np.testing.assert_allclose(out[1:, 3], flow, rtol=2e-3, atol=2e-7)
    volume = out[0, 0] - step * np.cumsum(out[1:, 3])
    np.testing.assert_allclose(out[1:, 0], volume, rtol=1e-9)


def test_no_chatter_at_a_long_step() -> None:
    # the printed loop swings between +-2.4 L/s at 4 ms
    slow, fine = follow(breathing(4e-3, 0.5, 0.25), 4e-3), follow(breathing(1e-3, 0.5, 0.25), 1e-3)
    assert np.abs(np.diff(slow[5:, 3])).max() < 0.02e-3
    np.testing.assert_allclose(slow[:, 0], fine[3::4, 0], rtol=3e-3)


def test_pressure_falls_as_the_chest_widens() -> None:
    at = [pressure_drop(3.2e-3, chest, 80.0, 2e-6, 2e-3, ATMOSPHERE) for chest in (4e-3, 4.1e-3)]
    assert at[1] < at[0]


def test_a_run_with_the_papers_lung(resting: RestingTorso) -> None:
    n = round(2.0 / BREATH_STEP)
    shape = np.sin(np.pi * np.arange(n) / n)[:, None] * np.array([0.3, 0.1, 0.0, 0.0])
    run = simulate(resting, group_activation(shape), posture="upright", rate=100.0, lung="one_way")
    assert run.lung[0] == pytest.approx(parameters()["one_way_share"] * run.chest[0], rel=1e-3)
    # nothing acts back: the chest is the same as with the pleural pressure held
    assert np.ptp(run.chest) > 0.2e-3
    gas = run.chest - run.lung
    boyle = (run.pleural + ATMOSPHERE) * gas
    np.testing.assert_allclose(boyle, boyle[0], rtol=1e-6)
    assert np.ptp(run.lung) == pytest.approx(np.ptp(run.chest), rel=0.05)


def test_an_unknown_lung_is_refused(resting: RestingTorso) -> None:
    with pytest.raises(ParameterError, match=r"lung is 'iron'\. Use two_way or one_way"):
        simulate(resting, np.zeros((9, len(MUSCLE_GROUPS))), posture="upright", lung="iron")
