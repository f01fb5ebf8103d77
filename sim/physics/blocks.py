"""Sparse factorisation of a symmetric matrix of 3 x 3 blocks (one block a particle pair)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.sparse import csc_matrix, eye
from scipy.sparse.linalg import splu

from sim.physics.compiled import compiled, inner
from sim.physics.types import Floats, Ints


class Pattern(NamedTuple):
    """Where the blocks of a matrix and of its factor stand.

    `order[k]` is the particle eliminated k-th and `place` its inverse. `pair` lists the
    off-diagonal blocks (i, j) of the matrix in elimination order, i < j; columns of the factor
    are `column[k] : column[k + 1]` of `row`.
    """

    order: Ints
    place: Ints
    pair: Ints
    row_start: Ints
    row_pair: Ints
    parent: Ints
    column: Ints
    row: Ints


def analyse(n: int, edges: Ints) -> Pattern:
    """Order the particles for little fill and find the pattern of the factor.

    Parameters
    ----------
    n : number of particles
    edges : (n_edges, 2), pairs of particles that share a block
    """
    i, j = edges[:, 0], edges[:, 1]
    ones = np.ones(len(edges))
    graph = csc_matrix((ones, (i, j)), shape=(n, n))
    graph = graph + graph.T + 10.0 * n * eye(n, format="csc")
    options = {"SymmetricMode": True}
    lu = splu(graph, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
    place = np.asarray(lu.perm_c, dtype=np.int64)
    order = np.argsort(place).astype(np.int64)
    low = np.minimum(place[i], place[j])
    high = np.maximum(place[i], place[j])
    pair = np.unique(np.stack([high, low], axis=1), axis=0)[:, ::-1].copy()
    row_start = np.searchsorted(pair[:, 1], np.arange(n + 1)).astype(np.int64)
    parent = np.full(n, -1, dtype=np.int64)
    flag = np.full(n, -1, dtype=np.int64)
    rows: list[list[int]] = [[] for _ in range(n)]
    for k in range(n):
        flag[k] = k
        for p in range(row_start[k], row_start[k + 1]):
            node = int(pair[p, 0])
            while flag[node] != k:
                if parent[node] == -1:
                    parent[node] = k
                rows[node].append(k)
                flag[node] = k
                node = int(parent[node])
    column = np.concatenate([[0], np.cumsum([len(r) for r in rows])]).astype(np.int64)
    row = np.array([k for r in rows for k in r], dtype=np.int64)
    return Pattern(
        order=order,
        place=place,
        pair=pair.astype(np.int64),
        row_start=row_start,
        row_pair=np.arange(len(pair), dtype=np.int64),
        parent=parent,
        column=column,
        row=row,
    )


@inner
def _invert(a: Floats, out: Floats) -> None:
    c0 = a[1, 1] * a[2, 2] - a[1, 2] * a[2, 1]
    c1 = a[1, 2] * a[2, 0] - a[1, 0] * a[2, 2]
    c2 = a[1, 0] * a[2, 1] - a[1, 1] * a[2, 0]
    s = 1.0 / (a[0, 0] * c0 + a[0, 1] * c1 + a[0, 2] * c2)
    out[0, 0], out[1, 0], out[2, 0] = c0 * s, c1 * s, c2 * s
    out[0, 1] = (a[0, 2] * a[2, 1] - a[0, 1] * a[2, 2]) * s
    out[1, 1] = (a[0, 0] * a[2, 2] - a[0, 2] * a[2, 0]) * s
    out[2, 1] = (a[0, 1] * a[2, 0] - a[0, 0] * a[2, 1]) * s
    out[0, 2] = (a[0, 1] * a[1, 2] - a[0, 2] * a[1, 1]) * s
    out[1, 2] = (a[0, 2] * a[1, 0] - a[0, 0] * a[1, 2]) * s
    out[2, 2] = (a[0, 0] * a[1, 1] - a[0, 1] * a[1, 0]) * s


@compiled
def factorise(
    pattern: Pattern, diagonal: Floats, off: Floats, lower: Floats, inverse: Floats
) -> None:
    """Factor A = L D L^T, L with unit diagonal.

    Parameters
    ----------
    pattern : of `analyse`
    diagonal : (n, 3, 3), in particle order
    off : (n_pairs, 3, 3), A[i, j] of `pattern.pair`
    lower : (n_fill, 3, 3), L, written
    inverse : (n, 3, 3), inverse of D in elimination order, written
    """
    n = diagonal.shape[0]
    work = np.zeros((n, 3, 3))
    d = np.zeros((3, 3))
    used = np.zeros(n, dtype=np.int64)
    flag = np.full(n, -1, dtype=np.int64)
    reach = np.empty(n, dtype=np.int64)
    path = np.empty(n, dtype=np.int64)
    for k in range(n):
        flag[k] = k
        top = n
        for p in range(pattern.row_start[k], pattern.row_start[k + 1]):
            node = pattern.pair[p, 0]
            work[node] += off[p]
            count = 0
            while flag[node] != k:
                path[count] = node
                flag[node] = k
                count += 1
                node = pattern.parent[node]
            while count > 0:
                count -= 1
                top -= 1
                reach[top] = path[count]
        d[:] = diagonal[pattern.order[k]]
        for t in range(top, n):
            i = reach[t]
            y = work[i]
            start = pattern.column[i]
            slot = start + used[i]
            # By name, or every store to the work would have them read again.
            y00, y01, y02 = y[0, 0], y[0, 1], y[0, 2]
            y10, y11, y12 = y[1, 0], y[1, 1], y[1, 2]
            y20, y21, y22 = y[2, 0], y[2, 1], y[2, 2]
            for s in range(start, slot):
                j, q = np.uintp(pattern.row[s]), np.uintp(s)
                for r in range(3):
                    l0, l1, l2 = lower[q, r, 0], lower[q, r, 1], lower[q, r, 2]
                    work[j, r, 0] -= l0 * y00 + l1 * y10 + l2 * y20
                    work[j, r, 1] -= l0 * y01 + l1 * y11 + l2 * y21
                    work[j, r, 2] -= l0 * y02 + l1 * y12 + l2 * y22
            for r in range(3):
                for c in range(3):
                    lower[slot, r, c] = (
                        y[0, r] * inverse[i, 0, c]
                        + y[1, r] * inverse[i, 1, c]
                        + y[2, r] * inverse[i, 2, c]
                    )
            for r in range(3):
                for c in range(3):
                    d[r, c] -= (
                        lower[slot, r, 0] * y[0, c]
                        + lower[slot, r, 1] * y[1, c]
                        + lower[slot, r, 2] * y[2, c]
                    )
            work[i] = 0.0
            used[i] += 1
        _invert(d, inverse[k])


@compiled
def solve(pattern: Pattern, lower: Floats, inverse: Floats, rhs: Floats, work: Floats) -> None:
    """Solve A x = rhs in place.

    Parameters
    ----------
    rhs : (n, 3), in particle order; overwritten by the solution
    work : (n, 3), scratch
    """
    n, column, row = rhs.shape[0], pattern.column, pattern.row
    for k in range(n):
        i = np.uintp(pattern.order[k])
        work[k, 0], work[k, 1], work[k, 2] = rhs[i, 0], rhs[i, 1], rhs[i, 2]
    for k in range(n):
        a, b, c = work[k, 0], work[k, 1], work[k, 2]
        for s in range(column[k], column[k + 1]):
            # Unsigned, and read before anything is written: no check, and no wait for a store.
            j, p = np.uintp(row[s]), np.uintp(s)
            x = work[j, 0] - (lower[p, 0, 0] * a + lower[p, 0, 1] * b + lower[p, 0, 2] * c)
            y = work[j, 1] - (lower[p, 1, 0] * a + lower[p, 1, 1] * b + lower[p, 1, 2] * c)
            z = work[j, 2] - (lower[p, 2, 0] * a + lower[p, 2, 1] * b + lower[p, 2, 2] * c)
            work[j, 0], work[j, 1], work[j, 2] = x, y, z
    for k in range(n - 1, -1, -1):
        x, y, z = 0.0, 0.0, 0.0
        for s in range(column[k], column[k + 1]):
            j, p = np.uintp(row[s]), np.uintp(s)
            a, b, c = work[j, 0], work[j, 1], work[j, 2]
            x += lower[p, 0, 0] * a + lower[p, 1, 0] * b + lower[p, 2, 0] * c
            y += lower[p, 0, 1] * a + lower[p, 1, 1] * b + lower[p, 2, 1] * c
            z += lower[p, 0, 2] * a + lower[p, 1, 2] * b + lower[p, 2, 2] * c
        a, b, c = work[k, 0], work[k, 1], work[k, 2]
        x = inverse[k, 0, 0] * a + inverse[k, 0, 1] * b + inverse[k, 0, 2] * c - x
        y = inverse[k, 1, 0] * a + inverse[k, 1, 1] * b + inverse[k, 1, 2] * c - y
        z = inverse[k, 2, 0] * a + inverse[k, 2, 1] * b + inverse[k, 2, 2] * c - z
        i = np.uintp(pattern.order[k])
        work[k, 0], work[k, 1], work[k, 2] = x, y, z
        rhs[i, 0], rhs[i, 1], rhs[i, 2] = x, y, z
