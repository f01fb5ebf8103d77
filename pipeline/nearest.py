"""The nearest point of a triangle mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, slots=True)
class Nearest:
    """Nearest points (n, 3) m on a mesh and the normals (n, 3) of the triangles they lie on."""

    points: Floats
    normals: Floats


def _dot(a: Floats, b: Floats) -> Floats:
    return np.asarray(np.sum(a * b, axis=-1))


def _nearest_on_segment(point: Floats, a: Floats, b: Floats) -> Floats:
    edge = b - a
    share = _dot(point - a, edge) / np.maximum(_dot(edge, edge), 1e-30)
    return a + np.clip(share, 0.0, 1.0)[:, None] * edge


def nearest_on_mesh(points: Floats, vertices: Floats, faces: NDArray[np.int64]) -> Nearest:
    """Nearest point of a mesh to each point.

    Parameters
    ----------
    points : (n, 3), m; vertices : (n_vertices, 3), m; faces : (n_faces, 3), outward
    """
    corners = vertices[faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    all_normals = across / np.maximum(np.linalg.norm(across, axis=1), 1e-30)[:, None]
    centres = corners.mean(axis=1)
    radii = np.linalg.norm(corners - centres[:, None], axis=-1).max(axis=1)
    nearest = np.empty_like(points)
    found = np.empty(len(points), dtype=int)
    for k, point in enumerate(points):
        # no triangle beyond the nearest centre can be nearer than its own reach allows
        away = np.linalg.norm(centres - point, axis=1)
        near = np.flatnonzero(away - radii <= away.min())
        a, b, c = corners[near].swapaxes(0, 1)
        normals = all_normals[near]
        foot = point - _dot(point - a, normals)[:, None] * normals
        inside = np.ones(len(near), dtype=bool)
        for p, q in ((a, b), (b, c), (c, a)):
            inside &= _dot(np.cross(q - p, foot - p), normals) >= 0
        candidates = np.stack(
            [
                np.where(inside[:, None], foot, np.inf),
                _nearest_on_segment(point, a, b),
                _nearest_on_segment(point, b, c),
                _nearest_on_segment(point, c, a),
            ]
        )
        squared = np.sum((candidates - point) ** 2, axis=-1)
        way, face = np.unravel_index(int(np.argmin(squared)), squared.shape)
        nearest[k], found[k] = candidates[way, face], near[face]
    return Nearest(points=nearest, normals=all_normals[found])
