"""Breaths: the sawtooth, the two breaths of a run, the error of the step."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.breaths import BreathSimulator, sawtooth
from sim.model.muscles import MUSCLE_GROUPS
from sim.model.torso import Subject, lung_capacity
from sim.physics.types import Floats
from sim.resting import RestingTorso, rest_torso
from sim.simulate import BREATH_STEP, LEVELS, group_activation, simulate
from sim.tables import parameters

RISE = parameters()["inspiratory_rise"]
RELEASE = parameters()["inspiratory_release"]
FADE = parameters()["expiratory_fade"]
TIMING = {"inspiration": 1.6, "expiration": 2.4, "pause": 0.4}


def breather(resting: RestingTorso) -> BreathSimulator:
    marks = resting.landmarks("upright")
    return BreathSimulator(
        torso=resting, posture="upright", rate=25.0, workers=1,
        attachments=resting.bind(np.array([marks["STRN"], marks["NAVEL"]]), "upright"),
        inspiration_time=1.0, expiration_time=1.4, pause_time=0.2,
    )  # fmt: skip


def at(time: float) -> tuple[float, float]:
    inward, outward = sawtooth(np.array([time]), **TIMING)
    return float(inward[0]), float(outward[0])


def test_inspiratory_sawtooth() -> None:
    assert at(0.0) == (0.0, 0.0)
    assert at(0.5 * RISE * 1.6)[0] == pytest.approx(0.5)
    for held in (RISE * 1.6, 1.6):
        assert at(held) == (pytest.approx(1.0), 0.0)
    # out without its pause lasts 2.0 s; the muscles let go over RELEASE of it
    assert at(1.6 + 0.5 * RELEASE * 2.0)[0] == pytest.approx(0.5)
    assert at(1.6 + RELEASE * 2.0)[0] == pytest.approx(0.0, abs=1e-12)
    assert at(3.9)[0] == 0.0


def test_expiratory_sawtooth() -> None:
    top = 1.6 + (1.0 - FADE) * 2.0
    assert at(top)[1] == pytest.approx(1.0)
    assert at(0.5 * (1.6 + top))[1] == pytest.approx(0.5)
    assert at(1.0)[1] == 0.0
    for rest in (3.6, 3.8, 3.99):
        assert at(rest) == (0.0, pytest.approx(0.0, abs=1e-12))


@given(st.floats(0.2, 5.0), st.floats(0.3, 8.0), st.floats(0.0, 0.8), st.floats(0.0, 20.0))
def test_sawtooth_is_periodic_and_between_nothing_and_all(
    inspiration: float, expiration: float, share: float, time: float
) -> None:
    timing = {"inspiration": inspiration, "expiration": expiration, "pause": share * expiration}
    period = inspiration + expiration
    now = np.array(sawtooth(np.array([time]), **timing))
    later = np.array(sawtooth(np.array([time + period]), **timing))
    assert (now >= 0.0).all()
    assert (now <= 1.0).all()
    steepest = period / min(RISE * inspiration, FADE * (expiration - share * expiration))
    np.testing.assert_allclose(later, now, rtol=0.0, atol=1e-9 * max(1.0, steepest))


def test_levels_reach_their_groups() -> None:
    one = group_activation(np.eye(4))
    assert one.shape == (4, len(MUSCLE_GROUPS))
    for k, name in enumerate(LEVELS[:3]):
        assert one[k, MUSCLE_GROUPS.index(name)] == 1.0
    belly = one[LEVELS.index("abdomen")]
    wall = [MUSCLE_GROUPS.index(g) for g in ("rectus", "transversus", "internal_oblique")]
    assert (belly[wall] > 0.0).all()
    assert not belly[MUSCLE_GROUPS.index("diaphragm")]
    assert (one >= 0.0).all()
    assert (one <= 1.0).all()


def test_activation_covers_two_breaths(resting: RestingTorso) -> None:
    breaths = breather(resting)
    activation = breaths.activation(np.array([0.2, 0.1, 0.05, 0.05]))
    n = round(2.4 / BREATH_STEP)
    assert activation.shape == (2 * n, len(MUSCLE_GROUPS))
    np.testing.assert_allclose(activation[:n], activation[n:], atol=1e-9)
    external = activation[:, MUSCLE_GROUPS.index("external_intercostals")]
    assert external.max() == pytest.approx(0.2, rel=1e-2)


def test_no_level_no_motion(resting: RestingTorso) -> None:
    runs = breather(resting).run(np.zeros((1, 4)))
    assert not runs.failed.any()
    assert np.ptp(runs.lung_volume[0]) < 1e-5
    assert np.ptp(runs.positions[0], axis=0).max() < 2e-4


def tidal(volume: Floats) -> float:
    return float(np.ptp(volume))


def test_more_effort_moves_more_air(resting: RestingTorso) -> None:
    levels = np.outer([0.5, 1.0, 1.5], [0.1, 0.06, 0.0, 0.0])
    runs = breather(resting).run(levels)
    volumes = [tidal(v) for v in runs.lung_volume]
    assert 0.0 < volumes[0] < volumes[1] < volumes[2]
    # in through the inspiration: the greatest volume comes about its end
    assert 0.8 < runs.time[np.argmax(runs.lung_volume[1])] < 1.4


def test_breathing_out_lowers_the_end_expiratory_volume(resting: RestingTorso) -> None:
    runs = breather(resting).run(np.array([[0.1, 0.06, 0.0, 0.0], [0.1, 0.06, 0.1, 0.1]]))
    assert runs.lung_volume[1].min() < runs.lung_volume[0].min() - 2e-5


def test_the_second_breath_is_steady(resting: RestingTorso) -> None:
    breaths = breather(resting)
    run = breaths.trajectory(np.array([0.1, 0.06, 0.05, 0.05]))
    start, end = np.interp([breaths.period, 2.0 * breaths.period], run.time, run.lung)
    second = run.lung[run.time >= breaths.period]
    assert abs(end - start) < 0.02 * tidal(second) + 5e-6


def run_at(resting: RestingTorso, levels: Floats, step: float) -> Floats:
    time = np.arange(2 * round(4.0 / step)) * step
    inward, outward = sawtooth(time, **TIMING)
    shape = np.stack([inward, inward, outward, outward], axis=1)
    run = simulate(
        resting, group_activation(shape * levels), posture="upright", step=step, rate=50.0
    )
    return run.lung[len(run.lung) // 2 :]


@pytest.mark.slow
@pytest.mark.parametrize(
    "levels", [[0.1, 0.06, 0.0, 0.0], [0.1, 0.06, 0.05, 0.05], [0.4, 0.25, 0.2, 0.2]]
)
def test_halving_the_step_hardly_changes_the_tidal_volume(
    resting: RestingTorso, levels: list[float]
) -> None:
    whole, half = (
        tidal(run_at(resting, np.array(levels), step)) for step in (BREATH_STEP, BREATH_STEP / 2)
    )
    assert half == pytest.approx(whole, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize(
    "subject",
    [Subject(sex="female", stature=1.2, mass=23.0), Subject(sex="male", stature=1.8, mass=140.0)],
    ids=["child", "heavy man"],
)
def test_a_child_and_a_heavy_man_breathe(subject: Subject) -> None:
    resting = rest_torso(subject)
    time = np.arange(round(8.0 / BREATH_STEP)) * BREATH_STEP
    inward, _ = sawtooth(time, **TIMING)
    levels = np.outer(inward, [0.15, 0.04, 0.0, 0.0])
    run = simulate(resting, group_activation(levels), posture="upright", rate=25.0)
    second = run.lung[run.time > 4.0]
    assert 0.05 < np.ptp(second) / lung_capacity(subject)["frc"] < 0.5
    assert np.abs(run.abdomen / run.abdomen[0] - 1.0).max() < 0.01
