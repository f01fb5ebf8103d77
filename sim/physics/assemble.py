"""The step's matrix: mass, and what threads, contacts and joints add to it.

Particles that pull on bodies enter both diagonal blocks with twice their stiffness, which bounds
the coupling from above and lets the two blocks be factored apart.
"""

from __future__ import annotations

import numpy as np

from sim.physics.compiled import inner
from sim.physics.contact import EDGE, cross_sheet
from sim.physics.forces import muscle_masses
from sim.physics.joints import add_joint_masses
from sim.physics.plant import Plant, Tree
from sim.physics.rows import add_outer, add_point_row, mirror
from sim.physics.types import Floats, Ints
from sim.physics.work import Matrix, Work

NEAR = 0.012
"""Gap below which contact is in the matrix: it may close before the next refresh, m."""


@inner
def _soft_thread(
    x: Floats, a: int, b: int, bound: int, along: float, across: float, diagonal: Floats,
    off: Floats, slot: int,
) -> None:  # fmt: skip
    """Add a thread to the blocks of its particles; twice if its other end is on a body."""
    both = a >= bound and b >= bound
    dx, dy, dz = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
    length = max((dx * dx + dy * dy + dz * dz) ** 0.5, 1e-6)
    d = (dx / length, dy / length, dz / length)
    scale = 1.0 if both else 2.0
    for r in range(3):
        for c in range(3):
            k = scale * ((along - across) * d[r] * d[c] + (across if r == c else 0.0))
            if a >= bound:
                diagonal[a - bound, r, c] += k
            if b >= bound:
                diagonal[b - bound, r, c] += k
            if both:
                off[slot, r, c] -= k


@inner
def _axes(x: Floats, a: int, b: int, out: Floats) -> None:
    """Rows: the line from a to b and two directions across it."""
    size = 0.0
    for c in range(3):
        out[0, c] = x[b, c] - x[a, c]
        size += out[0, c] ** 2
    if size < 1e-18:
        out[0, 0], out[0, 1], out[0, 2], size = 1.0, 0.0, 0.0, 1.0
    low = 0
    for c in range(3):
        out[0, c] /= size**0.5
        if abs(out[0, c]) < abs(out[0, low]):
            low = c
    size = 0.0
    for c in range(3):
        out[1, c] = (1.0 if c == low else 0.0) - out[0, low] * out[0, c]
        size += out[1, c] ** 2
    for c in range(3):
        out[1, c] /= size**0.5
    out[2, 0] = out[0, 1] * out[1, 2] - out[0, 2] * out[1, 1]
    out[2, 1] = out[0, 2] * out[1, 0] - out[0, 0] * out[1, 2]
    out[2, 2] = out[0, 0] * out[1, 1] - out[0, 1] * out[1, 0]


@inner
def _rigid_thread(
    tree: Tree, point_body: Ints, x: Floats, i: int, j: int, axis: Floats, mass: float,
    centre: Floats, motion: Floats, matrix: Matrix,
) -> None:  # fmt: skip
    """Add a mass along one axis of a thread to the bodies at its ends; others are particles."""
    count = 0
    for p, sign in ((i, 1.0), (j, -1.0)):
        if p < point_body.shape[0]:
            body = point_body[p]
            count = add_point_row(
                tree.body_root[body], tree.body_last_dof[body], tree.dof_parent, x[p], axis, sign,
                centre, motion, matrix.row, matrix.touched, count,
            )  # fmt: skip
    add_outer(matrix.row, matrix.touched, count, mass, matrix.rigid)


@inner
def _add_list(
    tree: Tree, point_body: Ints, x: Floats, a: Ints, b: Ints, slot: Ints, along: Floats,
    across: Floats, centre: Floats, motion: Floats, matrix: Matrix,
) -> None:  # fmt: skip
    """Add threads to the matrix.

    Parameters
    ----------
    a, b, slot : (n,), ends and matrix block
    along, across : (n,), kg; `across` is the tension's share against turning
    """
    bound = point_body.shape[0]
    axes = np.empty((3, 3))
    for e in range(a.shape[0]):
        i, j = a[e], b[e]
        one = i >= bound or j >= bound
        if one:
            _soft_thread(x, i, j, bound, along[e], across[e], matrix.diagonal, matrix.off, slot[e])
            if i >= bound and j >= bound:
                continue
        _axes(x, i, j, axes)
        for k in range(1 if one else 3):
            mass = along[e] if k == 0 else across[e]
            if mass != 0.0:
                _rigid_thread(
                    tree, point_body, x, i, j, axes[k], 2.0 * mass if one else mass,
                    centre, motion, matrix,
                )  # fmt: skip


