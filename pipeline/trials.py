"""Runs of the torso against one breath signature: every run is kept, every cost is counted once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.cost import mean_distance, velocity, without_offset
from pipeline.emulator import MIN_RUNS, Emulator, build_emulator, predict
from pipeline.model import Simulator
from pipeline.optimise import Stop, minimise, sobol_points
from pipeline.registration import Registration, as_recorded
from pipeline.scoring import Breath
from pipeline.settings import FitSettings

Floats = NDArray[np.float64]

N_GROUPS = 4
N_CANDIDATES = 2048
EMULATED_EVALUATIONS = 300
EMULATED_STEP = 0.03
STEP_AT_EMULATED = 0.01
STEP_ELSEWHERE = 0.1
"""First step of a search in a level: short where the emulator points, longer elsewhere."""
ROUND_RUNS = 4
ROUND_REACH = 0.02
"""Runs in a round of the search, and how far about the emulator's best they lie."""


class MarkerCost:
    """error_p + weight error_v of displacements against one target breath.

    Parameters
    ----------
    target : (n_frames, n_markers, 3), m, NaN where missing
    markers : (n,), indices of the markers that count
    rate : Hz
    """

    def __init__(
        self, target: Floats, markers: NDArray[np.int64], rate: float, settings: FitSettings
    ) -> None:
        self.target = target
        self.markers = markers
        self.rate = rate
        self.weight = settings.velocity_weight_s
        self.window = settings.velocity_window_s

    def __call__(self, displacement: Floats) -> Floats:
        """Cost (n,), m, of (n, n_frames, n_markers, 3) displacements; NaN for a failed run."""
        return np.array([self._one(run) for run in displacement])

    def _one(self, run: Floats) -> float:
        if not np.isfinite(run).all():
            return float("nan")
        difference = (self.target - run)[:, self.markers]
        cost = mean_distance(without_offset(difference))
        if self.weight > 0:
            same = np.zeros(len(run), dtype=np.int64)
            change = velocity(difference, same, self.rate, self.window)
            cost += self.weight * mean_distance(change)
        return cost


class Trials:
    """The simulator with a memory.

    Parameters
    ----------
    simulator : bound to the markers, at the signature's timing
    registration : turns the torso's axes into the recording's
    signature : the measured breath
    markers : (n,), indices of the markers that count
    back : markers by which the recording's trunk motion was removed
    """

    def __init__(
        self,
        simulator: Simulator,
        registration: Registration,
        signature: Breath,
        markers: NDArray[np.int64],
        back: tuple[int, ...],
        settings: FitSettings,
    ) -> None:
        self.simulator = simulator
        self.registration = registration
        self.settings = settings
        self.upper = np.full(N_GROUPS, settings.upper_level)
        self.signature = signature
        self.markers = markers
        self.back = back
        self.levels = np.empty((0, N_GROUPS))
        self.cost = np.empty(0)
        self.time = np.empty(0)
        self._positions: list[Floats] = []
        self._lung_volume: list[Floats] = []

    def run(self, levels: Floats) -> Floats:
        """Simulate (n, 4) levels, keep the runs, return their costs (n,), m."""
        runs = self.simulator.run(levels)
        self.time = np.asarray(runs.time)
        positions = as_recorded(runs, self.registration, self.back)
        cost = self.marker_cost()(positions)
        self._positions.extend(positions)
        self._lung_volume.extend(runs.lung_volume)
        self.levels = np.vstack([self.levels, levels])
        self.cost = np.append(self.cost, cost)
        return cost

    def marker_cost(self) -> MarkerCost:
        """Cost against the signature, on the frames of the simulator."""
        target = self.signature.at(self.time)
        return MarkerCost(target, self.markers, self.settings.frame_rate_hz, self.settings)

    def still_cost(self) -> float:
        """Cost of not moving at all, m."""
        cost = self.marker_cost()
        return float(cost(np.zeros((1, *cost.target.shape)))[0])

    @property
    def best(self) -> int:
        """The run of the lowest cost."""
        return int(np.nanargmin(self.cost))

    @property
    def good(self) -> NDArray[np.bool_]:
        """Runs that did not fail."""
        return np.isfinite(self.cost)

    def positions(self, run: int) -> Floats:
        """Markers of a run in the recording's axes, (n_frames, n_markers, 3), m."""
        return self._positions[run]

    def lung_volume(self, run: int) -> Floats:
        """Lung volume of a run, (n_frames,), m3."""
        return np.asarray(self._lung_volume[run])

    def displacement(self) -> Floats:
        """All runs that did not fail, each marker's mean removed: (n, n_frames, n_markers, 3)."""
        positions = np.stack(
            [p for p, kept in zip(self._positions, self.good, strict=True) if kept]
        )
        return np.asarray(positions - positions.mean(axis=1, keepdims=True))

    @property
    def enough(self) -> bool:
        """Whether enough runs succeeded for an emulator."""
        return int(self.good.sum()) >= MIN_RUNS

    def emulator(self) -> Emulator:
        """Emulator of all runs so far."""
        return build_emulator(self.levels[self.good], self.displacement())


