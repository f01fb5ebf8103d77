"""Straight lines between points: how long they are, how fast they lengthen, how they pull.

Lengths and pulls gather and scatter, one thread after the other; what lies between is arithmetic
over whole arrays, so each is a loop of its own and the processor takes several threads at a time.
Point numbers are read as unsigned: a signed one is first checked for counting from the end.
"""

from __future__ import annotations

import math

import numpy as np

from sim.physics.compiled import compiled
from sim.physics.types import Floats, Ints

SHORTEST = 1e-6
"""m, for the direction of a thread whose ends meet."""


@compiled
def measure(x: Floats, v: Floats, a: Ints, b: Ints, length: Floats, rate: Floats) -> None:
    """Write the length of every thread and how fast it lengthens.

    Parameters
    ----------
    x, v : (n_points, 3), m and m/s
    a, b : (n,), the two ends
    length, rate : (n,), m and m/s, written
    """
    for e in range(a.shape[0]):
        i, j = np.uintp(a[e]), np.uintp(b[e])
        dx, dy, dz = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
        length[e] = dx * dx + dy * dy + dz * dz
        rate[e] = dx * (v[j, 0] - v[i, 0]) + dy * (v[j, 1] - v[i, 1]) + dz * (v[j, 2] - v[i, 2])
    for e in range(a.shape[0]):
        length[e] = max(math.sqrt(length[e]), SHORTEST)
        rate[e] /= length[e]


@compiled
def pull(x: Floats, a: Ints, b: Ints, length: Floats, tension: Floats, f: Floats) -> None:
    """Add the pull of every thread on its two ends.

    Parameters
    ----------
    length : (n,), m, of `measure`
    tension : (n,), N
    f : (n_points, 3), N, added to
    """
    for e in range(a.shape[0]):
        i, j = np.uintp(a[e]), np.uintp(b[e])
        s = tension[e] / length[e]
        dx, dy, dz = s * (x[j, 0] - x[i, 0]), s * (x[j, 1] - x[i, 1]), s * (x[j, 2] - x[i, 2])
        f[i, 0] += dx
        f[i, 1] += dy
        f[i, 2] += dz
        f[j, 0] -= dx
        f[j, 1] -= dy
        f[j, 2] -= dz
