"""What a laugh's later stages start from: desired pressure and the calls to follow."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline import records
from pipeline.calls_file import TABLE, Call
from pipeline.pressure import PressureCurve
from sim.errors import InputError

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, slots=True)
class DesiredLaugh:
    """Pressure to follow, and when.

    Parameters
    ----------
    time : (n,), s in the file's time, at `rate` (1 kHz)
    pressure, low, high : (n,), Pa over atmosphere
    calls : kept calls in order of time
    inhalations : start and end, s, of breaths heard between bouts
    calibrated : whether the scale of the pressure was measured
    """

    time: Floats
    pressure: Floats
    low: Floats
    high: Floats
    rate: float
    calls: tuple[Call, ...]
    inhalations: tuple[tuple[float, float], ...]
    calibrated: bool

    def within(self, start: float, end: float) -> slice:
        """Samples from `start` to `end`, s."""
        first, last = np.searchsorted(self.time, [start, end])
        return slice(int(first), int(last))


def desired_laugh(folder: Path) -> DesiredLaugh:
    """Read what the stages `pressure` and `calls` left of a recording.

    Parameters
    ----------
    folder : results of the recording
    """
    curve = records.load(PressureCurve, folder / "pressure.npz")
    record = records.read_json(folder / "calls.json")
    # as the stage understood the table: what a hand left empty is filled in
    listed = [Call(**row) for row in record.get("calls", ())]
    calls = tuple(one for one in listed if one.kept)
    if not calls:
        raise InputError(
            f"{folder.name}: {record.get('why_no_laugh') or 'no call is kept'}. Where it is a laugh"
            f" all the same, write yes under 'kept' in {folder / TABLE}."
        )
    return DesiredLaugh(
        time=curve.time,
        pressure=curve.pressure,
        low=curve.low,
        high=curve.high,
        rate=curve.rate,
        calls=calls,
        inhalations=tuple((float(a), float(b)) for a, b in record["inhalations_s"]),
        calibrated=bool(curve.calibrated),
    )
