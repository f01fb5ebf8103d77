"""Which of laugh, cough, sneeze, breath and speech a recording is, and how sure that is."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.calls import Candidates
from pipeline.laughter import measure_bout
from pipeline.voice import HOP, RATE, Frames

Floats = NDArray[np.float64]

TABLE = Path(__file__).parent / "tables" / "sound_kinds.csv"
KINDS = ("laugh", "cough", "sneeze", "breath", "speech")
MEASURES = (
    "repetition",
    "change",
    "voiced_power",
    "steepest",
    "tilt",
    "log_rise",
    "periodicity",
    "log_active",
)
NO_BOUT = {"repetition": 1.0, "change": 7.0}
"""Of sounds without three peaks in a row: as unlike as the calls of a cough or of speech."""
ACTIVE_DB, OVER_NOISE_DB, EVENT_DB, NEAR_TOP_DB = 25.0, 6.0, 20.0, 10.0
SMOOTH, STEP = 5, 6
SURE = 0.6


@dataclass(frozen=True, kw_only=True, slots=True)
class Kind:
    """Most likely kind with the confidence of all five, each as likely beforehand."""

    kind: str
    confidence: float
    of_each: dict[str, float]

    @property
    def sentence(self) -> str:
        """The finding in words."""
        word = "a" if self.kind != "speech" else ""
        sure = "" if self.confidence >= SURE else ", unsure"
        return f"sounds like {word} {self.kind}".replace("  ", " ") + (
            f" ({self.confidence:.0%}{sure})"
        )


def kind_measures(candidates: Candidates, frames: Frames) -> dict[str, float]:
    """Measures of a whole recording.

    Parameters
    ----------
    candidates : of `pipeline.calls.find_calls`
    frames : of the same sound
    """
    level, power = frames.level, 10 ** (frames.level / 10)
    top = float(level.max())
    active = level > max(top - ACTIVE_DB, float(np.percentile(level, 10)) + OVER_NOISE_DB)
    if active.sum() < 5:
        active = level > top - ACTIVE_DB
    smooth = np.convolve(level, np.ones(SMOOTH) / SMOOTH, "same")
    bouts = [candidates.peak[candidates.of_bout(int(n))] for n in np.unique(candidates.bout)]
    measured = [measure_bout(peaks, frames) for peaks in bouts if len(peaks) >= 3]
    best = min(measured, key=lambda one: 2 * one.repetition + one.change / 3, default=None)
    return {
        "repetition": best.repetition if best else NO_BOUT["repetition"],
        "change": best.change if best else NO_BOUT["change"],
        "voiced_power": float(power[frames.periodicity > 0.7].sum() / power.sum()),
        "steepest": _steepest(smooth, top),
        "tilt": float((frames.tilt * power).sum() / power.sum()),
        "log_rise": _log_rise(smooth),
        "periodicity": float(frames.periodicity[active].mean()),
        "log_active": float(np.log(active.sum() * HOP / RATE)),
    }


def _steepest(smooth: Floats, top: float) -> float:
    """Largest rise within 30 ms that ends near the loudest, dB."""
    if len(smooth) <= STEP:
        return 0.0
    rise, ends = smooth[STEP:] - smooth[:-STEP], smooth[STEP:] > top - NEAR_TOP_DB
    return float(rise[ends].max()) if ends.any() else 0.0


def _log_rise(smooth: Floats) -> float:
    """Logarithm of the time in which the loudest event rises by 20 dB, s."""
    peak = int(smooth.argmax())
    under = np.flatnonzero(smooth[:peak] <= smooth[peak] - EVENT_DB)
    frames = peak - int(under[-1]) if len(under) else peak
    return float(np.log(frames * HOP / RATE + 0.01))


def tell_kind(measures: dict[str, float]) -> Kind:
    """Weigh the measures (multinomial logistic, weights in tables/sound_kinds.csv)."""
    scores = dict.fromkeys(KINDS, 0.0)
    with TABLE.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            value = 1.0
            if row["measure"] != "intercept":
                value = (measures[row["measure"]] - float(row["mean"])) / float(row["sd"])
            for kind in KINDS:
                scores[kind] += value * float(row[kind])
    values = np.array([scores[kind] for kind in KINDS])
    shares = np.exp(values - values.max())
    shares /= shares.sum()
    best = int(shares.argmax())
    return Kind(
        kind=KINDS[best],
        confidence=float(shares[best]),
        of_each={kind: float(share) for kind, share in zip(KINDS, shares, strict=True)},
    )
