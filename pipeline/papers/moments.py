"""The moments of a run that the papers' figures show."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.signal import find_peaks

from sim.behaviour import Behaviour
from sim.summary import find_breaths

Moments = list[tuple[str, int]]
STAND_OUT = 0.25
"""Share of the largest excursion by which a contraction stands out."""


def contractions(done: Behaviour) -> list[int]:
    """Frames in which the belly's pressure peaks."""
    pressure = done.trajectory.abdominal
    found = find_peaks(pressure, prominence=STAND_OUT * float(np.ptp(pressure)))[0]
    return [int(frame) for frame in found]


def gasps(done: Behaviour) -> list[tuple[int, float]]:
    """Inhalations up to the largest lung volume: frame of the end, largest flow in, m^3/s."""
    lung, inward = done.trajectory.lung, -done.trajectory.flow
    top = int(np.argmax(lung))
    least = STAND_OUT * float(max(inward[: top + 1].max(), 0.0))
    quick = find_peaks(np.append(0.0, inward[: top + 1]), prominence=least)[0] - 1
    stops = [*(int(f) for f in quick[1:]), top][: len(quick)]
    return [
        (int(f) + int(np.argmax(lung[f : stop + 1])), float(inward[f]))
        for f, stop in zip(quick, stops, strict=True)
    ]


def breath(done: Behaviour) -> Moments:
    """Least and largest volume of the last breath."""
    b = find_breaths(done.motion, done.cycle)[-1]
    return [("full exhale", b.low), ("full inhale", b.high)]


def whole_breath(done: Behaviour) -> Moments:
    """The last breath: empty, half-way in, full, half-way out."""
    b, lung = find_breaths(done.motion, done.cycle)[-1], done.trajectory.lung
    half = 0.5 * (lung[b.low] + lung[b.high])
    inward = b.low + int(np.argmin(np.abs(lung[b.low : b.high + 1] - half)))
    out = b.high + int(np.argmin(np.abs(lung[b.high : b.last + 1] - half)))
    return [("full exhale", b.low), ("half in", inward), ("full inhale", b.high), ("half out", out)]


def laugh(done: Behaviour) -> Moments:
    """Rest, two calls of the bout's middle with the pauses after them, its end."""
    lung, peaks = done.trajectory.lung, contractions(done)
    lowest = int(np.argmin(lung))
    inside = [p for p in peaks if p < lowest]
    out = [("at rest", 0)]
    middle = len(inside) // 2
    for k, p in enumerate(inside[middle : middle + 2]):
        later = [q for q in peaks if q > p]
        stop = later[0] if later else len(lung)
        trough = p + int(np.argmin(done.trajectory.abdominal[p:stop]))
        out += [(f"call {middle + k + 1}", p), ("pause", trough)]
    return [*out, ("least volume", lowest)]


def cough(done: Behaviour) -> Moments:
    """Rest, and for each cough the breath before it, the contraction and its end."""
    lung, peaks = done.trajectory.lung, contractions(done)
    out: Moments = []
    before = 0
    for k, p in enumerate(peaks[:2]):
        stop = peaks[k + 1] if k + 1 < len(peaks) else len(lung)
        full = before + int(np.argmax(lung[before : p + 1]))
        empty = p + int(np.argmin(lung[p:stop]))
        name = ("first", "second")[k]
        out += [("breath in", full), (f"{name} cough", p), ("after it", empty)]
        before = empty
    return out


def sneeze(done: Behaviour) -> Moments:
    """The gasps, the contraction, the least volume after it, the end."""
    t = done.trajectory
    peak = int(np.argmax(t.abdominal))
    empty = peak + int(np.argmin(t.lung[peak:]))
    ahs = [(f"ah {k + 1}", f) for k, (f, _) in enumerate(gasps(done)[-3:])]
    return [*ahs, ("choo", peak), ("least volume", empty), ("end", len(t.time) - 1)]


STRIPS: dict[str, Callable[[Behaviour], Moments]] = {
    "calm": whole_breath,
    "laugh": laugh,
    "belly_laugh": laugh,
    "giggle": laugh,
    "cough": cough,
    "sneeze": sneeze,
    "paradoxical": breath,
    "paradoxical_normal": breath,
}
"""Behaviours that have a strip."""
