"""The error table of one recording."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pipeline.breaths import recorded_cycles, signature_breath, used_cycles, without_cycles
from pipeline.cost import CycleFrames
from pipeline.level_fit import counted_markers, fit_levels
from pipeline.model import BreathModel
from pipeline.scoring import Breath, OwnBreaths, Row, score
from pipeline.settings import FitSettings

if TYPE_CHECKING:
    from pipeline.markers import MarkerRecording
    from pipeline.signature import BreathSignature


SCOPES = ("signature", "cycles", "cycles_steady")
OWN_SCOPES = ("own", "own_steady")


def _subsets(recording: MarkerRecording) -> dict[str, NDArray[np.int64]]:
    subsets = {"all": counted_markers(recording, "all")}
    if recording.sagittal:
        subsets["sagittal"] = counted_markers(recording, "sagittal")
    return subsets


def error_rows(
    recording: MarkerRecording,
    signature: BreathSignature,
    breath: Breath,
    own: OwnBreaths | None,
    settings: FitSettings,
) -> list[Row]:
    """Rows against the mean breath and against every used breath in recording time.

    `cycles` leaves one offset a marker for the whole recording, as printed in the papers;
    `cycles_steady` one a breath, so that slow drift counts neither for nor against the model.
    Those play one breath again and again; `own` and `own_steady` each breath's own fit.

    Parameters
    ----------
    breath : the signature's fit; own : the fit of each used breath, if there is one
    """
    # the signature, played once, on the frames of the model
    mean = CycleFrames(
        measured=signature_breath(signature).at(breath.time),
        cycle=np.zeros(len(breath.time), dtype=np.int64),
        breath_time=breath.time,
        rate=settings.frame_rate_hz,
    )
    cycles = recorded_cycles(recording, signature, used_cycles(signature)[0])
    every: dict[str, Breath | OwnBreaths] = dict.fromkeys(SCOPES, breath)
    if own is not None:
        every |= dict.fromkeys(OWN_SCOPES, own)
    return [
        score(
            f"{scope}_{name}",
            mean if scope == "signature" else cycles,
            played,
            markers,
            window=settings.velocity_window_s,
            min_cycles=1 if scope == "signature" else settings.min_cycles,
            by_cycle=scope.endswith("_steady"),
        )
        for name, markers in _subsets(recording).items()
        for scope, played in every.items()
    ]


def held_out_rows(
    recording: MarkerRecording,
    signature: BreathSignature,
    model: BreathModel,
    settings: FitSettings,
    seed: int,
) -> list[Row]:
    """Errors on breaths that neither signature, registration, fit nor baselines have seen."""
    ids, _ = used_cycles(signature)
    if len(ids) < settings.min_cycles or settings.heldout_every < 2:
        return []
    left_out = ids[settings.heldout_every - 1 :: settings.heldout_every]
    rest = without_cycles(recording, signature, left_out)
    found = fit_levels(
        recording, rest, model, settings, n_evaluations=settings.heldout_evaluations, seed=seed
    )
    return [
        score(
            f"{scope}_{name}",
            recorded_cycles(recording, rest, left_out),
            found.breath,
            markers,
            window=settings.velocity_window_s,
            min_cycles=1,
            by_cycle=scope == "heldout_steady",
            source=recorded_cycles(recording, rest, np.setdiff1d(ids, left_out)),
        )
        for name, markers in _subsets(recording).items()
        for scope in ("heldout", "heldout_steady")
    ]
