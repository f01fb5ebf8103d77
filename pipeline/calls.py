"""Calls and bouts: peaks of loudness, cut in the middle of the valleys between them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, signal

from pipeline.audio import Sound
from pipeline.envelope import RATE, mean_peak_height, smooth_envelope, without_floor
from pipeline.settings import CallSettings
from pipeline.voice import Frames

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

NEIGHBOURHOOD = 1.5
"""s on either side in which the loudest peak is sought."""
RANGE_DB = 60.0
"""Nothing so far under the loudest of a recording is a call; bouts may differ by 40 dB."""
EDGE = 0.1
"""Share of its height at which the first call of a bout begins and the last ends."""
FARTHEST_EDGE = 0.25
VALLEY = 0.1
"""A valley is what lies within this share of the lower peak's height over its deepest place."""
AROUND_PEAK = 0.02
BREATH_SHORTEST = 0.15
BREATH_OVER_NOISE = 6.0


@dataclass(frozen=True, kw_only=True, slots=True)
class Candidates:
    """Peaks of loudness that may be calls.

    Parameters
    ----------
    peak, start, end : (n,), s from the start of the sound; calls of a bout touch
    height : (n,), over the mean peak height of the recording
    bout : (n,), from 1
    voiced : (n,)
    depth : dB, median drop from the lower of two neighbouring peaks to the valley; nan for none
    """

    peak: Floats
    start: Floats
    end: Floats
    height: Floats
    bout: Ints
    voiced: Bools
    depth: float

    def of_bout(self, number: int) -> Ints:
        """Indices of the calls of a bout."""
        return np.flatnonzero(self.bout == number)


def call_envelope(sound: Sound, settings: CallSettings) -> Floats:
    """Envelope at RATE in which calls are sought."""
    envelope = smooth_envelope(sound.rectified, sound.rate, settings.envelope_hz)
    return without_floor(envelope) if settings.stronger else envelope


def find_calls(envelope: Floats, frames: Frames, settings: CallSettings) -> Candidates:
    """Find peaks, gather them into bouts and cut them apart.

    Parameters
    ----------
    envelope : of `call_envelope`
    frames : of the same sound
    settings : section `calls`
    """
    level = 20 * np.log10(np.maximum(envelope, 1e-30))
    peaks, _ = signal.find_peaks(
        level, prominence=settings.prominence_db, distance=round(settings.apart_s * RATE)
    )
    loudest = ndimage.maximum_filter1d(level, 2 * round(NEIGHBOURHOOD * RATE) + 1)
    loud = level[peaks] > loudest[peaks] - settings.depth_db
    peaks = peaks[loud & (level[peaks] > level.max() - RANGE_DB)]
    gaps = np.diff(peaks) / RATE > settings.gap_s
    bout = np.concatenate([[1], 1 + np.cumsum(gaps)]) if len(peaks) else np.empty(0)
    start, end, depth = _cut(envelope, peaks, bout)
    return Candidates(
        peak=peaks / RATE,
        start=start / RATE,
        end=end / RATE,
        height=envelope[peaks] / mean_peak_height(envelope),
        bout=bout.astype(np.int64),
        voiced=voiced_at(peaks / RATE, frames, settings),
        depth=float(np.median(depth)) if len(depth) else float("nan"),
    )


def voiced_at(peaks: Floats, frames: Frames, settings: CallSettings) -> Bools:
    """Whether the sound is periodic around each peak (s)."""
    return np.array(
        [
            np.median(frames.periodicity[frames.between(t - AROUND_PEAK, t + AROUND_PEAK)])
            >= settings.voiced_periodicity
            for t in peaks
        ],
        dtype=np.bool_,
    )


def _cut(envelope: Floats, peaks: Ints, bout: Floats) -> tuple[Floats, Floats, Floats]:
    """Start and end of each call, samples, and the depth of each valley, dB."""
    start, end = np.empty(len(peaks)), np.empty(len(peaks))
    depth: list[float] = []
    for i, peak in enumerate(peaks):
        if i and bout[i] == bout[i - 1]:
            start[i] = end[i - 1]
        else:
            first = int(peaks[i - 1]) if i else 0
            start[i] = _edge(envelope, int(peak), first)
        if i + 1 < len(peaks) and bout[i + 1] == bout[i]:
            end[i], fall = _valley(envelope, int(peak), int(peaks[i + 1]))
            depth.append(fall)
        else:
            last = int(peaks[i + 1]) if i + 1 < len(peaks) else len(envelope) - 1
            end[i] = _edge(envelope, int(peak), last)
    return start, end, np.array(depth)


def _valley(envelope: Floats, first: int, second: int) -> tuple[float, float]:
    """Middle of the valley between two peaks (dilorenzo2009 §6.3.3), and its depth, dB."""
    between = envelope[first : second + 1]
    lowest = int(between.argmin())
    lower = min(between[0], between[-1])
    rim = between[lowest] + VALLEY * (lower - between[lowest])
    above = np.flatnonzero(between > rim)
    left = above[above < lowest].max(initial=0)
    right = above[above > lowest].min(initial=len(between) - 1)
    depth = 20 * np.log10(lower / max(between[lowest], 1e-30))
    return first + (left + right) / 2.0, float(depth)


def _edge(envelope: Floats, peak: int, limit: int) -> float:
    """Where the sound of a bout's first or last call comes out of the quiet."""
    farthest = round(FARTHEST_EDGE * RATE)
    step = 1 if limit > peak else -1
    stop = peak + step * min(abs(limit - peak), farthest)
    walk = np.arange(peak, stop + step, step)
    under = np.flatnonzero(envelope[walk] < EDGE * envelope[peak])
    if len(under):
        return float(walk[under[0]])
    return float(walk[int(envelope[walk].argmin())])


def find_breaths(candidates: Candidates, kept: Bools, frames: Frames) -> list[tuple[float, float]]:
    """Breaths in between bouts, start and end in s: noise without voice, over the background.

    Parameters
    ----------
    candidates, kept : calls and which of them are laughter; only gaps between these are looked at
    frames : of the same sound
    """
    background = float(np.percentile(frames.level, 5))
    numbers = np.unique(candidates.bout[kept])
    found: list[tuple[float, float]] = []
    for before, after in pairwise(numbers):
        begin = float(candidates.end[candidates.of_bout(before)].max())
        stop = float(candidates.start[candidates.of_bout(after)].min())
        if stop - begin < BREATH_SHORTEST:
            continue
        span = frames.between(begin, stop)
        noisy = (frames.level[span] > background + BREATH_OVER_NOISE) & (
            frames.periodicity[span] < 0.7
        )
        labels, count = ndimage.label(ndimage.binary_closing(noisy, np.ones(13, dtype=np.bool_)))
        runs = [np.flatnonzero(labels == k + 1) for k in range(count)]
        if runs:
            longest = max(runs, key=len)
            times = frames.time[span][longest]
            if times[-1] - times[0] >= BREATH_SHORTEST:
                found.append((float(times[0]), float(times[-1])))
    return found
