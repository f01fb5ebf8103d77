"""How the skin changes over a calm breath (dilorenzo2009, Fig. 5.5)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from pipeline.papers.view import chosen_frames, outside
from sim.behaviour import Behaviour
from sim.resting import RestingTorso
from sim.simulate import skin_frames
from sim.summary import find_breaths

SNAPSHOTS = 4
MM = 1e3


@dataclass(frozen=True, kw_only=True, slots=True)
class SkinChange:
    """Skin of a breath.

    Parameters
    ----------
    lines : of each snapshot, time and midline front and back, (n, 2) m each
    figures : keys of the table
    """

    lines: list[dict[str, Any]]
    figures: dict[str, Any]


def skin_change(resting: RestingTorso, done: Behaviour) -> SkinChange:
    """Four snapshots of the last breath, from the least to the largest volume, and what moved."""
    b = find_breaths(done.motion, done.cycle)[-1]
    frames = np.linspace(b.low, b.high, SNAPSHOTS).round().astype(int)
    skins = skin_frames(resting, chosen_frames(done.trajectory, frames.tolist()))
    rim = resting.torso.anatomy.pelvis_rim[0][[0, 2]]
    front, back = outside(skins[0], resting.skin.faces, rim)
    lines = [
        {
            "time_s": float(done.motion.time[frame] - done.motion.time[b.low]),
            "front": front.points(skin).tolist(),
            "back": back.points(skin).tolist(),
        }
        for frame, skin in zip(frames, skins, strict=True)
    ]
    moved = MM * np.linalg.norm(skins[-1] - skins[0], axis=1)
    m = done.motion
    way = MM * (m.markers[b.high] - m.markers[b.low])
    each = dict(zip(m.marker_names, way, strict=True))
    skull = m.bodies.index("skull")
    neck = MM * float(np.linalg.norm(m.position[b.high, skull] - m.position[b.low, skull]))
    return SkinChange(
        lines=lines,
        figures={
            "skin_most_mm": float(moved.max()),
            "skin_unevenness": float(moved.std() / moved.mean()),
            "chest_forward_mm": float(each["STRN"][0]),
            "belly_forward_mm": float(each["NAVEL"][0]),
            "neck_moves_mm": neck,
        },
    )
