"""When a torso laughs, breathes in and rests, and how much air each bout will take."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from pipeline.calls_file import Call
from pipeline.laugh import DesiredLaugh
from pipeline.score import FLEXION, LARYNX, Score, burst, numbers
from pipeline.torso_runs import TorsoRuns
from sim.units import CUBIC_METRE_PER_LITRE, PASCAL_PER_CMH2O

Floats = NDArray[np.float64]

ONSET = 0.08
"""s; the pressure of a bout comes from nothing before its first sound (`pressure.fade_s`)."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Bout:
    """Calls in one breath out, in the time of the control file.

    Parameters
    ----------
    calls : in order, the next one starting where the last one ended
    start : s, when effort begins: before the first sound
    end : s
    """

    calls: tuple[Call, ...]
    start: float
    end: float


@dataclass(frozen=True, kw_only=True, slots=True)
class Plan:
    """Bouts and breaths on the control file's clock.

    Parameters
    ----------
    origin : s in the sound's file at which the control file begins
    bouts : in order
    breaths : start and end, s, of the breath in before each bout, or nothing where there is no room
    heard : numbers, from 0, of the bouts before which a breath in was heard
    end : s, of the control file
    """

    origin: float
    bouts: tuple[Bout, ...]
    breaths: tuple[tuple[float, float] | None, ...]
    heard: frozenset[int]
    end: float


@dataclass(frozen=True, kw_only=True, slots=True)
class Air:
    """Lung volumes that a laugh may use, m^3.

    Parameters
    ----------
    rest : resting volume
    floor : least; most : largest
    """

    rest: float
    floor: float
    most: float


def air_of(runs: TorsoRuns) -> Air:
    """Volumes of a torso; those of the papers' lung stand as far from its own resting volume."""
    of, constants = numbers(), runs.resting.torso.plant.constants
    rest = float(runs.rest.state.gas[0]) / constants.atmosphere
    below = (1.0 - of["reserve"]) * (rest - constants.residual_volume)
    capacity = constants.total_capacity - constants.residual_volume
    above = constants.residual_volume + of["most_volume"] * capacity - rest
    if runs.lung == "one_way":
        still = Score().line("abdomen", (0.0, 0.0))
        rest = float(runs.run(runs.rest, still, 0.0, runs.step)[0].lung[0])
    return Air(rest=rest, floor=rest - below, most=rest + above)


def air_used(
    time: Floats, pressure: Floats, larynx: Floats, *, linear: float, quadratic: float
) -> float:
    """Air that leaves the lung under a pressure, m^3: P = (linear + larynx) Q + quadratic Q^2.

    Parameters
    ----------
    time : (n,), s; pressure : (n,), Pa; larynx : (n,), Pa s/m^3
    linear, quadratic : of the airway, Pa s/m^3 and Pa s^2/m^6
    """
    drive, k = np.maximum(pressure, 0.0), linear + larynx
    # the tiny term keeps nothing over nothing out, where neither pressure nor resistance is
    flow = 2.0 * drive / (k + np.sqrt(k * k + 4.0 * quadratic * drive) + 1e-30)
    return float(np.trapezoid(flow, time))


def bout_air(desired: DesiredLaugh, bout: Bout, score: Score, runs: TorsoRuns) -> float:
    """Air that a bout will take, m^3, from its desired pressure and the score's larynx."""
    part = desired.within(bout.start, bout.end)
    time, pressure = desired.time[part], desired.pressure[part]
    if runs.lung == "one_way":
        k = runs.resting.torso.parameters["one_way_k"]
        return air_used(time, pressure, np.zeros(len(time)), linear=0.0, quadratic=k)
    constants = runs.resting.torso.plant.constants
    points = np.array(score.lines[LARYNX])
    larynx = np.interp(time, points[:, 0], points[:, 1]) * PASCAL_PER_CMH2O / CUBIC_METRE_PER_LITRE
    return air_used(
        time, pressure, larynx, linear=constants.airway_k1, quadratic=constants.airway_k2
    )


