"""A dense symmetric system: factored once, solved at every step."""

from __future__ import annotations

import numpy as np

from sim.physics.compiled import compiled
from sim.physics.types import Floats


@compiled
def factorise_dense(matrix: Floats, lower: Floats, upper: Floats) -> None:
    """Write the Cholesky factor of `matrix` (n, n), and what it is turned over, as rows."""
    lower[:] = np.linalg.cholesky(matrix)
    for i in range(lower.shape[0]):
        for j in range(i + 1):
            upper[j, i] = lower[i, j]


@compiled
def solve_dense(lower: Floats, upper: Floats, x: Floats) -> None:
    """Solve L L^T x = b in place; a row is taken off the rest at once, several numbers a time.

    Parameters
    ----------
    lower, upper : (n, n), of `factorise_dense`
    x : (n,), the right side, overwritten by the solution
    """
    n = x.shape[0]
    for k in range(n):
        row = upper[k]
        x[k] /= row[k]
        top = x[k]
        for j in range(k + 1, n):
            x[j] -= top * row[j]
    for k in range(n - 1, -1, -1):
        row = lower[k]
        x[k] /= row[k]
        top = x[k]
        for j in range(k):
            x[j] -= top * row[j]
