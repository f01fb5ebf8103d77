"""Sparse rows: what a force on a point does to the joints, and the mass that it adds there."""

from __future__ import annotations

import numpy as np

from sim.physics.compiled import compiled
from sim.physics.types import Floats, Ints


@compiled
def add_point_row(
    root: int,
    last: int,
    dof_parent: Ints,
    x: Floats,
    direction: Floats,
    scale: float,
    centre: Floats,
    motion: Floats,
    row: Floats,
    touched: Ints,
    count: int,
) -> int:
    """Add `scale` times the generalised force of a unit force on a point to a sparse row.

    Parameters
    ----------
    root, last : root of the body's tree and last degree of freedom that moves it
    x, direction : (3,)
    row : (n_dof,), dense row; entries listed in `touched[:count]` may be nonzero

    Returns
    -------
    the new count
    """
    rx, ry, rz = x[0] - centre[root, 0], x[1] - centre[root, 1], x[2] - centre[root, 2]
    dx, dy, dz = scale * direction[0], scale * direction[1], scale * direction[2]
    tx, ty, tz = ry * dz - rz * dy, rz * dx - rx * dz, rx * dy - ry * dx
    i = last
    while i >= 0:
        value = motion[i, 0] * tx + motion[i, 1] * ty + motion[i, 2] * tz
        value += motion[i, 3] * dx + motion[i, 4] * dy + motion[i, 5] * dz
        if row[i] == 0.0:
            touched[count] = i
            count += 1
            row[i] = 1e-300
        row[i] += value
        i = dof_parent[i]
    return count


@compiled
def add_outer(row: Floats, touched: Ints, count: int, weight: float, matrix: Floats) -> None:
    """Add `weight * row row^T` to `matrix` and clear the row.

    Each pair of entries is added once, to either half; `mirror` makes the whole of both.
    """
    for i in range(count):
        a = np.uintp(touched[i])
        w = weight * row[a]
        for j in range(i + 1):
            b = np.uintp(touched[j])
            matrix[a, b] += w * row[b]
    for i in range(count):
        row[touched[i]] = 0.0


@compiled
def mirror(matrix: Floats) -> None:
    """Add the two halves of a matrix, each of which holds a part of a symmetric sum."""
    for i in range(matrix.shape[0]):
        for j in range(i):
            both = matrix[i, j] + matrix[j, i]
            matrix[i, j] = both
            matrix[j, i] = both
