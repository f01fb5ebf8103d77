"""When the step's matrix is too old: what it holds is less than 3/4 of the truth.

The step is stable while the true matrix is at most 4/3 of the one it solves. What was not so when
it was built: a group of muscles is more active, a thread of tissue has stiffened as it stretched, a
particle touches the rib cage, or a fibre that resists hard along its line has turned. Force against
speed makes a contracting fibre resist lengthening a hundred times as hard as its particles resist
by their mass. The matrix knows that along the line it was built at. Turned by an angle t from
there, a share sin^2 t of the resistance acts across that line, where the matrix holds little more
than mass.
"""

from __future__ import annotations

import numpy as np

from sim.physics.compiled import compiled
from sim.physics.plant import Muscles
from sim.physics.types import Floats
from sim.physics.work import Known, Strings, Work

LOOSE = 0.6
"""Share of what the matrix holds across a fibre's line that may act there: twice the third that the
bound leaves, less a margin. A share is taken of what one element and its lighter particle hold, and
a particle within a fibre is held by two elements."""
AHEAD = 0.02
"""s; the matrix holds the most that a group is active, and the stiffest that a thread is at the
speed it stretches at, within this time from when it is made."""
GROWTH = 1.5
"""Over that stiffness: what the matrix holds of a thread."""
SPARE = 1.0 / 24.0
"""Of the lightest particle's mass, what a thread may stiffen by beyond that: eight threads at a
particle are a third."""
REACH = 0.002
"""m, from the rib cage, in which a particle's contact is to be in the matrix."""
MORE, LESS, SLIGHT = 4.0 / 3.0, 0.5, 0.02
"""A group's activation over that of the matrix: its fibres resist as much more or less. More leaves
the bound of a stable step, less only slows; slight ones do neither."""


@compiled
def keep_lines(
    x: Floats, muscles: Muscles, inertia: Floats, along: Floats, across: Floats, known: Known
) -> None:
    """Write the lines of all elements that move a particle, as the matrix has them.

    Parameters
    ----------
    x : (n_points, 3), m
    inertia : (n_particles,), kg
    along, across : (n_elements,), kg, what an element adds to the matrix
    known : written
    """
    bound = x.shape[0] - inertia.shape[0]
    for e in range(along.shape[0]):
        a, b = muscles.a[e], muscles.b[e]
        known.grip[e] = 0.0
        if max(a, b) < bound:
            continue
        lightest = inertia[max(a, b) - bound]
        if min(a, b) >= bound:
            lightest = min(lightest, inertia[min(a, b) - bound])
        known.grip[e] = along[e] / (lightest + across[e])
        square = 0.0
        for c in range(3):
            known.direction[e, c] = x[b, c] - x[a, c]
            square += known.direction[e, c] ** 2
        for c in range(3):
            known.direction[e, c] /= np.sqrt(max(square, 1e-12))


@compiled
def loosest(x: Floats, muscles: Muscles, known: Known) -> float:
    """Largest resistance across the line that the matrix has, over what it holds there."""
    worst = 0.0
    for e in range(known.grip.shape[0]):
        a, b = np.uintp(muscles.a[e]), np.uintp(muscles.b[e])
        dx, dy, dz = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
        direction = known.direction[e]
        dot = direction[0] * dx + direction[1] * dy + direction[2] * dz
        square = max(dx * dx + dy * dy + dz * dz, 1e-12)
        worst = max(worst, known.grip[e] * (1.0 - dot * dot / square))
    return worst


@compiled
def stiffened(strings: Strings, known: Known) -> bool:
    """Whether a thread of tissue is stiffer than the matrix bears."""
    most = 0.0
    for e in range(strings.slope.shape[0]):
        most = max(most, strings.slope[e] - known.slope[e])
    return most > 0.0


@compiled
def touched(gap: Floats, known: Known) -> bool:
    """Whether a particle is at the rib cage whose contact is not in the matrix.

    Parameters
    ----------
    gap : (n_contacts,), m
    """
    for n in range(gap.shape[0]):
        if gap[n] < REACH and not known.touching[n]:
            return True
    return False


@compiled
def differs(activation: Floats, known: Known) -> bool:
    """Whether a group resists by much more or less than the matrix has it."""
    for g in range(known.activation.shape[0]):
        level, had = activation[g], known.activation[g]
        if level > MORE * had + SLIGHT or level < LESS * had - SLIGHT:
            return True
    return False


@compiled
def too_old(muscles: Muscles, work: Work, activation: Floats) -> bool:
    """Whether the matrix is to be renewed; threads and gaps are those of the last step."""
    known = work.known
    return (
        differs(activation, known)
        or touched(work.gap, known)
        or stiffened(work.strings, known)
        or loosest(work.x, muscles, known) >= LOOSE
    )
