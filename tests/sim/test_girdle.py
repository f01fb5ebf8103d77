"""Shoulder girdles and arms: where they sit, what moves them, and that their weight is carried."""

from __future__ import annotations

import numpy as np
import pytest

from sim.model.muscles import MUSCLE_GROUPS
from sim.model.torso import Subject, build_torso
from sim.physics.types import Floats
from sim.resting import RestingTorso
from sim.simulate import BREATH_STEP, replay, simulate
from sim.tables import body_size, read_rows

BODIES = [f"{part}_{side}" for part in ("girdle", "upper_arm", "forearm") for side in "LR"]


def shoulder_way(resting: RestingTorso, group: str, level: float) -> tuple[Floats, Floats]:
    """How far left and right shoulder go while a group pulls for 1.2 s, mm."""
    n = round(1.2 / BREATH_STEP)
    activation = np.zeros((n, len(MUSCLE_GROUPS)))
    ramp = np.minimum(np.arange(n) / (0.4 * n), 1.0)
    activation[:, MUSCLE_GROUPS.index(group)] = level * ramp
    run = simulate(resting, activation, posture="upright", rate=10.0)
    model = resting.torso.skeleton.model
    at = replay(resting, run, np.zeros(0, dtype=np.int64)).position
    left, right = (at[:, model.body(f"upper_arm_{side}").id] for side in "LR")
    return 1e3 * (left[-1] - left[0]), 1e3 * (right[-1] - right[0])


def test_six_bodies_hang_on_the_sternum(resting: RestingTorso) -> None:
    model = resting.torso.skeleton.model
    for name in BODIES:
        assert model.body(name).dofnum == 3
    for side in "LR":
        assert model.body(f"girdle_{side}").parentid == model.body("sternum").id
        assert model.body(f"upper_arm_{side}").parentid == model.body(f"girdle_{side}").id
        assert model.body(f"forearm_{side}").parentid == model.body(f"upper_arm_{side}").id


@pytest.mark.parametrize(
    "subject",
    [
        Subject(sex="male", stature=1.756, mass=75.0),
        Subject(sex="female", stature=1.55, mass=50.0),
    ],
)
def test_shoulders_are_as_broad_as_the_population(subject: Subject) -> None:
    places = build_torso(subject).anatomy.girdle
    breadth = body_size(subject)["biacromial_breadth"]
    tip = places["acromion"]
    # rolling the shoulder down by its few degrees shortens the way across a little
    assert tip[0, 1] - tip[1, 1] == pytest.approx(breadth, rel=0.02)
    np.testing.assert_allclose(tip[1], tip[0] * [1.0, -1.0, 1.0], atol=1e-12)
    length = np.linalg.norm(places["clavicle_acromial"][0] - places["clavicle_sternal"][0])
    # end points, both sexes: 149.4 +- 10.3 mm (Bernat 2014)
    assert 0.125 < length * 1.756 / subject.stature < 0.165


@pytest.mark.parametrize(
    ("group", "axis", "sign"),
    [
        ("shoulder_elevators", 2, 1.0),
        ("shoulder_depressors", 2, -1.0),
        ("serratus_anterior", 0, 1.0),
        ("shoulder_retractors", 0, -1.0),
    ],
)
def test_each_group_moves_the_shoulders_its_way(
    resting: RestingTorso, group: str, axis: int, sign: float
) -> None:
    left, right = shoulder_way(resting, group, 0.2)
    assert sign * left[axis] > 3.0
    np.testing.assert_allclose(right, left * [1.0, -1.0, 1.0], atol=2.0)


def test_every_girdle_muscle_is_there_on_both_sides(resting: RestingTorso) -> None:
    plant = resting.torso.plant
    for row in read_rows("girdle_muscles.csv"):
        assert row["group"] in MUSCLE_GROUPS
    groups = [row["group"] for row in read_rows("girdle_muscles.csv")]
    for name in set(groups):
        count = int(np.sum(plant.muscles.group == MUSCLE_GROUPS.index(name)))
        assert count == 2 * groups.count(name)


@pytest.mark.parametrize("posture", ["upright", "supine"])
def test_their_weight_is_carried(resting: RestingTorso, posture: str) -> None:
    n = round(1.0 / BREATH_STEP)
    run = simulate(resting, np.zeros((n, len(MUSCLE_GROUPS))), posture=posture, rate=20.0)
    model = resting.torso.skeleton.model
    at = replay(resting, run, np.zeros(0, dtype=np.int64)).position
    moved = [np.ptp(at[:, model.body(name).id], axis=0).max() for name in BODIES]
    assert max(moved) < 2e-3
