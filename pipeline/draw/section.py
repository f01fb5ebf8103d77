"""Where a plane cuts a surface of triangles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
NUDGE = 1e-9
"""m; a vertex in the plane counts as beside it, so that every cut triangle has two ends."""

Edge = tuple[int, int]


def _crossing(vertices: Floats, edge: Edge, side: Floats) -> Floats:
    a, b = edge
    share = side[a] / (side[a] - side[b])
    point = vertices[a] + share * (vertices[b] - vertices[a])
    return np.asarray(point[[0, 2]])


def sagittal_section(vertices: Floats, faces: Ints, y: float) -> list[Floats]:
    """Lines in which a surface meets a sagittal plane, (n, 2) of x and z each.

    A line that comes back to its start is closed: its last point is its first.

    Parameters
    ----------
    vertices : (n, 3), m
    faces : (m, 3)
    y : m, of the plane
    """
    side = vertices[:, 1] - y
    side = np.where(np.abs(side) < NUDGE, NUDGE, side)
    joined: dict[Edge, list[Edge]] = {}
    for face in faces[np.ptp(np.sign(side[faces]), axis=1) > 0]:
        a, b, c = (int(i) for i in face)
        cut = [(min(e), max(e)) for e in ((a, b), (b, c), (c, a)) if side[e[0]] * side[e[1]] < 0]
        joined.setdefault(cut[0], []).append(cut[1])
        joined.setdefault(cut[1], []).append(cut[0])
    lines = []
    # open lines first, from an end; what is left is closed
    for start in sorted(joined, key=lambda edge: (len(joined[edge]), edge)):
        if start in joined:
            chain = _follow(joined, start)
            lines.append(np.array([_crossing(vertices, edge, side) for edge in chain]))
    return lines


def _follow(joined: dict[Edge, list[Edge]], start: Edge) -> list[Edge]:
    """Walk from edge to edge until there is no way on, and forget what was walked."""
    chain, here = [start], start
    while True:
        onward = [edge for edge in joined.pop(here) if edge in joined]
        if not onward:
            break
        here = onward[0]
        chain.append(here)
    return chain
