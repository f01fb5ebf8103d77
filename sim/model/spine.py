"""Bending the spine: one bend of the whole back, shared out over its joints."""

from __future__ import annotations

import numpy as np

from sim.errors import ParameterError
from sim.model.skeleton import SEGMENTS
from sim.physics.types import Floats
from sim.tables import read_rows

DIRECTIONS = {
    "flexion": ("flexion_deg", "extension_deg", 1, 1.0),
    "lateral": ("lateral_bending_deg", "lateral_bending_deg", 0, -1.0),
    "twist": ("rotation_deg", "rotation_deg", 2, 1.0),
}
"""Columns of `spine_limits.csv` for the positive and the negative way, axis and sign of the turn:
positive is forward, to the left side, and the chest turned to the left."""


JOINTS = (*SEGMENTS, "skull")
"""Joints of the spine from below, by the part above each."""


def spine_range(direction: str) -> tuple[float, float]:
    """Largest bend of the whole spine the negative and the positive way, rad, both positive."""
    ahead, back, _, _ = DIRECTIONS[direction]
    return float(_limits(back).sum()), float(_limits(ahead).sum())


def _limits(column: str) -> Floats:
    """Each joint's limit, from below, rad."""
    rows = {row["upper"].lower(): float(row[column]) for row in read_rows("spine_limits.csv")}
    return np.radians([rows[name.lower()] for name in JOINTS])


def _shares(column: str) -> Floats:
    """Each joint's share of a bend, from below."""
    limits = _limits(column)
    return np.asarray(limits / limits.sum())


def _check_bend(what: str, bend: Floats, low: float, high: float) -> None:
    if not (np.min(bend) >= -low - 1e-9 and np.max(bend) <= high + 1e-9):
        raise ParameterError(
            f"spine: {what} goes from {np.degrees(np.min(bend)):.4g} to"
            f" {np.degrees(np.max(bend)):.4g} degrees."
            f" Give {-np.degrees(low):.4g} to {np.degrees(high):.4g}."
        )


def spine_bend(**bends: Floats) -> Floats:
    """Rotation vectors of the spine's joints for a bend of the whole back.

    Each joint takes the share that its limit (dilorenzo2009, Table 3.1) has in the sum of all, so
    that all reach their limits together (section 6.2: the bend is distributed along the spine).

    Parameters
    ----------
    bends : (n,) each, rad, by the names of `DIRECTIONS`; the skull's turn against the pelvis

    Returns
    -------
    (n, 8, 3), rad, joints from below, for `sim.simulate.simulate`

    Raises
    ------
    ParameterError
        for an unknown direction, or a bend beyond the limits
    """
    unknown = sorted(set(bends) - set(DIRECTIONS))
    if unknown:
        raise ParameterError(f"spine: no direction {unknown[0]!r}. Use {', '.join(DIRECTIONS)}.")
    n = max(len(np.atleast_1d(bend)) for bend in bends.values())
    out = np.zeros((n, len(JOINTS), 3))
    for name, bend in bends.items():
        ahead, back, axis, sign = DIRECTIONS[name]
        _check_bend(name, bend, *spine_range(name))
        share = np.where(np.asarray(bend)[:, None] >= 0.0, _shares(ahead), _shares(back))
        out[:, :, axis] = sign * np.asarray(bend)[:, None] * share
    return out


def joint_bend(joint: str, direction: str, bend: Floats) -> Floats:
    """Rotation vectors of the spine's joints for the bend of one of them.

    Parameters
    ----------
    joint : one of `JOINTS`
    direction : one of `DIRECTIONS`
    bend : (n,), rad

    Returns
    -------
    (n, 8, 3), rad, as `spine_bend`

    Raises
    ------
    ParameterError
        for a bend beyond the limit of that joint
    """
    (ahead, back, axis, sign), k = DIRECTIONS[direction], JOINTS.index(joint)
    _check_bend(f"{direction} at {joint}", bend, _limits(back)[k], _limits(ahead)[k])
    out = np.zeros((len(bend), len(JOINTS), 3))
    out[:, k, axis] = sign * bend
    return out
