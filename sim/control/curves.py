"""Curves of time: sine, square, sawtooth and linear interpolation.

Each counts time from its `start` and is nothing outside `start` to `end`. `phase` is how far, in
seconds, a curve stands in its shape at `start`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from itertools import pairwise

import numpy as np

from sim.errors import ParameterError
from sim.physics.types import Floats


def _check_numbers(curve: Sine | Square | Sawtooth | Linear) -> None:
    for name in (field.name for field in fields(curve)):
        value = getattr(curve, name)
        if isinstance(value, float) and not math.isfinite(value):
            raise ParameterError(f"{name} is {value}. Give a number.")
    if curve.end is not None and not curve.end > curve.start:
        raise ParameterError(
            f"end is {curve.end:g} s, start {curve.start:g} s. Let it end after it starts."
        )
    if curve.period is not None and not curve.period > 0.0:
        raise ParameterError(f"period is {curve.period:g} s. Give more than 0.")


@dataclass(frozen=True, kw_only=True, slots=True)
class Sine:
    """offset + amplitude sin(2 pi (time - start + phase) / period).

    Parameters
    ----------
    start, end, period, phase : s; no end means for ever
    amplitude, offset : in the unit of what is driven
    """

    period: float
    amplitude: float
    offset: float = 0.0
    phase: float = 0.0
    start: float = 0.0
    end: float | None = None

    def __post_init__(self) -> None:
        _check_numbers(self)

    def shape(self, time: Floats) -> Floats:
        """Values at `time`, s since the start, (n,)."""
        turn = np.mod(time + self.phase, self.period) / self.period
        return np.asarray(self.offset + self.amplitude * np.sin(2.0 * math.pi * turn))


@dataclass(frozen=True, kw_only=True, slots=True)
class Square:
    """`low`, then `high` for the last part of each period.

    Parameters
    ----------
    start, end, period, phase : s
    high, low : in the unit of what is driven
    share : of the period that is high
    """

    period: float
    high: float
    low: float = 0.0
    share: float = 0.5
    phase: float = 0.0
    start: float = 0.0
    end: float | None = None

    def __post_init__(self) -> None:
        _check_numbers(self)
        if not 0.0 < self.share < 1.0:
            raise ParameterError(f"share is {self.share:g}. Give a part of the period, 0 to 1.")

    def shape(self, time: Floats) -> Floats:
        """Values at `time`, s since the start, (n,)."""
        turn = np.mod(time + self.phase, self.period) / self.period
        return np.where(turn >= 1.0 - self.share, self.high, self.low)


@dataclass(frozen=True, kw_only=True, slots=True)
class Sawtooth:
    """From `low` up to `high`, which is held, and down again; the rest of the period is `low`.

    Parameters
    ----------
    start, end, period, phase : s
    high, low : in the unit of what is driven
    rise, hold, release : shares of the period
    """

    period: float
    high: float
    low: float = 0.0
    rise: float = 1.0
    hold: float = 0.0
    release: float = 0.0
    phase: float = 0.0
    start: float = 0.0
    end: float | None = None

    def __post_init__(self) -> None:
        _check_numbers(self)
        for name in ("rise", "hold", "release"):
            if not getattr(self, name) >= 0.0:
                raise ParameterError(f"{name} is {getattr(self, name):g}. Give 0 to 1.")
        total = self.rise + self.hold + self.release
        if not 0.0 < total <= 1.0 + 1e-9:
            raise ParameterError(
                f"rise is {self.rise:g}, hold {self.hold:g} and release {self.release:g}."
                " Together they are more than 0 and at most 1."
            )

    def shape(self, time: Floats) -> Floats:
        """Values at `time`, s since the start, (n,)."""
        t = np.mod(time + self.phase, self.period)
        top, fall = self.rise * self.period, (self.rise + self.hold) * self.period
        up = t / top if top > 0.0 else np.ones_like(t)
        fading = self.release * self.period
        down = 1.0 - (t - fall) / fading if fading > 0.0 else np.where(t < fall, 1.0, 0.0)
        share = np.minimum(np.clip(up, 0.0, 1.0), np.clip(down, 0.0, 1.0))
        return np.asarray(self.low + (self.high - self.low) * share)


@dataclass(frozen=True, kw_only=True, slots=True)
class Linear:
    """Straight lines between points; level before the first and after the last.

    Parameters
    ----------
    points : time since the start, s, and value of each
    start, end, phase : s
    period : s, after which the points come again; none means that they come once
    """

    points: tuple[tuple[float, float], ...]
    period: float | None = None
    phase: float = 0.0
    start: float = 0.0
    end: float | None = None

    def __post_init__(self) -> None:
        _check_numbers(self)
        times = [time for time, _ in self.points]
        if not self.points or not np.isfinite(self.points).all():
            raise ParameterError("points are not all numbers. Write 'time value, time value'.")
        if any(b <= a for a, b in pairwise(times)):
            raise ParameterError("points do not go forward in time. Put them in order.")
        if self.period is not None and (times[0] < 0.0 or times[-1] > self.period):
            raise ParameterError(f"points leave the period of {self.period:g} s. Keep them in it.")

    def shape(self, time: Floats) -> Floats:
        """Values at `time`, s since the start, (n,)."""
        moved = time + self.phase
        if self.period is not None:
            moved = np.mod(moved, self.period)
        times, values = np.array(self.points).T
        return np.asarray(np.interp(moved, times, values))


Curve = Sine | Square | Sawtooth | Linear


def within(curve: Curve, time: Floats) -> np.ndarray:
    """Where a curve is on, (n,) of bool: from its start to before its end."""
    on = time >= curve.start
    return on if curve.end is None else on & (time < curve.end)


def add_up(curves: tuple[Curve, ...], time: Floats) -> Floats:
    """Sum of curves at `time`, s, (n,)."""
    out = np.zeros(len(time))
    for curve in curves:
        on = within(curve, time)
        out[on] += curve.shape(time[on] - curve.start)
    return out
