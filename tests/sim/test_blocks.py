"""The block factorisation against dense linear algebra."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim.physics.blocks import Pattern, analyse, factorise, solve
from sim.physics.types import Floats, Ints


def connected(n: int, rng: np.random.Generator, extra: int) -> Ints:
    """A tree through all particles and some more pairs, both ways round."""
    pairs = {(int(rng.integers(0, k)), k) for k in range(1, n)}
    for _ in range(extra):
        i, j = rng.integers(0, n, 2)
        if i != j:
            pairs.add((min(i, j), max(i, j)))
    out = np.array(sorted(pairs), dtype=np.int64).reshape(-1, 2)
    flip = rng.random(len(out)) < 0.5
    out[flip] = out[flip][:, ::-1]
    return out


def fill(pattern: Pattern, n: int, rng: np.random.Generator) -> tuple[Floats, Floats, Floats]:
    """Random symmetric positive definite blocks and the dense matrix that they make."""
    dense = np.zeros((n, 3, n, 3))
    diagonal = np.zeros((n, 3, 3))
    off = rng.standard_normal((len(pattern.pair), 3, 3))
    for block, (i, j) in zip(off, pattern.pair, strict=True):
        a, b = pattern.order[i], pattern.order[j]
        dense[a, :, b, :] = block
        dense[b, :, a, :] = block.T
    for k in range(n):
        root = rng.standard_normal((3, 3))
        diagonal[k] = root @ root.T + 9.0 * len(pattern.pair) * np.eye(3)
        dense[k, :, k, :] = diagonal[k]
    return diagonal, off, dense.reshape(3 * n, 3 * n)


def solved(pattern: Pattern, diagonal: Floats, off: Floats, rhs: Floats) -> Floats:
    n = len(diagonal)
    lower, inverse = np.zeros((len(pattern.row), 3, 3)), np.zeros((n, 3, 3))
    factorise(pattern, diagonal, off, lower, inverse)
    x = rhs.copy()
    solve(pattern, lower, inverse, x, np.zeros((n, 3)))
    return x


@given(st.integers(2, 25), st.integers(0, 40), st.integers(0, 2**32 - 1))
@settings(max_examples=60)
def test_solves_like_dense_algebra(n: int, extra: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    pattern = analyse(n, connected(n, rng, extra))
    diagonal, off, dense = fill(pattern, n, rng)
    rhs = rng.standard_normal((n, 3))
    expected = np.linalg.solve(dense, rhs.ravel()).reshape(n, 3)
    np.testing.assert_allclose(solved(pattern, diagonal, off, rhs), expected, rtol=1e-9, atol=1e-12)


@given(st.integers(2, 25), st.integers(0, 40), st.integers(0, 2**32 - 1))
@settings(max_examples=60)
def test_pattern_covers_every_pair_once(n: int, extra: int, seed: int) -> None:
    edges = connected(n, np.random.default_rng(seed), extra)
    pattern = analyse(n, edges)
    assert sorted(pattern.order) == list(range(n))
    np.testing.assert_array_equal(pattern.place[pattern.order], np.arange(n))
    named = {tuple(sorted(pattern.order[pair])) for pair in pattern.pair}
    assert named == {tuple(sorted(e)) for e in edges.tolist()}
    assert (pattern.pair[:, 0] < pattern.pair[:, 1]).all()
    # the factor holds at least every pair of the matrix, each column in rising order
    held = {(k, int(r)) for k in range(n) for r in pattern.row[slice(*pattern.column[k : k + 2])]}
    assert {tuple(p) for p in pattern.pair.tolist()} <= held


def test_a_chain_fills_nothing() -> None:
    edges = np.stack([np.arange(29), np.arange(1, 30)], axis=1)
    pattern = analyse(30, edges)
    assert len(pattern.row) == len(edges)


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e9])
def test_scale_of_the_masses_does_not_matter(scale: float) -> None:
    rng = np.random.default_rng(3)
    pattern = analyse(12, connected(12, rng, 10))
    diagonal, off, dense = fill(pattern, 12, rng)
    rhs = rng.standard_normal((12, 3))
    expected = np.linalg.solve(dense, rhs.ravel()).reshape(12, 3) / scale
    found = solved(pattern, scale * diagonal, scale * off, rhs)
    np.testing.assert_allclose(found, expected, rtol=1e-9)
