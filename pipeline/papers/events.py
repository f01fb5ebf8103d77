"""What the papers say in words about their breaths, laughs, coughs and sneezes, measured."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from pipeline.papers.moments import contractions, gasps
from sim.behaviour import Behaviour
from sim.physics.types import Floats
from sim.summary import dome_descent

MM, LITRES = 1e3, 1e3
"""Per metre, per cubic metre."""
BEFORE = 0.5
"""s before the first contraction; the fullest moment in it is what the dome rises from."""
UPPER_BACK = "T1-T4"
"""The segment whose tilt tells how far the spine is pulled."""


def tilt(done: Behaviour) -> Floats:
    """(n_frames,), degrees by which the upper back has turned forwards since rest."""
    b = done.motion.bodies.index(UPPER_BACK)
    now = Rotation.from_quat(done.motion.quaternion[:, b], scalar_first=True)
    then = Rotation.from_quat(done.rest.quaternion[0, b], scalar_first=True)
    return np.asarray(np.degrees((now * then.inv()).as_rotvec()[:, 1]))


def dome_rise(done: Behaviour, start: int, end: int) -> float:
    """Way of the dome up between two frames, mm."""
    return -MM * dome_descent(done.motion, done.rest, start, end)


def event_details(done: Behaviour, capacity: Mapping[str, float]) -> dict[str, Any]:
    """Figures of a run beyond `Behaviour.figures`.

    Parameters
    ----------
    capacity : "rv" as predicted, m^3
    """
    t = done.trajectory
    peaks, way = contractions(done), tilt(done)
    out: dict[str, Any] = {
        "contractions": len(peaks),
        "least_volume_over_rv_l": LITRES * (float(t.lung.min()) - capacity["rv"]),
        "expired_l": LITRES * float(t.lung.max() - t.lung[int(np.argmax(t.lung)) :].min()),
        "tilt_range_deg": float(np.ptp(way)),
    }
    if peaks:
        before = max(0, peaks[0] - round(BEFORE / float(np.median(np.diff(t.time)))))
        high = before + int(np.argmax(t.lung[before : peaks[0] + 1]))
        frames = range(peaks[0], peaks[0] + int(np.argmin(t.lung[peaks[0] :])) + 1)
        out["dome_rise_mm"] = max(dome_rise(done, high, f) for f in frames)
    flows = [flow for _, flow in gasps(done)]
    out["gasps"] = len(flows)
    out["gasps_grow"] = bool(len(flows) > 1 and (np.diff(flows) > 0.0).all())
    return out
