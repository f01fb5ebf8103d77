"""Fit of four muscle levels to a breath signature, with everything the report says about it."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.cycle_fits import fit_cycles
from pipeline.error_rows import error_rows, held_out_rows
from pipeline.level_fit import LevelFit, fit_levels
from pipeline.model import GROUPS, Bend, BreathModel
from pipeline.optimise import Stop, bound_warnings, effect_warnings
from pipeline.scoring import Row
from pipeline.trials import Trials

if TYPE_CHECKING:
    from pipeline.markers import MarkerRecording
    from pipeline.settings import FitSettings
    from pipeline.signature import BreathSignature

Floats = NDArray[np.float64]

PROBE_STEP = 0.05
SMALLEST_EFFECT = 1e-3
"""A change of the cost below this share of the cost of not moving is no effect."""


@dataclass(frozen=True, kw_only=True, slots=True)
class FitResult:
    """What a fit found.

    Parameters
    ----------
    levels : (4,), maximum activation of `groups`; cost : m, of the best run; cost_still : m, of
        not moving at all
    stop : how the search ended; warnings : one line each
    time : (n_frames,), s from onset; positions : (n_frames, n_markers, 3), m, markers of the
        best run in the recording's axes; lung_volume : (n_frames,), m3
    inspiration_time, expiration_time, pause_time : s, of the simulated breath
    bend : flexion, lateral bend and twist of the spine at the height of the inspiration, rad
    fit_scale, rotation, translation, points, residual, landmarks : as in `Registration`
    trace_levels : (n, 4), trace_cost : (n,), m, every run in order; NaN for a failed one
    run_levels : (n, 4), run_displacement : (n, n_frames, n_markers, 3), m, the runs that did not
        fail, each marker's mean removed: training data of the emulator
    cycle_id : (n_cycles,), cycle_levels : (n_cycles, 4), cycle_cost : (n_cycles,), m: a fit of
        each used breath; cycle_checks : real runs that checked some of them
    errors : rows of the error table
    """

    name: str
    posture: str
    labels: tuple[str, ...]
    groups: tuple[str, ...]
    levels: Floats
    cost: float
    cost_still: float
    stop: Stop
    warnings: tuple[str, ...]
    time: Floats
    positions: Floats
    lung_volume: Floats
    inspiration_time: float
    expiration_time: float
    pause_time: float
    bend: Bend
    fit_scale: tuple[float, float, float]
    rotation: Floats
    translation: Floats
    points: Floats
    residual: Floats
    landmarks: tuple[str, ...]
    trace_levels: Floats
    trace_cost: Floats
    run_levels: Floats
    run_displacement: Floats
    cycle_id: NDArray[np.int64]
    cycle_levels: Floats
    cycle_cost: Floats
    cycle_how: str
    cycle_checks: tuple[dict[str, float], ...]
    errors: tuple[Row, ...]
    seed: int
    settings: dict[str, Any]

    def __post_init__(self) -> None:
        """Turn the text that a file holds back into the enumeration."""
        object.__setattr__(self, "stop", Stop(self.stop))


def _probe(trials: Trials) -> Floats:
    """Largest change of the cost when each level alone is changed: (4,), m."""
    best, lowest = trials.levels[trials.best], trials.cost[trials.best]
    steps = PROBE_STEP * np.vstack([np.eye(len(best)), -np.eye(len(best))])
    around = np.clip(best + steps, 0, trials.upper)
    changes = np.abs(trials.run(around) - lowest)
    return np.asarray(np.nan_to_num(changes, nan=np.inf).reshape(2, -1).max(axis=0))


def _warnings(found: LevelFit, effects: Floats) -> tuple[str, ...]:
    trials = found.trials
    smallest = SMALLEST_EFFECT * trials.still_cost()
    n_failed = int(np.sum(~trials.good))
    failed = (f"{n_failed} of {len(trials.cost)} runs failed",) if n_failed else ()
    best = trials.levels[trials.best]
    return (
        *failed,
        *bound_warnings(GROUPS, best, np.zeros(len(best)), trials.upper),
        *effect_warnings(GROUPS, effects, PROBE_STEP, smallest),
        *found.registration.notes,
    )


def fit_breath(
    recording: MarkerRecording,
    signature: BreathSignature,
    model: BreathModel,
    settings: FitSettings,
    seed: int,
) -> FitResult:
    """Fit the torso to the signature and to each used breath, and score it.

    Parameters
    ----------
    model : the subject's torso, `pipeline.model.TorsoModel` or a stand-in
    seed : of every random choice; the result is the same for any number of workers
    """
    found = fit_levels(
        recording, signature, model, settings, n_evaluations=settings.n_evaluations, seed=seed
    )
    trials, registration = found.trials, found.registration
    warnings = _warnings(found, _probe(trials))
    cycles = fit_cycles(recording, signature, model, found, settings, seed)
    rows = error_rows(recording, signature, found.breath, cycles.breaths, settings)
    rows += held_out_rows(recording, signature, model, settings, seed)
    best = trials.best
    return FitResult(
        name=recording.name,
        posture=recording.posture,
        labels=recording.labels,
        groups=GROUPS,
        levels=trials.levels[best],
        cost=float(trials.cost[best]),
        cost_still=trials.still_cost(),
        stop=found.stop,
        warnings=warnings,
        time=trials.time,
        positions=trials.positions(best),
        lung_volume=trials.lung_volume(best),
        inspiration_time=signature.inspiration_time,
        expiration_time=signature.expiration_time,
        pause_time=signature.pause_time,
        bend=found.bend,
        fit_scale=registration.fit_scale,
        rotation=registration.rotation,
        translation=registration.translation,
        points=registration.points,
        residual=registration.residual,
        landmarks=registration.landmarks,
        trace_levels=trials.levels,
        trace_cost=trials.cost,
        run_levels=trials.levels[trials.good],
        run_displacement=trials.displacement(),
        cycle_id=cycles.ids,
        cycle_levels=cycles.levels,
        cycle_cost=cycles.cost,
        cycle_how=cycles.how,
        cycle_checks=cycles.checks,
        errors=tuple(rows),
        seed=seed,
        settings=dataclasses.asdict(settings),
    )
