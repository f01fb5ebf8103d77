"""A whole laugh: bout by bout, call by call, each from the state in which the last one ended."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from pipeline.call_effort import ABDOMEN, INTERCOSTALS, CallSpace
from pipeline.call_fit import CallFit, CallTask, fit_call, normalised_rms, with_tonic
from pipeline.call_guess import Probe, first_guess, probe
from pipeline.inhalation import Breath, breathe_in, breathing
from pipeline.laugh import DesiredLaugh
from pipeline.laugh_plan import ONSET, Air, Bout, Plan, air_of, bout_air, bout_lines, make_plan
from pipeline.score import Score, numbers
from pipeline.settings import FollowSettings
from pipeline.torso_runs import TorsoRuns
from sim.errors import InputError
from sim.simulate import Moment
from sim.units import CUBIC_METRE_PER_LITRE, PASCAL_PER_CMH2O

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, slots=True)
class CallResult:
    """A fitted call and what it was fitted to.

    Parameters
    ----------
    number : of calls.csv
    span : start and end of its sound, s on the control file's clock
    fit, space, pressure : the fit, its bounds and the desired pressure, Pa, step by step; the
        part that is fitted begins and ends earlier than the sound by what pressure lags
    started : the moment before it; before : the score before it
    loud : whether it asks for enough to state an error
    rms : normalised, over the sound, of the whole laugh played once; not a number if not loud
    """

    number: int
    span: tuple[float, float]
    fit: CallFit
    space: CallSpace
    pressure: Floats
    started: Moment
    before: Score
    loud: bool
    rms: float = float("nan")


@dataclass(frozen=True, kw_only=True, slots=True)
class LaughFit:
    """A laugh as the torso follows it.

    Parameters
    ----------
    plan, air, probe : what was laid out beforehand
    calls, breaths : fitted, in order of time
    needed : air that each bout was expected to take, m^3; begun : volume at which it began, m^3
    score : all that the torso is told
    """

    plan: Plan
    air: Air
    probe: Probe
    calls: tuple[CallResult, ...]
    breaths: tuple[Breath, ...]
    needed: tuple[float, ...]
    begun: tuple[float, ...]
    score: Score

    @property
    def used(self) -> list[float]:
        """Air that each bout took, m^3."""
        ends = []
        for bout in self.plan.bouts:
            last = next(c for c in self.calls if c.number == bout.calls[-1].call)
            ends.append(float(last.fit.trajectory.lung[-1]))
        return [begun - end for begun, end in zip(self.begun, ends, strict=True)]

    @property
    def evaluations(self) -> int:
        """Runs of the torso in all."""
        return sum(c.fit.evaluations for c in self.calls) + sum(b.evaluations for b in self.breaths)


def on_clock(desired: DesiredLaugh, origin: float) -> DesiredLaugh:
    """The same with the control file's time, for pressure alone."""
    return replace(desired, time=desired.time - origin)


def check_calls(desired: DesiredLaugh) -> None:
    """Refuse a call that is too short to be followed; only a hand makes such ones."""
    least = numbers()["least_call"]
    for call in desired.calls:
        if call.end - call.start < least:
            raise InputError(
                f"calls.csv: call {call.call}: lasts {call.end - call.start:.3f} s, less than"
                f" {least:g} s. Join it with its neighbour, or write no under 'kept'."
            )


def fit_laugh(
    desired: DesiredLaugh, span: tuple[float, float], runs: TorsoRuns, settings: FollowSettings,
    seed: int,
) -> LaughFit:  # fmt: skip
    """Fit all calls of a recording.

    Parameters
    ----------
    desired : in the file's time
    span : start and end of the sound in its file, s
    """
    check_calls(desired)
    plan, needed_first = _first_plan(desired, span, runs)
    clocked, air, found = on_clock(desired, plan.origin), air_of(runs), probe(runs)
    score, moment, at = Score(), runs.rest, 0.0
    calls: list[CallResult] = []
    breaths: list[Breath] = []
    needed, begun = [], []
    for number, (bout, breath) in enumerate(zip(plan.bouts, plan.breaths, strict=True)):
        use = bout_air(clocked, bout, bout_lines(Score(), bout, motion=False), runs)
        if number == 0 and not needed_first:
            breath = None
        heard = breath is not None and number in plan.heard
        above = numbers()["breath_above_rest"] * CUBIC_METRE_PER_LITRE if heard else 0.0
        wanted = float(np.clip(air.floor + use, air.rest + above, air.most))
        if bout.start > at:
            passed = breathe_in(
                runs, moment, score, (at, bout.start), breath, wanted, motion=settings.motion
            )
            breaths.append(passed)
            score, moment = passed.score, passed.moment
        needed.append(use)
        begun.append(breaths[-1].volume if breaths else air.rest)
        told = bout_lines(score, bout, motion=settings.motion)
        done = _fit_bout(runs, moment, told, bout, clocked, found, settings, seed)
        calls += done
        score, moment, at = done[-1].fit.score, done[-1].fit.moment, bout.end
    score = _at_rest(score, plan, settings)
    played = _with_errors(calls, clocked, runs, score, plan.end)
    return LaughFit(
        plan=plan, air=air, probe=found, calls=played, breaths=tuple(breaths),
        needed=tuple(needed), begun=tuple(begun), score=score,
    )  # fmt: skip


