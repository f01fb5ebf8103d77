"""Whether a bout is laughter: what tells calls from syllables, tones and coughs.

Call rate proves nothing: speech has 4.5 peaks a second. A laugh repeats one call: its spectrum
hardly changes from one call to the next while its level falls away between them, the voice is
interrupted each time, and the intervals are even, but not as even as a machine's.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.calls import Candidates
from pipeline.settings import CallSettings
from pipeline.voice import Frames

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

TABLE = Path(__file__).parent / "tables" / "laughter_weights.csv"
RANGE_DB = 35.0
"""Under the loudest of a bout; what is quieter counts as this quiet."""
PATCH = np.arange(-16, 17, 2)
"""Frames around a peak that are compared: 80 ms on either side."""
CORE = 4
SHAPE_RANGE_DB = 30.0
VOICED = 0.7
VOICE_RANGE_DB = 20.0
UNEVEN_FLOOR = 0.05
HELD_PITCH = 0.04
"""Semitones; voices wander by more within a call, the smoothest synthetic one by 0.05."""
NEVER_STOPS = 0.9
"""Share of a bout that is voiced; in laughs up to 0.8, in tones that follow each other nearly 1."""
STEADY_PITCH = 0.3
"""Semitones; in a room a voice never stops either, but its echo makes the pitch jump."""
FEW_FOR_MACHINE = 5
ALIKE = 1.5
DOUBT = 0.25
MEASURES = ("irregularity", "repetition", "change", "voiced_share", "periodicity")
REASONS = {
    "irregularity": "the intervals are uneven",
    "repetition": "the calls do not repeat one another",
    "change": "the spectrum changes from call to call, as syllables do",
    "voiced_share": "the voice goes on between the calls",
    "periodicity": "there is hardly any voice",
}


@dataclass(frozen=True, kw_only=True, slots=True)
class BoutMeasures:
    """What a bout of three or more peaks is judged by.

    Parameters
    ----------
    irregularity : log of the mean |log ratio| of neighbouring intervals (and a floor)
    repetition : spectrogram around a call against the next call's, over that half a call later
    change : dB, root mean square change of the spectrum's shape from call to call, median
    voiced_share : of the time between first and last call, loud and periodic
    periodicity : median at the peaks
    unevenness : mean |log ratio| of neighbouring intervals
    pitch_wander : semitones within a call, median; nan without voice
    shape : (N_BANDS,), dB, mean shape of the spectrum at the peaks
    """

    irregularity: float
    repetition: float
    change: float
    voiced_share: float
    periodicity: float
    unevenness: float
    pitch_wander: float
    shape: Floats


def measure_bout(peaks: Floats, frames: Frames) -> BoutMeasures:
    """Measure a bout.

    Parameters
    ----------
    peaks : (n,), s from the start of the sound, three or more
    frames : of the sound
    """
    intervals = np.diff(peaks)
    unevenness = float(np.mean(np.abs(np.diff(np.log(intervals)))))
    span = frames.between(peaks[0] - 0.1, peaks[-1] + 0.1)
    bands = np.maximum(frames.bands, frames.bands[span].max() - RANGE_DB)
    at_peak = np.stack([_patch(bands, frames.at(t)) for t in peaks])
    between = np.stack([_patch(bands, frames.at(t)) for t in peaks[:-1] + intervals / 2])
    again = float(np.median(_distance(at_peak[1:], at_peak[:-1])))
    other = float(np.median(_distance(between, at_peak[:-1])))
    shapes = np.stack([_shape(bands, frames.at(t)) for t in peaks])
    level = frames.level[span]
    by_peak = np.interp(frames.time[span], peaks, [frames.level[frames.at(t)] for t in peaks])
    voice = (frames.periodicity[span] > VOICED) & (level > by_peak - VOICE_RANGE_DB)
    return BoutMeasures(
        irregularity=float(np.log(unevenness + UNEVEN_FLOOR)),
        repetition=again / max(other, 1e-9),
        change=float(np.median(np.sqrt(((shapes[1:] - shapes[:-1]) ** 2).mean(axis=1)))),
        voiced_share=float(voice.mean()),
        periodicity=float(np.median([_core(frames.periodicity, frames.at(t)) for t in peaks])),
        unevenness=unevenness,
        pitch_wander=_pitch_wander(peaks, frames),
        shape=shapes.mean(axis=0),
    )


def _patch(bands: Floats, at: int) -> Floats:
    patch = bands[np.clip(at + PATCH, 0, len(bands) - 1)]
    return np.asarray(patch - patch.max(), dtype=np.float64)


def _distance(first: Floats, second: Floats) -> Floats:
    return np.asarray(np.sqrt(((first - second) ** 2).mean(axis=(1, 2))), dtype=np.float64)


def _shape(bands: Floats, at: int) -> Floats:
    core = bands[max(0, at - CORE) : at + CORE + 1]
    shape = 10 * np.log10((10 ** (core / 10)).mean(axis=0))
    shape = np.maximum(shape, shape.max() - SHAPE_RANGE_DB)
    return np.asarray(shape - shape.mean(), dtype=np.float64)


def _core(values: Floats, at: int) -> float:
    return float(np.median(values[max(0, at - CORE) : at + CORE + 1]))


def _pitch_wander(peaks: Floats, frames: Frames) -> float:
    wanders = []
    for t in peaks:
        at = frames.at(t)
        core = slice(max(0, at - CORE), at + CORE + 1)
        pitch = frames.pitch[core][frames.periodicity[core] > VOICED]
        if len(pitch) >= 4:
            wanders.append(float(np.std(12 * np.log2(pitch))))
    return float(np.median(wanders)) if wanders else float("nan")


def read_weights() -> dict[str, tuple[float, float, float]]:
    """Mean, standard deviation and weight of each measure; the intercept has weight alone."""
    with TABLE.open(encoding="utf-8", newline="") as file:
        rows = csv.DictReader(file)
        return {r["measure"]: (float(r["mean"]), float(r["sd"]), float(r["weight"])) for r in rows}


def laughter_probability(measures: BoutMeasures) -> tuple[float, str]:
    """Probability of laughter, as likely as not beforehand, and what speaks most against it."""
    weights = read_weights()
    parts = {
        name: weights[name][2] * (getattr(measures, name) - weights[name][0]) / weights[name][1]
        for name in MEASURES
    }
    score = weights["intercept"][2] + sum(parts.values())
    return float(1.0 / (1.0 + np.exp(-score))), min(parts, key=lambda name: parts[name])


@dataclass(frozen=True, kw_only=True, slots=True)
class Verdict:
    """A bout judged.

    Parameters
    ----------
    bout : its number; calls, voiced : how many
    laughter : whether it is kept
    probability : of laughter by its measures; nan for bouts too short to be measured
    why_not : empty for laughter
    """

    bout: int
    calls: int
    voiced: int
    laughter: bool
    probability: float
    why_not: str


def judge(candidates: Candidates, frames: Frames, settings: CallSettings) -> list[Verdict]:
    """Judge every bout by itself, then those near to laughter by what they are near to."""
    alone: list[Verdict] = []
    shapes: list[Floats] = []
    changes: list[float] = []
    for number in np.unique(candidates.bout):
        calls = candidates.of_bout(int(number))
        peaks, voiced = candidates.peak[calls], int(candidates.voiced[calls].sum())
        measures = measure_bout(peaks, frames) if len(calls) >= 3 else None
        probability, why_not = float("nan"), ""
        if measures is not None:
            probability, worst = laughter_probability(measures)
            why_not = _not_alive(measures, len(calls), voiced, settings)
            if not why_not and probability < settings.min_probability:
                why_not = f"not like laughter: {REASONS[worst]}"
        if voiced < settings.min_calls and not why_not.startswith("music"):
            why_not = too_few(voiced)
        bands = np.maximum(frames.bands, frames.bands.max() - RANGE_DB)
        usual = [t for t, v in zip(peaks, candidates.voiced[calls], strict=True) if v] or peaks
        shapes.append(np.mean([_shape(bands, frames.at(t)) for t in usual], axis=0))
        changes.append(measures.change if measures else float("nan"))
        alone.append(
            Verdict(
                bout=int(number),
                calls=len(calls),
                voiced=voiced,
                laughter=not why_not,
                probability=probability,
                why_not=why_not,
            )
        )
    if sum(one.voiced for one in alone if one.laughter) < settings.min_calls_all:
        alone = [
            replace(one, laughter=False, why_not=one.why_not or too_few(one.voiced))
            for one in alone
        ]
    return _with_neighbours(alone, shapes, changes, candidates, settings)


def too_few(voiced: int) -> str:
    """Why so few voiced calls are no laugh."""
    calls = (
        "no voiced call"
        if voiced == 0
        else "1 voiced call"
        if voiced == 1
        else (f"{voiced} voiced calls")
    )
    return f"{calls}: too few to be told from a spoken 'ha ha', a cough or noise"


def _not_alive(measures: BoutMeasures, calls: int, voiced: int, settings: CallSettings) -> str:
    if calls >= FEW_FOR_MACHINE and measures.unevenness < settings.machine_irregularity:
        return "music-like: the intervals are as even as a machine's"
    if voiced >= 3 and measures.pitch_wander < HELD_PITCH:
        return "music-like: every tone holds its pitch"
    if measures.voiced_share > NEVER_STOPS and measures.pitch_wander < STEADY_PITCH:
        return "music-like: the tone never stops"
    return ""


def _with_neighbours(
    alone: list[Verdict],
    shapes: list[Floats],
    changes: list[float],
    candidates: Candidates,
    settings: CallSettings,
) -> list[Verdict]:
    """Keep short or doubtful bouts that lie near laughter and sound like it."""
    sure = [i for i, one in enumerate(alone) if one.laughter]
    out = []
    for i, one in enumerate(alone):
        near = False
        doubtful = one.probability < DOUBT or one.why_not.startswith("music")
        if not one.laughter and one.voiced and not doubtful:
            for k in sure:
                gap = _gap(candidates, one.bout, alone[k].bout)
                unlike = float(np.sqrt(((shapes[i] - shapes[k]) ** 2).mean()))
                near = near or (gap <= settings.context_s and unlike <= ALIKE * changes[k])
        out.append(replace(one, laughter=True, why_not="") if near else one)
    return out


def _gap(candidates: Candidates, first: int, second: int) -> float:
    a, b = candidates.of_bout(first), candidates.of_bout(second)
    return float(
        max(
            candidates.start[a].min() - candidates.end[b].max(),
            candidates.start[b].min() - candidates.end[a].max(),
        )
    )
