"""Rigid motion of the trunk, told by markers on the back."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pipeline.conditioning import bridge, seen
from pipeline.raw import Floats

# passes of generalised Procrustes: the mean shape changes by less than 1e-6 m after three
N_PASSES = 4


class TrunkMotion(NamedTuple):
    """Pose of the trunk in every frame.

    rotation (n_frames, 3, 3) and centre (n_frames, 3), m, so that `(p - centre) @ rotation +
    reference` is the place relative to the back.
    """

    rotation: Floats
    centre: Floats
    reference: Floats

    def remove(self, positions: Floats) -> Floats:
        """Positions relative to the back, in the laboratory's axes at the mean pose."""
        shifted = positions - self.centre[:, None]
        return np.asarray(np.einsum("fmi,fij->fmj", shifted, self.rotation) + self.reference)

    def tilt(self) -> Floats:
        """Angle of each frame from the mean pose, (n_frames,), rad."""
        trace = np.trace(self.rotation, axis1=1, axis2=2)
        return np.asarray(np.arccos(np.clip((trace - 1.0) / 2.0, -1.0, 1.0)))


def leverage(back: Floats, points: Floats) -> float:
    """How much the scatter of one back marker is magnified at the farthest of `points`.

    The error of a rotation fitted to `back` is sigma^2 M^-1 with M the sum of |x|^2 I - x x^T;
    infinite for fewer than three markers and for markers on one line.

    Parameters
    ----------
    back, points : (n, 3), m, mean places
    """
    centred = back - back.mean(axis=0)
    moment = np.sum(centred**2) * np.eye(3) - centred.T @ centred
    if len(back) < 3 or np.linalg.cond(moment) > 1e6:
        return float("inf")
    inverse = np.linalg.inv(moment)
    arms = points - back.mean(axis=0)
    cross = np.cross(np.eye(3)[None], arms[:, None, :])
    spread = np.einsum("pik,ij,pjk->p", cross, inverse, cross)
    return float(np.sqrt(1.0 / len(back) + spread.max() / 3.0))


def trunk_motion(back: Floats) -> TrunkMotion:
    """Pose of every frame by least squares (Kabsch) on the back markers.

    Parameters
    ----------
    back : (n_frames, n_back, 3), m; holes are bridged by the others' motion
    """
    good = seen(back)
    filled = np.stack([bridge(back[:, i]) for i in range(back.shape[1])], axis=1)
    weights = np.where(good, 1.0, 0.0)
    # a frame in which too few are seen takes the bridged places
    weights[good.sum(axis=1) < 3] = 1.0
    weights = (weights / weights.sum(axis=1, keepdims=True))[:, :, None]
    shape = np.median(filled, axis=0)
    for _ in range(N_PASSES):
        centre = np.sum(weights * filled, axis=1)
        middle = np.sum(weights * shape, axis=1)
        moment = np.einsum(
            "fmi,fmj->fij", weights * (filled - centre[:, None]), shape - middle[:, None]
        )
        u, _, vt = np.linalg.svd(moment)
        u[:, :, 2] *= np.linalg.det(u @ vt)[:, None]
        rotation = u @ vt
        # where some are missing, the centre of the others lies elsewhere in the shape
        offset = middle - shape.mean(axis=0)
        centre = centre - np.einsum("fij,fj->fi", rotation, offset)
        placed = np.einsum("fmi,fij->fmj", filled - centre[:, None], rotation)
        shape = np.sum(weights * placed, axis=0) / weights.sum(axis=0) + shape.mean(axis=0)
    return TrunkMotion(rotation, centre, shape.mean(axis=0))


def shift_only(back: Floats) -> TrunkMotion:
    """Take the mean shift alone, for back markers that do not fix a rotation."""
    centre = np.mean([bridge(back[:, i]) for i in range(back.shape[1])], axis=0)
    rotation = np.broadcast_to(np.eye(3), (len(back), 3, 3)).copy()
    return TrunkMotion(rotation, centre, centre.mean(axis=0))
