"""One row of the error table: a model's breath and its baselines against recorded breaths."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.cost import (
    CycleFrames,
    Floats,
    leading_modes,
    mean_cycle,
    mean_distance,
    mean_seen,
    mode_residual,
    play,
    velocity,
    without_offset,
)

REFERENCE_MODES = (1, 2, 4)
MM = 1e3

Row = dict[str, str | float | int]


@dataclass(frozen=True, kw_only=True, slots=True)
class Breath:
    """One steady breath: time (n_time,) s from onset, positions (n_time, n_markers, 3) m."""

    time: Floats
    positions: Floats
    period: float

    def at(self, breath_time: Floats) -> Floats:
        """Positions (n, n_markers, 3), m, at the times of the mean breath, s."""
        return play(self.time, self.positions, self.period, breath_time)

    def predict(self, frames: CycleFrames) -> Floats:
        """Positions (n_frames, n_markers, 3), m: the same breath for every breath."""
        return self.at(frames.breath_time)


@dataclass(frozen=True, kw_only=True, slots=True)
class OwnBreaths:
    """A breath for each breath of a recording, all at the timing of the mean breath.

    Parameters
    ----------
    time : (n_time,), s from onset; period : s
    positions : number of the breath -> (n_time, n_markers, 3), m
    """

    time: Floats
    positions: dict[int, Floats]
    period: float

    def predict(self, frames: CycleFrames) -> Floats:
        """Positions (n_frames, n_markers, 3), m: each breath its own."""
        result = np.empty_like(frames.measured)
        for number in np.unique(frames.cycle):
            chosen = frames.cycle == number
            at = frames.breath_time[chosen]
            result[chosen] = play(self.time, self.positions[int(number)], self.period, at)
        return result


def _others_mean(frames: CycleFrames, source: CycleFrames, grid: Floats, period: float) -> Floats:
    """Predict each frame of `frames` by the mean of the other breaths in `source`."""
    warped = mean_cycle(source, grid)
    result = np.full_like(frames.measured, np.nan)
    for number in np.unique(frames.cycle):
        others = [breath for other, breath in warped.items() if other != number]
        if not others:
            continue
        mean = mean_seen(np.stack(others), axis=0)
        chosen = frames.cycle == number
        result[chosen] = play(grid, mean, period, frames.breath_time[chosen])
    return result


def _references(centred: Floats, source: Floats, markers: NDArray[np.int64]) -> dict[str, float]:
    usable = source[:, markers]
    n_values = 3 * len(markers)
    references = {}
    for k in REFERENCE_MODES:
        modes = leading_modes(usable, min(k, n_values))
        left = mode_residual(centred[:, markers], modes)
        references[f"reference_{k}_mm"] = MM * mean_distance(left)
    return references


def score(
    scope: str,
    frames: CycleFrames,
    breath: Breath | OwnBreaths,
    markers: NDArray[np.int64],
    *,
    window: float,
    min_cycles: int,
    by_cycle: bool = False,
    source: CycleFrames | None = None,
) -> Row:
    """Errors of a model's breath, of not moving, of the other breaths and of free modes.

    All of them have the same freedom: one offset for each marker (and breath, if `by_cycle`).

    Parameters
    ----------
    frames : what is predicted, in recording time
    markers : (n,), indices of the markers that count
    window : s, of the velocities
    min_cycles : with fewer breaths the row gives no verdict
    source : breaths from which the baselines may learn; `frames` themselves without it
    """
    known = frames if source is None else source
    groups = frames.cycle if by_cycle else None
    model = breath.predict(frames)
    difference = frames.measured - model
    still = without_offset(frames.measured, groups)
    speeds = [velocity(x, frames.cycle, frames.rate, window) for x in (frames.measured, model)]
    spread = frames.measured - _others_mean(frames, known, breath.time, breath.period)
    moved = without_offset(difference, groups)[:, markers]
    error, error_still = mean_distance(moved), mean_distance(still[:, markers])
    n_cycles = len(np.unique(frames.cycle))
    explained = 1 - error / error_still if error_still > 0 else float("nan")
    learned = (
        still
        if source is None
        else without_offset(known.measured, known.cycle if by_cycle else None)
    )
    return {
        "scope": scope,
        "error_p_mm": MM * error,
        "error_v_mm_s": MM * mean_distance((speeds[0] - speeds[1])[:, markers]),
        "error_p_still_mm": MM * error_still,
        **_references(still, learned, markers),
        "explained": explained,
        "spread_mm": MM * mean_distance(without_offset(spread, groups)[:, markers]),
        "error_v_still_mm_s": MM * mean_distance(speeds[0][:, markers]),
        "error_p_absolute_mm": MM * mean_distance(difference[:, markers]),
        "n_cycles": n_cycles,
        "verdict": _verdict(explained, n_cycles, min_cycles),
    }


def _verdict(explained: float, n_cycles: int, min_cycles: int) -> str:
    if n_cycles < min_cycles:
        return f"n = {n_cycles}: no verdict under {min_cycles} breaths"
    if not np.isfinite(explained):
        return "nothing moves"
    if explained <= 0:
        return "no better than not moving"
    return f"explains {100 * explained:.0f} % of the displacement"
