"""Breaths of a recording as the cost sees them, and a signature computed anew from some of them."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pipeline.cost import CycleFrames, cycle_frames, mean_cycle, mean_seen
from pipeline.scoring import Breath

if TYPE_CHECKING:
    from pipeline.markers import MarkerRecording
    from pipeline.signature import BreathSignature

Floats = NDArray[np.float64]


def signature_breath(signature: BreathSignature) -> Breath:
    """Return the mean measured breath without the last frame where that repeats the first."""
    period = signature.inspiration_time + signature.expiration_time
    inside = signature.time < signature.time[0] + period * (1 - 1e-9)
    return Breath(time=signature.time[inside], positions=signature.mean[inside], period=period)


def used_cycles(signature: BreathSignature) -> tuple[NDArray[np.int64], Floats]:
    """Numbers (n,) of the used breaths and their onset, peak, end (n, 3), s."""
    ids = np.flatnonzero(signature.used)
    events = np.column_stack([signature.onset, signature.peak, signature.end])
    return ids, events[ids]


def recorded_cycles(
    recording: MarkerRecording, signature: BreathSignature, ids: NDArray[np.int64]
) -> CycleFrames:
    """Frames of some breaths of a recording, in recording time."""
    events = np.column_stack([signature.onset, signature.peak, signature.end])[ids]
    return cycle_frames(
        recording.positions,
        recording.start + np.arange(len(recording.positions)) / recording.rate,
        events,
        ids,
        inspiration_time=signature.inspiration_time,
        expiration_time=signature.expiration_time,
        rate=recording.rate,
    )


def without_cycles(
    recording: MarkerRecording, signature: BreathSignature, left_out: NDArray[np.int64]
) -> BreathSignature:
    """Compute the signature anew from the other used breaths."""
    ids, events = used_cycles(signature)
    kept = ~np.isin(ids, left_out)
    inspiration = float(np.median(events[kept, 1] - events[kept, 0]))
    expiration = float(np.median(events[kept, 2] - events[kept, 1]))
    share = signature.pause_time / signature.expiration_time
    turn = signature.inspiration_time
    time = np.where(
        signature.time <= turn,
        signature.time / turn * inspiration,
        inspiration + (signature.time - turn) / signature.expiration_time * expiration,
    )
    used = signature.used & ~np.isin(np.arange(len(signature.used)), left_out)
    renewed = dataclasses.replace(
        signature,
        time=time,
        inspiration_time=inspiration,
        expiration_time=expiration,
        pause_time=share * expiration,
        used=used,
        n_used=int(used.sum()),
    )
    warped = mean_cycle(recorded_cycles(recording, renewed, ids[kept]), time)
    mean = mean_seen(np.stack(list(warped.values())), axis=0)
    return dataclasses.replace(renewed, mean=mean)
