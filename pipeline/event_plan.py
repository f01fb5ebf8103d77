"""Bursts of coughs and sneezes, phases of breaths, and the flow that their sound asks for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from pipeline.audio import Sound
from pipeline.envelope import RATE, smooth_envelope
from pipeline.score import numbers
from sim.errors import InputError
from sim.units import CUBIC_METRE_PER_LITRE

Floats = NDArray[np.float64]

SMOOTH = {"cough": 25.0, "sneeze": 25.0, "breath": 4.0}
"""Hz; a cough's rise takes 20 ms, a breath's phases seconds."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Events:
    """What the torso is to do.

    Parameters
    ----------
    time : (n,), s in the file; flow : (n,), m^3/s, positive out
    spans : start and end, s in the file, of each burst or phase
    """

    time: Floats
    flow: Floats
    spans: tuple[tuple[float, float], ...]

    def volume(self, start: float, end: float) -> float:
        """Air that the flow between two times moves out, m^3."""
        part = (self.time >= start) & (self.time <= end)
        return float(self.flow[part].sum()) / RATE


def find_events(sound: Sound, kind: str, strength: float) -> Events:
    """Bursts or phases with their flow: loudness to a power, the loudest one as usual.

    Parameters
    ----------
    kind : "cough", "sneeze" or "breath"
    strength : factor on the flow

    Raises
    ------
    InputError
        if nothing stands out
    """
    of = numbers()
    envelope = smooth_envelope(sound.rectified, sound.rate, SMOOTH[kind])
    quiet = float(np.percentile(envelope, 5))
    envelope = np.maximum(envelope - quiet, 0.0)
    top, breath = float(envelope.max()), kind == "breath"
    gap, least = (
        (of["phase_gap"], of["phase_least"]) if breath else (of["event_gap"], of["event_least"])
    )
    spans = _spans(envelope, of["event_quiet"] * top, of["event_share"], gap, least)
    if not spans:
        raise InputError(
            f"{sound.source}: no {kind} stands out of the noise. Name a part by start_s and end_s."
        )
    inside = np.zeros(len(envelope), dtype=bool)
    for a, b in spans:
        inside[a:b] = True
    shape = np.where(inside, envelope / top, 0.0) ** of["flow_exponent"]
    flow = strength * of[f"{kind}_flow"] * CUBIC_METRE_PER_LITRE * shape
    if breath:
        flow = _in_and_out(flow, spans)
    time = sound.start + np.arange(len(envelope)) / RATE
    told = tuple((float(time[a]), float(time[min(b, len(time) - 1)])) for a, b in spans)
    return Events(time=time, flow=flow, spans=told)


def _spans(
    envelope: Floats, quiet: float, share: float, gap: float, least: float
) -> list[tuple[int, int]]:
    """First and last sample of each stretch that is loud for its surroundings."""
    near = ndimage.maximum_filter1d(envelope, 2 * round(RATE * max(gap, 0.3)) + 1)
    loud = (envelope > share * near) & (envelope > 0.5 * quiet)
    reach = round(gap * RATE)
    padded = np.pad(loud, reach)
    loud = ndimage.binary_closing(padded, np.ones(reach + 1, dtype=bool))[reach:-reach]
    marks, count = ndimage.label(loud)
    found = (
        [(int(p[0].start), int(p[0].stop)) for p in ndimage.find_objects(marks)] if count else []
    )
    return [
        (a, b) for a, b in found if b - a >= least * RATE and float(envelope[a:b].max()) > quiet
    ]


def _in_and_out(flow: Floats, spans: list[tuple[int, int]]) -> Floats:
    """Phases turn by turn, the first one in; each breath out takes what the breath in brought."""
    out = np.zeros_like(flow)
    drawn = 0.0
    for number, (a, b) in enumerate(spans):
        volume = float(flow[a:b].sum())
        if number % 2 == 0:
            out[a:b], drawn = -flow[a:b], volume
        else:
            out[a:b] = flow[a:b] * drawn / max(volume, 1e-12)
    return out
