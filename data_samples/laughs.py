"""Laughs of people who do not exist: pressure first, then the sound it would make.

The level of the voice follows the pressure by the measured gain of voices, the larynx opens and
closes once a call, the room adds echo and noise. Nothing here comes from `pipeline` or `sim`.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import signal

Floats = NDArray[np.float64]

FOLDER = Path(__file__).parent
RATE = 16000
FORMANTS = ((730.0, 90.0), (1190.0, 110.0), (2440.0, 160.0), (3400.0, 220.0))
"""Hz, centre and width of an open vowel of a man; a woman's lie 15 % higher."""
FEMALE_TRACT = 1.15
LEAD = 0.4


@dataclass(frozen=True, kw_only=True, slots=True)
class Speaker:
    """What stays the same in everything a person laughs.

    Parameters
    ----------
    peak_pressure : cmH2O; gain : dB a doubling of pressure; loudness : dB; call_rate, pitch : Hz
    reverberation : s
    """

    sex: str
    peak_pressure: float
    gain: float
    loudness: float
    call_rate: float
    pitch: float
    reverberation: float


@dataclass(frozen=True, kw_only=True, slots=True)
class Laugh:
    """Sound and what made it, all at RATE.

    Parameters
    ----------
    sound : (n,); pressure : (n,), cmH2O; flow : (n,), L/s, into the lung positive
    peaks, starts, ends : (n_calls,), s; bout : (n_calls,), from 1
    inhalations : start and end, s
    """

    sound: Floats
    pressure: Floats
    flow: Floats
    peaks: Floats
    starts: Floats
    ends: Floats
    bout: NDArray[np.int64]
    inhalations: tuple[tuple[float, float], ...]


def read_parameters() -> dict[str, float]:
    """Numbers of laugh_parameters.csv."""
    with (FOLDER / "laugh_parameters.csv").open(encoding="utf-8", newline="") as file:
        return {row["name"]: float(row["value"]) for row in csv.DictReader(file)}


def draw_speaker(rng: np.random.Generator, sex: str, p: dict[str, float]) -> Speaker:
    """Draw a person."""
    return Speaker(
        sex=sex,
        peak_pressure=p["peak_pressure"] * float(np.exp(rng.normal(0, p["peak_pressure_log_sd"]))),
        gain=float(rng.normal(p[f"gain_{sex}"], p["gain_sd"])),
        loudness=float(rng.normal(0, p["loudness_sd"])),
        call_rate=float(rng.normal(p["call_rate"], p["call_rate_sd_speakers"])),
        pitch=p[f"pitch_{sex}"] * float(np.exp(rng.normal(0, p["pitch_log_sd"]))),
        reverberation=float(rng.uniform(p["reverberation_low"], p["reverberation_high"])),
    )


def draw_laugh(
    rng: np.random.Generator, speaker: Speaker, bouts: tuple[int, ...], p: dict[str, float]
) -> Laugh:
    """Draw a laugh of one person.

    Parameters
    ----------
    rng : source of chance
    speaker : who laughs
    bouts : number of calls of each bout; an inhalation stands between two
    p : `read_parameters`
    """
    peaks, bout, breaths = _timing(rng, speaker, bouts, p)
    duration = peaks[-1] + 0.7
    time = np.arange(int(duration * RATE)) / RATE
    heights = _heights(rng, speaker, bouts, p)
    pressure, starts, ends = _pressure(rng, time, peaks, heights, bout, breaths, p)
    closed, level = _larynx(rng, time, peaks, starts, ends, p)
    dry = _voice(rng, speaker, pressure, closed * 10 ** (level / 20), p)
    dry += _air(rng, speaker, time, pressure, 1 - closed, breaths, p)
    wet = _room(rng, speaker, dry, p)
    resistance = (
        p["airway"]
        + p["glottis_abducted"]
        + closed * (p["glottis_adducted"] - p["glottis_abducted"])
    )
    # a breath in passes an open larynx
    resistance = np.where(pressure < 0, p["airway"], resistance)
    return Laugh(
        sound=wet,
        pressure=pressure,
        flow=-pressure / resistance,
        peaks=peaks,
        starts=starts,
        ends=ends,
        bout=bout,
        inhalations=tuple(breaths),
    )


