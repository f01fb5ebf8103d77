"""Polylines and triangles: what the surfaces of the torso are woven from."""

from __future__ import annotations

import numpy as np

from sim.errors import ParameterError
from sim.model.points import Points
from sim.physics.surface import enclosed_volume
from sim.physics.types import Floats, Ints


def along(line: Floats, stations: Floats) -> Floats:
    """Points of a polyline at shares of its length.

    Parameters
    ----------
    line : (n, 3), m
    stations : (k,), in [0, 1]

    Returns
    -------
    (k, 3), m
    """
    steps = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    return np.stack([np.interp(stations, steps / steps[-1], line[:, c]) for c in range(3)], axis=1)


def ray_depths(triangles: Floats, origin: Floats, way: Floats) -> Floats:
    """How far ahead of `origin` a ray crosses triangles, (n_crossings,) m.

    Parameters
    ----------
    triangles : (n, 3, 3), m
    origin, way : (3,), m and a unit vector
    """
    a = triangles[:, 0]
    u, w = triangles[:, 1] - a, triangles[:, 2] - a
    p = np.cross(way, w)
    det = np.einsum("ij,ij->i", u, p)
    det = np.where(np.abs(det) < 1e-12, 1e-12, det)
    s = np.einsum("ij,ij->i", origin - a, p) / det
    q = np.cross(origin - a, u)
    t = (q @ way) / det
    depth = np.einsum("ij,ij->i", w, q) / det
    hit = (s >= -1e-6) & (t >= -1e-6) & (s + t <= 1.0 + 1e-6) & (depth > 0.0)
    return np.asarray(depth[hit])


def strip(points: Points, a: list[int], b: list[int]) -> list[tuple[int, int, int]]:
    """Triangles between two polylines that run alongside, shorter diagonals first."""
    faces, i, j = [], 0, 0
    while i < len(a) - 1 or j < len(b) - 1:
        if j == len(b) - 1:
            ahead = True
        elif i == len(a) - 1:
            ahead = False
        else:
            p = np.linalg.norm(points.at(a[i + 1]) - points.at(b[j]))
            q = np.linalg.norm(points.at(a[i]) - points.at(b[j + 1]))
            ahead = bool(p <= q)
        face = (a[i], a[i + 1], b[j]) if ahead else (a[i], b[j + 1], b[j])
        i, j = (i + 1, j) if ahead else (i, j + 1)
        if len(set(face)) == 3:
            faces.append(face)
    return faces


def orient(places: Floats, faces: Ints) -> Ints:
    """Turn the faces of a closed mesh outwards.

    Raises
    ------
    ParameterError
        if an edge does not belong to exactly two faces
    """
    faces = faces.copy()
    edges: dict[tuple[int, int], list[int]] = {}
    for f, (a, b, c) in enumerate(faces.tolist()):
        for i, j in ((a, b), (b, c), (c, a)):
            edges.setdefault((min(i, j), max(i, j)), []).append(f)
    if any(len(owners) != 2 for owners in edges.values()):
        raise ParameterError("a cavity of the torso is not closed. Check the size of the subject.")
    done, queue = {0}, [0]
    while queue:
        f = queue.pop()
        a, b, c = faces[f].tolist()
        for i, j in ((a, b), (b, c), (c, a)):
            for g in edges[min(i, j), max(i, j)]:
                if g in done:
                    continue
                x, y, z = faces[g].tolist()
                if (i, j) in ((x, y), (y, z), (z, x)):
                    faces[g] = faces[g, ::-1]
                done.add(g)
                queue.append(g)
    return faces if enclosed_volume(places, faces) > 0.0 else faces[:, ::-1].copy()