GROWTH = 1.5
"""Over a thread's stiffness at a refresh: what it may stiffen until the next."""


@inner
def _add_threads(
    plant: Plant, work: Work, step: float, activation: Floats, centre: Floats, motion: Floats
) -> None:
    tree, body, x, matrix = plant.tree, plant.point_body, work.x, work.matrix
    muscles, tissue, links = plant.muscles, plant.tissue, plant.links
    fibres, strings = work.fibres, work.strings
    square = step * step
    along = np.empty(muscles.a.shape[0])
    muscle_masses(step, muscles, plant.constants, activation, fibres, along)
    _add_list(
        tree, body, x, muscles.a, muscles.b, muscles.slot, along,
        square * fibres.tension / fibres.length, centre, motion, matrix,
    )  # fmt: skip
    _add_list(
        tree, body, x, tissue.a, tissue.b, tissue.slot,
        square * np.where(tissue.curve > 0.0, GROWTH, 1.0) * strings.slope + step * tissue.damping,
        square * np.maximum(strings.tension, 0.0) / tissue.rest, centre, motion, matrix,
    )  # fmt: skip
    # A link holds in every direction: its stiffest for all three bounds it from above.
    stiffest = square * np.maximum(links.along, links.across) + step * links.damping
    _add_list(
        tree, body, x, links.a, links.b, np.zeros_like(links.a), stiffest, stiffest,
        centre, motion, matrix,
    )  # fmt: skip


@inner
def _add_contacts(plant: Plant, work: Work, step: float, centre: Floats, motion: Floats) -> None:
    """Contact in every direction of the particle: it may pass to another face at any step."""
    contacts, constants, tree, matrix = plant.contacts, plant.constants, plant.tree, work.matrix
    bound = plant.point_body.shape[0]
    weight, normal = np.empty(3), np.empty(3)
    mass = 2.0 * (step * step * constants.contact_stiffness + step * constants.contact_damping)
    for i in range(contacts.point.shape[0]):
        p, face = contacts.point[i], contacts.face[work.held[i]]
        gap, inside = cross_sheet(
            work.x, contacts.face, work.held[i], p, contacts.axis, weight, normal
        )
        if inside < -EDGE or gap > NEAR:
            continue
        for c in range(3):
            matrix.diagonal[p - bound, c, c] += mass
        count = 0
        for k in range(3):
            body = plant.point_body[face[k]]
            count = add_point_row(
                tree.body_root[body], tree.body_last_dof[body], tree.dof_parent, work.x[face[k]],
                normal, weight[k], centre, motion, matrix.row, matrix.touched, count,
            )  # fmt: skip
        add_outer(matrix.row, matrix.touched, count, mass, matrix.rigid)


@inner
def _add_inertia(tree: Tree, mass: Floats, locked: Floats, matrix: Floats) -> None:
    """Joint-space inertia, and what holds a degree of freedom in place."""
    for i in range(locked.shape[0]):
        for k in range(tree.m_start[i], tree.m_start[i] + tree.m_count[i]):
            j = tree.m_column[k]
            matrix[i, j] += mass[k]
            if i != j:
                matrix[j, i] += mass[k]
        matrix[i, i] += locked[i]


@inner
def assemble(
    plant: Plant, work: Work, step: float, activation: Floats, mass: Floats, locked: Floats,
    centre: Floats, motion: Floats,
) -> None:  # fmt: skip
    """Write both diagonal blocks of the step's matrix; parameters as in `refresh`."""
    matrix = work.matrix
    matrix.rigid[:] = 0.0
    matrix.diagonal[:] = 0.0
    matrix.off[:] = 0.0
    for p in range(plant.particle_inertia.shape[0]):
        for c in range(3):
            matrix.diagonal[p, c, c] = plant.particle_inertia[p]
    _add_threads(plant, work, step, activation, centre, motion)
    _add_contacts(plant, work, step, centre, motion)
    mirror(matrix.rigid)
    add_joint_masses(plant.joints, step, matrix.rigid)
    _add_inertia(plant.tree, mass, locked, matrix.rigid)
