"""nlopt behind one door: bounds, several starts in step, a log, and words for how it ended."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

import nlopt
import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from sim.errors import ParameterError

Floats = NDArray[np.float64]
Batch = Callable[[Floats], Floats]

ALGORITHMS = {
    "nelder_mead": nlopt.LN_NELDERMEAD,
    "sbplx": nlopt.LN_SBPLX,
    "cobyla": nlopt.LN_COBYLA,
    "bobyqa": nlopt.LN_BOBYQA,
    "crs2": nlopt.GN_CRS2_LM,
    "direct": nlopt.GN_DIRECT_L,
}
"""Direct search as in the papers (`nelder_mead`, `sbplx`), and later methods."""

BOUND_MARGIN = 2e-3
"""A level this near a bound, as a share of the range, is called "at the bound"."""


class Stop(StrEnum):
    """How a search ended; the text goes into the report."""

    CONVERGED = "converged: the last steps were smaller than the tolerance"
    BUDGET = "stopped by the budget of runs; more runs may still improve it (fit.n_evaluations)"
    ROUNDOFF = "stopped where rounding hides any progress; the result is usable"
    FAILED = "failed: not one run of the model succeeded"
    REACHED = "stopped at the error that was asked for"
    NO_SEARCH = "no search was asked for; the best of the first runs is given"


@dataclass(frozen=True, kw_only=True, slots=True)
class Search:
    """Result of `minimise`.

    Parameters
    ----------
    best : (n_parameters,); cost : its cost
    stop : of the start that found the best point
    trace : (n, n_parameters) every point in the order of evaluation; trace_cost : (n,), with
        failed runs at the penalty; failed : (n,)
    """

    best: Floats
    cost: float
    stop: Stop
    trace: Floats
    trace_cost: Floats
    failed: NDArray[np.bool_]


class _Ledger:
    """Every evaluation, in an order that no scheduler can change."""

    def __init__(self, evaluate: Batch, penalty: float) -> None:
        self.evaluate = evaluate
        self.penalty = penalty
        self.points: list[Floats] = []
        self.costs: list[float] = []
        self.failed: list[bool] = []

    def __call__(self, points: Floats) -> Floats:
        costs = np.asarray(self.evaluate(points), dtype=float)
        bad = ~np.isfinite(costs)
        # nlopt must never see a NaN: CRS2 would lose its best point, DIRECT-L its life
        costs = np.where(bad, self.penalty, np.minimum(costs, self.penalty))
        self.points.extend(np.array(points))
        self.costs.extend(costs.tolist())
        self.failed.extend(bad.tolist())
        return costs


class _Lockstep:
    """Several searches, each in its thread, whose evaluations are gathered into batches.

    A batch goes out when every search that still lives has asked for one point, so its content
    depends on the searches alone, never on timing or on the number of workers.
    """

    def __init__(self, ledger: _Ledger, n_searches: int) -> None:
        self.ledger = ledger
        self.condition = threading.Condition()
        self.live = set(range(n_searches))
        self.asked: dict[int, Floats] = {}
        self.answers: dict[int, float] = {}
        self.broken = False

    def ask(self, search: int, point: Floats) -> float:
        with self.condition:
            self.asked[search] = point
            self.condition.notify_all()
            self.condition.wait_for(lambda: search in self.answers or self.broken)
            if self.broken:
                raise nlopt.ForcedStop
            return self.answers.pop(search)

    def leave(self, search: int) -> None:
        with self.condition:
            self.live.discard(search)
            self.condition.notify_all()

    def serve(self) -> None:
        """Answer batches until no search lives; an exception releases all threads first."""
        try:
            while True:
                with self.condition:
                    self.condition.wait_for(lambda: set(self.asked) == self.live)
                    if not self.live:
                        return
                    order = sorted(self.asked)
                    points = np.array([self.asked[k] for k in order])
                costs = self.ledger(points)
                with self.condition:
                    self.asked.clear()
                    self.answers.update(zip(order, costs.tolist(), strict=True))
                    self.condition.notify_all()
        except BaseException:
            with self.condition:
                self.broken = True
                self.condition.notify_all()
            raise


def _run_nlopt(
    objective: Callable[[Floats], float],
    start: Floats,
    *,
    algorithm: str,
    lower: Floats,
    upper: Floats,
    step: Floats,
    max_evaluations: int,
    tolerance: float,
    goal: float,
    seed: int,
) -> Stop:
    optimiser = nlopt.opt(ALGORITHMS[algorithm], len(start))
    nlopt.srand(seed)
    optimiser.set_lower_bounds(lower)
    optimiser.set_upper_bounds(upper)
    optimiser.set_min_objective(lambda point, _gradient: objective(np.array(point)))
    optimiser.set_maxeval(max_evaluations)
    optimiser.set_xtol_abs(np.full(len(start), tolerance))
    optimiser.set_stopval(goal)
    # nlopt cannot step across a bound: turn the first step inwards where it would
    optimiser.set_initial_step(np.where(start + step > upper, -step, step))
    try:
        optimiser.optimize(start)
    except nlopt.RoundoffLimited:
        return Stop.ROUNDOFF
    except nlopt.ForcedStop:
        return Stop.BUDGET
    ends = {nlopt.MAXEVAL_REACHED: Stop.BUDGET, nlopt.STOPVAL_REACHED: Stop.REACHED}
    return ends.get(optimiser.last_optimize_result(), Stop.CONVERGED)


def sobol_points(n: int, lower: Floats, upper: Floats, seed: int) -> Floats:
    """Scrambled Sobol points, (n, n_parameters), inside the bounds."""
    sampler = qmc.Sobol(len(lower), scramble=True, rng=np.random.default_rng(seed))
    unit = sampler.random_base2(max(0, math.ceil(math.log2(max(n, 1)))))[:n]
    return np.asarray(lower + unit * (upper - lower))


def minimise(
    evaluate: Batch,
    *,
    lower: Floats,
    upper: Floats,
    starts: Floats,
    step: Floats,
    algorithm: str,
    max_evaluations: int,
    tolerance: float,
    penalty: float,
    seed: int,
    goal: float = -math.inf,
) -> Search:
    """Minimise a cost that is evaluated in batches, from several starts in step.

    Parameters
    ----------
    evaluate : (n, n_parameters) -> (n,); not-a-number for a failed run
    lower, upper : (n_parameters,)
    starts : (n_starts, n_parameters); step : (n_starts,), the first one of a local search
    max_evaluations : of all starts together
    tolerance : a start ends at steps this small
    penalty : cost of a failed run, finite
    goal : a start ends at a cost this low
    """
    if algorithm not in ALGORITHMS:
        known = ", ".join(ALGORITHMS)
        raise ParameterError(f"settings: fit.algorithm: '{algorithm}' is unknown. Use {known}.")
    ledger = _Ledger(evaluate, penalty)
    lockstep = _Lockstep(ledger, len(starts))
    stops: dict[int, Stop] = {}
    bests: dict[int, float] = {}
    crashes: list[Exception] = []

    def search(number: int) -> None:
        def objective(point: Floats) -> float:
            cost = lockstep.ask(number, point)
            bests[number] = min(bests.get(number, math.inf), cost)
            return cost

        try:
            stops[number] = _run_nlopt(
                objective,
                np.clip(starts[number], lower, upper),
                algorithm=algorithm,
                lower=lower,
                upper=upper,
                step=np.full(len(lower), step[number]),
                max_evaluations=max(1, max_evaluations // len(starts)),
                tolerance=tolerance,
                goal=goal,
                seed=seed + number,
            )
        except Exception as error:
            crashes.append(error)
        finally:
            lockstep.leave(number)

    threads = [threading.Thread(target=search, args=(k,)) for k in range(len(starts))]
    for thread in threads:
        thread.start()
    try:
        lockstep.serve()
    finally:
        for thread in threads:
            thread.join()
    if crashes:
        raise crashes[0]
    costs, failed = np.array(ledger.costs), np.array(ledger.failed, dtype=bool)
    best = int(np.argmin(costs))
    winner = min(bests, key=lambda k: (bests[k], k))
    return Search(
        best=ledger.points[best],
        cost=float(costs[best]),
        stop=Stop.FAILED if failed.all() else stops[winner],
        trace=np.array(ledger.points),
        trace_cost=costs,
        failed=failed,
    )


def bound_warnings(
    names: tuple[str, ...], point: Floats, lower: Floats, upper: Floats
) -> tuple[str, ...]:
    """One line for every parameter that lies at a bound."""
    margin = BOUND_MARGIN * (upper - lower)
    return tuple(
        f"{name} is at its {'lower' if value - low <= edge else 'upper'} bound ({value:.3f})"
        for name, value, low, high, edge in zip(names, point, lower, upper, margin, strict=True)
        if value - low <= edge or high - value <= edge
    )


def effect_warnings(
    names: tuple[str, ...], changes: Floats, step: float, smallest: float
) -> tuple[str, ...]:
    """One line for every parameter whose change hardly moves the cost.

    Parameters
    ----------
    changes : (n_parameters,), largest change of the cost for a change of `step`
    smallest : a change below this is no effect
    """
    return tuple(
        f"{name} has no effect on the error: changing it by {step:g} changes nothing visible"
        for name, change in zip(names, changes, strict=True)
        if change < smallest
    )
