"""Coughs, sneezes and breaths from their sound: the search of the calls with other primitives."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.call_effort import PARAMETERS, CallSpace
from pipeline.call_fit import CallFit, CallTask, fit_call, with_tonic
from pipeline.event_plan import Events
from pipeline.inhalation import INSPIRATORY, Breath, breathe_in, breathing
from pipeline.laugh_plan import Air, air_of
from pipeline.score import FLEXION, LARYNX, Score, numbers
from pipeline.settings import FollowSettings
from pipeline.torso_runs import TorsoRuns
from sim.simulate import Moment
from sim.units import CUBIC_METRE_PER_LITRE

Floats = NDArray[np.float64]

GASPS = ((0.0, 0.0), (0.21, 0.29), (0.375, 0.21), (0.58, 0.57), (0.75, 0.47), (1.0, 1.0))
"""A sneeze's breath in by steps: shares of its time and level (sneeze.xml of the library)."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Burst:
    """One expulsion on the control file's clock.

    Parameters
    ----------
    closed : s, when the larynx closes; start : when it opens; end : when the sound is over
    gap : end of the burst before; breath : breath in between, or none
    """

    closed: float
    start: float
    end: float
    gap: float
    breath: tuple[float, float] | None


@dataclass(frozen=True, kw_only=True, slots=True)
class EventFit:
    """Events as the torso follows them.

    Parameters
    ----------
    score, origin, end : as in `pipeline.follow_stage.Told`
    breaths : breaths in, s on the control file's clock
    asked : start and end of each fitted part, s on the control file's clock
    rows : a row an event
    evaluations : runs of the torso
    warnings : what a person should know
    """

    score: Score
    origin: float
    end: float
    breaths: tuple[tuple[float, float], ...]
    asked: tuple[tuple[float, float], ...]
    rows: tuple[dict[str, Any], ...]
    evaluations: int
    warnings: tuple[str, ...]


def lay_out(events: Events, kind: str, runs: TorsoRuns) -> tuple[float, list[Burst]]:
    """Clock and bursts: each behind a closed larynx, a breath in before it where there is room."""
    of, step = numbers(), runs.step
    closed, margin = of[f"{kind}_closed"], of["breath_margin"]
    inhale = of["sneeze_breath_time"] if kind == "sneeze" else of["breath_time"]
    early = closed + inhale + 2.0 * margin
    first = float(events.time[0])
    origin = first - np.ceil(max(0.0, first + early - events.spans[0][0]) / step) * step
    bursts: list[Burst] = []
    for start, end in events.spans:
        a, b = runs.grid(start - origin), runs.grid(end - origin)
        before = bursts[-1].end if bursts else 0.0
        shut = runs.grid(max(before, a - closed))
        room = shut - before - 2.0 * margin
        breath = None
        if not bursts or room >= of["event_breath_gap"]:
            breath = (max(before + margin, shut - margin - inhale), shut - margin)
        bursts.append(Burst(closed=shut, start=a, end=b, gap=before, breath=breath))
    return float(origin), bursts


def fit_bursts(
    events: Events, kind: str, runs: TorsoRuns, settings: FollowSettings, seed: int
) -> EventFit:
    """Fit coughs or sneezes burst by burst, each from where the last one ended.

    Parameters
    ----------
    kind : "cough" or "sneeze"
    """
    origin, bursts = lay_out(events, kind, runs)
    air, score, moment = air_of(runs), Score(), runs.rest
    breaths: list[tuple[float, float]] = []
    rows: list[dict[str, Any]] = []
    warnings: list[str] = []
    evaluations, tonic = 0, 0.0
    for number, burst in enumerate(bursts):
        if burst.closed > burst.gap:
            wanted = _wanted(events, kind, bursts, number, origin, air)
            passed = _draw_breath(runs, moment, score, burst, kind, wanted, settings)
            score, moment, tonic = passed.score, passed.moment, 0.0
            evaluations += passed.evaluations
            breaths += [passed.span] if passed.span else []
        told = _larynx(score, burst)
        if settings.motion:
            told = _bow(told, burst, kind)
        fit = _fit_burst(runs, moment, told, burst, events, origin, tonic, settings, seed, kind)
        score, moment, tonic = fit.score, fit.moment, fit.tonic
        evaluations += fit.evaluations
        warnings += [f"event {number + 1}: {line}" for line in fit.warnings]
        rows.append(_row(number + 1, fit, burst, origin))
    end = runs.grid(max(float(events.time[-1]) - origin, bursts[-1].end + numbers()["breath_time"]))
    score = breathing(score, (bursts[-1].end, end), None, 0.0, motion=settings.motion)
    return EventFit(
        score=score, origin=origin, end=end, breaths=tuple(breaths),
        asked=tuple((b.closed, b.end) for b in bursts), rows=tuple(rows), evaluations=evaluations,
        warnings=tuple(warnings),
    )  # fmt: skip


