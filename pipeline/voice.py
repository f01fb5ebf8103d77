"""Short frames of sound: level, periodicity, pitch, and the shape of the spectrum."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import signal

Floats = NDArray[np.float64]

RATE = 8000.0
"""Hz at which frames are taken, so that files of any rate are told apart by the same measures."""
WINDOW, HOP = 256, 40
"""Samples: 32 ms every 5 ms."""
PITCH = (70.0, 1100.0)
"""Hz; laughter reaches far above speech (Bachorowski 2001)."""
N_BANDS, PER_BAND = 6, 3
"""Six bands of three mel steps: as wide as the pitch of a laugh is high, so that a harmonic that
moves does not jump from band to band."""
BAND_EDGES = (150.0, 3800.0)
BLOCK = 4096
FLOOR = 1e-12


@dataclass(frozen=True, kw_only=True, slots=True)
class Frames:
    """Measures of a sound every 5 ms.

    Parameters
    ----------
    time : (n,), s, middle of the frame
    level : (n,), dB of the mean power, full scale = 0
    periodicity : (n,), 0 noise to 1 periodic: the highest peak of the autocorrelation
    pitch : (n,), Hz at that peak
    bands : (n, N_BANDS), dB, power in bands of equal width on the mel scale
    tilt : (n,), dB, power above 1.5 kHz over that below
    """

    time: Floats
    level: Floats
    periodicity: Floats
    pitch: Floats
    bands: Floats
    tilt: Floats

    def at(self, seconds: float) -> int:
        """Index of the frame nearest to a time."""
        return int(np.clip(round((seconds - self.time[0]) * RATE / HOP), 0, len(self.time) - 1))

    def between(self, start: float, end: float) -> slice:
        """Frames from `start` to `end`, at least one."""
        first = self.at(start)
        return slice(first, max(first + 1, self.at(end) + 1))


def frame_measures(samples: Floats, rate: float) -> Frames:
    """Cut a sound into frames and measure each.

    Parameters
    ----------
    samples : (n,), any unit
    rate : Hz, RATE or more
    """
    low = _at_frame_rate(samples, rate)
    low = np.pad(low, WINDOW // 2)
    count = max(1, 1 + (len(low) - WINDOW) // HOP)
    low = np.pad(low, (0, max(0, WINDOW + (count - 1) * HOP - len(low))))
    windows = np.lib.stride_tricks.sliding_window_view(low, WINDOW)[::HOP][:count]
    parts = [_measure(windows[i : i + BLOCK]) for i in range(0, count, BLOCK)]
    level, periodicity, pitch, bands, tilt = (
        np.concatenate(piece) for piece in zip(*parts, strict=True)
    )
    return Frames(
        time=np.arange(count) * HOP / RATE,
        level=level,
        periodicity=periodicity,
        pitch=pitch,
        bands=bands,
        tilt=tilt,
    )


def _at_frame_rate(samples: Floats, rate: float) -> Floats:
    if rate == RATE:
        return samples
    divisor = math.gcd(round(rate), round(RATE))
    up, down = round(RATE) // divisor, round(rate) // divisor
    return np.asarray(signal.resample_poly(samples, up, down), dtype=np.float64)


def _measure(windows: Floats) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    shape = signal.windows.hann(WINDOW, sym=False)
    shaped = (windows - windows.mean(axis=1, keepdims=True)) * shape
    spectrum = np.abs(np.fft.rfft(shaped, 2 * WINDOW, axis=1)) ** 2
    frequency = np.arange(WINDOW + 1) * RATE / (2 * WINDOW)
    power = spectrum.sum(axis=1)
    level = 10 * np.log10((shaped**2).sum(axis=1) / (shape**2).sum() + FLOOR)
    in_bands = (spectrum @ _band_weights(frequency).T).reshape(len(windows), N_BANDS, PER_BAND)
    bands = 10 * np.log10(in_bands.mean(axis=2) + FLOOR)
    high = spectrum[:, frequency > 1500.0].sum(axis=1)
    tilt = 10 * np.log10((high + FLOOR) / (power - high + FLOOR))
    periodicity, pitch = _autocorrelation_peak(spectrum, shape)
    return level, periodicity, pitch, bands, tilt


def _autocorrelation_peak(spectrum: Floats, shape: Floats) -> tuple[Floats, Floats]:
    """Highest peak of the autocorrelation over that of the window (Boersma 1993)."""
    of_window = np.fft.irfft(np.abs(np.fft.rfft(shape, 2 * WINDOW)) ** 2)[:WINDOW]
    lags = np.fft.irfft(spectrum, axis=1)[:, :WINDOW]
    shortest, longest = int(RATE / PITCH[1]), int(RATE / PITCH[0])
    norm = lags[:, :1] + FLOOR
    ratio = lags[:, : longest + 2] / norm * (of_window[0] / of_window[: longest + 2])
    inner = ratio[:, shortest : longest + 1]
    is_peak = (inner >= ratio[:, shortest - 1 : longest]) & (
        inner >= ratio[:, shortest + 1 : longest + 2]
    )
    # a small cost on long lags: the period, not twice the period
    cost = 0.01 * np.log2(np.arange(shortest, longest + 1) / shortest)
    scored = np.where(is_peak, inner - cost, -1.0)
    best = scored.argmax(axis=1)
    rows = np.arange(len(spectrum))
    periodicity = np.clip(np.where(scored[rows, best] > 0, inner[rows, best], 0.0), 0.0, 1.0)
    # the top of a parabola through three lags: at 8 kHz a whole lag is up to a semitone
    at = best + shortest
    before, top, after = ratio[rows, at - 1], ratio[rows, at], ratio[rows, at + 1]
    bend = before - 2 * top + after
    shift = np.where(bend < -FLOOR, 0.5 * (before - after) / np.minimum(bend, -FLOOR), 0.0)
    return periodicity, RATE / (at + np.clip(shift, -0.5, 0.5))


def _band_weights(frequency: Floats) -> Floats:
    """Triangular bands, (N_BANDS * PER_BAND, n_frequencies)."""
    edges = _from_mel(np.linspace(_mel(BAND_EDGES[0]), _mel(BAND_EDGES[1]), N_BANDS * PER_BAND + 2))
    rise = (frequency - edges[:-2, None]) / (edges[1:-1] - edges[:-2])[:, None]
    fall = (edges[2:, None] - frequency) / (edges[2:] - edges[1:-1])[:, None]
    return np.maximum(0.0, np.minimum(rise, fall))


def _mel(frequency: float) -> float:
    return 2595.0 * math.log10(1.0 + frequency / 700.0)


def _from_mel(mel: Floats) -> Floats:
    return 700.0 * (10.0 ** (mel / 2595.0) - 1.0)
