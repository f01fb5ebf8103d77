"""The figures of a run: volumes, rotations, excursions, shares and pressures of one breath."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from sim.model.anatomy import SIDES
from sim.model.skeleton import segment_of
from sim.motion import Motion
from sim.physics.types import Floats, Ints
from sim.ultrasound import dome_excursion, is_dome
from sim.units import PASCAL_PER_CMH2O

STEADY_DRIFT = 5e-6
"""m^3; end-expiratory volume of a steady run drifts by less than this a breath."""
STEADY_TIDAL = 0.01
"""Tidal volume of a steady run changes by less than this share a breath."""
NOTHING = 1e-9
"""m^3; a smaller volume has no shares."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Breath:
    """Frames of one breath.

    Parameters
    ----------
    first, last : first frame and last frame of the period
    low, high : frames of the least lung volume before the largest, and of the largest; a single
        cycle that loses more air after its largest volume than it took in before it (a cough, a
        laugh) has its least volume after it
    """

    first: int
    last: int
    low: int
    high: int


def find_breaths(motion: Motion, period: float) -> list[Breath]:
    """Whole breaths of a run that starts with an onset, each `period` s long.

    The steps left over at the end of a run make no frame, so it may seem short by nearly one.
    """
    lung, out = motion.volumes["lung"], []
    frame = float(np.median(np.diff(motion.time)))
    n = int((motion.time[-1] + 0.99 * frame) / period)
    for k in range(n):
        first, last = (
            int(np.argmin(np.abs(motion.time - t))) for t in (k * period, (k + 1) * period)
        )
        high = first + int(np.argmax(lung[first : last + 1]))
        low = first + int(np.argmin(lung[first : high + 1]))
        after = high + int(np.argmin(lung[high : last + 1]))
        low = after if n == 1 and lung[after] < lung[low] else low
        out.append(Breath(first=first, last=last, low=low, high=high))
    return out


def swept_volume(start: Floats, end: Floats, faces: Ints) -> float:
    """Volume that an open surface sweeps to its outer side, m^3.

    Each point goes straight; the rule of Simpson is exact for that path, so that the parts of
    a closed surface add up to the change of the volume inside.

    Parameters
    ----------
    start, end : (n_points, 3), m
    faces : (n_faces, 3)
    """
    way = (end - start)[faces].mean(axis=1)
    total = 0.0
    for weight, share in ((1.0, 0.0), (4.0, 0.5), (1.0, 1.0)):
        x = (start + share * (end - start))[faces]
        area = 0.5 * np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
        total += weight / 6.0 * float((way * area).sum())
    return total


def compartments(motion: Motion, start: int, end: int) -> dict[str, float]:
    """Volumes that rib cage, belly wall and diaphragm sweep between two frames, m^3.

    The rib cage is the inner sheet with its apposed part; the belly is the wall with back and
    floor; both outwards. The diaphragm is counted as it descends, against the world.
    """
    n_dome, out = len(motion.soft["diaphragm"].faces), {}
    for name, part in (("rib_cage", "chest_cavity"), ("belly", "abdomen")):
        soft = motion.soft[part]
        x, y = soft.vertices[start], soft.vertices[end]
        out[name] = swept_volume(x, y, soft.faces[:-n_dome])
        if part == "abdomen":
            out["diaphragm"] = -swept_volume(x, y, soft.faces[-n_dome:])
    return out


def rib_rotations(motion: Motion, rest: Motion, frame: int) -> dict[str, dict[str, float]]:
    """Rotation of every rib against its vertebrae since rest, rad.

    Pump (front end up) and bucket (side up) are components of the rotation vector along the
    transverse and the sagittal axis.
    """
    out = {}
    for side, letter in enumerate(SIDES):
        for rib in range(1, 13):
            name, spine = f"rib_{letter}{rib}", segment_of(f"T{rib}")
            now, then = (
                _turn(spine, q, motion.bodies).inv() * _turn(name, q, motion.bodies)
                for q in (motion.quaternion[frame], rest.quaternion[0])
            )
            upright = _turn(spine, rest.quaternion[0], rest.bodies)
            turn = upright.apply((now * then.inv()).as_rotvec())
            out[name] = {"pump": -turn[1], "bucket": turn[0] if side == 0 else -turn[0]}
    return out


def _turn(body: str, quaternion: Floats, bodies: tuple[str, ...]) -> Rotation:
    return Rotation.from_quat(quaternion[bodies.index(body)], scalar_first=True)


def against_body(motion: Motion, points: Floats, body: str) -> Floats:
    """Points as a body sees them.

    Parameters
    ----------
    points : (n_frames, n, 3), m, world

    Returns
    -------
    (n_frames, n, 3), m, in the frame of the body, parallel to the world's as built
    """
    b = motion.bodies.index(body)
    turn = Rotation.from_quat(motion.quaternion[:, b], scalar_first=True).as_matrix()
    return np.asarray(np.einsum("fij,fni->fnj", turn, points - motion.position[:, b, None]))


