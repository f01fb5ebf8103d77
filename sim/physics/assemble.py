"""The step's matrix: mass, and what threads, contacts and joints add to it.

Bodies and particles are two blocks, and `sim.physics.coupling` has what lies between. What is in
the matrix and not in the forces is artificial inertia: contact that does not touch stays out.
"""

from __future__ import annotations

import numpy as np

from sim.physics.age import AHEAD, GROWTH, SPARE, keep_lines
from sim.physics.compiled import inner
from sim.physics.contact import EDGE, cross_sheet
from sim.physics.coupling import Coupling, couple
from sim.physics.forces import muscle_masses, stiffest_soon
from sim.physics.joints import add_joint_masses
from sim.physics.mass import Mass, add_mass, arm, project_masses
from sim.physics.plant import Plant, Tree
from sim.physics.types import Floats, Ints
from sim.physics.work import Work

NEAR = 0.004
"""m, gap below which contact is in the matrix; more holds back what does not touch."""
ACROSS = 0.2
"""Of its mass along the normal, what a contact adds to a particle across it."""


@inner
def _thread_mass(x: Floats, i: int, j: int, along: float, across: float) -> Mass:
    """Mass of a thread along its line and across it."""
    a, b = np.uintp(i), np.uintp(j)
    dx, dy, dz = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
    k = (along - across) / max(dx * dx + dy * dy + dz * dz, 1e-12)
    kx, ky = k * dx, k * dy
    return across + kx * dx, kx * dy, kx * dz, across + ky * dy, ky * dz, across + k * dz * dz


@inner
def _add_block(m: Mass, k: float, blocks: Floats, n: int) -> None:
    """Add k times a mass to block n of (n_blocks, 3, 3)."""
    xx, xy, xz, yy, yz, zz = m
    out = blocks[np.uintp(n)]
    out[0, 0] += k * xx
    out[0, 1] += k * xy
    out[0, 2] += k * xz
    out[1, 0] += k * xy
    out[1, 1] += k * yy
    out[1, 2] += k * yz
    out[2, 0] += k * xz
    out[2, 1] += k * yz
    out[2, 2] += k * zz


@inner
def _add_list(
    root: Ints, point_body: Ints, x: Floats, a: Ints, b: Ints, slot: Ints, along: Floats,
    across: Floats, centre: Floats, diagonal: Floats, off: Floats, pairs: Floats, joined: Floats,
    coupling: Coupling,
) -> None:  # fmt: skip
    """Add threads to the matrix.

    Parameters
    ----------
    root : (n_bodies,), body at the root of each kinematic tree
    a, b, slot : (n,), ends and matrix block
    along, across : (n,), kg; `across` is the tension's share against turning
    """
    bound = point_body.shape[0]
    for e in range(a.shape[0]):
        # The end on the later body comes first, and a particle last.
        i, j = a[e], b[e]
        if i >= bound or (j < bound and point_body[i] < point_body[j]):
            i, j = j, i
        m = _thread_mass(x, i, j, along[e], across[e])
        if i >= bound:
            _add_block(m, 1.0, diagonal, i - bound)
            _add_block(m, 1.0, diagonal, j - bound)
            _add_block(m, -1.0, off, slot[e])
            continue
        body = point_body[i]
        r = arm(x, i, centre, root[body])
        joined[body, body] = 1.0
        if j >= bound:
            _add_block(m, 1.0, diagonal, j - bound)
            add_mass(m, 1.0, r, r, pairs, body, body)
            couple(coupling, j - bound, body, r, m, 1.0)
            continue
        other = point_body[j]
        s = arm(x, j, centre, root[other])
        joined[other, other] = 1.0
        joined[body, other] = 1.0
        add_mass(m, 1.0, r, r, pairs, body, body)
        add_mass(m, 1.0, s, s, pairs, other, other)
        add_mass(m, -1.0, r, s, pairs, body, other)
        if body == other:
            add_mass(m, -1.0, s, r, pairs, body, other)


