"""From a breath signature to four levels: registration, first runs, search."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pipeline.breaths import signature_breath
from pipeline.model import NO_BEND, Bend, BreathModel, Simulator
from pipeline.optimise import Stop
from pipeline.registration import Registration, register
from pipeline.scoring import Breath
from pipeline.settings import FitSettings
from pipeline.spine_fit import fit_bend
from pipeline.trials import Trials, first_runs, search
from sim.errors import InputError

if TYPE_CHECKING:
    from pipeline.markers import MarkerRecording
    from pipeline.signature import BreathSignature


@dataclass(frozen=True, kw_only=True, slots=True)
class LevelFit:
    """Where the torso was put, all its runs, and how the search ended.

    bend : of the spine, rad, as in `sim.breaths.BreathSimulator`; that of all its runs
    """

    registration: Registration
    trials: Trials
    stop: Stop
    bend: Bend = NO_BEND

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
    bend: Bend = NO_BEND,
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
        bend=bend,
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
    """Register the torso and search the four levels, and the bend of the spine if it is wanted.

    Parameters
    ----------
    n_evaluations : runs of the search; 0 keeps the best of the first runs. With the spine there
        are two searches, before its bend is known and after.
    """
    registration = register(
        model, signature.mean[0], recording.names, recording.sagittal, recording.posture, settings
    )
    timing = (signature.inspiration_time, signature.expiration_time, signature.pause_time)
    markers = counted_markers(recording, settings.markers)

    def bent(bend: Bend) -> Simulator:
        rate = settings.frame_rate_hz
        return bound_simulator(model, registration, recording.posture, timing, rate, bend)

    def searched(bend: Bend) -> tuple[Trials, Stop]:
        breath = signature_breath(signature)
        trials = Trials(bent(bend), registration, breath, markers, recording.back, settings)
        first_runs(trials, settings.n_initial, seed)
        if not trials.good.any():
            raise InputError(
                f"{recording.name}: fit: not one of {settings.n_initial} runs of the torso "
                "succeeded. Check the subject's size and the timing of the signature, or lower "
                "fit.upper_level."
            )
        return trials, search(trials, n_evaluations, seed) if n_evaluations else Stop.NO_SEARCH

    trials, stop = searched(NO_BEND)
    bend = NO_BEND
    if settings.spine and recording.posture == "upright":
        bend = fit_bend(trials, bent)
    if bend != NO_BEND:
        trials, stop = searched(bend)
    return LevelFit(registration=registration, trials=trials, stop=stop, bend=bend)
