"""A skin that follows a torso."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.spatial.transform import Rotation

from sim.physics.types import Floats, Ints
from sim.skin.binding import Weights
from sim.skin.frame import RestPose

FRAMES = 16
"""Frames that are placed at once."""


@dataclass(frozen=True, kw_only=True, slots=True)
class BoundSkin:
    """A skin at rest and what it follows.

    Parameters
    ----------
    vertices : (n, 3), m, at rest; faces : (m, 3), outward
    weights : of `rest.handles`
    rest : the pose it was bound in
    about : how it was made: words and numbers by name
    """

    vertices: Floats
    faces: Ints
    weights: Weights
    rest: RestPose
    about: dict[str, str | float]

    def matrix(self) -> sparse.csr_array:
        """Weights (n, n_handles)."""
        n, most = self.weights.handle.shape
        rows = np.repeat(np.arange(n), most)
        size = (n, len(self.rest.handles))
        full = sparse.coo_array(
            (self.weights.weight.ravel(), (rows, self.weights.handle.ravel())), shape=size
        )
        return full.tocsr()

    def places(self, position: Floats, quaternion: Floats, abdomen: Floats) -> Floats:
        """Vertices of every frame: v = sum over j of w_j p_j (dilorenzo2009, Eq. 8.1).

        p_j is where handle j alone would take the vertex: a bone turns and shifts it, a vertex of
        the abdomen shifts it.

        Parameters
        ----------
        position, quaternion : (n_frames, n_bodies, 3) and (n_frames, n_bodies, 4), w x y z
        abdomen : (n_frames, n_abdomen, 3), m

        Returns
        -------
        (n_frames, n, 3), m
        """
        rest, weights = self.rest, self.matrix()
        start = Rotation.from_quat(rest.quaternion, scalar_first=True).as_matrix()
        at = np.concatenate([self.vertices, np.ones((len(self.vertices), 1))], axis=1)
        out = np.empty((len(position), len(self.vertices), 3))
        for first in range(0, len(position), FRAMES):
            part = slice(first, first + FRAMES)
            n = len(position[part])
            turns = Rotation.from_quat(quaternion[part].reshape(-1, 4), scalar_first=True)
            turn = turns.as_matrix().reshape(n, -1, 3, 3) @ start.transpose(0, 2, 1)
            shift = position[part] - np.einsum("fbij,bj->fbi", turn, rest.position)
            bodies = np.concatenate([turn, shift[..., None]], axis=-1)
            soft = np.zeros((n, len(rest.abdomen), 3, 4))
            soft[..., :3] = np.eye(3)
            soft[..., 3] = abdomen[part] - rest.abdomen
            every = np.concatenate([bodies, soft], axis=1).transpose(1, 0, 2, 3)
            blended = weights @ every.reshape(len(rest.handles), -1)
            blended = blended.reshape(len(at), n, 3, 4)
            out[part] = np.einsum("vfij,vj->fvi", blended, at)
        return out