def first_runs(trials: Trials, n: int, seed: int) -> None:
    """Rest, then Sobol points, dense at small levels where breathing lives."""
    unit = sobol_points(n - 1, np.zeros(N_GROUPS), np.ones(N_GROUPS), seed)
    trials.run(np.vstack([np.zeros(N_GROUPS), trials.upper * unit**3]))


def emulated_best(
    emulator: Emulator, cost: MarkerCost, upper: Floats, seed: int, start: Floats | None = None
) -> tuple[Floats, float]:
    """Lowest cost according to the emulator: levels (4,) and cost, m.

    Parameters
    ----------
    start : (4,), where the search begins; the best of many random levels without it
    """

    def evaluate(levels: Floats) -> Floats:
        return cost(predict(emulator, levels))

    if start is None:
        levels = (
            upper * sobol_points(N_CANDIDATES, np.zeros(N_GROUPS), np.ones(N_GROUPS), seed) ** 2
        )
        start = levels[int(np.argmin(evaluate(levels)))]
    found = minimise(
        evaluate,
        lower=np.zeros(N_GROUPS),
        upper=upper,
        starts=start[None],
        step=np.array([EMULATED_STEP]),
        algorithm="bobyqa",
        max_evaluations=EMULATED_EVALUATIONS,
        tolerance=1e-4,
        penalty=1.0,
        seed=seed,
    )
    return found.best, found.cost


def _emulated_rounds(trials: Trials, n_runs: int, seed: int) -> None:
    """Run the emulator's best and a few levels about it, learn from them, and look again."""
    cost = trials.marker_cost()
    while n_runs > 0:
        size = min(ROUND_RUNS, n_runs)
        suggested, _ = emulated_best(trials.emulator(), cost, trials.upper, seed)
        reach = np.full(N_GROUPS, ROUND_REACH)
        about = suggested + sobol_points(size - 1, -reach, reach, seed + n_runs)
        trials.run(np.clip(np.vstack([suggested, about]), 0, trials.upper))
        n_runs -= size


def search(trials: Trials, n_evaluations: int, seed: int) -> Stop:
    """Search with real runs: rounds of the emulator's best, then nlopt from where they end.

    Parameters
    ----------
    n_evaluations : real runs in all, half of them for the rounds
    """
    settings, first = trials.settings, STEP_ELSEWHERE
    order = np.argsort(np.where(trials.good, trials.cost, np.inf))
    starts = trials.levels[order[: settings.n_starts]]
    if trials.enough:
        n_rounds = min(max(n_evaluations // 2, ROUND_RUNS), n_evaluations)
        _emulated_rounds(trials, n_rounds, seed)
        n_evaluations -= n_rounds
        if n_evaluations == 0:
            return Stop.BUDGET
        suggested, _ = emulated_best(trials.emulator(), trials.marker_cost(), trials.upper, seed)
        order = np.argsort(np.where(trials.good, trials.cost, np.inf))
        starts = np.vstack([suggested, trials.levels[order[: settings.n_starts - 1]]])
        first = STEP_AT_EMULATED
        # BOBYQA moves a start that is nearer than a step to a bound: to the bound where it is near
        starts = np.where(starts < first / 2, 0.0, starts)
    return minimise(
        trials.run,
        lower=np.zeros(N_GROUPS),
        upper=trials.upper,
        starts=starts,
        step=np.full(len(starts), first),
        algorithm=settings.algorithm,
        max_evaluations=n_evaluations,
        tolerance=settings.level_tolerance,
        penalty=settings.failed_penalty * max(trials.still_cost(), settings.surface_sd_m),
        seed=seed,
    ).stop
