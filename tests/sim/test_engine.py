"""The step loop: the same numbers every time, on any number of threads; divergence is told."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sim import simulate as simulation
from sim.breaths import BreathSimulator
from sim.engine import State
from sim.errors import TorsoError, UnstableSimulation
from sim.model.muscles import MUSCLE_GROUPS
from sim.physics.types import Floats
from sim.rest import copy_state
from sim.resting import RestingTorso
from sim.simulate import BREATH_STEP, Trajectory, simulate

FIELDS = ("qpos", "soft", "lung", "chest", "abdomen", "alveolar", "pleural", "flow")


def some_effort(duration: float = 1.0) -> Floats:
    n = round(duration / BREATH_STEP)
    rise = np.minimum(np.arange(n) * BREATH_STEP, 1.0)
    share = np.zeros(len(MUSCLE_GROUPS))
    share[MUSCLE_GROUPS.index("diaphragm")] = 0.1
    share[MUSCLE_GROUPS.index("external_intercostals")] = 0.3
    return np.asarray(rise[:, None] * share)


def same(a: Trajectory, b: Trajectory) -> bool:
    return all(np.array_equal(getattr(a, name), getattr(b, name)) for name in FIELDS)


def test_the_same_run_twice_is_the_same_to_the_bit(resting: RestingTorso) -> None:
    runs = [simulate(resting, some_effort(), posture="upright") for _ in range(2)]
    assert runs[0].lung[-1] > runs[0].lung[0] + 1e-5
    assert same(*runs)


def test_a_run_does_not_remember_the_one_before(resting: RestingTorso) -> None:
    first = simulate(resting, some_effort(), posture="upright")
    simulate(resting, 3.0 * some_effort(), posture="upright")
    assert same(first, simulate(resting, some_effort(), posture="upright"))


def test_one_worker_and_two_agree_to_the_bit(resting: RestingTorso) -> None:
    marks = resting.landmarks("upright")
    bound = resting.bind(np.array([marks["STRN"], marks["NAVEL"]]), "upright")
    levels = np.random.default_rng(1).uniform(0.0, 0.1, (3, 4))
    runs = []
    for workers in (1, 2):
        breather = BreathSimulator(
            torso=resting, posture="upright", attachments=bound, inspiration_time=0.3,
            expiration_time=0.4, pause_time=0.1, rate=25.0, workers=workers,
        )  # fmt: skip
        runs.append(breather.run(levels))
    assert not runs[0].failed.any()
    np.testing.assert_array_equal(runs[0].positions, runs[1].positions)
    np.testing.assert_array_equal(runs[0].lung_volume, runs[1].lung_volume)


def test_frames_come_at_the_rate_asked_for(resting: RestingTorso) -> None:
    run = simulate(resting, some_effort(), posture="upright", rate=25.0, tension=True)
    assert len(run.time) == 25
    np.testing.assert_allclose(run.time, (np.arange(25) + 1) / 25.0)
    assert run.tension.shape == (25, len(resting.torso.plant.muscles.a))
    assert run.tension.min() >= 0.0


def beaten(resting: RestingTorso, dump: Path | None = None) -> UnstableSimulation:
    """A run whose activation no muscle has: a million times the maximum."""
    activation = np.full((600, len(MUSCLE_GROUPS)), 1e6)
    with pytest.raises(UnstableSimulation) as error:
        simulate(resting, activation, posture="upright", dump=dump)
    return error.value


def test_divergence_is_told_in_one_line(resting: RestingTorso) -> None:
    error = beaten(resting)
    assert isinstance(error, TorsoError)
    assert error.dump is None
    text = str(error)
    assert "\n" not in text
    assert "diverged at" in text
    assert "m/s" in text
    assert "Lower the activation or the step." in text


def test_divergence_leaves_its_state_behind(resting: RestingTorso, tmp_path: Path) -> None:
    dump = tmp_path / "deep" / "state.npz"
    error = beaten(resting, dump)
    assert error.dump == dump
    assert str(dump) in str(error)
    with np.load(dump) as archive:
        assert set(archive.files) == set(State._fields)
        assert archive["qpos"].shape == resting.upright.state.qpos.shape


def test_a_diverged_run_harms_no_other(
    resting: RestingTorso, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = copy_state(resting.upright.state)
    good = simulate(resting, some_effort(0.2), posture="upright")
    beaten(resting)
    for now, then in zip(resting.upright.state, before, strict=True):
        np.testing.assert_array_equal(now, then)
    assert same(good, simulate(resting, some_effort(0.2), posture="upright"))
    # a limit that no run can keep stops the first step
    monkeypatch.setattr(simulation, "SPEED_LIMIT", 0.0)
    with pytest.raises(UnstableSimulation, match=r"diverged at 0\.000 s"):
        simulate(resting, some_effort(0.2), posture="upright")


def test_a_failed_breath_is_marked_and_the_others_go_on(resting: RestingTorso) -> None:
    marks = resting.landmarks("upright")
    breather = BreathSimulator(
        torso=resting, posture="upright",
        attachments=resting.bind(marks["STRN"][None], "upright"), inspiration_time=0.3,
        expiration_time=0.4, pause_time=0.1, rate=25.0, workers=2,
    )  # fmt: skip
    runs = breather.run(np.array([[0.1, 0.05, 0.0, 0.0], [np.nan, 0.05, 0.0, 0.0]]))
    assert runs.failed.tolist() == [False, True]
    assert np.isnan(runs.positions[1]).all()
    assert np.isfinite(runs.positions[0]).all()