def dome_descent(motion: Motion, rest: Motion, start: int, end: int) -> float:
    """Mean way down of the dome between two frames, m."""
    vertices = motion.soft["diaphragm"].vertices[:, is_dome(rest), 2]
    return float((vertices[start] - vertices[end]).mean())


def steadiness(motion: Motion, breaths: list[Breath]) -> tuple[bool, float, str]:
    """Whether the last breath repeats the one before; end-expiratory drift, m^3; why not."""
    lung = motion.volumes["lung"]
    if len(breaths) < 2:
        return False, float("nan"), "one breath from rest: nothing to compare it with"
    before, last = breaths[-2:]
    drift = float(lung[last.last] - lung[before.last])
    tidal = [float(lung[b.high] - lung[b.low]) for b in (before, last)]
    change = abs(tidal[1] / tidal[0] - 1.0) if tidal[0] > 0.0 else 0.0
    reasons = []
    if abs(drift) >= STEADY_DRIFT:
        reasons.append(f"end-expiratory volume drifts {1e6 * drift:.1f} mL a breath")
    if change >= STEADY_TIDAL:
        reasons.append(f"tidal volume changes {100.0 * change:.1f} % a breath")
    return not reasons, drift, "; ".join(reasons)


def summarise(motion: Motion, rest: Motion, *, rate: float) -> dict[str, Any]:
    """Figures of the last whole breath, in the units of their names.

    Parameters
    ----------
    motion : a run that starts at rest with an onset
    rest : the torso at rest in the same posture, one frame
    rate : breaths a second
    """
    breaths = find_breaths(motion, 1.0 / rate)
    b, lung = breaths[-1], motion.volumes["lung"]
    tidal = float(lung[b.high] - lung[b.low])
    steady, drift, why = steadiness(motion, breaths)
    swept = compartments(motion, b.low, b.high)
    outer = swept["rib_cage"] + swept["belly"]
    gain = float(np.subtract(*motion.volumes["chest_cavity"][[b.high, b.low]]))
    belly = rest.volumes["abdomen"][0]
    return {
        "breaths_per_min": 60.0 * rate,
        "tidal_volume_l": 1e3 * tidal,
        "minute_ventilation_l_min": 6e4 * rate * tidal,
        "end_expiratory_volume_l": 1e3 * float(lung[b.low]),
        "rib_rotation_deg": _degrees(rib_rotations(motion, rest, b.high)),
        **_excursions(motion, rest, b),
        "rib_cage_share": swept["rib_cage"] / outer if abs(outer) > NOTHING else None,
        "rib_cage_volume_l": 1e3 * swept["rib_cage"],
        "abdominal_wall_volume_l": 1e3 * swept["belly"],
        "compartment_sum_error": abs(outer - gain) / abs(gain) if abs(gain) > NOTHING else None,
        "diaphragm_volume_l": 1e3 * swept["diaphragm"],
        "pleural_pressure_cmh2o": _span(motion.pressures["pleural"], b),
        "abdominal_pressure_cmh2o": _span(motion.pressures["abdomen"], b),
        "abdomen_volume_error": float(np.abs(motion.volumes["abdomen"] / belly - 1.0).max()),
        "end_expiratory_drift_ml": 1e6 * drift if np.isfinite(drift) else None,
        "steady": steady,
        "not_steady_because": why,
        "n_breaths": len(breaths),
    }


def _degrees(ribs: dict[str, dict[str, float]]) -> dict[str, dict[str, float]]:
    return {k: {axis: float(np.degrees(a)) for axis, a in v.items()} for k, v in ribs.items()}


def _excursions(motion: Motion, rest: Motion, b: Breath) -> dict[str, Any]:
    way = 1e3 * (motion.markers[b.high] - motion.markers[b.low])
    each = dict(zip(motion.marker_names, way.tolist(), strict=True))
    # the chest against its back: what the spine does is no motion of the sternum
    chest = against_body(motion, motion.markers, "T5-T8")
    sternum = 1e3 * (chest[b.high] - chest[b.low])[motion.marker_names.index("STRN")]
    dome = dome_descent(motion, rest, b.low, b.high)
    echo = dome_excursion(motion, rest, b.low, b.high)
    return {
        "sternum_excursion_mm": float(sternum[0]),
        "sternum_excursion_up_mm": float(sternum[2]),
        "abdomen_excursion_mm": each["NAVEL"][0],
        "diaphragm_excursion_mm": 1e3 * dome,
        "diaphragm_excursion_right_posterior_mm": 1e3 * echo["right"],
        "marker_excursion_mm": {k: dict(zip("xyz", v, strict=True)) for k, v in each.items()},
    }


def _span(pressure: Floats, b: Breath) -> list[float]:
    part = pressure[b.first : b.last + 1] / PASCAL_PER_CMH2O
    return [float(part.min()), float(part.max())]