@inner
def _add_threads(plant: Plant, work: Work, step: float, activation: Floats, centre: Floats) -> None:
    tree, body, x, matrix = plant.tree, plant.point_body, work.x, work.matrix
    muscles, tissue, links = plant.muscles, plant.tissue, plant.links
    fibres, strings = work.fibres, work.strings
    square = step * step
    along = np.empty(muscles.a.shape[0])
    muscle_masses(step, muscles, plant.constants, activation, fibres, along)
    across = square * fibres.tension / fibres.length
    keep_lines(x, muscles, plant.particle_inertia, along, across, work.known)
    _add_list(
        tree.body_root, body, x, muscles.a, muscles.b, muscles.slot, along, across, centre,
        matrix.diagonal, matrix.off, matrix.pairs, matrix.joined, matrix.coupling,
    )  # fmt: skip
    spare = SPARE * plant.particle_inertia.min() / square
    slope = work.known.slope
    stiffest_soon(tissue, strings, AHEAD, slope)
    slope[:] = np.where(tissue.curve > 0.0, GROWTH, 1.0) * slope
    _add_list(
        tree.body_root, body, x, tissue.a, tissue.b, tissue.slot,
        square * slope + step * tissue.damping,
        square * np.maximum(strings.tension, 0.0) / tissue.rest, centre,
        matrix.diagonal, matrix.off, matrix.pairs, matrix.joined, matrix.coupling,
    )  # fmt: skip
    slope += spare
    # A link holds in every direction: its stiffest for all three bounds it from above.
    stiffest = square * np.maximum(links.along, links.across) + step * links.damping
    _add_list(
        tree.body_root, body, x, links.a, links.b, np.zeros_like(links.a), stiffest, stiffest,
        centre,
        matrix.diagonal, matrix.off, matrix.pairs, matrix.joined, matrix.coupling,
    )  # fmt: skip


@inner
def _add_contacts(plant: Plant, work: Work, step: float, centre: Floats) -> None:
    """Contact along its normal, and a part of it across for what the normal may turn."""
    contacts, constants, tree, matrix = plant.contacts, plant.constants, plant.tree, work.matrix
    x, bound = work.x, plant.point_body.shape[0]
    weight, normal = np.empty(3), np.empty(3)
    once = step * step * constants.contact_stiffness + step * constants.contact_damping
    work.known.touching[:] = False
    for i in range(contacts.point.shape[0]):
        p, face = contacts.point[i], contacts.face[work.held[i]]
        gap, inside = cross_sheet(
            x, contacts.face, work.held[i], p, contacts.axis, work.sheet_normal, weight, normal
        )
        if inside < -EDGE or gap > NEAR:
            continue
        work.known.touching[i] = True
        nx, ny, nz = normal[0], normal[1], normal[2]
        m = (nx * nx, nx * ny, nx * nz, ny * ny, ny * nz, nz * nz)
        _add_block(m, (1.0 - ACROSS) * once, matrix.diagonal, p - bound)
        for c in range(3):
            matrix.diagonal[p - bound, c, c] += ACROSS * once
        for k in range(3):
            body = plant.point_body[face[k]]
            r = arm(x, face[k], centre, tree.body_root[body])
            couple(matrix.coupling, p - bound, body, r, m, once * weight[k])
            for j in range(3):
                other = plant.point_body[face[j]]
                if other <= body:
                    s = arm(x, face[j], centre, tree.body_root[other])
                    share = once * weight[k] * weight[j]
                    add_mass(m, share, r, s, matrix.pairs, body, other)
                    matrix.joined[body, other] = 1.0


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
    work.known.activation[:] = activation[: len(work.known.activation)]
    matrix.diagonal[:] = 0.0
    matrix.off[:] = 0.0
    matrix.coupling.used[0] = 0
    matrix.coupling.motion[:] = motion
    for p in range(plant.particle_inertia.shape[0]):
        for c in range(3):
            matrix.diagonal[p, c, c] = plant.particle_inertia[p]
    _add_threads(plant, work, step, activation, centre)
    _add_contacts(plant, work, step, centre)
    project_masses(plant.tree, motion, matrix.pairs, matrix.joined, matrix.wrench, matrix.rigid)
    add_joint_masses(plant.joints, step, matrix.rigid)
    _add_inertia(plant.tree, mass, locked, matrix.rigid)
