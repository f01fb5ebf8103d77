"""A fit of every used breath: the emulator suggests, real runs decide."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pipeline.breaths import recorded_cycles, used_cycles
from pipeline.cost import mean_cycle, play
from pipeline.level_fit import LevelFit, bound_simulator
from pipeline.model import BreathModel
from pipeline.registration import as_recorded
from pipeline.scoring import MM, OwnBreaths
from pipeline.trials import MarkerCost, emulated_best

if TYPE_CHECKING:
    from pipeline.markers import MarkerRecording
    from pipeline.settings import FitSettings
    from pipeline.signature import BreathSignature

Floats = NDArray[np.float64]

HOW = (
    "each breath: the best real run at the timing of the mean breath, one of the search or one at "
    "the levels that the emulator finds for it; checked by real runs at the breath's own timing"
)

NOT_DONE = "not done: too many runs of the torso failed for an emulator"


@dataclass(frozen=True, kw_only=True, slots=True)
class CycleFits:
    """Levels (n_cycles, 4) and cost (n_cycles,) m of the breaths `ids`, and what checks said.

    how : in words; checks : breath, error of the emulator's fit and of a real run with the same
    levels, mm; breaths : the real runs
    """

    how: str
    ids: NDArray[np.int64]
    levels: Floats
    cost: Floats
    checks: tuple[dict[str, float], ...]
    breaths: OwnBreaths | None


def _spread_out(n: int, wanted: int) -> NDArray[np.int64]:
    return np.unique(np.linspace(0, n - 1, min(n, wanted)).round().astype(np.int64))


def _real_cost(
    recording: MarkerRecording,
    signature: BreathSignature,
    model: BreathModel,
    found: LevelFit,
    levels: Floats,
    cost: MarkerCost,
    events: Floats,
) -> float:
    """Cost, m, of a run at the breath's own timing, its frames warped like the measured ones."""
    inspiration, expiration = (float(t) for t in np.diff(events))
    pause = signature.pause_time / signature.expiration_time * expiration
    timing, rate = (inspiration, expiration, pause), cost.rate
    simulator = bound_simulator(
        model, found.registration, recording.posture, timing, rate, found.bend
    )
    runs = simulator.run(levels[None])
    time, turn = found.trials.time, signature.inspiration_time
    late = inspiration + (time - turn) / signature.expiration_time * expiration
    at = np.where(time < turn, time / turn * inspiration, late)
    positions = as_recorded(runs, found.registration, recording.back)[0]
    played = play(np.asarray(runs.time), positions, inspiration + expiration, at)
    return float(cost(played[None])[0])


def _best_real_runs(
    recording: MarkerRecording,
    found: LevelFit,
    costs: list[MarkerCost],
    suggested: Floats,
) -> tuple[Floats, Floats, list[Floats]]:
    """For each breath the best real run: of the search, or at the levels the emulator suggests.

    Returns
    -------
    levels (n_cycles, 4); costs (n_cycles,), m; positions of each run, (n_frames, n_markers, 3) m
    """
    trials = found.trials
    runs = trials.simulator.run(suggested)
    positions = [
        *(trials.positions(int(k)) for k in np.flatnonzero(trials.good)),
        *as_recorded(runs, found.registration, recording.back),
    ]
    levels = np.vstack([trials.levels[trials.good], suggested])
    each = np.array([cost(np.stack(positions)) for cost in costs])
    best = np.nanargmin(each, axis=1)
    return (
        levels[best],
        each.min(axis=1, where=~np.isnan(each), initial=np.inf),
        [positions[k] for k in best],
    )


def fit_cycles(
    recording: MarkerRecording,
    signature: BreathSignature,
    model: BreathModel,
    found: LevelFit,
    settings: FitSettings,
    seed: int,
) -> CycleFits:
    """Fit every used breath; cost and offset freedom are those of the signature's fit."""
    trials = found.trials
    ids, events = used_cycles(signature)
    if not trials.enough:
        return CycleFits(
            how=NOT_DONE,
            ids=ids[:0],
            levels=np.empty((0, len(trials.upper))),
            cost=np.empty(0),
            checks=(),
            breaths=None,
        )
    targets = mean_cycle(recorded_cycles(recording, signature, ids), trials.time)
    emulator = trials.emulator()
    best = trials.levels[trials.best]
    costs = [
        MarkerCost(targets[int(k)], trials.markers, settings.frame_rate_hz, settings) for k in ids
    ]
    fits = [emulated_best(emulator, cost, trials.upper, seed, start=best) for cost in costs]
    suggested = np.array([level for level, _ in fits]).reshape(-1, 4)
    levels, cost, positions = _best_real_runs(recording, found, costs, suggested)

    # the slowest, the fastest and some between them: timing is what the emulator leaves out
    order = np.argsort(events[:, 2] - events[:, 0], kind="stable")
    chosen = order[_spread_out(len(ids), settings.n_cycle_checks)]
    checks = tuple(
        {
            "cycle": float(ids[k]),
            "duration_s": float(events[k, 2] - events[k, 0]),
            "emulated_mm": MM * fits[k][1],
            "real_mm": MM
            * _real_cost(recording, signature, model, found, suggested[k], costs[k], events[k]),
        }
        for k in chosen
    )
    return CycleFits(
        how=HOW,
        ids=ids,
        levels=levels,
        cost=cost,
        checks=checks,
        breaths=OwnBreaths(
            time=trials.time,
            positions=dict(zip(ids.tolist(), positions, strict=True)),
            period=trials.signature.period,
        ),
    )