def _wanted(
    events: Events, kind: str, bursts: list[Burst], number: int, origin: float, air: Air
) -> float:
    """Lung volume before a burst: enough for all up to the next breath, and as is usual."""
    last = number + 1
    while last < len(bursts) and bursts[last].breath is None:
        last += 1
    used = events.volume(bursts[number].start + origin, bursts[last - 1].end + origin)
    usual = air.rest
    if bursts[number].breath is not None:
        usual += numbers()[f"{kind}_inspired"] * CUBIC_METRE_PER_LITRE
    return float(np.clip(max(usual, air.floor + used), air.rest, air.most))


def _draw_breath(
    runs: TorsoRuns, moment: Moment, score: Score, burst: Burst, kind: str, wanted: float,
    settings: FollowSettings,
) -> Breath:  # fmt: skip
    gap = (burst.gap, burst.closed)
    steps = GASPS if kind == "sneeze" else ()
    return breathe_in(
        runs, moment, score, gap, burst.breath, wanted, motion=settings.motion, steps=steps
    )


def _larynx(score: Score, burst: Burst) -> Score:
    """Closed, then opening; the diaphragm is active until it opens (cough.xml of the library)."""
    of = numbers()
    held = score.level("diaphragm")
    if held > 0.0:
        gone = burst.start + of["opening_time"]
        score = score.line("diaphragm", (burst.start, held), (gone, 0.0))
    if burst.start - burst.closed < 2e-3:
        return score
    opened = burst.start + of["opening_time"]
    score = score.shut(burst.closed, burst.start)
    score = score.line(LARYNX, (burst.closed, 0.0), (burst.start, of["opening_resistance"]))
    return score.line(LARYNX, (opened, 0.0))


def _bow(score: Score, burst: Burst, kind: str) -> Score:
    """The back flexes with a burst."""
    of = numbers()
    bowed = of["sneeze_flexion"] if kind == "sneeze" else of["flexion"]
    middle = max(burst.start, burst.closed + 0.02) + 0.5 * (burst.end - burst.start)
    score = score.line(FLEXION, (max(burst.closed, 1e-3), score.level(FLEXION)))
    return score.line(FLEXION, (middle, bowed), (max(burst.end, middle + 0.01), bowed))


def _fit_burst(
    runs: TorsoRuns, moment: Moment, score: Score, burst: Burst, events: Events, origin: float,
    tonic: float, settings: FollowSettings, seed: int, kind: str,
) -> CallFit:  # fmt: skip
    of = numbers()
    n_steps = round((burst.end - burst.closed) / runs.step)
    time = burst.closed + np.arange(1, n_steps + 1) * runs.step
    flow = np.interp(time, events.time - origin, events.flow)
    most = np.array([1.0, 1.0, 1.0]) * of["most_burst"]
    space = CallSpace(start=burst.closed, end=burst.end, most=most)
    share = float(flow.max()) / (of[f"{kind}_flow"] * CUBIC_METRE_PER_LITRE)
    start, period = burst.closed, 1.2 * (burst.end - burst.closed)
    raw = np.array([0.6 * share, 0.6 * share, start, 1 / period, 0.1, start, 1 / period])
    task = CallTask(
        runs=runs, moment=moment, score=with_tonic(score, burst.closed, tonic), space=space,
        pressure=flow, quantity="flow",
    )  # fmt: skip
    guesses = [space.values(space.unit(raw * np.array([k, k, 1, 1, 1, 1, 1]))) for k in (1.0, 0.4)]
    return fit_call(task, guesses, tonic, settings, seed)


