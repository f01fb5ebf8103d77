"""The breath signature: the mean breath of a person, inspiration and expiration apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.breathing import Breaths, breathing_signal, check_breathing, find_breaths
from pipeline.conditioning import Bools, bridge
from pipeline.markers import MarkerRecording
from pipeline.raw import Floats
from pipeline.settings import SignatureSettings
from sim.errors import InputError

BAND = (5.0, 95.0)


@dataclass(frozen=True, kw_only=True, slots=True)
class BreathSignature:
    """Mean cycle with its band, and every cycle it was made of.

    Parameters
    ----------
    phase : (n_phase,), 0 at one onset, 1 at the next
    time : (n_phase,), s from the onset, at the median timings
    inspiration_time, expiration_time : s, medians; the pause is part of expiration
    pause_time : s, median of the rest at the end of expiration
    mean, low, high : (n_phase, n_markers, 3), m, body axes; 5th and 95th percentile of the cycles
    onset, peak, end : (n_cycles,), s in the file's time
    used : (n_cycles,)
    why_not : (n_cycles,) empty for cycles used
    breathing_signal : (n_frames,), m, up on inspiration
    rate : Hz
    n_used : number of cycles used
    """

    phase: Floats
    time: Floats
    inspiration_time: float
    expiration_time: float
    pause_time: float
    mean: Floats
    low: Floats
    high: Floats
    onset: Floats
    peak: Floats
    end: Floats
    used: Bools
    why_not: tuple[str, ...]
    breathing_signal: Floats
    rate: float
    n_used: int


def breath_signature(recording: MarkerRecording, settings: SignatureSettings) -> BreathSignature:
    """Find the breaths of a recording and average them."""
    check_breathing(recording, settings)
    signal = breathing_signal(recording)
    breaths = find_breaths(signal, recording.rate, settings)
    _check_found(recording, breaths, settings)
    why_not = _left_out(recording, breaths, settings)
    used = np.array([not why for why in why_not])
    inspiration = float(np.median((breaths.peak - breaths.onset)[used]))
    expiration = float(np.median((breaths.end - breaths.peak)[used]))
    pause = float(np.median((breaths.end - breaths.rest)[used]))
    n_phase = settings.n_phase
    time = np.linspace(0.0, inspiration + expiration, n_phase)
    cycles = np.stack(
        [
            warp(recording, breaths.onset[k], breaths.peak[k], breaths.end[k], time, inspiration)
            for k in np.flatnonzero(used)
        ]
    )
    # a breath that starts elsewhere is the same breath: only motion within it is averaged
    cycles = cycles - cycles.mean(axis=1, keepdims=True)
    place = np.nanmean(recording.positions, axis=0)
    low, high = np.percentile(cycles, BAND, axis=0)
    return BreathSignature(
        phase=np.linspace(0.0, 1.0, n_phase),
        time=time,
        inspiration_time=inspiration,
        expiration_time=expiration,
        pause_time=max(0.0, pause),
        mean=place + cycles.mean(axis=0),
        low=place + low,
        high=place + high,
        onset=breaths.onset + recording.start,
        peak=breaths.peak + recording.start,
        end=breaths.end + recording.start,
        used=used,
        why_not=why_not,
        breathing_signal=signal,
        rate=recording.rate,
        n_used=int(used.sum()),
    )


def warp(
    recording: MarkerRecording,
    onset: float,
    peak: float,
    end: float,
    time: Floats,
    inspiration: float,
) -> Floats:
    """Return one cycle at the times of the mean cycle, (n_phase, n_markers, 3), m.

    Inspiration and expiration (with its pause) are stretched apart, each linearly.
    """
    expiration = time[-1] - inspiration
    there = np.where(
        time <= inspiration,
        onset + time / inspiration * (peak - onset),
        peak + (time - inspiration) / expiration * (end - peak),
    )
    frames = np.arange(len(recording.positions)) / recording.rate
    out = np.empty((len(time), len(recording.labels), 3))
    for marker in range(len(recording.labels)):
        track = bridge(recording.positions[:, marker])
        for axis in range(3):
            out[:, marker, axis] = np.interp(there, frames, track[:, axis])
    return out


def _check_found(recording: MarkerRecording, breaths: Breaths, settings: SignatureSettings) -> None:
    source = recording.quality.get("file", recording.name)
    if not np.isfinite(breaths.end).any():
        raise InputError(
            f"{source}: breathing: no breathing found, no whole breath in"
            f" {len(recording.positions) / recording.rate:.1f} s. Give a longer recording."
        )
    size = float(np.median(breaths.rise))
    if size < settings.min_amplitude_m:
        raise InputError(
            f"{source}: breathing: no breathing found, the markers move by {1e3 * size:.2f} mm"
            " relative to the back. Place markers on chest and belly."
        )


def _left_out(
    recording: MarkerRecording, breaths: Breaths, settings: SignatureSettings
) -> tuple[str, ...]:
    """Reason why each cycle is not averaged, empty for those that are."""
    n = len(breaths.onset)
    complete = np.isfinite(breaths.end)
    period = np.where(complete, breaths.end - breaths.onset, np.nan)
    level = np.interp(
        np.nan_to_num(breaths.end),
        np.arange(n_frames(recording)) / recording.rate,
        breathing_signal(recording),
    )
    start_level = np.interp(
        breaths.onset, np.arange(n_frames(recording)) / recording.rate, breathing_signal(recording)
    )
    size, usual = float(np.median(breaths.rise)), float(np.nanmedian(period))
    few = int(complete.sum()) <= settings.few_cycles
    out: list[str] = []
    for k in range(n):
        last_open = k == n - 1 and not breaths.closed_by_onset
        if not complete[k]:
            out.append("edge: expiration is cut off")
        elif last_open and not few:
            out.append("edge: no next onset closes it")
        elif _in_gap(recording, breaths.onset[k], breaths.end[k]):
            out.append("gap: markers missing")
        elif few:
            out.append("")
        elif breaths.rise[k] > settings.sigh_ratio * size:
            out.append("sigh")
        elif breaths.rise[k] < size / settings.outlier_ratio:
            out.append("outlier: small")
        elif not 1.0 / settings.outlier_ratio < period[k] / usual < settings.outlier_ratio:
            out.append("outlier: duration")
        elif abs(level[k] - start_level[k]) > settings.drift_share * breaths.rise[k]:
            out.append("drift: does not come back")
        else:
            out.append("")
    return tuple(out)


def n_frames(recording: MarkerRecording) -> int:
    """Frames of a recording."""
    return len(recording.positions)


def _in_gap(recording: MarkerRecording, onset: float, end: float) -> bool:
    first, stop = round(onset * recording.rate), round(end * recording.rate) + 1
    return bool(np.isnan(recording.positions[first:stop]).any())
