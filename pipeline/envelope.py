"""The loudness of a sound over time: rectified, low-passed, at 1 kHz."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, signal

Floats = NDArray[np.float64]

RATE = 1000.0
"""Hz of every envelope and pressure."""
FLOOR_WINDOW = 0.4
"""s; a reverberant floor is what stays under the calls for two periods of laughter."""
VALLEY_WINDOW = 0.35
"""s; quiet shorter than this is a valley within a bout."""
PEAK_SHARE = 0.1
"""A peak stands out by this share of the highest, or it is none."""


def published_envelope(rectified: Floats, rate: float, cutoff: float, passes: int) -> Floats:
    """Rectified sound through a first-order Butterworth low-pass (dilorenzo2009 §6.3).

    Parameters
    ----------
    rectified : (n,)
    rate, cutoff : Hz
    passes : 1 as published, its delay at low frequencies 1 / (2π cutoff) taken off; 2 there and
        back, without delay

    Returns
    -------
    (n_times,), at RATE from the first sample on
    """
    sections = signal.butter(1, cutoff, fs=rate, output="sos")
    if passes == 1:
        smooth, delay = signal.sosfilt(sections, rectified), 1.0 / (2.0 * np.pi * cutoff)
    else:
        pad = min(len(rectified) - 1, round(rate / cutoff))
        smooth, delay = signal.sosfiltfilt(sections, rectified, padlen=pad), 0.0
    return np.maximum(at_rate(np.asarray(smooth), rate, delay), 0.0)


def smooth_envelope(rectified: Floats, rate: float, cutoff: float) -> Floats:
    """Envelope in which single calls are told apart: second order there and back, no delay."""
    sections = signal.butter(2, cutoff, fs=rate, output="sos")
    pad = min(len(rectified) - 1, round(rate / cutoff))
    smooth = at_rate(signal.sosfiltfilt(sections, rectified, padlen=pad), rate, 0.0)
    return np.maximum(smooth, 1e-5 * max(float(smooth.max()), 1e-30))


def at_rate(values: Floats, rate: float, delay: float) -> Floats:
    """Values at RATE, shifted to come `delay` (s) earlier."""
    count = max(1, int(len(values) / rate * RATE))
    wanted = np.arange(count) / RATE + delay
    return np.interp(wanted, np.arange(len(values)) / rate, values)


def without_floor(envelope: Floats) -> Floats:
    """Envelope with the floor under its valleys taken off: the stronger filter for muddy sound.

    The floor is the grey opening over two periods of laughter, smoothed. What remains falls to
    nothing between calls that echo or a crowd had run together.
    """
    window = round(FLOOR_WINDOW * RATE)
    floor = ndimage.grey_opening(envelope, (window,), mode="nearest")
    floor = ndimage.uniform_filter1d(floor, window, mode="nearest")
    return np.maximum(envelope - floor, 1e-5 * float(envelope.max()))


def mean_peak_height(curve: Floats) -> float:
    """Mean height of the peaks that stand out by a tenth of the highest."""
    top = float(curve.max())
    peaks, _ = signal.find_peaks(curve, prominence=PEAK_SHARE * top, distance=round(0.08 * RATE))
    return float(curve[peaks].mean()) if len(peaks) else top


def presence(envelope: Floats, mean_peak: float, share: float, fade: float) -> Floats:
    """How much there is sound, 0 to 1: 1 within a bout, its valleys included, with soft edges.

    Parameters
    ----------
    envelope, mean_peak : in the same unit
    share : of the mean peak from which on there is sound
    fade : s, length of an edge
    """
    loud = envelope > max(share * mean_peak, 2.0 * float(np.percentile(envelope, 5)))
    if not loud.any():
        loud = envelope > share * mean_peak
    reach = round(VALLEY_WINDOW * RATE)
    padded = np.pad(loud, reach)
    whole = ndimage.binary_closing(padded, np.ones(2 * (reach // 2) + 1, dtype=np.bool_))
    half = max(1, round(fade * RATE))
    window = signal.windows.hann(2 * half + 1, sym=True)
    # widened by half a fade, so that a bout's first rise is inside
    wide = ndimage.binary_dilation(whole, np.ones(2 * (half // 2) + 1, dtype=np.bool_))
    soft = np.convolve(wide, window / window.sum(), "same")[reach:-reach]
    return np.asarray(np.clip(soft, 0.0, 1.0), dtype=np.float64)
