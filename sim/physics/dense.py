"""A dense symmetric system: factored once, solved at every step.

What is kept is the inverse of the triangular factor: to multiply by it waits for nothing, while in
a substitution each unknown waits for the one before.
"""

from __future__ import annotations

import numpy as np

from sim.physics.compiled import compiled
from sim.physics.types import Floats


@compiled
def factorise_dense(matrix: Floats, inverse: Floats) -> None:
    """Write the inverse of the lower Cholesky factor of `matrix`.

    Parameters
    ----------
    matrix : (n, n), symmetric, positive definite
    inverse : (n, n), its lower triangle is written and the rest not looked at
    """
    lower = np.linalg.cholesky(matrix)
    for i in range(lower.shape[0]):
        row = inverse[i]
        row[: i + 1] = 0.0
        row[i] = 1.0
        for k in range(i):
            share, other = lower[i, k], inverse[k]
            for j in range(k + 1):
                row[j] -= share * other[j]
        scale = 1.0 / lower[i, i]
        for j in range(i + 1):
            row[j] *= scale


@compiled
def solve_dense(inverse: Floats, x: Floats, work: Floats) -> None:
    """Solve the system in place.

    Parameters
    ----------
    inverse : (n, n), of `factorise_dense`
    x : (n,), the right side, overwritten by the solution
    work : (n,), scratch
    """
    n = x.shape[0]
    for i in range(n):
        row, total = inverse[i], 0.0
        for j in range(i + 1):
            total += row[j] * x[j]
        work[i] = total
    x[:] = 0.0
    for i in range(n):
        row, share = inverse[i], work[i]
        for j in range(i + 1):
            x[j] += share * row[j]
