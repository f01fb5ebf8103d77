"""The seven parameters of a call, and the bursts of activation that they stand for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.score import Score, burst, numbers

Floats = NDArray[np.float64]

INTERCOSTALS, ABDOMEN, DIAPHRAGM = "internal_intercostals", "abdomen", "diaphragm"
MUSCLES = (INTERCOSTALS, ABDOMEN, DIAPHRAGM)
PARAMETERS = (
    "intercostals_amplitude",
    "abdomen_amplitude",
    "expiratory_start_s",
    "expiratory_frequency_hz",
    "diaphragm_amplitude",
    "diaphragm_start_s",
    "diaphragm_frequency_hz",
)
"""Internal intercostals and abdomen share start and frequency (dilorenzo2009 section 6.3.2)."""
AMPLITUDES = (0, 1, 4)


@dataclass(frozen=True, kw_only=True, slots=True)
class CallSpace:
    """Where the seven parameters of one call may lie, and the unit box that is searched.

    Parameters
    ----------
    start, end : s, of the call
    most : (3,), largest amplitudes of intercostals, abdomen, diaphragm
    """

    start: float
    end: float
    most: Floats

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """Lower and upper bounds, (7,) each, in the units of `PARAMETERS`."""
        of, length = numbers(), self.end - self.start
        slow, fast = 1.0 / (of["longest_period"] * length), 1.0 / (of["shortest_period"] * length)
        latest = self.start + of["latest_start"] * length
        low = np.array([0.0, 0.0, self.start, slow, 0.0, self.start, slow])
        high = np.array([*self.most[:2], latest, fast, self.most[2], latest, fast])
        return low, high

    def values(self, unit: Floats) -> Floats:
        """Parameters (7,) of a point in the unit box."""
        low, high = self.bounds
        return np.asarray(low + np.clip(unit, 0.0, 1.0) * (high - low))

    def unit(self, values: Floats) -> Floats:
        """Point in the unit box of parameters (7,), the nearest inside it."""
        low, high = self.bounds
        return np.clip((values - low) / np.maximum(high - low, 1e-12), 0.0, 1.0)

    def moved(self, values: Floats, other: CallSpace, louder: float) -> Floats:
        """Parameters of this call told to another one: in proportion to its length and height."""
        scale = (other.end - other.start) / (self.end - self.start)
        out = np.array(values, dtype=float)
        for k in (2, 5):
            out[k] = other.start + scale * (values[k] - self.start)
        out[[3, 6]] /= scale
        out[list(AMPLITUDES)] *= louder
        return other.values(other.unit(out))


def with_call(score: Score, values: Floats) -> Score:
    """The score with the bursts of a call.

    Parameters
    ----------
    values : (7,), in the order of `PARAMETERS`
    """
    expire, brake = (values[2], 1.0 / values[3]), (values[5], 1.0 / values[6])
    for muscle, timing, height in zip(
        MUSCLES, (expire, expire, brake), values[list(AMPLITUDES)], strict=True
    ):
        score = score.add(muscle, burst(float(timing[0]), float(timing[1]), float(height)))
    return score
