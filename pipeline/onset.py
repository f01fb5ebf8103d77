"""The end of the pause before an inspiration, to better than the noise allows by eye."""

from __future__ import annotations

import numpy as np

from pipeline.raw import Floats

# shares of the fall and of the rise between which the foot of a breath is fitted
FALL_SHARE = 0.35
RISE_SHARE = 0.5
N_GRID = 28
N_SAMPLES = 120
# how a rise leaves the pause: between straight (1, constant flow) and a parabola (2, flow that
# starts smoothly); the first half of a half-cosine comes nearest with 1.7
POWER = 1.6


def refine_onset(
    signal: Floats, smooth: Floats, rate: float, before: int, trough: int, peak: int
) -> tuple[float, float]:
    """Start and end of the rest around a trough, s.

    A flat rest between a fall and a rise is fitted by least squares to the signal,

        s(t) = b + f max(0, t0 - t)^2 + r max(0, t - t1)^1.6,   t0 <= t1,

    over all pairs (t0, t1) of a grid; t0 is where expiration ends, t1 the onset.

    Parameters
    ----------
    signal, smooth : (n_frames,), m, as measured and low-passed
    rate : Hz
    before, trough, peak : frames of the last peak (or the start), of the minimum, of the next peak
    """
    low = smooth[trough]
    height = smooth[peak] - low
    rising = np.flatnonzero(smooth[trough : peak + 1] > low + RISE_SHARE * height)
    stop = trough + int(rising[0]) if rising.size else peak
    fall_height = smooth[before] - low
    falling = np.flatnonzero(
        smooth[before : trough + 1] > low + FALL_SHARE * min(height, max(fall_height, 1e-12))
    )
    start = before + int(falling[-1]) if falling.size else before
    if stop - start < 4:
        return trough / rate, trough / rate
    frames = np.unique(np.linspace(start, stop, min(N_SAMPLES, stop - start + 1)).astype(int))
    values = signal[frames] - low
    times = (frames - start) / (stop - start)
    first, last = _fit(times, values / max(height, 1e-12))
    span = (stop - start) / rate
    return start / rate + first * span, start / rate + last * span


def _fit(times: Floats, values: Floats) -> tuple[float, float]:
    """Best (t0, t1) in units of the window."""
    grid = np.linspace(0.0, 0.95, N_GRID)
    t0, t1 = (a.ravel() for a in np.meshgrid(grid, grid, indexing="ij"))
    pairs = t0 <= t1
    t0, t1 = t0[pairs], t1[pairs]
    fall = np.maximum(0.0, t0[:, None] - times) ** 2
    rise = np.maximum(0.0, times - t1[:, None]) ** POWER
    k = int(np.argmin(_residual(fall, rise, values)))
    return float(t0[k]), float(t1[k])


def _residual(fall: Floats, rise: Floats, values: Floats) -> Floats:
    """Squared error of the best b, f, r for every row of `fall` and `rise`, (n_pairs,)."""
    design = np.stack([np.ones_like(fall), fall, rise], axis=2)
    gram = np.einsum("kni,knj->kij", design, design)
    # a fall or rise outside the window has no column: a small ridge keeps the system regular
    gram += 1e-9 * np.eye(3)
    right = np.einsum("kni,n->ki", design, values)
    weights = np.linalg.solve(gram, right[:, :, None])[:, :, 0]
    error = values - np.einsum("kni,ki->kn", design, weights)
    return np.asarray(np.sum(error**2, axis=1) + _wrong_way(weights))


def _wrong_way(weights: Floats) -> Floats:
    """Penalty for a fall or rise that points down: not what the model means."""
    return np.asarray(1e3 * np.sum(np.minimum(0.0, weights[:, 1:]) ** 2, axis=1))
