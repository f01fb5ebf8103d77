"""Where a plane cuts a surface of triangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
NUDGE = 1e-9
"""m; a vertex in the plane counts as beside it, so that every cut triangle has two ends."""

Edge = tuple[int, int]


@dataclass(frozen=True, kw_only=True, slots=True)
class Cut:
    """A line on a surface: its points lie on edges and go with them.

    Parameters
    ----------
    edge : (n, 2), vertices
    share : (n,), of the way from the first to the second
    """

    edge: Ints
    share: Floats

    def points(self, vertices: Floats) -> Floats:
        """(n, 2), x and z of the line where the vertices (n_vertices, 3) now are."""
        a, b = vertices[self.edge[:, 0]], vertices[self.edge[:, 1]]
        return np.asarray((a + self.share[:, None] * (b - a))[:, [0, 2]])

    def part(self, chosen: slice) -> Cut:
        """Some points of the line."""
        return Cut(edge=self.edge[chosen], share=self.share[chosen])


def sagittal_cuts(vertices: Floats, faces: Ints, y: float) -> list[Cut]:
    """Lines in which a surface meets a sagittal plane, open ones first.

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
            edge = np.array(_follow(joined, start), dtype=np.int64)
            first, second = side[edge[:, 0]], side[edge[:, 1]]
            lines.append(Cut(edge=edge, share=first / (first - second)))
    return lines


def sagittal_section(vertices: Floats, faces: Ints, y: float) -> list[Floats]:
    """Points of `sagittal_cuts`, (n, 2) of x and z each."""
    return [cut.points(vertices) for cut in sagittal_cuts(vertices, faces, y)]


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
