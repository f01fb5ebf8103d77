"""Ghosting: a marker that jumps between two positions a millimetre or more apart and back.

A camera that loses a marker, or two rays that are swapped, move its place by a step; a body
does not step. Places in the second position are taken as not seen and filled like a gap.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.signal

from pipeline.conditioning import Run, neighbour_prediction, seen
from pipeline.raw import Floats

# time over which a step is measured: low-passed files spread a jump over a few frames
STEP_S = 0.03
# neighbours needed for a prediction that a step stands out from
MIN_MARKERS = 8
# below this rate a quick motion and a step look alike
MIN_RATE = 40.0
# a step is so many times the usual change in the same time
TIMES_USUAL = 8.0
# a second position held longer is where the marker now is
LONGEST_S = 1.0
# time on either side that tells which of two positions is the usual one
AROUND_S = 2.0


class Flicker(NamedTuple):
    """What is known of a marker that jumps: stretches to repair, and all its jumps."""

    stretches: list[Run]
    n_jumps: int


def find_flicker(positions: Floats, rate: float, smallest: float) -> dict[int, Flicker]:
    """Find the frames in which markers sit in a second position.

    A step of the track against what the neighbours predict opens a stretch, the opposite step
    closes it.

    Parameters
    ----------
    positions : (n_frames, n_markers, 3), m
    rate : Hz
    smallest : m, steps below never count

    Returns
    -------
    one entry for every marker that jumps; stretches only where it is plain which is the ghost
    """
    if rate < MIN_RATE or positions.shape[1] < MIN_MARKERS:
        return {}
    found = {}
    for marker in range(positions.shape[1]):
        flicker = _flicker(positions, marker, rate, smallest)
        if flicker.n_jumps:
            found[marker] = flicker
    return found


def _flicker(positions: Floats, marker: int, rate: float, smallest: float) -> Flicker:
    half = max(1, round(STEP_S * rate))
    rest = positions[:, marker] - neighbour_prediction(positions, marker)
    change = np.zeros_like(rest)
    change[half:-half] = rest[2 * half :] - rest[: -2 * half]
    size = np.nan_to_num(np.linalg.norm(change, axis=1))
    usual = float(np.median(size[seen(positions)[:, marker]]))
    steps, _ = scipy.signal.find_peaks(
        size, height=max(smallest, TIMES_USUAL * usual), distance=2 * half + 1
    )
    out: list[Run] = []
    opened: int | None = None
    for step in steps:
        if opened is None or step - opened > LONGEST_S * rate:
            opened = int(step)
            continue
        stretch = Run(max(0, opened - half + 1), int(step) + half)
        returns = np.linalg.norm(change[opened] + change[step]) < 0.5 * size[opened]
        if returns and _is_unusual(rest, stretch, round(AROUND_S * rate)):
            out.append(stretch)
            opened = None
        else:
            opened = int(step)
    return Flicker(out, len(steps))


def _is_unusual(rest: Floats, stretch: Run, around: int) -> bool:
    """Whether the places in a stretch, not those next to it, are off the usual ones."""
    start, stop = stretch
    near = slice(max(0, start - around), stop + around)
    usual = np.nanmedian(rest[near], axis=0)
    width = stop - start
    beside = np.concatenate([rest[max(0, start - width) : start], rest[stop : stop + width]])
    inside = np.linalg.norm(np.nanmedian(rest[start:stop], axis=0) - usual)
    return bool(inside > 2.0 * np.linalg.norm(np.nanmedian(beside, axis=0) - usual))


def without_flicker(positions: Floats, found: dict[int, Flicker]) -> Floats:
    """Positions with the frames in second positions marked as not seen."""
    out = positions.copy()
    for marker, flicker in found.items():
        for start, stop in flicker.stretches:
            out[start:stop, marker] = np.nan
    return out
