"""Where the body is in a recording: its axes, its back, its front midline, its own motion."""

from __future__ import annotations

from typing import Any

import numpy as np

from pipeline.axes import body_axes
from pipeline.conditioning import bridge
from pipeline.labels import places, region
from pipeline.raw import Floats, RawMarkers
from pipeline.trunk import leverage, shift_only, trunk_motion

# a rotation is not trusted that magnifies the scatter of a back marker more than so at the front
MAX_LEVERAGE = 2.5


def find_body(
    raw: RawMarkers, positions: Floats, spots: list[str], posture: str
) -> tuple[Floats, list[int], list[str]]:
    """Axes of the body and the markers on its back."""
    bridged = np.stack([bridge(positions[:, i]) for i in range(len(spots))], axis=1)
    mean = bridged.mean(axis=0)
    moved = bridged - mean
    axes, notes = body_axes(
        source=raw.source,
        mean=mean,
        motion=np.einsum("fmi,fmj->mij", moved, moved) / len(moved),
        spots=spots,
        posture=posture,
        vertical=raw.vertical,
    )
    back = [i for i, spot in enumerate(spots) if region(spot) == "back"]
    if not any(region(spot) for spot in spots):
        back = _back_by_geometry(mean @ axes.T)
    return axes, back, notes


def _back_by_geometry(places_in_body: Floats) -> list[int]:
    """Markers near the spine: rearmost third, middle two thirds of the breadth."""
    depth, breadth = places_in_body[:, 0], places_in_body[:, 1]
    behind = depth < depth.min() + np.ptp(depth) / 3.0
    middle = np.abs(breadth - np.median(breadth)) < np.ptp(breadth) / 3.0
    return [int(i) for i in np.flatnonzero(behind & middle)]


def remove_trunk(
    positions: Floats, back: list[int], warnings: list[str]
) -> tuple[Floats, dict[str, Any]]:
    """Positions relative to the back, with what was removed."""
    if len(back) < 3:
        warnings.append("fewer than 3 markers on the back: motion of the trunk is not removed")
        return positions, {"removed": False}
    middle = np.nanmean(positions[:, back], axis=0)
    magnified = leverage(middle, np.nanmean(positions, axis=0))
    if magnified < MAX_LEVERAGE:
        motion = trunk_motion(positions[:, back])
    else:
        motion = shift_only(positions[:, back])
        warnings.append(
            "markers on the back lie too close together, or on one line, to tell how the trunk"
            " tilts: only its shift is removed"
        )
    placed = motion.remove(positions)
    left = placed[:, back] - np.nanmean(placed[:, back], axis=0)
    return (
        placed,
        {
            "removed": True,
            "travel_mm": 1e3 * float(np.linalg.norm(np.ptp(motion.centre, axis=0))),
            "tilt_deg": float(np.degrees(np.ptp(motion.tilt()))),
            "leverage": magnified if np.isfinite(magnified) else None,
            "back_residual_mm": 1e3 * float(np.nanmean(np.linalg.norm(left, axis=2))),
        },
    )


def front_midline(body: Floats, spots: list[str]) -> tuple[int, ...]:
    """Front midline column from top to bottom."""
    mean = np.nanmean(body, axis=0)
    named = [
        i
        for i, spot in enumerate(spots)
        if spot == "MID"
        or (spot in places() and region(spot) == "front" and places()[spot].nominal[1] == 0.0)
    ]
    if not named and not any(region(spot) for spot in spots):
        offset = np.abs(mean[:, 1] - 0.5 * (mean[:, 1].max() + mean[:, 1].min()))
        ahead = mean[:, 0] > mean[:, 0].mean()
        named = [int(i) for i in np.flatnonzero(ahead & (offset < 0.12 * np.ptp(mean[:, 1])))]
    return tuple(sorted(named, key=lambda i: -mean[i, 2]))
