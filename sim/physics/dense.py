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
    """Solve L L^T x = b in place.

    Parameters
    ----------
    lower, upper : (n, n), of `factorise_dense`
    x : (n,), the right side, overwritten by the solution
    """
    n = x.shape[0]
    for k in range(n):
        row, rest = lower[k], x[k]
        for j in range(k):
            rest -= row[j] * x[j]
        x[k] = rest / row[k]
    for k in range(n - 1, -1, -1):
        row, rest = upper[k], x[k]
        for j in range(k + 1, n):
            rest -= row[j] * x[j]
        x[k] = rest / row[k]
