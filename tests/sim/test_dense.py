"""The dense factorisation against numpy's."""

from __future__ import annotations

import numpy as np
import pytest

from sim.physics.dense import factorise_dense, solve_dense


@pytest.mark.parametrize("n", [1, 2, 7, 146])
def test_solves_like_numpy(n: int) -> None:
    rng = np.random.default_rng(n)
    root = rng.normal(size=(n, n))
    matrix = root @ root.T + np.diag(10.0 ** rng.uniform(-2.0, 6.0, n))
    inverse, x, rhs = np.full((n, n), np.nan), rng.normal(size=n), rng.normal(size=n)
    factorise_dense(matrix, inverse)
    x[:] = rhs
    solve_dense(inverse, x, np.empty(n))
    assert x == pytest.approx(np.linalg.solve(matrix, rhs), rel=1e-8)
