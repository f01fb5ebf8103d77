"""Marker errors as the papers print them, and what must stand beside them to mean something."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

IMPUTATION_ROUNDS = 30


@dataclass(frozen=True, kw_only=True, slots=True)
class CycleFrames:
    """Frames of some breaths in recording time, and where each lies in the mean breath.

    Parameters
    ----------
    measured : (n_frames, n_markers, 3), m, NaN where missing
    cycle : (n_frames,), the breath each frame belongs to
    breath_time : (n_frames,), s after the onset of the mean breath, inspiration and expiration
        of each breath mapped separately
    rate : Hz
    """

    measured: Floats
    cycle: NDArray[np.int64]
    breath_time: Floats
    rate: float


def cycle_frames(
    positions: Floats,
    times: Floats,
    events: Floats,
    ids: NDArray[np.int64],
    *,
    inspiration_time: float,
    expiration_time: float,
    rate: float,
) -> CycleFrames:
    """Cut breaths out of a recording and map their frames to the time of the mean breath.

    Parameters
    ----------
    positions : (n_frames, n_markers, 3), m
    times : (n_frames,), s
    events : (n_cycles, 3), s: onset, peak and end of each breath
    ids : (n_cycles,), their numbers
    inspiration_time, expiration_time : s, of the mean breath
    rate : Hz
    """
    frames, owners, mapped = [], [], []
    for number, (onset, peak, end) in zip(ids, events, strict=True):
        index = np.flatnonzero((times >= onset) & (times < end))
        inspiration = (times[index] - onset) / (peak - onset) * inspiration_time
        expiration = inspiration_time + (times[index] - peak) / (end - peak) * expiration_time
        frames.append(index)
        owners.append(np.full(len(index), number))
        mapped.append(np.where(times[index] < peak, inspiration, expiration))
    return CycleFrames(
        measured=positions[np.concatenate(frames)],
        cycle=np.concatenate(owners).astype(np.int64),
        breath_time=np.concatenate(mapped),
        rate=rate,
    )


def play(time: Floats, positions: Floats, period: float, at: Floats) -> Floats:
    """One breath repeated for ever, read at the times `at`.

    Parameters
    ----------
    time : (n_time,), s from onset; positions : (n_time, n_markers, 3); period : s
    at : (n,), s

    Returns
    -------
    (n, n_markers, 3)
    """
    closed_time = np.append(time, time[0] + period)
    closed = np.concatenate([positions, positions[:1]])
    wrapped = time[0] + np.mod(at - time[0], period)
    right = np.clip(np.searchsorted(closed_time, wrapped, side="right"), 1, len(time))
    share = (wrapped - closed_time[right - 1]) / (closed_time[right] - closed_time[right - 1])
    share = share[:, None, None]
    return np.asarray(closed[right - 1] * (1 - share) + closed[right] * share)


def mean_seen(values: Floats, axis: int | None = None) -> Floats:
    """Mean of the values that are there; not-a-number where there are none."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Mean of empty slice", category=RuntimeWarning)
        return np.asarray(np.nanmean(values, axis=axis))


def without_offset(difference: Floats, groups: NDArray[np.int64] | None = None) -> Floats:
    """Remove each marker's mean: one over all frames, or one for each group of frames.

    Parameters
    ----------
    difference : (n_frames, n_markers, 3), NaN where missing
    groups : (n_frames,), or None
    """
    if groups is None:
        return difference - mean_seen(difference, axis=0)
    result = np.empty_like(difference)
    for group in np.unique(groups):
        chosen = groups == group
        result[chosen] = difference[chosen] - mean_seen(difference[chosen], axis=0)
    return result


def mean_distance(difference: Floats) -> float:
    """error_p or error_v as printed: the mean length over frames and markers, NaN left out.

    Parameters
    ----------
    difference : (n_frames, n_markers, 3)

    References
    ----------
    dilorenzo2009, 5.3.2
    """
    return float(mean_seen(np.linalg.norm(difference, axis=-1)))


def velocity(positions: Floats, groups: NDArray[np.int64], rate: float, window: float) -> Floats:
    """Central differences over `window`, never across two breaths; NaN at their ends.

    A difference of neighbouring frames would be noise alone: 0.5 mm at 100 Hz is 35 mm/s.

    Parameters
    ----------
    positions : (n_frames, n_markers, 3), m; groups : (n_frames,); rate : Hz; window : s

    Returns
    -------
    (n_frames, n_markers, 3), m/s
    """
    result = np.full_like(positions, np.nan)
    half = max(1, round(window * rate / 2))
    if len(positions) > 2 * half:
        inner = (positions[2 * half :] - positions[: -2 * half]) * (rate / (2 * half))
        same = groups[2 * half :] == groups[: -2 * half]
        result[half:-half] = np.where(same[:, None, None], inner, np.nan)
    return result


def _flat(values: Floats) -> Floats:
    return values.reshape(len(values), -1)


def leading_modes(centred: Floats, n_modes: int) -> Floats:
    """Find the directions that carry most of the displacement; missing values are imputed.

    Parameters
    ----------
    centred : (n_frames, n_markers, 3), m, offsets removed

    Returns
    -------
    (n_modes, 3 n_markers), orthonormal rows
    """
    data = _flat(centred)
    missing = np.isnan(data)
    filled = np.where(missing, 0.0, data)
    for _ in range(IMPUTATION_ROUNDS if missing.any() else 1):
        # the eigenvectors of the small covariance matrix: frames are many, channels few
        _, vectors = np.linalg.eigh(filled.T @ filled)
        modes = vectors[:, ::-1][:, :n_modes].T
        filled = np.where(missing, filled @ modes.T @ modes, filled)
    return np.asarray(modes)


def mode_residual(centred: Floats, modes: Floats) -> Floats:
    """Return what the best motion along `modes` leaves, frame by frame; NaN where missing."""
    data = _flat(centred)
    seen = ~np.isnan(data)
    left = np.array(data)
    whole = seen.all(axis=1)
    left[whole] -= data[whole] @ modes.T @ modes
    for frame in np.flatnonzero(~whole):
        mask = seen[frame]
        basis = modes[:, mask].T
        weights = np.linalg.lstsq(basis, data[frame, mask], rcond=None)[0]
        left[frame, mask] -= basis @ weights
    return left.reshape(centred.shape)


def mean_cycle(frames: CycleFrames, grid: Floats) -> dict[int, Floats]:
    """Each breath on the times of the mean breath.

    Parameters
    ----------
    grid : (n_grid,), s after onset

    Returns
    -------
    number of the breath -> (n_grid, n_markers, 3), m, NaN where missing
    """
    warped = {}
    for number in np.unique(frames.cycle):
        chosen = frames.cycle == number
        data = _flat(frames.measured[chosen])
        time = frames.breath_time[chosen]
        columns = [np.interp(grid, time, column) for column in data.T]
        warped[int(number)] = np.stack(columns, axis=1).reshape(len(grid), -1, 3)
    return warped