def _timing(
    rng: np.random.Generator, speaker: Speaker, bouts: tuple[int, ...], p: dict[str, float]
) -> tuple[Floats, NDArray[np.int64], list[tuple[float, float]]]:
    at, peaks, bout, breaths = LEAD, [], [], []
    for number, count in enumerate(bouts, start=1):
        for call in range(count):
            peaks.append(at)
            bout.append(number)
            slow = 1 + p["interval_growth"] * call
            at += slow / speaker.call_rate * (1 + rng.normal(0, p["interval_sd"]))
        if number < len(bouts):
            begin = peaks[-1] + 0.3
            end = begin + p["inhalation_time"] * (1 + rng.normal(0, 0.1))
            breaths.append((begin, end))
            at = end + 0.25
    return np.array(peaks), np.array(bout), breaths


def _heights(
    rng: np.random.Generator, speaker: Speaker, bouts: tuple[int, ...], p: dict[str, float]
) -> Floats:
    parts = [p["peak_fall"] ** np.arange(n) * np.exp(rng.normal(0, p["peak_sd"], n)) for n in bouts]
    heights: Floats = np.concatenate(parts)
    return heights * (speaker.peak_pressure / float(heights.mean()))


def _pressure(
    rng: np.random.Generator,
    time: Floats,
    peaks: Floats,
    heights: Floats,
    bout: NDArray[np.int64],
    breaths: list[tuple[float, float]],
    p: dict[str, float],
) -> tuple[Floats, Floats, Floats]:
    """Cosine arcs from valley to peak to valley; a half sine below zero for each breath in."""
    pressure = np.zeros_like(time)
    starts, ends = np.empty_like(peaks), np.empty_like(peaks)
    for number in np.unique(bout):
        mine = np.flatnonzero(bout == number)
        knots = [(peaks[mine[0]] - p["onset_time"], 0.0)]
        starts[mine[0]] = knots[0][0]
        for i in mine:
            knots.append((peaks[i], heights[i]))
            if i < mine[-1]:
                middle = peaks[i] + (peaks[i + 1] - peaks[i]) * rng.uniform(0.5, 0.7)
                lower = min(heights[i], heights[i + 1])
                knots.append((middle, lower * rng.uniform(p["valley_low"], p["valley_high"])))
                ends[i] = starts[i + 1] = middle
        ends[mine[-1]] = peaks[mine[-1]] + p["release_time"]
        knots.append((ends[mine[-1]], 0.0))
        for (t0, p0), (t1, p1) in pairwise(knots):
            inside = (time >= t0) & (time < t1)
            phase = (time[inside] - t0) / (t1 - t0)
            pressure[inside] = p0 + (p1 - p0) * (1 - np.cos(np.pi * phase)) / 2
    for begin, end in breaths:
        inside = (time >= begin) & (time < end)
        phase = (time[inside] - begin) / (end - begin)
        pressure[inside] = -p["inhalation_pressure"] * np.sin(np.pi * phase)
    return pressure, starts, ends


def _larynx(
    rng: np.random.Generator,
    time: Floats,
    peaks: Floats,
    starts: Floats,
    ends: Floats,
    p: dict[str, float],
) -> tuple[Floats, Floats]:
    """How far the larynx is closed, 0 to 1, and the level it adds, dB."""
    closed, level = np.zeros_like(time), np.zeros_like(time)
    for peak, start, end in zip(peaks, starts, ends, strict=True):
        share = max(0.2, rng.normal(p["voiced_share"], p["voiced_share_sd"]))
        half = share * (end - start) / 2
        centre = peak + rng.normal(0, p["larynx_lag_sd"])
        edge = 0.02
        rise = np.clip((time - centre + half + edge) / (2 * edge), 0, 1)
        fall = np.clip((centre + half + edge - time) / (2 * edge), 0, 1)
        closed = np.maximum(closed, np.sin(np.pi / 2 * np.minimum(rise, fall)) ** 2)
        level[(time >= start) & (time < end)] = rng.normal(0, p["call_level_sd"])
    return closed, level


