"""Bouts, breaths and the air they take, on the control file's clock."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from pipeline.calls_file import Call
from pipeline.inhalation import breathing
from pipeline.laugh import DesiredLaugh
from pipeline.laugh_fit import check_calls
from pipeline.laugh_plan import ONSET, air_used, bout_lines, make_plan
from pipeline.score import LARYNX, Score, burst, numbers
from sim.errors import InputError
from sim.tables import parameters
from sim.units import CUBIC_METRE_PER_LITRE, PASCAL_PER_CMH2O


def call(number: int, start: float, end: float, bout: int) -> Call:
    return Call(
        call=number, start=start, peak_time=0.5 * (start + end), end=end, peak=1.0, bout=bout,
        voiced=True, kept=True, why_not="",
    )  # fmt: skip


CALLS = (
    call(1, 2.0, 2.2, 1),
    call(2, 2.2, 2.45, 1),
    call(3, 3.6, 3.8, 2),
    call(5, 4.0, 4.2, 2),
    call(6, 4.6, 4.8, 3),
)
TIME = np.arange(0.0, 6.0, 0.001)
DESIRED = DesiredLaugh(
    time=TIME, pressure=np.full(len(TIME), 1000.0), low=TIME, high=TIME, rate=1000.0, calls=CALLS,
    inhalations=((2.6, 3.4),), calibrated=False,
)  # fmt: skip


def test_calls_of_a_bout_follow_each_other() -> None:
    plan = make_plan(DESIRED, 1.0, 6.0, early=0.0, step=0.002)
    assert plan.origin == pytest.approx(1.0)
    assert [len(bout.calls) for bout in plan.bouts] == [2, 2, 1]
    for bout in plan.bouts:
        assert bout.calls[0].start == bout.start and bout.calls[-1].end == bout.end
        assert all(a.end == b.start for a, b in pairwise(bout.calls))
    assert plan.bouts[0].start == pytest.approx(1.0 - ONSET)
    assert plan.bouts[0].end == pytest.approx(1.45)
    # a gap within a bout belongs to the call before it
    assert plan.bouts[1].calls[0].end == pytest.approx(3.0)


def test_breaths_where_they_were_heard_else_where_there_is_room() -> None:
    plan = make_plan(DESIRED, 1.0, 6.0, early=0.0, step=0.002)
    assert plan.breaths[1] == pytest.approx((1.6, 2.4))
    assert plan.heard == {1}
    start, end = plan.breaths[0] or (0.0, 0.0)
    assert end < plan.bouts[0].start and end - start == pytest.approx(numbers()["breath_time"])
    # 0.32 s to the third bout is less than a breath takes with its margins
    assert plan.breaths[2] is None


def test_the_torso_may_begin_before_the_sound() -> None:
    plan = make_plan(DESIRED, 1.9, 6.0, early=1.0, step=0.002)
    assert plan.origin == pytest.approx(2.0 - ONSET - 1.0, abs=0.002)
    assert plan.bouts[0].start == pytest.approx(1.0, abs=0.003)


def test_air_is_the_flow_that_the_resistance_lets_pass() -> None:
    time, pressure = np.linspace(0.0, 2.0, 201), np.full(201, 2000.0)
    larynx = np.full(201, 3e6)
    assert air_used(time, pressure, larynx, linear=1e6, quadratic=0.0) == pytest.approx(1e-3)
    # 2000 = 8.2e7 Q^2, as with the papers' lung
    free = air_used(time, pressure, 0 * larynx, linear=0.0, quadratic=8.3e7)
    assert free == pytest.approx(2.0 * np.sqrt(2000.0 / 8.3e7))
    assert air_used(time, -pressure, larynx, linear=1e6, quadratic=0.0) == 0.0


def test_one_call_without_a_larynx_takes_what_the_issue_says() -> None:
    time = np.linspace(0.0, 0.2, 2001)
    pressure = 20.0 * PASCAL_PER_CMH2O * np.sin(np.pi * time / 0.2) ** 2
    k = parameters()["one_way_k"]
    free = air_used(time, pressure, np.zeros(2001), linear=0.0, quadratic=k)
    assert free == pytest.approx(0.6e-3, rel=0.05)
    larynx = np.full(2001, 30.0 * PASCAL_PER_CMH2O / CUBIC_METRE_PER_LITRE)
    assert air_used(time, pressure, larynx, linear=117700.0, quadratic=2.94e7) < 0.1e-3


def test_the_larynx_works_in_calls_and_is_open_between_bouts() -> None:
    plan = make_plan(DESIRED, 1.0, 6.0, early=0.0, step=0.002)
    score = Score()
    for bout in plan.bouts[:2]:
        score = bout_lines(score, bout, motion=True)
    times, values = np.array(score.lines[LARYNX]).T
    of = numbers()
    at = np.interp([1.1, 1.2, 2.0, 2.7], times, values)
    assert at == pytest.approx([of["larynx_high"], of["larynx_low"], 0.0, at[3]])
    assert at[3] > of["larynx_low"] and values.min() >= 0.0
    assert (np.diff(times) > 0).all()


def test_a_breath_in_rises_holds_and_lets_go() -> None:
    score = Score().add("abdomen", burst(0.0, 0.2, 0.1)).line("abdomen", (0.0, 0.0), (1.0, 0.1))
    told = breathing(score, (1.0, 2.0), (1.2, 1.8), 0.5, motion=True)
    drive = told.controls(step=0.002).drive(3.0)
    assert drive.activation.max() <= 1.0
    times, values = np.array(told.lines["external_intercostals"]).T
    assert np.interp([1.1, 1.9, 2.3], times, values) == pytest.approx([0.0, 0.5, 0.0])
    assert told.level("abdomen") == 0.0


def test_overlapping_gaps_of_edited_calls_do_not_cross() -> None:
    near = replace(DESIRED, calls=(call(1, 2.0, 2.2, 1), call(2, 2.21, 2.4, 2)))
    plan = make_plan(near, 1.0, 6.0, early=0.0, step=0.002)
    assert plan.bouts[1].start >= plan.bouts[0].end
    assert plan.breaths[1] is None


def test_a_call_that_a_hand_made_too_short_is_named() -> None:
    short = replace(DESIRED, calls=(*CALLS[:1], call(2, 2.2, 2.21, 1)))
    with pytest.raises(InputError, match=r"calls\.csv: call 2: lasts 0\.010 s"):
        check_calls(short)
    check_calls(DESIRED)
