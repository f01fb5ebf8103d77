"""The resting equilibrium: it stands still, at the predicted volume, in both postures."""

from __future__ import annotations

import numpy as np
import pytest

from sim import engine
from sim.errors import ParameterError
from sim.model.landmarks import marker_places
from sim.model.muscles import MUSCLE_GROUPS
from sim.model.torso import Subject, lung_capacity
from sim.physics.contact import follow_sheet
from sim.physics.types import Floats
from sim.rest import GRAVITY, Machine, lie_down, residual
from sim.resting import RestingTorso, rest_torso
from sim.simulate import BREATH_STEP, Trajectory, replay, simulate, skin_frames

CMH2O = 98.0665


def quiet(resting: RestingTorso, duration: float, posture: str = "upright") -> Trajectory:
    """A run without any activation."""
    nothing = np.zeros((round(duration / BREATH_STEP), len(MUSCLE_GROUPS)))
    return simulate(resting, nothing, posture=posture, rate=10.0)


def shift(resting: RestingTorso, run: Trajectory, posture: str = "upright") -> Floats:
    """Greatest distance of any point from rest, frame by frame, m."""
    everything = np.arange(len(resting.upright.points))
    moved = replay(resting, run, everything).points - resting.rest(posture).points
    return np.asarray(np.linalg.norm(moved, axis=2).max(axis=1))


@pytest.fixture(scope="module")
def ten_seconds(resting: RestingTorso) -> Trajectory:
    return quiet(resting, 10.0)


def test_it_stands_still(resting: RestingTorso, ten_seconds: Trajectory) -> None:
    assert shift(resting, ten_seconds).max() < 2e-3


def test_bones_and_skin_hardly_stir(resting: RestingTorso, ten_seconds: Trajectory) -> None:
    skin = skin_frames(resting, ten_seconds)
    assert np.linalg.norm(skin - resting.vertices("upright"), axis=2).max() < 2e-3


def test_pleural_pressure_is_that_of_rest(resting: RestingTorso, ten_seconds: Trajectory) -> None:
    assert ten_seconds.pleural[-1] / CMH2O == pytest.approx(-5.0, abs=0.1)
    # the last five seconds as a whole, as single frames show the contact's chatter (0.04 cmH2O);
    # net flow against some 300 mL/s in quiet breathing
    assert abs(ten_seconds.alveolar[-50:].mean()) / CMH2O < 0.02
    assert abs(ten_seconds.lung[-1] - ten_seconds.lung[-51]) / 5.0 < 1e-6


def test_lung_holds_the_predicted_volume(resting: RestingTorso, ten_seconds: Trajectory) -> None:
    predicted = lung_capacity(resting.torso.subject)["frc"]
    assert ten_seconds.lung[0] == pytest.approx(predicted, rel=2e-3)
    assert ten_seconds.lung[-1] == pytest.approx(predicted, rel=5e-3)


def test_bones_are_in_balance(resting: RestingTorso) -> None:
    # what is left against the weight of the trunk, some 100 N
    rest = resting.upright
    machine, plant = Machine(rest.torso), rest.torso.plant
    follow_sheet(
        rest.points,
        plant.contacts,
        machine.work.held,
        machine.work.ease,
        1.0,
        machine.work.sheet_normal,
    )
    pleural = rest.torso.parameters["end_expiratory_pleural"]
    left = residual(machine, plant, rest.state, GRAVITY["upright"], pleural)
    assert np.abs(left).max() < 1.0


def test_the_built_bones_are_the_resting_bones(resting: RestingTorso) -> None:
    model = resting.torso.skeleton.model
    tendon = int(model.joint("central_tendon").qposadr[0])
    moved = np.delete(resting.upright.state.qpos - model.qpos0, np.arange(tendon, tendon + 7))
    assert np.abs(moved).max() < 1e-6


def test_abdominal_pressure_grows_downwards(resting: RestingTorso) -> None:
    run = quiet(resting, 0.2)
    # at the rim of the diaphragm: above the atmosphere, below a third of its maximum
    assert 0.0 < run.abdominal[-1] / CMH2O < 40.0


def air_lost_lying(resting: RestingTorso) -> float:
    run = quiet(resting, 0.5, "supine")
    return float(lung_capacity(resting.torso.subject)["frc"] - run.lung[-1])


def test_lying_down_takes_air_out(resting: RestingTorso) -> None:
    assert air_lost_lying(resting) > 0.0


def test_lying_down_takes_as_much_air_out_as_measured(resting: RestingTorso) -> None:
    # 0.5 to 1.1 L (Agostoni & Hyatt 1986)
    assert 0.5e-3 < air_lost_lying(resting) < 1.1e-3


def test_lying_down_pushes_the_diaphragm_up(resting: RestingTorso) -> None:
    dome = resting.torso.diaphragm[:, -1]
    lying, standing = (resting.rest(p).points[dome, 2].mean() for p in ("supine", "upright"))
    assert lying > standing + 0.005


def test_only_gravity_turns(resting: RestingTorso) -> None:
    assert resting.rest("supine").torso is resting.torso
    assert resting.rest("upright") is resting.upright
    assert lie_down(resting.upright, "upright") is resting.upright


def test_an_unknown_posture_is_one_clear_line(resting: RestingTorso) -> None:
    with pytest.raises(ParameterError, match="upright or supine") as error:
        resting.rest("sitting")
    assert "\n" not in str(error.value)


def test_markers_ride_on_the_skin(resting: RestingTorso) -> None:
    marks = resting.landmarks("upright")
    points = np.array(list(marks.values()))
    bound = resting.bind(points, "upright")
    found = marker_places(bound, resting.vertices("upright"))
    np.testing.assert_allclose(found, points, rtol=0.0, atol=1e-9)


def test_every_run_starts_from_the_same_rest(resting: RestingTorso) -> None:
    before = [part.copy() for part in resting.upright.state]
    quiet(resting, 0.2)
    for now, then in zip(resting.upright.state, before, strict=True):
        np.testing.assert_array_equal(now, then)
    assert isinstance(resting.upright.state, engine.State)


@pytest.mark.slow
def test_no_drift_in_a_minute(resting: RestingTorso) -> None:
    run = quiet(resting, 60.0)
    away = shift(resting, run)
    assert away.max() < 2e-3
    # no trend: the last half is where the first half ended
    assert away[-1] < away[: len(away) // 2].max() + 2e-4
    assert abs(run.lung[-1] - run.lung[len(run.lung) // 2]) < 5e-6


@pytest.mark.slow
def test_supine_stands_still_for_a_minute(resting: RestingTorso) -> None:
    run = quiet(resting, 60.0, "supine")
    assert shift(resting, run, "supine").max() < 2e-3
    assert abs(run.lung[-1] - run.lung[len(run.lung) // 2]) < 5e-6


@pytest.mark.slow
@pytest.mark.parametrize(
    "subject",
    [
        Subject(sex="female", stature=1.63, mass=62.0),
        Subject(sex="female", stature=1.52, mass=50.0),
        Subject(sex="male", stature=1.92, mass=110.0),
    ],
)
def test_others_stand_still_too(subject: Subject) -> None:
    other = rest_torso(subject)
    run = quiet(other, 10.0)
    assert shift(other, run).max() < 2e-3
    assert run.pleural[-1] / CMH2O == pytest.approx(-5.0, abs=0.1)
    assert run.lung[-1] == pytest.approx(lung_capacity(subject)["frc"], rel=5e-3)
