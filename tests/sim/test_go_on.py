"""A run in pieces is the run as a whole."""

from __future__ import annotations

import numpy as np
import pytest

from sim.physics.types import Floats
from sim.resting import RestingTorso
from sim.simulate import (
    Moment,
    Trajectory,
    go_on,
    group_activation,
    rest_moment,
    simulate,
)

N, CUT, LARYNX = 200, 90, 3e6
STEP = 0.002
"""s, of a call in `pipeline`."""
RATE = 1.0 / STEP


def a_call() -> Floats:
    """Internal intercostals and abdomen in a burst of 0.2 s."""
    time = np.arange(N) * STEP
    inside = (time > 0.05) & (time < 0.25)
    burst = np.where(inside, np.sin(np.pi * (time - 0.05) / 0.2) ** 2, 0.0)
    still = np.zeros(N)
    return group_activation(np.stack([still, still, 0.4 * burst, 0.2 * burst], axis=1))


def in_pieces(resting: RestingTorso, lung: str) -> tuple[Trajectory, Trajectory, Moment]:
    drive, larynx = a_call(), np.full(N, LARYNX)
    first, between = go_on(
        resting, rest_moment(resting, "upright"), drive[:CUT], step=STEP, rate=RATE,
        larynx=larynx[:CUT], lung=lung,
    )  # fmt: skip
    second, _ = go_on(
        resting, between, drive[CUT:], step=STEP, rate=RATE, larynx=larynx[CUT:], lung=lung
    )
    return first, second, between


@pytest.mark.parametrize("lung", ["two_way", "one_way"])
def test_pieces_join(resting: RestingTorso, lung: str) -> None:
    first, second, _ = in_pieces(resting, lung)
    whole = simulate(
        resting,
        a_call(),
        posture="upright",
        step=STEP,
        rate=RATE,
        larynx=np.full(N, LARYNX),
        lung=lung,
    )
    for name in ("alveolar", "lung", "flow"):
        joined = np.concatenate([getattr(first, name), getattr(second, name)])
        asked = getattr(whole, name)
        # the matrix of the implicit step is renewed at the cut, its answer changes a little
        assert np.abs(joined - asked).max() < 0.01 * np.ptp(asked), name
    assert np.array_equal(first.qpos, whole.qpos[:CUT])


def test_a_moment_can_be_started_from_again(resting: RestingTorso) -> None:
    _, second, between = in_pieces(resting, "two_way")
    kept = between.state.soft.copy()
    again, _ = go_on(
        resting, between, a_call()[CUT:], step=STEP, rate=RATE, larynx=np.full(N - CUT, LARYNX)
    )
    assert np.array_equal(between.state.soft, kept)
    assert np.array_equal(again.alveolar, second.alveolar)


def test_the_papers_lung_goes_on_from_its_own_volume(resting: RestingTorso) -> None:
    first, second, between = in_pieces(resting, "one_way")
    assert between.one_way is not None
    assert between.one_way.volume == first.lung[-1]
    drawn = second.flow[0] * STEP
    assert second.lung[0] == pytest.approx(first.lung[-1] - drawn, rel=1e-9)
