"""Seven parameters of a call, found again on a lung that answers in a line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.call_effort import PARAMETERS, CallSpace, with_call
from pipeline.call_fit import CallTask, fit_call, normalised_rms, with_tonic
from pipeline.configuration import load, section
from pipeline.optimise import Stop
from pipeline.score import Score
from sim.control.curves import add_up
from sim.errors import UnstableSimulation

STEP = 0.002
SPACE = CallSpace(start=0.4, end=0.62, most=np.array([0.9, 0.9, 0.85]))
PLANTED = np.array([0.4, 0.15, 0.41, 5.5, 0.1, 0.43, 6.0])
GAIN = {"internal_intercostals": 4000.0, "abdomen": 2000.0, "diaphragm": -1500.0}


class Toy:
    """Pressure follows activation through a first-order lag; nothing else happens."""

    step = STEP
    lag = 0.015

    def __init__(self, *, broken: bool = False) -> None:
        self.broken = broken

    def each(self, moment: Any, scores: Sequence[Score], start: float, end: float) -> list[Any]:
        return [None if self.broken else self.one(score, start, end) for score in scores]

    def one(self, score: Score, start: float, end: float) -> Any:
        time = np.arange(round(start / STEP), round(end / STEP)) * STEP
        drive = sum(gain * add_up(score.curves(name), time) for name, gain in GAIN.items())
        pressure, value = np.empty(len(time)), 0.0
        for k, wanted in enumerate(drive):
            value += STEP / self.lag * (wanted - value)
            pressure[k] = value
        return SimpleNamespace(alveolar=pressure, flow=1e-6 * pressure), None


def settings(**changes: Any) -> Any:
    return section("follow", {**load(None, {})["follow"], **changes}, "test")


def task(**more: Any) -> CallTask:
    toy = Toy()
    told = with_call(with_tonic(with_tonic(Score(), 0.4, 0.0), 0.62, 0.05), PLANTED)
    pressure = toy.one(told, 0.4, 0.62)[0].alveolar
    start = with_tonic(Score(), 0.4, 0.0)
    return CallTask(runs=toy, moment=None, score=start, space=SPACE, pressure=pressure, **more)  # type: ignore[arg-type]


def guess() -> np.ndarray:
    return SPACE.values(SPACE.unit(PLANTED * np.array([0.5, 0.7, 1.02, 0.85, 0.5, 1.0, 1.1])))


@pytest.mark.parametrize("algorithm", ["nelder_mead", "bobyqa"])
def test_a_planted_pressure_is_followed(algorithm: str) -> None:
    one = task()
    fit = fit_call(one, [guess()], 0.0, settings(algorithm=algorithm, goal=0.0), 1)
    assert fit.rms < 0.05
    assert fit.rms == min(fit.trace)
    assert fit.evaluations == len(fit.trace) <= settings().n_evaluations
    assert one.cost(one.run([(fit.values, fit.tonic)])[0]) == fit.rms


def test_the_tonic_level_is_set_anew_between_the_searches() -> None:
    # a first step that sees bursts of the wrong length blames the tonic level for them
    wrong = SPACE.values(SPACE.unit(PLANTED * np.array([0.5, 0.7, 0.98, 1.5, 0.5, 1.0, 1.5])))
    fits = [
        fit_call(task(), [wrong], 0.0, settings(goal=0.0, linear_steps=1, n_evaluations=n), 1)
        for n in (14, 150)
    ]
    off = [abs(fit.tonic - 0.05) for fit in fits]
    assert off[1] < 0.5 * off[0]


def test_a_search_ends_at_the_error_asked_for() -> None:
    fit = fit_call(task(), [guess()], 0.0, settings(linear_steps=0, goal=0.2), 1)
    assert fit.rms <= 0.2 and fit.evaluations < 100
    assert fit.stop == Stop.REACHED


def test_a_quiet_call_gets_no_search() -> None:
    fit = fit_call(task(), [guess()], 0.0, settings(), 1, worth=False)
    assert fit.stop == Stop.NO_SEARCH and fit.evaluations < 40


def test_the_same_seed_gives_the_same_fit() -> None:
    first, second = (fit_call(task(), [guess()], 0.0, settings(), 3) for _ in range(2))
    assert np.array_equal(first.values, second.values)
    assert np.array_equal(first.trace, second.trace)


def test_flow_can_be_asked_for() -> None:
    one = task(quantity="flow")
    one.pressure = 1e-6 * one.pressure
    assert fit_call(one, [guess()], 0.0, settings(), 1).rms < 0.1


def test_a_torso_that_cannot_follow_says_so() -> None:
    one = task()
    one.runs = Toy(broken=True)  # type: ignore[assignment]
    with pytest.raises(UnstableSimulation, match=r"call at 0\.40 s"):
        fit_call(one, [guess()], 0.0, settings(n_evaluations=10), 1)


def test_no_pressure_at_all_costs_one() -> None:
    desired = np.sin(np.linspace(0, 3, 50)) ** 2
    assert normalised_rms(np.zeros(50), desired) == pytest.approx(1.0)
    assert normalised_rms(desired, desired) == 0.0


@given(st.lists(st.floats(0.0, 1.0), min_size=7, max_size=7))
def test_the_unit_box_is_the_space(unit: list[float]) -> None:
    values = SPACE.values(np.array(unit))
    low, high = SPACE.bounds
    assert (values >= low).all() and (values <= high).all()
    assert np.allclose(SPACE.unit(values), unit)


def test_expiratory_muscles_share_their_timing() -> None:
    told = with_call(Score(), PLANTED)
    inner, belly, dome = (
        told.bursts[m][0] for m in ("internal_intercostals", "abdomen", "diaphragm")
    )
    assert (inner.start, inner.period) == (belly.start, belly.period) == (0.41, 1 / 5.5)
    assert (dome.start, dome.period) == (0.43, 1 / 6.0)
    assert len(PARAMETERS) == 7


def test_a_call_is_told_to_a_longer_and_louder_one() -> None:
    other = replace(SPACE, start=1.0, end=1.44)
    moved = SPACE.moved(PLANTED, other, 1.5)
    assert moved[0] == pytest.approx(0.6) and moved[3] == pytest.approx(5.5 / 2)
    assert moved[2] == pytest.approx(1.0 + 2 * 0.01)
