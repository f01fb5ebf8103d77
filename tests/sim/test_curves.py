"""Curves of control files: known values, periods, sums and what they refuse."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.breaths import sawtooth
from sim.control.curves import Curve, Linear, Sawtooth, Sine, Square, add_up
from sim.errors import ParameterError
from sim.tables import parameters


def at(curve: Curve, *times: float) -> list[float]:
    return [float(v) for v in add_up((curve,), np.array(times))]


def test_sine() -> None:
    curve = Sine(period=4.0, amplitude=0.3, offset=1.0)
    assert at(curve, 0.0, 1.0, 3.0, 5.0) == pytest.approx([1.0, 1.3, 0.7, 1.3])
    ahead = Sine(period=4.0, amplitude=0.3, offset=1.0, phase=1.0)
    assert at(ahead, 0.0, 2.0) == pytest.approx([1.3, 0.7])


def test_square_is_low_then_high() -> None:
    curve = Square(period=4.0, high=1.0, low=0.25)
    assert at(curve, 0.0, 1.99, 2.0, 3.99, 4.0) == [0.25, 0.25, 1.0, 1.0, 0.25]
    printed = Square(period=4.0, high=1.0, phase=2.0, end=4.0)
    # dilorenzo2009 section 8.1: on while the printed outer intercostals shorten, first breath only
    assert at(printed, 0.0, 1.9, 2.0, 3.9, 4.1, 5.0) == [1.0, 1.0, 0.0, 0.0, 0.0, 0.0]
    short = Square(period=1.0, high=1.0, share=0.1)
    assert at(short, 0.85, 0.95) == [0.0, 1.0]


def test_sawtooth() -> None:
    curve = Sawtooth(period=10.0, high=2.0, low=1.0, rise=0.4, hold=0.1, release=0.2)
    times = (0.0, 2.0, 4.0, 4.5, 5.0, 6.0, 7.0, 9.0, 12.0)
    assert at(curve, *times) == pytest.approx([1.0, 1.5, 2.0, 2.0, 2.0, 1.5, 1.0, 1.0, 1.5])
    plain = Sawtooth(period=2.0, high=1.0)
    assert at(plain, 0.0, 1.0, 1.999) == pytest.approx([0.0, 0.5, 0.9995])
    falling = Sawtooth(period=2.0, high=1.0, rise=0.0, release=1.0)
    assert at(falling, 0.0, 1.0) == pytest.approx([1.0, 0.5])
    block = Sawtooth(period=2.0, high=1.0, rise=0.0, hold=0.5)
    assert at(block, 0.0, 0.9, 1.1) == [1.0, 1.0, 0.0]


def test_linear() -> None:
    curve = Linear(points=((0.0, 0.0), (0.1, 1.0), (0.35, 1.0), (0.4, 0.0)), start=1.0, end=2.0)
    assert at(curve, 0.9, 1.05, 1.2, 1.375, 1.9) == pytest.approx([0.0, 0.5, 1.0, 0.5, 0.0])
    assert at(Linear(points=((0.0, 0.2),)), 0.0, 50.0) == [0.2, 0.2]
    again = Linear(points=((0.0, 0.0), (1.0, 1.0)), period=2.0, phase=0.5)
    assert at(again, 0.0, 2.0, 1.0) == pytest.approx([0.5, 0.5, 1.0])


def test_curves_add_up_where_they_are_on() -> None:
    curves = (Sine(period=1.0, amplitude=0.0, offset=0.2, end=2.0),
              Square(period=1.0, high=0.5, low=0.5, start=1.0))  # fmt: skip
    found = add_up(curves, np.array([0.5, 1.5, 2.5]))
    assert found == pytest.approx([0.2, 0.7, 0.5])


@pytest.mark.parametrize(
    ("make", "numbers", "word"),
    [
        (Sine, {"period": 0.0, "amplitude": 1.0}, "period is 0 s"),
        (Square, {"period": -1.0, "high": 1.0}, "period is -1 s"),
        (Sine, {"period": 1.0, "amplitude": float("inf")}, "amplitude is inf"),
        (Sine, {"period": 1.0, "amplitude": 1.0, "start": 2.0, "end": 1.0}, "end is 1 s, start 2"),
        (Square, {"period": 1.0, "high": 1.0, "share": 1.5}, "share is 1.5"),
        (Sawtooth, {"period": 1.0, "high": 1.0, "hold": 0.5}, "at most 1"),
        (Sawtooth, {"period": 1.0, "high": 1.0, "rise": -0.5}, "rise is -0.5"),
        (Linear, {"points": ()}, "points are not all numbers"),
        (Linear, {"points": ((1.0, 0.0), (1.0, 1.0))}, "forward in time"),
        (Linear, {"points": ((0.0, 0.0), (3.0, 1.0)), "period": 2.0}, "leave the period"),
    ],
)
def test_refused(make: Any, numbers: dict[str, Any], word: str) -> None:
    with pytest.raises(ParameterError, match=word):
        make(**numbers)


@given(
    st.floats(0.3, 5.0), st.floats(0.3, 8.0), st.floats(0.0, 0.8), st.floats(0.0, 1.0)
)  # fmt: skip
def test_a_sawtooth_is_that_of_the_fit(
    inspiration: float, expiration: float, share: float, level: float
) -> None:
    pause, period = share * expiration, inspiration + expiration
    p, out = parameters(), expiration - share * expiration
    inward = Sawtooth(
        period=period, high=level, rise=p["inspiratory_rise"] * inspiration / period,
        hold=(1.0 - p["inspiratory_rise"]) * inspiration / period,
        release=p["inspiratory_release"] * out / period,
    )  # fmt: skip
    outward = Sawtooth(
        period=period, high=level, rise=(1.0 - p["expiratory_fade"]) * out / period,
        release=p["expiratory_fade"] * out / period, phase=period - inspiration,
    )  # fmt: skip
    time = np.linspace(0.0, 2.9 * period, 501)
    expected = sawtooth(time, inspiration=inspiration, expiration=expiration, pause=pause)
    for curve, wanted in ((inward, expected[0]), (outward, expected[1])):
        np.testing.assert_allclose(add_up((curve,), time), level * wanted, rtol=0.0, atol=1e-12)


@given(st.floats(0.01, 10.0), st.floats(-5.0, 5.0), st.floats(0.0, 30.0))
def test_curves_come_again_after_a_period(period: float, phase: float, time: float) -> None:
    for curve in (
        Sine(period=period, amplitude=0.4, offset=0.5, phase=phase),
        Sawtooth(period=period, high=1.0, rise=0.4, release=0.4, phase=phase),
    ):
        now, later = at(curve, time, time + period)
        assert later == pytest.approx(now, abs=1e-12 * (1.0 + time / period) * 100.0)
        assert -1e-12 <= now <= 1.0 + 1e-12
