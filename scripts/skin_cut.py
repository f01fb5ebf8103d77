"""Cutting a mesh by planes, and finding what of it is seen from outside."""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array, vstack
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

DIRECTIONS = 60
PIXELS = 700
INSET, BULGE = 0.8, 0.06  # of a cap's inner ring and middle, over its radius


@dataclass(frozen=True)
class Rows:
    """A mesh whose vertices are weighted sums of others: matrix (m, n), faces (k, 3)."""

    matrix: csr_array
    faces: Ints

    @classmethod
    def whole(cls, n: int, faces: Ints) -> Rows:
        """Return a mesh of n vertices as it is."""
        used, inverse = np.unique(faces, return_inverse=True)
        one = csr_array((np.ones(len(used)), (np.arange(len(used)), used)), shape=(len(used), n))
        return cls(one, inverse.reshape(faces.shape).astype(np.int64))


def cut(rows: Rows, height: Floats, shape: Floats, *, parts: int) -> Rows:
    """Keep where `height` (n,) of the original vertices is positive; close each opening by a cap.

    `shape` (n, 3) m is the pose in which it is cut; there are `parts` openings.
    """
    value = rows.matrix @ height
    kept: list[list[int]] = []
    segments: list[tuple[int, int]] = []
    new: list[tuple[int, int, float]] = []
    edges: dict[tuple[int, int], int] = {}
    count = len(value)

    def crossing(a: int, b: int) -> int:
        key = (min(a, b), max(a, b))
        if key not in edges:
            share = value[key[0]] / (value[key[0]] - value[key[1]])
            edges[key] = count + len(new)
            new.append((key[0], key[1], share))
        return edges[key]

    for face in rows.faces.tolist():
        above = [value[i] > 0 for i in face]
        if all(above):
            kept.append(face)
        elif any(above):
            # turn it so that the corner that stands alone comes first
            lone = above.index(sum(above) == 1)
            a, b, c = face[lone:] + face[:lone]
            p, q = crossing(a, b), crossing(a, c)
            if above[lone]:
                kept.append([a, p, q])
                segments.append((p, q))
            else:
                kept += [[p, b, c], [p, c, q]]
                segments.append((q, p))
    share = np.array([s for _, _, s in new])
    at = np.arange(len(new))
    ends = np.array([(a, b) for a, b, _ in new])
    added = csr_array(
        (np.concatenate([1 - share, share]), (np.tile(at, 2), ends.T.ravel())),
        shape=(len(new), count),
    )
    matrix = vstack([rows.matrix, added @ rows.matrix], format="csr")
    return _capped(Rows(matrix, np.array(kept)), np.array(segments), shape, parts)


def _capped(rows: Rows, segments: Ints, shape: Floats, parts: int) -> Rows:
    n = rows.matrix.shape[0]
    graph = csr_array((np.ones(len(segments)), segments.T), shape=(n, n))
    label = np.asarray(connected_components(graph.astype(bool), directed=False)[1])
    matrix, faces = rows.matrix, rows.faces.tolist()
    loops = [np.flatnonzero(label == k) for k in np.unique(label[segments[:, 0]])]
    loops = sorted(loops, key=len)[-parts:]
    for loop in loops:
        middle = csr_array(np.full((1, len(loop)), 1.0 / len(loop))) @ matrix[loop]
        ring = INSET * matrix[loop] + (1.0 - INSET) * csr_array(np.ones((len(loop), 1))) @ middle
        first = matrix.shape[0]
        matrix = vstack([matrix, ring, middle], format="csr")
        inner = dict(zip(loop.tolist(), range(first, first + len(loop)), strict=True))
        for a, b in segments.tolist():
            if a in inner:
                p, q = inner[a], inner[b]
                faces += [[b, a, p], [b, p, q], [q, p, first + len(loop)]]
    used, inverse = np.unique(np.array(faces), return_inverse=True)
    return Rows(matrix[used], inverse.reshape(-1, 3).astype(np.int64))


@numba.njit(cache=False)  # type: ignore[untyped-decorator]
def _draw(points: Floats, faces: Ints, depth: Floats, owner: Ints) -> None:
    high, wide = depth.shape
    for t in range(len(faces)):
        a, b, c = points[faces[t, 0]], points[faces[t, 1]], points[faces[t, 2]]
        area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
        if abs(area) < 1e-12:
            continue
        for y in range(
            max(0, int(min(a[1], b[1], c[1]))), min(high, int(max(a[1], b[1], c[1])) + 2)
        ):
            for x in range(
                max(0, int(min(a[0], b[0], c[0]))), min(wide, int(max(a[0], b[0], c[0])) + 2)
            ):
                v = ((x - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (y - a[1])) / area
                w = ((b[0] - a[0]) * (y - a[1]) - (x - a[0]) * (b[1] - a[1])) / area
                if v < 0 or w < 0 or v + w > 1:
                    continue
                z = a[2] + v * (b[2] - a[2]) + w * (c[2] - a[2])
                if z > depth[y, x]:
                    depth[y, x] = z
                    owner[y, x] = t


def seen_faces(shape: Floats, faces: Ints) -> npt.NDArray[np.bool_]:
    """Return which faces (m,) are seen from any of many directions; mouth and sockets are not."""
    golden = np.pi * (3.0 - np.sqrt(5.0))
    # only the head has hidden parts: the picture is of it, the rest stands before it
    high = shape[:, 2] > shape[np.unique(faces)].mean(axis=0)[2]
    seen = ~high[faces].all(axis=1)
    head = shape[np.unique(faces[~seen])]
    centre = head.mean(axis=0)
    reach = float(np.linalg.norm(head - centre, axis=-1).max())
    for k in range(DIRECTIONS):
        up = 1.0 - 2.0 * (k + 0.5) / DIRECTIONS
        flat, turn = np.sqrt(1.0 - up * up), golden * k
        way = np.array([flat * np.cos(turn), flat * np.sin(turn), up])
        across = np.cross(way, [0.0, 0.0, 1.0])
        across /= np.linalg.norm(across)
        frame = np.stack([across, np.cross(way, across), way])
        points = (shape - centre) @ frame.T
        points[:, :2] = (points[:, :2] / reach + 1.0) * 0.5 * PIXELS
        depth, owner = np.full((PIXELS, PIXELS), -np.inf), np.full((PIXELS, PIXELS), -1)
        _draw(points, faces, depth, owner)
        seen[np.unique(owner[owner >= 0])] = True
    middles = shape[faces].mean(axis=1)
    twin = np.asarray(cKDTree(middles).query(middles * [1.0, -1.0, 1.0])[1])
    return np.asarray(seen | seen[twin])
