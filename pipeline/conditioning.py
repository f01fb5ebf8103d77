"""Gaps, rate and noise of marker tracks."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import scipy.signal
from scipy.interpolate import PchipInterpolator

from pipeline.raw import Floats

Bools = npt.NDArray[np.bool_]

# motions of a torso that predict a marker from its neighbours
N_MODES = 6


class Run(NamedTuple):
    """Frames `start` to `stop` (exclusive)."""

    start: int
    stop: int


def runs(mask: Bools) -> list[Run]:
    """Stretches in which `mask` is true."""
    edges = np.diff(np.concatenate([[0], mask.astype(np.int8), [0]]))
    starts, stops = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    return [Run(int(a), int(b)) for a, b in zip(starts, stops, strict=True)]


def seen(positions: Floats) -> Bools:
    """Frames and markers with a place, (n_frames, n_markers)."""
    return np.asarray(np.isfinite(positions).all(axis=2))


def bridge(track: Floats) -> Floats:
    """Fill every hole of a (n_frames, k) track by straight lines, level at the ends."""
    good = np.isfinite(track).all(axis=1)
    index = np.arange(len(track))
    return np.stack([np.interp(index, index[good], column[good]) for column in track.T], axis=1)


def neighbour_prediction(positions: Floats, marker: int) -> Floats:
    """Track of a marker as its neighbours tell it, (n_frames, 3).

    Least squares on the first principal motions of all other markers, over the frames in which
    the marker is seen.
    """
    others = [i for i in range(positions.shape[1]) if i != marker]
    here = bridge(positions[:, marker])
    good = seen(positions)[:, marker]
    if not others or good.sum() < 3 * N_MODES:
        return np.zeros_like(here)
    tracks = np.concatenate([bridge(positions[:, i]) for i in others], axis=1)
    tracks = tracks - tracks.mean(axis=0)
    size, modes = np.linalg.eigh(tracks[good].T @ tracks[good])
    # eigenvalues rise; those of rounding alone predict nothing
    chosen = np.flatnonzero(size > 1e-12 * max(size[-1], 1e-24))[-N_MODES:]
    design = np.column_stack([tracks @ modes[:, chosen], np.ones(len(tracks))])
    weights, *_ = np.linalg.lstsq(design[good], here[good], rcond=None)
    return np.asarray(design @ weights)


def fill_gaps(positions: Floats, max_gap: int) -> Floats:
    """Fill gaps of at most `max_gap` frames; longer ones stay not-a-number.

    The neighbours say how the marker moved, a monotone cubic through what they leave
    unexplained on both sides ties the piece to the track.
    """
    out = positions.copy()
    index = np.arange(len(positions))
    for marker in range(positions.shape[1]):
        good = seen(positions)[:, marker]
        gaps = [g for g in runs(~good) if g.stop - g.start <= max_gap]
        if not gaps or good.sum() < 4:
            continue
        guess = neighbour_prediction(positions, marker)
        rest = positions[good, marker] - guess[good]
        tie = PchipInterpolator(index[good], rest, axis=0, extrapolate=False)
        for gap in gaps:
            inside = index[gap.start : gap.stop]
            left = np.clip(inside, index[good][0], index[good][-1])
            out[inside, marker] = guess[inside] + tie(left)
    return out


def low_pass(positions: Floats, rate: float, cutoff: float) -> Floats:
    """Zero-phase Butterworth low-pass (4th order there and back); holes stay holes."""
    if cutoff >= 0.45 * rate:
        return positions
    sos = scipy.signal.butter(2, cutoff, fs=rate, output="sos")
    out = positions.copy()
    pad = min(len(positions) - 1, round(3 * rate / cutoff))
    for marker in range(positions.shape[1]):
        good = seen(positions)[:, marker]
        if good.sum() < 2:
            continue
        smooth = scipy.signal.sosfiltfilt(sos, bridge(positions[:, marker]), axis=0, padlen=pad)
        out[good, marker] = smooth[good]
    return out


def decimate(positions: Floats, factor: int) -> Floats:
    """Keep every `factor`-th frame after a zero-phase anti-alias filter."""
    if factor <= 1:
        return positions
    # 80 % of the new Nyquist frequency; 6th order there and back
    sos = scipy.signal.butter(6, 0.8 / factor, output="sos")
    pad = min(len(positions) - 1, 30 * factor)
    n_out = -(-len(positions) // factor)
    out = np.full((n_out, positions.shape[1], 3), np.nan)
    for marker in range(positions.shape[1]):
        good = seen(positions)[:, marker]
        if good.sum() < 2:
            continue
        slow = scipy.signal.sosfiltfilt(sos, bridge(positions[:, marker]), axis=0, padlen=pad)
        keep = good[::factor]
        out[keep, marker] = slow[::factor][keep]
    return out


def noise_level(positions: Floats) -> Floats:
    """White noise of each marker and axis, (n_markers,), m.

    From the median of the second differences, whose variance is six times that of the noise;
    motion that is fast against the frame rate adds to it.
    """
    second = np.diff(positions, n=2, axis=0)
    with np.errstate(invalid="ignore"):
        size = np.array(
            [
                np.nanmedian(np.abs(track[np.isfinite(track)])) if np.isfinite(track).any() else 0.0
                for track in np.moveaxis(second, 1, 0)
            ]
        )
    return np.asarray(1.4826 * size / np.sqrt(6.0))
