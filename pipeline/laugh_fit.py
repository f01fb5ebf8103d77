"""A whole laugh: bout by bout, call by call, each from the state in which the last one ended."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.call_effort import ABDOMEN, INTERCOSTALS, PARAMETERS, CallSpace
from pipeline.call_fit import CallFit, CallTask, fit_call, normalised_rms, with_tonic
from pipeline.inhalation import Breath, breathe_in, breathing
from pipeline.laugh import DesiredLaugh
from pipeline.laugh_plan import ONSET, Air, Bout, Plan, air_of, bout_air, bout_lines, make_plan
from pipeline.score import LARYNX, Score, burst, numbers
from pipeline.settings import FollowSettings
from pipeline.torso_runs import TorsoRuns
from sim.simulate import Moment
from sim.units import CUBIC_METRE_PER_LITRE, PASCAL_PER_CMH2O

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, slots=True)
class Probe:
    """How pressure answers a burst of all expiratory muscles at rest.

    Parameters
    ----------
    lag : s from the top of activation to that of pressure
    gain : Pa of pressure for each unit of the internal intercostals' level
    """

    lag: float
    gain: float


@dataclass(frozen=True, kw_only=True, slots=True)
class CallResult:
    """A fitted call and what it was fitted to.

    Parameters
    ----------
    number : of calls.csv
    fit, space, pressure : the fit, its bounds and the desired pressure, Pa, step by step
    started : the moment before it; before : the score before it
    rms : over the call alone, without the onset of a bout; not a number for a call that asks for
        next to nothing, where a share of it means nothing
    """

    number: int
    fit: CallFit
    space: CallSpace
    pressure: Floats
    started: Moment
    before: Score
    rms: float


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


def probe(runs: TorsoRuns) -> Probe:
    """Burst against a laughing larynx, from rest."""
    of = numbers()
    height, period = of["lag_probe"], of["probe_period"]
    share = 1.0 / of["intercostals_per_abdomen"]
    score = Score().line(LARYNX, (0.0, 0.5 * (of["larynx_low"] + of["larynx_high"])))
    score = score.add(INTERCOSTALS, burst(0.0, period, height))
    score = score.add(ABDOMEN, burst(0.0, period, share * height))
    run, _ = runs.run(runs.rest, score, 0.0, runs.grid(2.0 * period))
    top = int(np.argmax(run.alveolar))
    lag = float(run.time[top]) - 0.5 * period
    return Probe(lag=max(0.0, lag), gain=float(run.alveolar[top]) / height)


def on_clock(desired: DesiredLaugh, origin: float) -> DesiredLaugh:
    """The same with the control file's time, for pressure alone."""
    return replace(desired, time=desired.time - origin)


def first_guess(space: CallSpace, time: Floats, pressure: Floats, found: Probe) -> Floats:
    """Parameters of a burst as wide and as high as the pressure, that much earlier as it lags."""
    share = 1.0 / numbers()["intercostals_per_abdomen"]
    top, step = int(np.argmax(pressure)), float(time[1] - time[0])
    middle = 0.5 * (float(pressure.max()) + float(pressure.min()))
    # a squared sine is above half its height for half its period
    period = 2.0 * step * max(1, int((pressure > middle).sum()))
    start = float(time[top]) - found.lag - 0.5 * period
    height = float(np.ptp(pressure)) / found.gain
    brake = 0.05 * height
    raw = np.array([height, share * height, start, 1 / period, brake, start, 1 / period])
    return space.values(space.unit(raw))


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
    return LaughFit(
        plan=plan, air=air, probe=found, calls=tuple(calls), breaths=tuple(breaths),
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
    for number, call in enumerate(bout.calls):
        n_steps = round((call.end - call.start) / runs.step)
        time = call.start + runs.step * np.arange(1.0, n_steps + 1.0)
        pressure = np.interp(time, desired.time, desired.pressure)
        space = CallSpace(start=call.start, end=call.end, most=_most(score, call.start))
        guesses = [first_guess(space, time, pressure, found)]
        if done:
            last = done[-1]
            louder = float(np.ptp(pressure) / max(np.ptp(last.pressure), 1e-9))
            guesses.append(last.space.moved(last.fit.values, space, louder))
        task = CallTask(runs=runs, moment=moment, score=score, space=space, pressure=pressure)
        loud = _size(pressure) >= numbers()["quiet_call"] * PASCAL_PER_CMH2O
        fit = fit_call(task, guesses, tonic, settings, seed, worth=loud)
        sounding = time > call.start + (ONSET if number == 0 else 0.0)
        one = CallResult(
            number=call.call, fit=fit, space=space, pressure=pressure, started=moment, before=score,
            rms=_rms(fit, pressure, sounding) if loud else float("nan"),
        )  # fmt: skip
        done.append(one)
        score, moment, tonic = fit.score, fit.moment, fit.tonic
    return done


def _size(pressure: Floats) -> float:
    return float(np.sqrt(np.mean(np.square(pressure))))


def _rms(fit: CallFit, pressure: Floats, part: NDArray[np.bool_]) -> float:
    return normalised_rms(fit.trajectory.alveolar[part], pressure[part])


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


def bound_lines(fit: LaughFit) -> list[str]:
    """One line for every parameter and side: the calls in which it lies at that bound."""
    found: dict[str, list[str]] = {}
    for one in fit.calls:
        for line in one.fit.warnings:
            found.setdefault(line.split(" (")[0], []).append(str(one.number))
    return [f"{what} in call {', '.join(calls)}" for what, calls in sorted(found.items())]


def warnings_of(fit: LaughFit) -> list[str]:
    """What a person should know of a laugh."""
    litre = CUBIC_METRE_PER_LITRE
    out = bound_lines(fit)
    quiet = [str(c.number) for c in fit.calls if not np.isfinite(c.rms)]
    if quiet:
        out.append(
            f"calls {', '.join(quiet)} ask for less than {numbers()['quiet_call']:g} cmH2O:"
            " followed without a search, and no error is stated for them; the map 'power'"
            " (pressure.map) gives quiet calls more pressure"
        )
    for number, (need, begun) in enumerate(zip(fit.needed, fit.begun, strict=True), start=1):
        there = begun - fit.air.floor
        if need > there + 0.1 * litre:
            out.append(
                f"bout {number}: needs {need / litre:.1f} L and has {there / litre:.1f} L; lower"
                " pressure.intensity, or cut it in two in calls.csv"
            )
    return out


def call_columns(fit: LaughFit) -> dict[int, dict[str, Any]]:
    """Further columns of calls.csv by the number of the call; starts in the file's time."""
    out: dict[int, dict[str, Any]] = {}
    for one in fit.calls:
        values = dict(zip(PARAMETERS, one.fit.values.tolist(), strict=True))
        for name in ("expiratory_start_s", "diaphragm_start_s"):
            values[name] += fit.plan.origin
        out[one.number] = {
            "rms_normalised": f"{one.rms:.4f}" if np.isfinite(one.rms) else "",
            "evaluations": str(one.fit.evaluations),
            "seconds": f"{one.fit.seconds:.2f}",
            **{name: f"{value:.4f}" for name, value in values.items()},
            "tonic": f"{one.fit.tonic:.4f}",
            "at_bound": "; ".join(one.fit.warnings),
        }
    return out


def volumes_litre(values: Sequence[float]) -> list[float]:
    """Volumes in L."""
    return [round(v / CUBIC_METRE_PER_LITRE, 3) for v in values]


def centimetres(pressure: Floats) -> Floats:
    """Pressure in cmH2O."""
    return pressure / PASCAL_PER_CMH2O