def _voice(
    rng: np.random.Generator,
    speaker: Speaker,
    pressure: Floats,
    amount: Floats,
    p: dict[str, float],
) -> Floats:
    """Pulses of the glottis through fixed formants, level by the gain of the voice."""
    above = np.maximum(pressure, 1e-3) / speaker.peak_pressure
    wander = np.cumsum(rng.normal(0, 1, len(pressure) // 80 + 2))
    wander = np.interp(np.arange(len(pressure)) / 80, np.arange(len(wander)), wander)
    wander = p["jitter"] * (wander - wander.mean()) / max(1e-9, wander.std())
    pitch = speaker.pitch * np.maximum(above, 0.2) ** p["pitch_per_pressure"] * np.exp(wander)
    phase = np.cumsum(pitch) / RATE
    # an asymmetric triangle of flow, differentiated: harmonics fall by 6 dB an octave
    flow = np.interp(phase % 1.0, [0.0, 0.4, 0.6, 1.0], [0.0, 1.0, 0.0, 0.0])
    source = np.diff(flow, prepend=flow[0]) * np.minimum(1.0, RATE / np.maximum(pitch, 1) / 70)
    speaks = 1 / (1 + np.exp(-(pressure - p["threshold_pressure"]) / 0.3))
    gain = 10 ** ((speaker.gain * np.log2(above) + speaker.loudness) / 20)
    return _formants(source, speaker) * amount * speaks * gain


def _air(
    rng: np.random.Generator,
    speaker: Speaker,
    time: Floats,
    pressure: Floats,
    opened: Floats,
    breaths: list[tuple[float, float]],
    p: dict[str, float],
) -> Floats:
    """Noise of the open larynx and of breaths in."""
    noise = rng.normal(0, 1, len(time))
    h = _formants(noise, speaker)
    h /= h.std()
    sigh = signal.sosfilt(signal.butter(2, [400, 2500], "bandpass", fs=RATE, output="sos"), noise)
    sigh /= sigh.std()
    loud = 10 ** (speaker.loudness / 20)
    push = np.maximum(pressure, 0.0) / speaker.peak_pressure
    out = h * opened * push * 10 ** (p["aspiration_level"] / 20) * loud
    for begin, end in breaths:
        inside = (time >= begin) & (time < end)
        swell = np.sin(np.pi * (time[inside] - begin) / (end - begin))
        out[inside] += sigh[inside] * swell * 10 ** (p["inhalation_level"] / 20) * loud
    return out


def _formants(source: Floats, speaker: Speaker) -> Floats:
    """Resonances one after another, scaled to unit power where the source has it."""
    out = source
    for centre, width in FORMANTS:
        scale = FEMALE_TRACT if speaker.sex == "female" else 1.0
        radius = np.exp(-np.pi * width / RATE)
        angle = 2 * np.pi * centre * scale / RATE
        a = [1.0, -2 * radius * np.cos(angle), radius**2]
        out = signal.lfilter([sum(a)], a, out)
    return np.asarray(out / np.sqrt((out**2).mean() + 1e-20), dtype=np.float64)


def _room(rng: np.random.Generator, speaker: Speaker, dry: Floats, p: dict[str, float]) -> Floats:
    """Echo that dies away, and the noise of the room."""
    length = int(speaker.reverberation * RATE)
    decay = rng.normal(0, 1, length) * 10 ** (-3 * np.arange(length) / length)
    decay *= 10 ** (-p["direct_to_reverberant"] / 20) / np.sqrt((decay**2).sum())
    decay[0] += 1.0
    wet = signal.fftconvolve(dry, decay)[: len(dry)]
    loud = np.percentile(np.abs(wet), 99)
    return np.asarray(
        wet + rng.normal(0, 1, len(wet)) * loud * 10 ** (p["noise_level"] / 20), dtype=np.float64
    )