def make_plan(
    desired: DesiredLaugh, start: float, end: float, *, early: float, step: float
) -> Plan:
    """Lay calls out as bouts, with the breaths between them.

    Parameters
    ----------
    start, end : s, of the sound in its file
    early : s that the torso begins before the first bout, for a breath, beyond what silence gives
    step : s, of the simulation
    """
    of = numbers()
    numbered = [one.bout for one in desired.calls]
    groups = [[c for c in desired.calls if c.bout == n] for n in dict.fromkeys(numbered)]
    groups.sort(key=lambda calls: calls[0].start)
    origin = min(start, groups[0][0].start - ONSET - early)
    origin = start - np.ceil((start - origin) / step) * step
    bouts: list[Bout] = []
    for calls in groups:
        before = bouts[-1].end if bouts else 0.0
        begins = max(before, calls[0].start - origin - ONSET)
        bouts.append(_bout([_moved(c, origin) for c in calls], begins, step))
    heard = [(a - origin, b - origin) for a, b in desired.inhalations]
    gaps = [(0.0, bouts[0].start), *((a.end, b.start) for a, b in pairwise(bouts))]
    breaths = [_breath(gap, heard) for gap in gaps]
    sounding = frozenset(k for k, b in enumerate(breaths) if b is not None and _overlaps(b, heard))
    last = max(end - origin, bouts[-1].end + of["breath_time"])
    return Plan(
        origin=float(origin), bouts=tuple(bouts), breaths=tuple(breaths), heard=sounding,
        end=_grid(last, step),
    )  # fmt: skip


def _overlaps(breath: tuple[float, float], heard: Sequence[tuple[float, float]]) -> bool:
    return any(a < breath[1] and b > breath[0] for a, b in heard)


def _grid(time: float, step: float) -> float:
    return round(time / step) * step


def _moved(call: Call, origin: float) -> Call:
    return replace(
        call,
        start=call.start - origin,
        peak_time=call.peak_time - origin,
        end=call.end - origin,
    )


def _bout(calls: Sequence[Call], start: float, step: float) -> Bout:
    """A bout whose calls follow each other without a gap, on the grid of steps."""
    edges = [start, *(call.start for call in calls[1:]), calls[-1].end]
    edges = [_grid(edge, step) for edge in edges]
    laid = [replace(c, start=a, end=b) for c, (a, b) in zip(calls, pairwise(edges), strict=True)]
    return Bout(calls=tuple(laid), start=edges[0], end=edges[-1])


def _breath(
    gap: tuple[float, float], heard: Sequence[tuple[float, float]]
) -> tuple[float, float] | None:
    """Where a breath in fits between two bouts: where it was heard, else right before the next."""
    of = numbers()
    start, end = gap[0] + of["breath_margin"], gap[1] - of["breath_margin"]
    if end - start < of["least_breath_time"]:
        return None
    for a, b in heard:
        a, b = max(a, start), min(b, end)
        if b - a >= of["least_breath_time"]:
            return a, b
    return max(start, end - of["breath_time"]), end


def bout_lines(score: Score, bout: Bout, *, motion: bool) -> Score:
    """Larynx, diaphragm and, on top, back and shoulders during a bout."""
    of = numbers()
    low, time = of["larynx_low"], of["larynx_time"]
    score = score.line(LARYNX, (max(0.0, bout.start - time), 0.0), (bout.start, low))
    for call in bout.calls:
        peak = min(max(call.peak_time, call.start + 0.2 * time), call.end - 0.2 * time)
        score = score.line(LARYNX, (peak, of["larynx_high"]), (call.end, low))
    score = score.line(LARYNX, (bout.end + time, 0.0))
    score = score.line(
        "diaphragm",
        (bout.start, score.level("diaphragm")),
        (min(bout.start + of["let_go_time"], bout.calls[0].end), of["diaphragm_tonic"]),
        (bout.end, of["diaphragm_tonic"]),
    )
    return _secondary(score, bout) if motion else score


def _secondary(score: Score, bout: Bout) -> Score:
    """The back bows and bobs, the shoulders bob (dilorenzo2009 section 6.2)."""
    of = numbers()
    bowed = min(bout.start + of["flexion_time"], bout.end)
    score = score.line(FLEXION, (bout.start, score.level(FLEXION)), (bowed, of["flexion"]))
    score = score.line(FLEXION, (max(bout.end, bowed + 1e-3), of["flexion"]))
    for call in bout.calls:
        length = call.end - call.start
        score = score.add(FLEXION, burst(call.start, length, of["bob"]))
        shoulders = burst(call.start, length, of["shoulders_call"])
        score = score.add("shoulder_depressors", shoulders)
    return score
