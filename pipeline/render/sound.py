"""The sound of a film, cut to its span."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from pipeline.audio import read_samples
from sim.errors import InputError

RATE = 48000
"""Hz, of a film's sound."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Track:
    """A sound on the run's own time.

    Parameters
    ----------
    start : s, of its first sample
    samples : (n, n_channels) with one or two channels, full scale = 1, at `RATE`
    """

    start: float
    samples: NDArray[np.float32]

    @property
    def stop(self) -> float:
        """End, s."""
        return self.start + len(self.samples) / RATE

    def cut(self, start: float, stop: float) -> NDArray[np.float32]:
        """Samples from one time to another, silent where there are none."""
        out = np.zeros((round((stop - start) * RATE), self.samples.shape[1]), dtype=np.float32)
        first = round((self.start - start) * RATE)
        low, high = max(first, 0), min(first + len(self.samples), len(out))
        if high > low:
            out[low:high] = self.samples[low - first : high - first]
        return out


def followed_start(trajectory: Path) -> float:
    """When the sound's file begins on the run's time, s, by the record beside a laugh's run."""
    record = trajectory.with_name("follow.json")
    try:
        return -float(json.loads(record.read_text(encoding="utf-8"))["control_starts_at_s"])
    except (OSError, ValueError, KeyError, TypeError):
        return 0.0


def read_track(path: Path, start: float) -> Track:
    """Read a sound file as it is, at a film's rate.

    Parameters
    ----------
    start : s, of the run's own time, at which the file begins
    """
    samples, rate = read_samples(path)
    if samples.shape[1] > 2:
        samples = samples.mean(axis=1, keepdims=True)
    if not len(samples) or not np.isfinite(samples).all():
        raise InputError(f"{path}: sound: holds no samples, or some that are no numbers.")
    if rate != RATE:
        shared = int(np.gcd(rate, RATE))
        samples = signal.resample_poly(samples, RATE // shared, rate // shared, axis=0)
    return Track(start=start, samples=np.clip(samples, -1.0, 1.0).astype(np.float32))
