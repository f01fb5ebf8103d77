"""What a run is told besides activation: a bend of the back, the resistance of the larynx."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sim.errors import ParameterError
from sim.model.muscles import MUSCLE_GROUPS
from sim.model.spine import DIRECTIONS, spine_bend, spine_range
from sim.resting import RestingTorso
from sim.simulate import BREATH_STEP, group_activation, replay, simulate

CLOSED = 1e15
"""Pa s/m^3; a litre a second would take ten billion atmospheres."""


@pytest.mark.parametrize("direction", DIRECTIONS)
def test_a_bend_is_shared_out_and_adds_up(direction: str) -> None:
    low, high = spine_range(direction)
    axis = DIRECTIONS[direction][2]
    for whole in (-low, -0.3 * low, 0.5 * high, high):
        turns = spine_bend(**{direction: np.array([whole])})[0]
        assert abs(turns[:, axis].sum()) == pytest.approx(abs(whole))
        assert not np.delete(turns, axis, axis=1).any()


def test_a_bend_beyond_the_limits_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"spine: flexion goes from 0 to 171\.9 degrees"):
        spine_bend(flexion=np.array([0.0, 3.0]))
    with pytest.raises(ParameterError, match="no direction 'bow'"):
        spine_bend(bow=np.zeros(3))


@pytest.mark.parametrize(
    ("direction", "axis"), [("flexion", (0, 1, 0)), ("lateral", (-1, 0, 0)), ("twist", (0, 0, 1))]
)
def test_the_back_bends_the_named_way(
    resting: RestingTorso, direction: str, axis: tuple[int, int, int]
) -> None:
    n = round(1.5 / BREATH_STEP)
    bend = np.radians(20.0) * np.minimum(np.arange(n) / (0.4 * n), 1.0)
    run = simulate(
        resting, np.zeros((n, len(MUSCLE_GROUPS))), posture="upright", rate=10.0,
        bend=spine_bend(**{direction: bend}),
    )  # fmt: skip
    model = resting.torso.skeleton.model
    turned = replay(resting, run, np.zeros(0, dtype=np.int64)).rotation[[0, -1]]
    skull = Rotation.from_matrix(turned[:, model.body("skull").id])
    turn = np.degrees((skull[1] * skull[0].inv()).as_rotvec())
    # the bend is the servos' set point; the weight that leans takes the back further, most sideways
    assert 15.0 < turn @ axis < 30.0
    assert np.linalg.norm(turn - (turn @ axis) * np.array(axis)) < 4.0


def test_a_closed_larynx_keeps_the_air_and_builds_pressure(resting: RestingTorso) -> None:
    n = round(0.6 / BREATH_STEP)
    effort = group_activation(np.array([0.0, 0.0, 0.3, 0.3])) * np.ones((n, 1))
    effort *= np.minimum(np.arange(n) / (0.5 * n), 1.0)[:, None]
    closed = simulate(resting, effort, posture="upright", larynx=np.full(n, CLOSED), rate=100.0)
    opened = simulate(resting, effort, posture="upright", rate=100.0)
    assert np.abs(closed.flow).max() < 1e-9
    gas = (closed.alveolar + resting.torso.plant.constants.atmosphere) * closed.lung
    np.testing.assert_allclose(gas, gas[0], rtol=1e-9)
    assert closed.alveolar[-1] > 2000.0
    # an open airway leaves its own resistance, and more where the volume limits the flow
    k, flow = resting.torso.plant.constants, opened.flow[-1]
    assert opened.alveolar[-1] >= 0.98 * (k.airway_k1 * flow + k.airway_k2 * flow * abs(flow))
    assert opened.alveolar[-1] < 0.6 * closed.alveolar[-1]
    assert opened.lung[-1] < opened.lung[0] - 0.2e-3


def test_a_larynx_of_another_length_is_refused(resting: RestingTorso) -> None:
    with pytest.raises(ParameterError, match="larynx has 7 steps, activation 9"):
        simulate(resting, np.zeros((9, len(MUSCLE_GROUPS))), posture="upright", larynx=np.zeros(7))
