"""When the step's matrix is too old: a fibre that resists hard along its line has turned.

Force against speed makes a contracting fibre resist lengthening a hundred times as hard as its
particles resist by their mass. The matrix knows that along the line it was built at. Turned by an
angle t from there, a share sin^2 t of the resistance acts across that line, where the matrix holds
little more than mass. The step is stable while the true matrix is at most 4/3 of the one it
solves. `engine.LOOSE` is twice that third less a margin: a share is taken of what one element and
its lighter particle hold, and a particle within a fibre is held by two elements.
"""

from __future__ import annotations

import numpy as np

from sim.physics.compiled import compiled
from sim.physics.plant import Muscles
from sim.physics.types import Floats
from sim.physics.work import Lines


@compiled
def keep_lines(
    x: Floats, muscles: Muscles, inertia: Floats, along: Floats, across: Floats, lines: Lines
) -> None:
    """Write the lines of all elements that move a particle, as the matrix has them.

    Parameters
    ----------
    x : (n_points, 3), m
    inertia : (n_particles,), kg
    along, across : (n_elements,), kg, what an element adds to the matrix
    lines : written
    """
    bound = x.shape[0] - inertia.shape[0]
    for e in range(along.shape[0]):
        a, b = muscles.a[e], muscles.b[e]
        lines.grip[e] = 0.0
        if max(a, b) < bound:
            continue
        lightest = inertia[max(a, b) - bound]
        if min(a, b) >= bound:
            lightest = min(lightest, inertia[min(a, b) - bound])
        lines.grip[e] = along[e] / (lightest + across[e])
        square = 0.0
        for c in range(3):
            lines.direction[e, c] = x[b, c] - x[a, c]
            square += lines.direction[e, c] ** 2
        for c in range(3):
            lines.direction[e, c] /= np.sqrt(max(square, 1e-12))


@compiled
def loosest(x: Floats, muscles: Muscles, lines: Lines) -> float:
    """Largest resistance across the line that the matrix has, over what it holds there."""
    worst = 0.0
    for e in range(lines.grip.shape[0]):
        a, b = np.uintp(muscles.a[e]), np.uintp(muscles.b[e])
        dx, dy, dz = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
        direction = lines.direction[e]
        dot = direction[0] * dx + direction[1] * dy + direction[2] * dz
        square = max(dx * dx + dy * dy + dz * dz, 1e-12)
        worst = max(worst, lines.grip[e] * (1.0 - dot * dot / square))
    return worst
