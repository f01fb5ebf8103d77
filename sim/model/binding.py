"""The chest cavity as the papers bind it: every point follows its four nearest bones or vertices.

dilorenzo2009, sections 6.3.1 and 8.2: equal weights; a bone carries the point along as it moves
and turns, a vertex of the abdominal cavity shifts it. What is near a bone is not said: here it is
the distance from the nearest of the places at which something is fixed to the bone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from sim.model.torso import Torso
from sim.physics.types import Floats, Ints

NEIGHBOURS = 4
"""dilorenzo2009, section 6.3.1."""


@dataclass(frozen=True, kw_only=True, slots=True)
class BoundCavity:
    """How the points of the chest cavity follow; each row of the weights sums to one over both.

    Parameters
    ----------
    faces : (n_faces, 3), into the cavity's points, outward
    bone : (n, n_bodies), weight of a bone
    arm : (n, n_bodies, 3), weighted place of the point as each bone sees it, m
    vertex : (n_vertices,), points of the torso that it follows
    share : (n, n_vertices), their weights
    shift : (n, 3), weighted sum of what lies between these and the point, m
    """

    faces: Ints
    bone: Floats
    arm: Floats
    vertex: Ints
    share: Floats
    shift: Floats

    def places(self, position: Floats, rotation: Floats, points: Floats) -> Floats:
        """Where the cavity's points are, dilorenzo2009 Eq. 8.1.

        Parameters
        ----------
        position, rotation : (n_frames, n_bodies, 3) and (n_frames, n_bodies, 3, 3), body to world
        points : (n_frames, n_points, 3), points of the torso, m

        Returns
        -------
        (n_frames, n, 3), m
        """
        turned = rotation.transpose(0, 1, 3, 2).reshape(len(position), -1, 3)
        moving = np.concatenate([turned, position, points[:, self.vertex]], axis=1)
        weight = np.hstack([self.arm.reshape(len(self.arm), -1), self.bone, self.share])
        # one large product instead of one a frame
        return np.asarray(np.tensordot(moving, weight, (1, 1)).transpose(0, 2, 1) + self.shift)


def bind_cavity(torso: Torso, position: Floats, rotation: Floats, points: Floats) -> BoundCavity:
    """Bind the chest cavity of a torso at rest.

    Parameters
    ----------
    position, rotation : (n_bodies, 3) and (n_bodies, 3, 3), body to world
    points : (n_points, 3), m
    """
    plant = torso.plant
    own, faces = np.unique(plant.chest_faces, return_inverse=True)
    vertex = np.unique(plant.abdomen_faces)
    n, n_bodies = len(own), len(position)
    at = points[own]
    far = np.full((n, n_bodies), np.inf)
    for b in np.unique(plant.point_body):
        far[:, b] = cKDTree(points[: torso.n_bound][plant.point_body == b]).query(at)[0]
    away = np.linalg.norm(at[:, None] - points[vertex][None], axis=2)
    chosen = np.argsort(np.hstack([far, away]), axis=1, kind="stable")[:, :NEIGHBOURS]
    weight = np.zeros((n, n_bodies + len(vertex)))
    np.put_along_axis(weight, chosen, 1.0 / NEIGHBOURS, axis=1)
    bone, share = weight[:, :n_bodies], weight[:, n_bodies:]
    seen = np.einsum("bck,nbc->nbk", rotation, at[:, None] - position[None])
    return BoundCavity(
        faces=faces.reshape(plant.chest_faces.shape).astype(np.int64),
        bone=bone,
        arm=bone[:, :, None] * seen,
        vertex=vertex,
        share=share,
        shift=share.sum(axis=1, keepdims=True) * at - share @ points[vertex],
    )
