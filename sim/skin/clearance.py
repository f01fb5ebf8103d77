"""How far points lie below a skin, and pushing the skin out where that is too little."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree

from sim.model.landmarks import vertex_normals
from sim.physics.types import Floats, Ints
from sim.physics.winding import turns

NEAREST = 10
"""Triangles, by their middles, among which the nearest point of a skin is looked for."""
ROUNDS = 16
EVENED = 6
"""Times that normals are averaged over neighbours, so that a push does not fold the skin."""
BESIDE = 0.02
"""m; what lies deeper below its layer at first is left out: pushing only moves the skin away."""
MOST = 0.012
"""m, of a push in one round."""
CLOSE = 2e-4
"""m; a layer that is thinner by less is thick enough."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Depths:
    """Where points lie against a skin.

    Parameters
    ----------
    depth : (k,), m, below it; negative outside
    face : (k,), the nearest triangle
    share : (k, 3), barycentric place of the nearest point
    """

    depth: Floats
    face: Ints
    share: Floats


def edges(faces: Ints) -> Ints:
    """Edges (k, 2) of triangles, each once."""
    ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    return np.unique(np.sort(ends, axis=1), axis=0)


def neighbours(faces: Ints, n: int) -> sparse.csr_array:
    """(n, n), one where two vertices share an edge."""
    a, b = edges(faces).T
    ones = np.ones(len(a))
    half = sparse.coo_array((ones, (a, b)), shape=(n, n))
    return (half + half.T).tocsr()


def nearest_shares(points: Floats, a: Floats, b: Floats, c: Floats) -> Floats:
    """Barycentric shares (..., 3) of the points of triangles nearest to points (..., 3)."""
    u, v, p = b - a, c - a, points - a
    uu, uv, vv = (u * u).sum(-1), (u * v).sum(-1), (v * v).sum(-1)
    pu, pv = (p * u).sum(-1), (p * v).sum(-1)
    area = np.maximum(uu * vv - uv * uv, 1e-24)
    s, t = (vv * pu - uv * pv) / area, (uu * pv - uv * pu) / area
    inside = (s >= 0) & (t >= 0) & (s + t <= 1)
    along = [
        (np.clip(pu / np.maximum(uu, 1e-24), 0, 1), np.zeros_like(s)),
        (np.zeros_like(s), np.clip(pv / np.maximum(vv, 1e-24), 0, 1)),
    ]
    w = c - b
    far = np.clip(((points - b) * w).sum(-1) / np.maximum((w * w).sum(-1), 1e-24), 0, 1)
    along.append((1.0 - far, far))
    away = [
        ((p - x[..., None] * u - y[..., None] * v) ** 2).sum(-1) for x, y in along
    ]  # of the three sides
    best = np.argmin(away, axis=0)
    s = np.where(inside, s, np.choose(best, [x for x, _ in along]))
    t = np.where(inside, t, np.choose(best, [y for _, y in along]))
    return np.stack([1.0 - s - t, s, t], axis=-1)


def depths(points: Floats, vertices: Floats, faces: Ints, normals: Floats | None = None) -> Depths:
    """How deep points (k, 3), m, lie below a skin with vertices (n, 3).

    Parameters
    ----------
    normals : (n, 3), of the vertices, whose side decides; else those of the mesh
    """
    if normals is None:
        normals = vertex_normals(vertices, faces)
    corners = vertices[faces]
    near = cKDTree(corners.mean(axis=1)).query(points, k=min(NEAREST, len(faces)))[1]
    near = near.reshape(len(points), -1)
    a, b, c = (corners[near, k] for k in range(3))
    share = nearest_shares(points[:, None], a, b, c)
    foot = share[..., :1] * a + share[..., 1:2] * b + share[..., 2:] * c
    away = np.linalg.norm(points[:, None] - foot, axis=-1)
    best = np.argmin(away, axis=1)
    row = np.arange(len(points))
    face, share = near[row, best], share[row, best]
    normal = np.einsum("ki,kij->kj", share, normals[faces[face]])
    below = ((foot[row, best] - points) * normal).sum(-1) >= 0
    # in a fold, such as an armpit, a normal may point to the wrong side
    doubtful = np.flatnonzero(~below)
    below[doubtful] = turns(points[doubtful], vertices, faces) > 0.5
    return Depths(depth=np.where(below, 1.0, -1.0) * away[row, best], face=face, share=share)


def evened(values: Floats, near: sparse.csr_array, times: int) -> Floats:
    """Values (n, ...) averaged with their neighbours' mean some times."""
    count = np.maximum(near.sum(axis=1), 1.0)
    for _ in range(times):
        values = 0.5 * (values + (near @ values) / count[:, None])
    return values


def outward(vertices: Floats, faces: Ints, near: sparse.csr_array) -> Floats:
    """Evened unit normals (n, 3)."""
    normals = evened(vertex_normals(vertices, faces), near, EVENED)
    return np.asarray(normals / np.maximum(np.linalg.norm(normals, axis=1), 1e-12)[:, None])


def push_out(
    vertices: Floats, faces: Ints, points: Floats, least: Floats, movable: Floats, reach: float
) -> Floats:
    """Move a skin outwards until every point lies at least so deep below it.

    What is pushed takes its surroundings along: the move u along the evened normals minimises
    the squared differences between neighbours, plus u^2 / reach^2, plus its distance from what
    is needed where a point lies too near.

    Parameters
    ----------
    points : (k, 3), m; least : (k,), m
    movable : (n,), in [0, 1], zero where the skin stays
    reach : of the push, in edges
    """
    n = len(vertices)
    near = neighbours(faces, n)
    count = near.sum(axis=1)
    laplace = sparse.diags_array(count) - near
    hold = sparse.diags_array(count / reach**2 + 1e3 * (movable <= 0.0))
    out = vertices.copy()
    beside = depths(points, out, faces).depth < least + BESIDE
    points, least = points[beside], least[beside]
    for _ in range(ROUNDS):
        normals = outward(out, faces, near)
        found = depths(points, out, faces, normals)
        short = np.flatnonzero(least - found.depth > CLOSE)
        if not len(short):
            break
        need = np.zeros(n)
        lack = np.minimum((least - found.depth)[short], MOST)
        for corner in range(3):
            strong = found.share[short, corner] > 0.1
            np.maximum.at(need, faces[found.face[short], corner][strong], lack[strong])
        need = np.where(movable > 0.0, need, 0.0)
        firm = 4.0 * count * (need > 0)
        system = (laplace + hold + sparse.diags_array(firm)).tocsc()
        move = splu(system).solve(firm * need)
        out = out + np.maximum(move, 0.0)[:, None] * normals
    return out
