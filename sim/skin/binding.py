"""Binding a skin: which bones and which vertices of the belly each of its vertices follows."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from sim.model.bone_shapes import Shape
from sim.physics.types import Floats, Ints
from sim.skin.body_mesh import skin_parameters
from sim.skin.clearance import evened, neighbours
from sim.skin.frame import RestPose, bone_points

MOST = 12
"""Handles of a vertex; what is left out is less than a hundredth."""
NEIGHBOURS = 4
"""dilorenzo2009, section 8.2."""
SAMPLES = 160
"""Nearest points of bones and belly that a vertex looks at."""
GRID = 4
"""Points along an edge at which the triangles of the belly are looked at."""
SMOOTH, NEAREST = "smooth", "nearest"


@dataclass(frozen=True, kw_only=True, slots=True)
class Weights:
    """What each vertex of a skin follows.

    Parameters
    ----------
    handle : (n, k), indices of `RestPose.handles`
    weight : (n, k), rows sum to one; unused places are zero
    """

    handle: Ints
    weight: Floats


def fewest(full: Floats, most: int) -> Weights:
    """The `most` largest weights of each row of (n, n_handles), made to sum to one again."""
    most = min(most, full.shape[1])
    order = np.argsort(-full, axis=1, kind="stable")[:, :most]
    weight = np.take_along_axis(full, order, axis=1)
    return Weights(
        handle=np.where(weight > 0.0, order, 0).astype(np.int64),
        weight=weight / weight.sum(axis=1, keepdims=True),
    )


def nearest_weights(
    vertices: Floats, faces: Ints, rest: RestPose, shapes: Mapping[str, Shape], belly: Ints
) -> Weights:
    """Four nearest bones or vertices of the belly, each with a quarter (dilorenzo2009, Eq. 8.1).

    How far a bone is, is not printed: here it is the distance of its nearest point.
    """
    n_bodies = len(rest.bodies)
    far = np.full((len(vertices), n_bodies), np.inf)
    for body, points in bone_points(rest, shapes).items():
        far[:, rest.bodies.index(body)] = cKDTree(points).query(vertices)[0]
    away, vertex = map(np.asarray, cKDTree(rest.abdomen).query(vertices, k=NEIGHBOURS))
    handles = np.hstack([np.tile(np.arange(n_bodies), (len(vertices), 1)), n_bodies + vertex])
    order = np.argsort(np.hstack([far, away]), axis=1, kind="stable")[:, :NEIGHBOURS]
    return Weights(
        handle=np.take_along_axis(handles, order, axis=1).astype(np.int64),
        weight=np.full((len(vertices), NEIGHBOURS), 1.0 / NEIGHBOURS),
    )


def _samples(
    rest: RestPose, shapes: Mapping[str, Shape], belly: Ints
) -> tuple[Floats, Ints, Floats]:
    """Points (k, 3), m, the handles (k, 3) they move with, and in which shares (k, 3)."""
    points, handles, shares = [], [], []
    for body, at in bone_points(rest, shapes).items():
        points.append(at)
        handles.append(np.full((len(at), 3), rest.bodies.index(body)))
        shares.append(np.tile([1.0, 0.0, 0.0], (len(at), 1)))
    step = (np.arange(GRID) + 0.5) / GRID
    u, v = (grid.ravel() for grid in np.meshgrid(step, step))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    share = np.stack([1.0 - u - v, u, v], axis=1)
    free = belly[np.isin(belly, rest.wall).any(axis=1)]
    corners = rest.abdomen[free]
    points.append(np.einsum("sk,fkc->fsc", share, corners).reshape(-1, 3))
    handles.append(np.repeat(len(rest.bodies) + free, len(share), axis=0))
    shares.append(np.tile(share, (len(free), 1)))
    return np.concatenate(points), np.concatenate(handles), np.concatenate(shares)


def smooth_weights(
    vertices: Floats, faces: Ints, rest: RestPose, shapes: Mapping[str, Shape], belly: Ints
) -> Weights:
    """Gaussian shares of what lies near, evened over the skin.

    A vertex at the distance d of the nearest point takes of a point at r the share
    exp((d^2 - r^2) / 2 s^2), with s the larger of `nearest_layer` and `reach_share` d: over a thin
    layer it follows one bone, over a thick one many. Points of the belly lie on its triangles,
    and hand their share on to the corners.

    Parameters
    ----------
    belly : (m, 3), faces of the abdomen, of `rest.abdomen`
    """
    p = skin_parameters()
    points, handles, shares = _samples(rest, shapes, belly)
    away, found = cKDTree(points).query(vertices, k=min(SAMPLES, len(points)))
    away, found = np.asarray(away), np.asarray(found)
    nearest = away[:, :1]
    reach = np.maximum(p["nearest_layer"], p["reach_share"] * nearest)
    kernel = np.exp((nearest**2 - away**2) / (2.0 * reach**2))
    full = np.zeros((len(vertices), len(rest.handles)))
    rows = np.repeat(np.arange(len(vertices)), found.shape[1] * 3)
    np.add.at(full, (rows, handles[found].ravel()), (kernel[..., None] * shares[found]).ravel())
    full /= full.sum(axis=1, keepdims=True)
    return fewest(evened(full, neighbours(faces, len(vertices)), int(p["smoothing"])), MOST)


Method = Callable[[Floats, Ints, RestPose, Mapping[str, Shape], Ints], Weights]
METHODS: dict[str, Method] = {SMOOTH: smooth_weights, NEAREST: nearest_weights}
