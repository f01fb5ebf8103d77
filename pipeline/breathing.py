"""Where a recording breathes: one signal for the trunk, and the onset and peak of every breath."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.signal
import scipy.stats

from pipeline.conditioning import bridge, low_pass
from pipeline.markers import MarkerRecording
from pipeline.onset import refine_onset
from pipeline.raw import Floats
from pipeline.settings import SignatureSettings
from sim.errors import InputError

# cut-offs (Hz) of the band in which the common motion is sought: 1.2 to 180 breaths a minute
COMMON_BAND = (0.02, 3.0)
N_REWEIGHTS = 5


@dataclass(frozen=True, kw_only=True, slots=True)
class Breaths:
    """Breaths of a signal, times in s from its first sample.

    Parameters
    ----------
    onset : (n,), start of inspiration, which is the end of the pause before it
    peak : (n,), end of inspiration
    end : (n,), next onset, or the end of expiration of the last breath; not-a-number when the
        last expiration is cut off
    rest : (n,), start of the pause at the end of this breath's expiration
    rise : (n,), m, signal from onset to peak
    closed_by_onset : whether the last `end` is an onset
    """

    onset: Floats
    peak: Floats
    end: Floats
    rest: Floats
    rise: Floats
    closed_by_onset: bool


def breathing_signal(recording: MarkerRecording) -> Floats:
    """First common motion of the markers, up on inspiration, (n_frames,), m.

    The principal component of all displacements in the breathing band, markers that do not
    follow it weighted down; scaled to the root mean square displacement of the markers.
    """
    chosen = moving_markers(recording)
    tracks = np.stack([bridge(recording.positions[:, i]) for i in chosen], axis=1)
    moved = tracks - tracks.mean(axis=0)
    band = _in_band(moved, recording.rate)
    size = np.sqrt(np.mean(band**2, axis=(0, 2)))
    # a marker that comes off moves most and would be the first component all by itself
    weights = 1.0 / np.maximum(1.0, size / max(float(np.median(size)), 1e-9))
    for _ in range(N_REWEIGHTS):
        scaled = (band * weights[:, None]).reshape(len(band), -1)
        _, vectors = np.linalg.eigh(scaled.T @ scaled)
        loading = vectors[:, -1].reshape(-1, 3)
        score = scaled @ vectors[:, -1] / np.sum((weights[:, None] * loading) ** 2)
        rest = band - score[:, None, None] * loading * weights[:, None]
        spread = np.sqrt(np.mean(rest**2, axis=(0, 2)))
        usual = max(float(np.median(spread)), 1e-6)
        weights = 1.0 / np.maximum(1.0, spread / (2.0 * usual))
    weighted = loading * weights[:, None]
    signal = np.einsum("fmi,mi->f", moved, weighted) / np.sqrt(np.sum(weights**2))
    place = np.nanmean(recording.positions[:, chosen], axis=0)
    return np.asarray(signal * _sign(place, loading, bool(recording.back)))


def moving_markers(recording: MarkerRecording) -> list[int]:
    """Markers that can show a breath: those on the back are the reference, if there are others."""
    n = len(recording.labels)
    others = [i for i in range(n) if i not in recording.back]
    return others or list(range(n))


def _in_band(moved: Floats, rate: float) -> Floats:
    low, high = COMMON_BAND
    sos = scipy.signal.butter(1, low, btype="highpass", fs=rate, output="sos")
    flat = scipy.signal.detrend(moved, axis=0)
    flat = scipy.signal.sosfiltfilt(sos, flat, axis=0, padlen=min(len(flat) - 1, round(rate)))
    return low_pass(np.asarray(flat), rate, high)


def _sign(place: Floats, loading: Floats, has_back: bool) -> float:
    """Sign that makes the front of the body go forward, and the chest up, on inspiration."""
    # with markers on the front only there is no depth to tell sides by
    front = place[:, 0] >= place[:, 0].mean() if has_back else np.full(len(place), True)
    upper = front & (place[:, 2] >= np.median(place[front, 2]))
    return 1.0 if loading[front, 0].sum() + 0.5 * loading[upper, 2].sum() >= 0 else -1.0


def check_breathing(recording: MarkerRecording, settings: SignatureSettings) -> None:
    """Refuse what cannot hold a readable breath, before any is looked for."""
    source = recording.quality.get("file", recording.name)
    duration = len(recording.positions) / recording.rate
    if duration < settings.min_duration_s:
        raise InputError(
            f"{source}: breathing: no breathing found, {duration:.1f} s are too short"
            f" (at least {settings.min_duration_s:g}). Give a longer recording."
        )
    trunk = recording.quality.get("trunk", {})
    travel, tilt = trunk.get("travel_mm", 0.0), trunk.get("tilt_deg", 0.0)
    if travel > 1e3 * settings.max_travel_m or tilt > np.degrees(settings.max_tilt_rad):
        raise InputError(
            f"{source}: breathing: no breathing found, the trunk moves by {travel:.0f} mm and"
            f" tilts by {tilt:.0f} degrees. Record a person at rest, or choose start_s and end_s."
        )


def find_breaths(signal: Floats, rate: float, settings: SignatureSettings) -> Breaths:
    """Onset and peak of every breath.

    Turning points are told from noise by hysteresis: a turn counts once the signal has come
    back by `hysteresis` of the size of breaths around it. The onset is then the end of the flat
    stretch before the rise (`pipeline.onset`).

    Parameters
    ----------
    signal : (n_frames,), m, up on inspiration
    rate : Hz
    """
    smooth = _smoothed(signal, rate, settings.search_hz)
    troughs, peaks = _turns(smooth, rate, settings)
    if len(peaks) >= 3:
        period = float(np.median(np.diff(peaks))) / rate
        smooth = _smoothed(signal, rate, min(max(6.0 / period, 0.7), settings.search_hz * 2))
        troughs, peaks = _turns(smooth, rate, settings)
    return _breaths(signal, smooth, rate, troughs, peaks)


def _smoothed(signal: Floats, rate: float, cutoff: float) -> Floats:
    stacked = np.repeat(signal[:, None, None], 3, axis=2)
    return np.asarray(low_pass(stacked, rate, cutoff)[:, 0, 0])


def _turns(smooth: Floats, rate: float, settings: SignatureSettings) -> tuple[list[int], list[int]]:
    """Frames of troughs and peaks, in turn, every trough before its peak."""
    # the smaller of near and far: neither a sigh nor the deep part of a recording hides the rest
    near, far = (_local_size(smooth, rate, s) for s in (settings.local_s, 2.5 * settings.local_s))
    size = np.minimum(near, far)
    need = np.maximum(settings.hysteresis * size, settings.smallest_share * _overall_size(smooth))
    troughs: list[int] = []
    peaks: list[int] = []
    lowest = highest = 0
    rising = False
    for i in range(1, len(smooth)):
        if rising:
            if smooth[i] > smooth[highest]:
                highest = i
            elif smooth[highest] - smooth[i] > need[highest]:
                peaks.append(highest)
                rising, lowest = False, i
        else:
            if smooth[i] < smooth[lowest]:
                lowest = i
            elif smooth[i] - smooth[lowest] > need[lowest]:
                troughs.append(lowest)
                rising, highest = True, i
    if len(troughs) > len(peaks):
        troughs.pop()
    if len(peaks) > 0:
        troughs.append(_last_trough(smooth, peaks[-1]))
    return troughs, peaks


def _last_trough(smooth: Floats, peak: int) -> int:
    return peak + int(np.argmin(smooth[peak:]))


def _local_size(smooth: Floats, rate: float, window: float) -> Floats:
    """Size of the breaths around every frame, (n_frames,), m.

    Weighted median of the prominences of all maxima, each weighted by itself: many small
    wiggles weigh less than few breaths, and one sigh less than the breaths around it.
    """
    peaks, properties = scipy.signal.find_peaks(smooth, prominence=0.0)
    heights = properties["prominences"]
    overall = float(np.ptp(smooth))
    if len(peaks) == 0:
        return np.full(len(smooth), overall)
    centres = np.arange(0, len(smooth), max(1, round(rate)))
    sizes = []
    for centre in centres:
        near = np.abs(peaks - centre) <= window * rate
        sizes.append(_weighted_median(heights[near]) if near.any() else np.nan)
    known = np.isfinite(sizes)
    everywhere = np.interp(np.arange(len(smooth)), centres[known], np.asarray(sizes)[known])
    return np.asarray(everywhere)


def _overall_size(smooth: Floats) -> float:
    _, properties = scipy.signal.find_peaks(smooth, prominence=0.0)
    heights = properties["prominences"]
    return _weighted_median(heights) if heights.size else float(np.ptp(smooth))


def _weighted_median(heights: Floats) -> float:
    order = np.sort(heights)
    return float(order[np.searchsorted(np.cumsum(order), 0.5 * order.sum())])


def _drift(smooth: Floats, troughs: list[int]) -> Floats:
    """Slope of the resting level around every trough, m a frame.

    A line through up to five troughs: a drift goes on, a single breath's end does not count.
    """
    at = np.array(troughs, dtype=np.float64)
    slopes = np.zeros(len(troughs))
    for k in range(len(troughs)):
        near = slice(max(0, k - 2), k + 3)
        if len(at[near]) >= 3:
            slopes[k] = scipy.stats.theilslopes(smooth[troughs][near], at[near]).slope
    return slopes


def _breaths(
    signal: Floats, smooth: Floats, rate: float, troughs: list[int], peaks: list[int]
) -> Breaths:
    """Onsets, rests and ends from turning points; `troughs` has one more than `peaks`."""
    n = len(peaks)
    slopes = _drift(smooth, troughs)
    frames = np.arange(len(signal))
    onset, rest = np.full(n, np.nan), np.full(n + 1, np.nan)
    for k in range(n):
        before = peaks[k - 1] if k else 0
        drift = slopes[k] * (frames - troughs[k])
        rest[k], onset[k] = refine_onset(
            signal - drift, smooth - drift, rate, before, troughs[k], peaks[k]
        )
    peak = np.array(peaks, dtype=np.float64) / rate
    rise = smooth[np.array(peaks, dtype=int)] - np.interp(
        onset * rate, np.arange(len(smooth)), smooth
    )
    end = np.append(onset[1:], np.nan)
    closed = True
    if n:
        # a last expiration that came down is a whole breath, though no next onset closes it
        came_down = smooth[peaks[-1]] - smooth[troughs[-1]]
        if came_down >= 0.75 * rise[-1]:
            end[-1] = rest[n] = troughs[-1] / rate
            closed = False
    return Breaths(
        onset=onset, peak=peak, end=end, rest=rest[1:], rise=rise, closed_by_onset=closed
    )