def _row(number: int, fit: CallFit, burst: Burst, origin: float) -> dict[str, Any]:
    values = dict(zip(PARAMETERS, fit.values.tolist(), strict=True))
    for name in ("expiratory_start_s", "diaphragm_start_s"):
        values[name] += origin
    return {
        "event": str(number),
        "closed_s": f"{burst.closed + origin:.3f}",
        "start_s": f"{burst.start + origin:.3f}",
        "end_s": f"{burst.end + origin:.3f}",
        "rms_normalised": f"{fit.rms:.4f}",
        "evaluations": str(fit.evaluations),
        "seconds": f"{fit.seconds:.2f}",
        **{name: f"{value:.4f}" for name, value in values.items()},
    }


def fit_breaths(events: Events, runs: TorsoRuns, settings: FollowSettings) -> EventFit:
    """Follow breaths: each breath in by its volume, each breath out by letting go."""
    of, step = numbers(), runs.step
    first = float(events.time[0])
    origin = first - step * np.ceil(max(0.0, first + 0.1 - events.spans[0][0]) / step)
    clocked = replace(events, time=events.time - origin)
    phases = [(runs.grid(a - origin), runs.grid(b - origin)) for a, b in events.spans]
    end = runs.grid(max(float(clocked.time[-1]), phases[-1][1] + of["breath_time"]))
    score, moment, at, evaluations = Score(), runs.rest, 0.0, 0
    drawn: list[tuple[float, float]] = []
    rows: list[dict[str, Any]] = []
    for number in range(0, len(phases), 2):
        a, b = phases[number]
        wanted = min(air_of(runs).rest - clocked.volume(a, b), air_of(runs).most)
        passed = breathe_in(runs, moment, score, (at, b), (a, b), wanted, motion=settings.motion)
        score, evaluations = passed.score, evaluations + passed.evaluations
        drawn.append((a, b))
        out = phases[number + 1] if number + 1 < len(phases) else (b, end)
        score = _let_go(score, passed.level, b, out)
        later = phases[number + 2][0] if number + 2 < len(phases) else end
        at = runs.grid(max(b + step, 0.5 * (out[1] + later)) if later < end else end)
        moment = runs.run(passed.moment, score, b, at)[1]
        rows.append(
            {
                "event": str(number // 2 + 1),
                "start_s": f"{a + origin:.3f}",
                "end_s": f"{out[1] + origin:.3f}",
                "volume_l": f"{(passed.volume - air_of(runs).rest) / CUBIC_METRE_PER_LITRE:.3f}",
                "wanted_l": f"{(wanted - air_of(runs).rest) / CUBIC_METRE_PER_LITRE:.3f}",
                "level": f"{passed.level:.3f}",
            }
        )
    said = "which phase of a breath goes in cannot be heard: the first is taken to go in"
    return EventFit(
        score=score, origin=float(origin), end=end, breaths=tuple(drawn),
        asked=((phases[0][0], phases[-1][1]),), rows=tuple(rows), evaluations=evaluations,
        warnings=(said,),
    )  # fmt: skip


def _let_go(score: Score, level: float, end: float, out: tuple[float, float]) -> Score:
    """Inspiratory muscles let go over a share of the breath out."""
    of = numbers()
    start = max(out[0], end)
    calm = start + of["release_share"] * (out[1] - start)
    shares = {INSPIRATORY: 1.0, "diaphragm": of["diaphragm_per_intercostals"]}
    for muscle, share in shares.items():
        score = score.line(muscle, (end, share * level), (start + 1e-3, share * level))
        score = score.line(muscle, (max(calm, start + 2e-3), 0.0))
    score = score.line("shoulder_elevators", (max(calm, end + 1e-3), 0.0))
    return score
