"""When the rows of a table were measured, and all columns on one even grid."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from pipeline.delimited_text import Floats, Table
from pipeline.raw import Column
from sim.errors import InputError

TIME = re.compile(r"^(?:time|timestamp|t)(?:[\s_]*[\[(]?(?P<unit>ms|s|sec|seconds)[\])]?)?$", re.I)
FRAME = re.compile(r"^(?:frame|frames|sample|index|frame_?number|field|frame#)$", re.I)


def row_times(table: Table, assumed_rate: float, notes: list[str]) -> tuple[Floats, float]:
    """Time of every row (s) and the rate (Hz), from whatever the table has."""
    frames = _column(table, FRAME)
    stamps = _column(table, TIME)
    if "rate_hz" in table.stated:
        rate = _stated_rate(table)
        if frames is None:
            return np.arange(table.numbers.shape[0]) / rate, rate
        return frames / (rate * _step(table, frames)), rate
    if stamps is not None:
        seconds = stamps * _stamp_scale(table, stamps)
        if frames is None:
            return seconds, 1.0 / _step(table, seconds)
        times = _by_counter(table, frames, seconds, notes)
        return times, 1.0 / _step(table, times)
    notes.append(f"neither times nor a rate are stated; {assumed_rate:g} Hz assumed")
    if frames is None:
        return np.arange(table.numbers.shape[0]) / assumed_rate, assumed_rate
    return (frames - frames[0]) / (assumed_rate * _step(table, frames)), assumed_rate


def _by_counter(table: Table, frames: Floats, seconds: Floats, notes: list[str]) -> Floats:
    """Take times from the frame counter: single stamps can be wrong, the median step is not."""
    moving = np.diff(frames) > 0
    if not moving.any():
        _step(table, frames)
    period = float(np.median(np.diff(seconds)[moving] / np.diff(frames)[moving]))
    if not period > 0:
        _step(table, seconds)
    # a counter that is rounded to its stamps: a line through both ends beats the median step
    good = np.abs(seconds - seconds[0] - period * (frames - frames[0])) < 0.05 * np.ptp(seconds)
    if good.sum() > 2:
        period = float(np.polyfit(frames[good], seconds[good], 1)[0])
    times = period * frames
    wrong = int(np.sum(np.abs(times - seconds) > 2.0 * np.median(np.abs(np.diff(times)))))
    if wrong:
        notes.append(f"{wrong} time stamps disagree with the frame counter, which is used")
    return np.asarray(times)


def _column(table: Table, pattern: re.Pattern[str]) -> Floats | None:
    for index, name in enumerate(table.names):
        if pattern.match(name) and np.isfinite(table.numbers[:, index]).all():
            return np.asarray(table.numbers[:, index])
    return None


def _step(table: Table, times: Floats) -> float:
    step = float(np.median(np.diff(times)))
    if not step > 0:
        raise InputError(
            f"{table.path}: time: does not increase from row to row. Correct the time column."
        )
    return step


def _stamp_scale(table: Table, stamps: Floats) -> float:
    unit = next(m["unit"] for name in table.names if (m := TIME.match(name)))
    if unit:
        return 0.001 if unit.lower() == "ms" else 1.0
    # no motion capture samples slower than once in 3 s or faster than 3 kHz
    return 0.001 if _step(table, stamps) > 3.0 else 1.0


def _stated_rate(table: Table) -> float:
    text = table.stated["rate_hz"].replace(",", ".")
    try:
        rate = float(text.split()[0])
    except ValueError:
        rate = 0.0
    if not (np.isfinite(rate) and rate > 0):
        raise InputError(f"{table.path}: rate_hz {text!r}: not a positive number. Correct it.")
    return rate


def in_order(times: Floats, columns: list[Column], notes: list[str]) -> tuple[Floats, list[Column]]:
    """Drop rows that step back in time; a last row of zeros is a sentinel, no measurement."""
    highest = np.maximum.accumulate(np.concatenate([[-np.inf], times[:-1]]))
    keep = times > highest
    if keep.all():
        return times, columns
    notes.append(f"{int((~keep).sum())} rows that step back in time left out (sentinel or repeat)")
    return times[keep], [Column(c.label, c.places[keep]) for c in columns]


def common_grid(path: Path, spans: list[Floats], rate: float) -> Floats:
    """Even times that all files cover."""
    begin = max(float(times[0]) for times in spans)
    end = min(float(times[-1]) for times in spans)
    n = int(np.floor((end - begin) * rate + 1e-6)) + 1
    if n < 2:
        raise InputError(f"{path}: time: the files do not overlap. Give one recording only.")
    return np.asarray(begin + np.arange(n) / rate)


def resample(times: Floats, places: Floats, grid: Floats, rate: float) -> Floats:
    """Linear interpolation to the grid; what lies in a hole stays not-a-number."""
    places = places.copy()
    places[(places == 0.0).all(axis=1)] = np.nan
    if times.size == grid.size and np.allclose(times, grid, atol=1e-3 / rate):
        return places
    seen = np.isfinite(places).all(axis=1)
    if seen.sum() < 2:
        return np.full((grid.size, 3), np.nan)
    known = times[seen]
    out = np.stack([np.interp(grid, known, places[seen, a]) for a in range(3)], axis=1)
    after = np.clip(np.searchsorted(known, grid), 1, known.size - 1)
    hole = known[after] - known[after - 1] > 1.75 / rate
    exact = np.minimum(np.abs(grid - known[after]), np.abs(grid - known[after - 1])) < 0.01 / rate
    outside = (grid < known[0] - 0.5 / rate) | (grid > known[-1] + 0.5 / rate)
    out[(hole & ~exact) | outside] = np.nan
    return out
