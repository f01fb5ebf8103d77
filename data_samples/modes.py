"""How the skin moves: upper ribs, lower ribs and abdominal wall, each a displacement a litre.

Ribs turn about their costovertebral joints (pump and bucket handle, a little inward yaw); the
abdominal wall bulges outwards. Displacements are linear in the compartment's volume, so that the
volume that the surface sweeps is the stated one exactly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from data_samples.parameters import Parameters
from data_samples.trunk import Floats, Trunk

N_RIBS = 10
N_AZIMUTH, N_HEIGHT = 144, 120


@dataclass(frozen=True, kw_only=True, slots=True)
class Modes:
    """Marker displacement per swept volume, (n_markers, 3) m/m3, and the full rib rotation.

    `rib_cage_share_upper` is the upper ribs' part of the rib cage volume when both turn together;
    `full_rotation_volume` (m3) is what the rib cage sweeps from FRC to TLC angles.
    """

    upper: Floats
    lower: Floats
    abdomen: Floats
    rib_cage_share_upper: float
    full_rotation_volume: float


def _smoothstep(value: Floats) -> Floats:
    clipped = np.clip(value, 0.0, 1.0)
    return clipped**2 * (3.0 - 2.0 * clipped)


def _by_level(p: Parameters, name: str, level: Floats) -> Floats:
    slope = (p(f"rib7_{name}") - p(f"rib3_{name}")) / 4.0
    return p(f"rib3_{name}") + slope * (level - 3.0)


def _rib_joints(p: Parameters, trunk: Trunk) -> Floats:
    """Joint centres of ribs 1 to 10 on the left, (10, 3) m."""
    units = np.array([p(f"t{k}_height") for k in range(1, N_RIBS + 1)])
    scale = p("stature") / p("reference_stature")
    height = trunk.heights["c7"] - scale * np.concatenate([[0.0], np.cumsum(units)[:-1]])
    x = trunk.back(height) + p("rib_joint_depth")
    return np.stack([x, np.full(N_RIBS, p("rib_joint_lateral")), height], axis=-1)


def _rib_level(p: Parameters, joints: Floats, points: Floats) -> Floats:
    """Rib (1 to 10, continuous) whose sloping plane passes through each point."""
    slope = np.tan([p(f"rib{k}_slope") for k in range(1, N_RIBS + 1)])
    level = np.empty(len(points))
    for index, point in enumerate(points):
        plane = joints[:, 2] - np.maximum(point[0] - joints[:, 0], 0.0) * slope
        level[index] = np.interp(-point[2], -plane, np.arange(1, N_RIBS + 1))
    return level


def _rib_motion(p: Parameters, trunk: Trunk, points: Floats, level: Floats) -> Floats:
    """Displacement (n, 3) m of points that ride on the ribs at the full rotation."""
    joints = _rib_joints(p, trunk)
    numbers = np.arange(1, N_RIBS + 1)
    joint = np.stack([np.interp(level, numbers, joints[:, k]) for k in range(3)], axis=-1)
    side = np.sign(points[:, 1])
    outward = np.abs(points[:, 1])
    half_breadth = trunk.half_breadth(points[:, 2])
    ahead = np.maximum(points[:, 0] - joint[:, 0], 0.0)
    beside = np.maximum(outward - joint[:, 1], 0.0)
    above = points[:, 2] - joint[:, 2]
    pump = _by_level(p, "pump", level)
    # Left and right bucket rotations cancel at the sternum and are whole at the side.
    bucket = _by_level(p, "bucket", level) * np.clip(outward / half_breadth, 0.0, 1.0)
    yaw = p("yaw_per_bucket") * bucket
    width = p("spine_quiet_width")
    free = np.maximum(_smoothstep(outward / width), _smoothstep(ahead / width))
    motion = np.stack(
        [
            -pump * above + yaw * beside,
            side * (-bucket * above - yaw * ahead),
            pump * ahead + bucket * beside,
        ],
        axis=-1,
    )
    return motion * free[:, None]


def _margin(p: Parameters, azimuth: Floats) -> Floats:
    """0 in front, 1 from the azimuth at which the costal margin has reached the tenth rib."""
    turn = np.abs((azimuth + np.pi) % (2.0 * np.pi) - np.pi)
    return _smoothstep(turn / p("margin_azimuth"))


def _chest_weight(p: Parameters, trunk: Trunk, azimuth: Floats, height: Floats) -> Floats:
    """1 on the rib cage, falling to 0 on the abdominal wall."""
    z, side = trunk.heights, _margin(p, azimuth)
    margin = z["xiphoid"] + side * (z["tenth"] - z["xiphoid"])
    front_fade = z["xiphoid"] - z["navel"] - p("chest_fade_front")
    fade = front_fade + side * (p("chest_fade_lateral") - front_fade)
    return 1.0 - _smoothstep((margin - height) / fade)


def _belly_motion(p: Parameters, trunk: Trunk, azimuth: Floats, points: Floats) -> Floats:
    """Outward displacement (n, 3) of the abdominal wall, 1 at its largest."""
    z, side = trunk.heights, _margin(p, azimuth)
    top_front = z["xiphoid"] + p("belly_top_front")
    top = top_front + side * (z["tenth"] + p("belly_top_lateral") - top_front)
    along = np.clip((top - points[:, 2]) / (top - z["bottom"]), 0.0, 1.0)
    cosine, ratio = np.cos(azimuth), p("belly_lateral_ratio")
    around = np.where(
        cosine >= 0.0, ratio + (1.0 - ratio) * cosine**2, ratio * (1.0 - np.abs(cosine)) ** 2
    )
    size = np.sin(np.pi * along) * around
    return np.stack([size * cosine, size * np.sin(azimuth), np.zeros_like(size)], axis=-1)


def _shapes(
    p: Parameters, trunk: Trunk, points: Floats, azimuth: Floats
) -> tuple[Floats, Floats, Floats]:
    """Upper ribs, lower ribs at full rotation (m) and belly (1), each (n, 3)."""
    level = _rib_level(p, _rib_joints(p, trunk), points)
    ribs = _rib_motion(p, trunk, points, level)
    ribs *= _chest_weight(p, trunk, azimuth, points[:, 2])[:, None]
    low = _smoothstep((level - p("upper_lower_split")) / p("upper_lower_width") * 0.5 + 0.5)
    belly = _belly_motion(p, trunk, azimuth, points)
    return ribs * (1.0 - low[:, None]), ribs * low[:, None], belly


def _swept(grid: Floats, motion: Floats) -> float:
    """Volume (m3) that a closed ring of skin, (n_azimuth, n_height, 3), sweeps by `motion`."""
    around = 0.5 * (np.roll(grid, -1, axis=0) - np.roll(grid, 1, axis=0))
    upward = np.gradient(grid, axis=1)
    share = np.ones(grid.shape[1])
    share[[0, -1]] = 0.5
    return float(np.sum(np.cross(around, upward) * motion, axis=(0, 2)) @ share)


def build_modes(p: Parameters, trunk: Trunk, markers: Floats, azimuth: Floats) -> Modes:
    """Modes of a subject at its markers (n, 3) m, scaled by the volume the surface sweeps."""
    angles = np.linspace(-np.pi, np.pi, N_AZIMUTH, endpoint=False)
    heights = np.linspace(trunk.heights["bottom"], trunk.heights["notch"], N_HEIGHT)
    theta, z = np.meshgrid(angles, heights, indexing="ij")
    grid = trunk.point(theta, z)
    everywhere = _shapes(p, trunk, grid.reshape(-1, 3), theta.ravel())
    volume = [_swept(grid, motion.reshape(grid.shape)) for motion in everywhere]
    upper, lower, abdomen = (
        motion / swept
        for motion, swept in zip(_shapes(p, trunk, markers, azimuth), volume, strict=True)
    )
    return Modes(
        upper=upper,
        lower=lower,
        abdomen=abdomen,
        rib_cage_share_upper=volume[0] / (volume[0] + volume[1]),
        full_rotation_volume=volume[0] + volume[1],
    )
