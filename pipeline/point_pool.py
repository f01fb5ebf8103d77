"""All moving points of a trajectory, each once: riders on rigid bodies, and free ones.

Surfaces and muscles share their points. Most of them ride on a bone, so that a body and a place
in its frame say everything; only the free ones need principal components.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pipeline.packing import Modes, Packer, Quantised, principal, quantise
from sim.motion import Motion

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

RIDES = 5e-5
"""m; a point that stays so near to one place in a body's frame rides on it."""
PROBES = 5
"""Frames at which points are compared and riders are looked for."""


class PointPool:
    """Points of all surfaces and muscles of one motion.

    Parameters
    ----------
    tolerance : m, of free points
    """

    def __init__(self, motion: Motion, tolerance: float) -> None:
        parts = [soft.vertices for soft in motion.soft.values()]
        if motion.elements is not None:
            parts.append(motion.elements.endpoints.reshape(len(motion.time), -1, 3))
        every = np.concatenate([np.asarray(p, dtype=np.float64) for p in parts], axis=1)
        self._starts = np.cumsum([0, *(p.shape[1] for p in parts)])
        first, self._index = _once(every)
        self.motion = motion
        turns = Rotation.from_quat(motion.quaternion.reshape(-1, 4), scalar_first=True)
        self._turns = turns.as_matrix().reshape(*motion.quaternion.shape[:2], 3, 3)
        points = every[:, first]
        body, local = self._riders(points)
        order = np.argsort(body < 0, kind="stable")
        self._index = np.argsort(order)[self._index]
        self.n_riding = int((body >= 0).sum())
        self.body = body[order][: self.n_riding]
        self.local: Quantised = quantise(local[order][: self.n_riding])
        self.free: Modes = principal(points[:, order[self.n_riding :]], tolerance)
        rode = self._carried(self.body, self.local.values())
        away = rode - points[:, order[: self.n_riding]]
        same = np.linalg.norm(every - points[:, order][:, self._index], axis=-1).max(initial=0.0)
        riding = np.linalg.norm(away, axis=-1).max(initial=0.0)
        self.error = float(same + max(riding, self.free.error))

    def index(self, part: int) -> Ints:
        """Return where the points of a surface lie in the pool; the muscles' come last."""
        return np.asarray(self._index[self._starts[part] : self._starts[part + 1]])

    def _carried(self, body: Ints, local: Floats) -> Floats:
        turned = np.einsum("fpij,pj->fpi", self._turns[:, body], local)
        return np.asarray(turned + self.motion.position[:, body])

    def _riders(self, points: Floats) -> tuple[Ints, Floats]:
        """Body that each point (n_frames, n, 3) rides on, -1 for none, and its place there."""
        n, frames = points.shape[1], _probes(len(points))
        body, local = np.full(n, -1), np.zeros((n, 3))
        best = np.full(n, RIDES)
        for b in range(len(self.motion.bodies)):
            away = points[frames] - self.motion.position[frames, b][:, None]
            own = np.einsum("fji,fpj->fpi", self._turns[frames, b], away)
            middle = own.mean(axis=0)
            spread = np.linalg.norm(own - middle, axis=-1).max(axis=0)
            better = spread < best
            body[better], local[better], best[better] = b, middle[better], spread[better]
        on = body >= 0
        away = np.linalg.norm(self._carried(body[on], local[on]) - points[:, on], axis=-1)
        body[np.flatnonzero(on)[away.max(axis=0, initial=0.0) > RIDES]] = -1
        return body, local

    def put(self, packer: Packer) -> dict[str, Any]:
        """Add to a packer; riders come first in the pool."""
        return {
            "body": packer.add(self.body.astype(np.uint16)),
            "local": self.local.put(packer),
            "free": self.free.put(packer),
        }


def _probes(n_frames: int) -> Ints:
    return np.unique(np.linspace(0, n_frames - 1, PROBES).astype(np.int64))


def _once(points: Floats) -> tuple[Ints, Ints]:
    """Indices of points (n_frames, n, 3) that differ, and which of them each point is."""
    key = np.moveaxis(points[_probes(len(points))].astype(np.float32), 1, 0)
    _, first, index = np.unique(
        key.reshape(points.shape[1], -1), axis=0, return_index=True, return_inverse=True
    )
    return first.astype(np.int64), index.ravel().astype(np.int64)
