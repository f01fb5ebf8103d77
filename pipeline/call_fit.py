"""Fit the bursts of one call to its pressure, from the moment in which the last call ended."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pipeline.call_effort import (
    ABDOMEN,
    INTERCOSTALS,
    PARAMETERS,
    CallSpace,
    with_call,
)
from pipeline.linear_steps import linear_steps
from pipeline.optimise import Search, Stop, bound_warnings, minimise
from pipeline.score import Score, numbers
from pipeline.settings import FollowSettings
from pipeline.torso_runs import Run, TorsoRuns
from sim.errors import UnstableSimulation
from sim.simulate import Moment, Trajectory

Floats = NDArray[np.float64]

PENALTY = 10.0
"""Cost of a run that the torso cannot do: ten times no pressure at all."""
HALVES = (0.5, 1.0)
"""Of the runs of a call, when the searches end."""
SILENT = 0.005
"""Amplitude under which a muscle takes no part in a call."""


@dataclass(frozen=True, kw_only=True, slots=True)
class CallFit:
    """A call as the torso follows it.

    Parameters
    ----------
    values : (7,), in the order of `PARAMETERS`
    tonic : level of the abdomen's tonic effort at the end of the call
    rms : root mean square of simulated less desired pressure over that of desired pressure
    evaluations : runs of the torso; seconds : elapsed
    trace : (n,), rms of every run in order
    stop : how the search ended
    warnings : parameters at their bounds
    score, moment, trajectory : the score with the call, the moment at its end, and the run
    """

    values: Floats
    tonic: float
    rms: float
    evaluations: int
    seconds: float
    trace: Floats
    stop: Stop
    warnings: tuple[str, ...]
    score: Score
    moment: Moment
    trajectory: Trajectory


def with_tonic(score: Score, end: float, tonic: float) -> Score:
    """The score with the tonic effort going on to a level of the abdomen at `end`, s."""
    share = numbers()["intercostals_per_abdomen"]
    return score.line(ABDOMEN, (end, tonic)).line(INTERCOSTALS, (end, share * tonic))


@dataclass(slots=True, kw_only=True)
class CallTask:
    """One call to be fitted; it remembers every run.

    Parameters
    ----------
    runs, moment : the torso and where it stands
    score : all that is told but the call's own bursts and tonic effort
    space : of the seven parameters
    pressure : (n_steps,), Pa, desired at the end of each step; or flow, m^3/s
    quantity : what of a run stands against it, "alveolar" (pressure) or "flow"
    """

    runs: TorsoRuns
    moment: Moment
    score: Score
    space: CallSpace
    pressure: Floats
    quantity: str = "alveolar"
    trace: list[float] = field(default_factory=list)

    def told(self, values: Floats, tonic: float) -> Score:
        """The score with a call."""
        return with_call(with_tonic(self.score, self.space.end, tonic), values)

    def run(self, tried: Sequence[tuple[Floats, float]]) -> list[Run | None]:
        """Run calls side by side."""
        scores = [self.told(values, tonic) for values, tonic in tried]
        found = self.runs.each(self.moment, scores, self.space.start, self.space.end)
        self.trace += [self.cost(one) for one in found]
        return found

    def cost(self, run: Run | None) -> float:
        """Normalised root mean square of a run."""
        if run is None:
            return PENALTY
        return normalised_rms(self.answer(run), self.pressure)

    def answer(self, run: Run) -> Floats:
        """What the torso did, (n_steps,)."""
        return np.asarray(getattr(run[0], self.quantity), dtype=np.float64)


def normalised_rms(simulated: Floats, desired: Floats) -> float:
    """RMS of the difference over that of constant zero pressure (dilorenzo2009 section 6.3.2)."""
    size = float(np.sqrt(np.mean(np.square(desired))))
    return float(np.sqrt(np.mean(np.square(simulated - desired)))) / max(size, 1e-9)


def fit_call(
    task: CallTask,
    guesses: Sequence[Floats],
    tonic: float,
    settings: FollowSettings,
    seed: int,
    *,
    worth: bool = True,
) -> CallFit:
    """Fit a call.

    Parameters
    ----------
    guesses : seven parameters each, to start from
    tonic : level of the abdomen's tonic effort at the call's start
    worth : whether a search comes after the linear steps
    """
    began = time.monotonic()
    values, level = linear_steps(task, guesses, tonic, settings.linear_steps)
    stop = Stop.NO_SEARCH
    if worth:
        values, level, stop = _searched(task, values, level, settings, seed)
    score = task.told(values, level)
    # the best run once more, to go on from
    best = task.runs.each(task.moment, [score], task.space.start, task.space.end)[0]
    if best is None:
        raise UnstableSimulation(
            f"the torso cannot follow the call at {task.space.start:.2f} s. Lower"
            " pressure.intensity."
        )
    low, high = task.space.bounds
    return CallFit(
        values=values,
        tonic=level,
        rms=task.cost(best),
        evaluations=len(task.trace),
        seconds=time.monotonic() - began,
        trace=np.array(task.trace),
        stop=stop,
        warnings=_at_bounds(values, low, high),
        score=score,
        moment=best[1],
        trajectory=best[0],
    )


def _searched(
    task: CallTask, values: Floats, level: float, settings: FollowSettings, seed: int
) -> tuple[Floats, float, Stop]:
    """Two searches with a linear step between, which sets the tonic level anew; how they ended."""
    stop = Stop.NO_SEARCH
    for share in HALVES:
        if stop is not Stop.NO_SEARCH and settings.linear_steps > 0:
            values, level = linear_steps(task, [values], level, 1)
        left = round(share * settings.n_evaluations) - len(task.trace)
        if left <= 0:
            continue
        found = search(task, values, level, settings, left, settings.algorithm, seed)
        stop = found.stop
        if found.cost <= min(task.trace):
            values = task.space.values(found.best)
        if stop is Stop.REACHED:
            break
    return values, level, stop


def _at_bounds(values: Floats, low: Floats, high: Floats) -> tuple[str, ...]:
    """Warnings of parameters at a bound; when a silent muscle starts means nothing."""
    silent = (values[0] < SILENT and values[1] < SILENT, values[4] < SILENT)
    moot = {2, 3} if silent[0] else set()
    moot |= {5, 6} if silent[1] else set()
    kept = [k for k in range(len(PARAMETERS)) if k not in moot]
    names = tuple(PARAMETERS[k] for k in kept)
    return bound_warnings(names, values[kept], low[kept], high[kept])


def search(
    task: CallTask,
    start: Floats,
    tonic: float,
    settings: FollowSettings,
    budget: int,
    algorithm: str,
    seed: int,
) -> Search:
    """Search the unit box of the seven parameters with nlopt, from `start` in several sizes.

    Parameters
    ----------
    start : (7,), parameters
    budget : runs
    algorithm : of `pipeline.optimise.ALGORITHMS`
    """

    def evaluate(points: Floats) -> Floats:
        runs = task.run([(task.space.values(point), tonic) for point in points])
        return np.array([np.nan if run is None else task.cost(run) for run in runs])

    first = task.space.unit(start)
    sizes = np.array([settings.first_step * 0.4**k for k in range(settings.n_starts)])
    return minimise(
        evaluate,
        lower=np.zeros(len(first)),
        upper=np.ones(len(first)),
        starts=np.tile(first, (settings.n_starts, 1)),
        step=sizes,
        algorithm=algorithm,
        max_evaluations=budget,
        tolerance=settings.tolerance,
        penalty=PENALTY,
        goal=settings.goal,
        seed=seed,
    )
