"""From a breath signature to four levels: registration, first runs, search."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pipeline.breaths import signature_breath
from pipeline.model import BreathModel, Simulator
from pipeline.optimise import Stop
from pipeline.registration import Registration, register
from pipeline.scoring import Breath
from pipeline.settings import FitSettings
from pipeline.trials import Trials, first_runs, search
from sim.errors import InputError

if TYPE_CHECKING:
    from pipeline.markers import MarkerRecording
    from pipeline.signature import BreathSignature


@dataclass(frozen=True, kw_only=True, slots=True)
class LevelFit:
    """Where the torso was put, all its runs, and how the search ended."""

    registration: Registration
    trials: Trials
    stop: Stop

    @property
    def breath(self) -> Breath:
        """The best run, in the recording's axes."""
        trials = self.trials
        positions = trials.positions(trials.best)
        return Breath(time=trials.time, positions=positions, period=trials.signature.period)


def counted_markers(recording: MarkerRecording, which: str) -> NDArray[np.int64]:
    """Return the indices of the markers that count: all, or the front column if there is one."""
    if which == "sagittal" and recording.sagittal:
        return np.array(recording.sagittal)
    return np.arange(recording.positions.shape[1])


def bound_simulator(
    model: BreathModel,
    registration: Registration,
    posture: str,
    timing: tuple[float, float, float],
    rate: float,
) -> Simulator:
    """Put the markers on the torso; timing is inspiration, expiration and pause, s."""
    return model.simulator(
        registration.fit_scale,
        posture,
        registration.points,
        inspiration_time=timing[0],
        expiration_time=timing[1],
        pause_time=timing[2],
        rate=rate,
    )


def fit_levels(
    recording: MarkerRecording,
    signature: BreathSignature,
    model: BreathModel,
    settings: FitSettings,
    *,
    n_evaluations: int,
    seed: int,
) -> LevelFit:
    """Register the torso and search the four levels.

    Parameters
    ----------
    n_evaluations : runs of the search; 0 keeps the best of the first runs
    """
    registration = register(
        model, signature.mean[0], recording.names, recording.sagittal, recording.posture, settings
    )
    timing = (signature.inspiration_time, signature.expiration_time, signature.pause_time)
    trials = Trials(
        bound_simulator(model, registration, recording.posture, timing, settings.frame_rate_hz),
        registration,
        signature_breath(signature),
        counted_markers(recording, settings.markers),
        recording.back,
        settings,
    )
    first_runs(trials, settings.n_initial, seed)
    if not trials.good.any():
        raise InputError(
            f"{recording.name}: fit: not one of {settings.n_initial} runs of the torso succeeded. "
            "Check the subject's size and the timing of the signature, or lower fit.upper_level."
        )
    stop = search(trials, n_evaluations, seed) if n_evaluations else Stop.NO_SEARCH
    return LevelFit(registration=registration, trials=trials, stop=stop)
