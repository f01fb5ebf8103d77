"""Where the eye is: everything in the picture, from a named side."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

VIEWS = {
    "three-quarter": (0.85, 0.62, 0.3),
    "front": (1.0, 0.0, 0.06),
    "side": (0.001, 1.0, 0.06),
    "back": (-1.0, 0.0, 0.06),
    "above": (0.02, 0.0, 1.0),
}
"""From the torso to the eye; as in `viewer/src/stage.js`, whose `left` and `oblique` are `side` and
`three-quarter`."""
FIELD = np.radians(28.0)
"""Angle of what is seen, over the height."""
ROOM = 1.08
"""Of the picture over what is in it."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Camera:
    """An eye.

    Parameters
    ----------
    view : (4, 4), from the torso's axes to right, up and towards the eye
    tangents : of half the angle seen, over width and height
    near, far : m, ahead of the eye
    """

    view: Floats
    tangents: tuple[float, float]
    near: float
    far: float

    @property
    def projection(self) -> Floats:
        """From the eye's axes to the picture's, (4, 4)."""
        span = self.far - self.near
        out = np.zeros((4, 4))
        out[0, 0], out[1, 1] = 1.0 / self.tangents[0], 1.0 / self.tangents[1]
        out[2, 2], out[2, 3] = -(self.far + self.near) / span, -2.0 * self.far * self.near / span
        out[3, 2] = -1.0
        return out

    def pixels(self, points: Floats, size: tuple[int, int]) -> Floats:
        """Where points (n, 3) are in a picture: (n, 2), from its left and its top."""
        seen = np.column_stack([points, np.ones(len(points))]) @ (self.projection @ self.view).T
        flat = seen[:, :2] / seen[:, 3:]
        return np.asarray(0.5 * (1.0 + flat * [1.0, -1.0]) * size)


def _axes(view: str) -> Floats:
    """Rows: right, up, towards the eye."""
    way = np.array(VIEWS[view]) / np.linalg.norm(VIEWS[view])
    right = np.cross([0.0, 0.0, 1.0], way)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(way, right), way])


def look(view: str, points: Floats, aspect: float, foot: float = 0.0) -> Camera:
    """Return the nearest eye on a side from which every point (n, 3) is in the picture.

    Parameters
    ----------
    aspect : width over height
    foot : share of the height that is kept free below
    """
    axes = _axes(view)
    tangents = (float(np.tan(FIELD / 2.0)) * aspect, float(np.tan(FIELD / 2.0)))
    kept = (tangents[0], tangents[1] * (1.0 - foot))
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    away = 1.0
    for _ in range(4):
        # what is nearer looks larger: the middle of the picture is found step by step
        own = (points - middle) @ axes.T
        away = float((ROOM * np.abs(own[:, :2]) / kept + own[:, 2:]).max())
        flat = own[:, :2] / (away - own[:, 2:])
        middle = middle + away * 0.5 * (flat.min(axis=0) + flat.max(axis=0)) @ axes[:2]
    middle = middle - away * tangents[1] * foot * axes[1]
    deep = float(np.abs((points - middle) @ axes[2]).max())
    matrix = np.eye(4)
    matrix[:3, :3] = axes
    matrix[:3, 3] = -axes @ (middle + away * axes[2])
    margin = 0.05 + deep
    return Camera(view=matrix, tangents=tangents, near=max(away - margin, 0.02), far=away + margin)
