"""What threads and contacts add to the inertia of jointed bodies, body pair by body pair.

A stiffness between two points is a 6 x 6 block between their bodies; all blocks of a pair are
summed before the joints are looked at, so a thread costs no more for a long chain of joints.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from sim.physics.compiled import compiled, inner
from sim.physics.plant import Tree
from sim.physics.types import Floats

Mass: TypeAlias = tuple[float, float, float, float, float, float]
"""Symmetric 3 x 3 mass, kg: xx, xy, xz, yy, yz, zz."""
Arm: TypeAlias = tuple[float, float, float]
"""A point from the centre that its body's motion is stated at, m."""


@compiled
def arm(x: Floats, p: int, centre: Floats, root: int) -> Arm:
    """Point `p` of `x` from the centre of mass of the tree whose root is body `root`."""
    i, o = np.uintp(p), np.uintp(root)
    return x[i, 0] - centre[o, 0], x[i, 1] - centre[o, 1], x[i, 2] - centre[o, 2]


@inner
def _add_row(x: float, y: float, z: float, s: Arm, out: Floats, i: int) -> None:
    """Add a force (x, y, z) on the point s, as a wrench, to a row of a block."""
    out[i, 0] += s[1] * z - s[2] * y
    out[i, 1] += s[2] * x - s[0] * z
    out[i, 2] += s[0] * y - s[1] * x
    out[i, 3] += x
    out[i, 4] += y
    out[i, 5] += z


@compiled
def add_mass(m: Mass, k: float, r: Arm, s: Arm, pairs: Floats, a: int, b: int) -> None:
    """Add k J_r^T m J_s, where J_r turns a body's motion into that of its point r.

    Parameters
    ----------
    pairs : (n_bodies, n_bodies, 6, 6), rotation first; block (a, b) is added to
    """
    xx, xy, xz, yy, yz, zz = k * m[0], k * m[1], k * m[2], k * m[3], k * m[4], k * m[5]
    (x, y, z), out = r, pairs[a, b]
    _add_row(y * xz - z * xy, y * yz - z * yy, y * zz - z * yz, s, out, 0)
    _add_row(z * xx - x * xz, z * xy - x * yz, z * xz - x * zz, s, out, 1)
    _add_row(x * xy - y * xx, x * yy - y * xy, x * yz - y * xz, s, out, 2)
    _add_row(xx, xy, xz, s, out, 3)
    _add_row(xy, yy, yz, s, out, 4)
    _add_row(xz, yz, zz, s, out, 5)


@inner
def _gather(tree: Tree, motion: Floats, pairs: Floats, joined: Floats, wrench: Floats) -> None:
    """Wrench on each body alone from a unit change of each joint; `pairs` is emptied."""
    wrench[:] = 0.0
    for a in range(pairs.shape[0]):
        for b in range(a + 1):
            if joined[a, b] == 0.0:
                continue
            joined[a, b] = 0.0
            block, out = pairs[a, b], wrench[a]
            # The other half of the sum comes of turning the whole over.
            scale = 0.5 if a == b else 1.0
            j = tree.body_last_dof[b]
            while j >= 0:
                s = motion[j]
                s0, s1, s2, s3, s4, s5 = s[0], s[1], s[2], s[3], s[4], s[5]
                for c in range(6):
                    k = block[c]
                    out[c, j] += scale * (
                        k[0] * s0 + k[1] * s1 + k[2] * s2 + k[3] * s3 + k[4] * s4 + k[5] * s5
                    )
                j = tree.dof_parent[j]
            block[:] = 0.0


@compiled
def project_masses(
    tree: Tree, motion: Floats, pairs: Floats, joined: Floats, wrench: Floats, out: Floats
) -> None:
    """Joint-space matrix of the masses between bodies.

    Parameters
    ----------
    motion : (n_dof, 6), how each degree of freedom moves its bodies
    pairs : (n_bodies, n_bodies, 6, 6), kg, of a later and an earlier body; emptied
    joined : (n_bodies, n_bodies), not zero where a pair has a block; emptied
    wrench : (n_bodies, 6, n_dof), scratch
    out : (n_dof, n_dof), written
    """
    _gather(tree, motion, pairs, joined, wrench)
    n = out.shape[0]
    for b in range(wrench.shape[0] - 1, 0, -1):
        parent = tree.body_parent[b]
        if parent > 0:
            for c in range(6):
                whole, part = wrench[parent, c], wrench[b, c]
                for j in range(n):
                    whole[j] += part[j]
    for i in range(n):
        w, row = wrench[np.uintp(tree.dof_body[i])], out[i]
        s0, s1, s2, s3, s4, s5 = (
            motion[i, 0], motion[i, 1], motion[i, 2], motion[i, 3], motion[i, 4], motion[i, 5],
        )  # fmt: skip
        w0, w1, w2, w3, w4, w5 = w[0], w[1], w[2], w[3], w[4], w[5]
        for j in range(n):
            row[j] = s0 * w0[j] + s1 * w1[j] + s2 * w2[j] + s3 * w3[j] + s4 * w4[j] + s5 * w5[j]
    for i in range(n):
        for j in range(i + 1):
            both = out[i, j] + out[j, i]
            out[i, j] = both
            out[j, i] = both