def _first_plan(
    desired: DesiredLaugh, span: tuple[float, float], runs: TorsoRuns
) -> tuple[Plan, bool]:
    """The plan, and whether a breath comes before the first bout because it needs more air."""
    of = numbers()
    plan = make_plan(desired, *span, early=0.0, step=runs.step)
    bout, air = plan.bouts[0], air_of(runs)
    use = bout_air(
        on_clock(desired, plan.origin), bout, bout_lines(Score(), bout, motion=False), runs
    )
    if use <= air.rest - air.floor:
        return plan, False
    early = of["breath_time"] + 2.0 * of["breath_margin"]
    return make_plan(desired, *span, early=early, step=runs.step), True


def _at_rest(score: Score, plan: Plan, settings: FollowSettings) -> Score:
    """Everything fades after the last bout."""
    gap = (plan.bouts[-1].end, plan.end)
    return breathing(score, gap, None, 0.0, motion=settings.motion)


def _fit_bout(
    runs: TorsoRuns, moment: Moment, score: Score, bout: Bout, desired: DesiredLaugh, found: Probe,
    settings: FollowSettings, seed: int,
) -> list[CallResult]:  # fmt: skip
    """Fit the calls of a bout in turn."""
    score, tonic = with_tonic(score, bout.start, 0.0), 0.0
    done: list[CallResult] = []
    for call, (start, end) in zip(bout.calls, _windows(bout, found.lag, runs), strict=True):
        n_steps = round((end - start) / runs.step)
        time = start + runs.step * np.arange(1.0, n_steps + 1.0)
        pressure = np.interp(time, desired.time, desired.pressure)
        space = CallSpace(start=start, end=end, most=_most(score, start))
        guesses = [first_guess(space, time, pressure, found)]
        if done:
            last = done[-1]
            louder = float(np.ptp(pressure) / max(np.ptp(last.pressure), 1e-9))
            guesses.append(last.space.moved(last.fit.values, space, louder))
        task = CallTask(runs=runs, moment=moment, score=score, space=space, pressure=pressure)
        loud = _size(pressure) >= numbers()["quiet_call"] * PASCAL_PER_CMH2O
        fit = fit_call(task, guesses, tonic, settings, seed, worth=loud)
        first = call.start + (ONSET if not done else 0.0)
        one = CallResult(
            number=call.call, span=(first, call.end), fit=fit, space=space, pressure=pressure,
            started=moment, before=score, loud=loud,
        )  # fmt: skip
        done.append(one)
        score, moment, tonic = fit.score, fit.moment, fit.tonic
    return done


def _size(pressure: Floats) -> float:
    return float(np.sqrt(np.mean(np.square(pressure))))


def _windows(bout: Bout, lag: float, runs: TorsoRuns) -> list[tuple[float, float]]:
    """Part of each call that is fitted: cut so much before its sound that effort can be felt."""
    lead = numbers()["lags_ahead"] * lag
    edges = [bout.start]
    for call in bout.calls[1:]:
        least = edges[-1] + 0.5 * (call.start - edges[-1])
        edges.append(runs.grid(max(least, call.start - lead)))
    return list(pairwise([*edges, bout.end]))


def _with_errors(
    calls: list[CallResult], desired: DesiredLaugh, runs: TorsoRuns, score: Score, end: float
) -> tuple[CallResult, ...]:
    """The calls with the error of each when the whole is played once from rest."""
    whole, _ = runs.run(runs.rest, score, 0.0, end)
    asked = np.interp(whole.time, desired.time, desired.pressure)

    def error(one: CallResult) -> float:
        part = (whole.time > one.span[0]) & (whole.time <= one.span[1])
        return normalised_rms(whole.alveolar[part], asked[part]) if one.loud else float("nan")

    return tuple(replace(one, rms=error(one)) for one in calls)


def _most(score: Score, start: float) -> Floats:
    """Largest amplitudes (3,), so that no muscle passes its limit together with what it has."""
    of = numbers()
    tonic = of["most_burst"] - score.level(ABDOMEN)
    tails = {
        muscle: sum(2.0 * s.amplitude for s in sines if s.end is not None and s.end > start)
        for muscle, sines in score.bursts.items()
    }
    share = of["intercostals_per_abdomen"]
    intercostals = of["most_burst"] - share * score.level(ABDOMEN)
    brake = of["most_burst"] - of["diaphragm_tonic"]
    room = [intercostals - tails.get(INTERCOSTALS, 0.0), tonic - tails.get(ABDOMEN, 0.0)]
    room.append(brake - tails.get("diaphragm", 0.0))
    return np.asarray(np.maximum(room, 0.02))
