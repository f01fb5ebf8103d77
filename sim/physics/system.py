"""The implicit step: forces at the predicted place, one factorisation for many steps.

The step solves (M + h D + h^2 K) dv = h f(x + h v, v). The matrix only shapes the change of
velocity, never the forces, so a matrix that is a little old, or larger than the true one,
keeps the scheme stable and of first order; equilibria are exact. Particles that pull on
bodies enter both diagonal blocks with twice their stiffness, which bounds the coupling from
above and lets the two blocks be factored apart. The two volumes, whose stiffness is felt
by every point at once, are kept as vectors and solved by the Woodbury identity.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sim.physics.blocks import factorise, solve
from sim.physics.compiled import compiled
from sim.physics.forces import EDGE, cross_sheet, muscle_masses
from sim.physics.plant import Plant
from sim.physics.rigid import add_outer, add_point_row, project
from sim.physics.surface import add_pressure
from sim.physics.types import Floats, Ints

NEAR = 0.012
"""Gap below which contact is in the matrix: it may close before the next refresh, m."""


class Work(NamedTuple):
    """Scratch of one run."""

    x: Floats
    v: Floats
    f: Floats
    tau: Floats
    bias: Floats
    wrench: Floats
    length: Floats
    rate: Floats
    tension: Floats
    factor: Floats
    pull: Floats
    gap: Floats
    held: Ints
    diagonal: Floats
    off: Floats
    lower: Floats
    inverse: Floats
    scratch: Floats
    rigid: Floats
    """(n_dof, n_dof), inverse of the rigid block"""
    row: Floats
    touched: Ints
    belly: Floats
    chest: Floats
    """(n_dof + 3 n_particles,), gradients of the two volumes"""
    belly_solved: Floats
    chest_solved: Floats
    change: Floats
    span: Floats


def make_work(plant: Plant) -> Work:
    """Allocate the scratch of one run."""
    n_dof = len(plant.tree.dof_body)
    n_particles = len(plant.particle_inertia)
    n_points = len(plant.point_body) + n_particles
    n_elements, n_chains = len(plant.muscles.a), len(plant.muscles.chain_rest)
    n_contacts, pattern = len(plant.contacts.point), plant.pattern
    size = n_dof + 3 * n_particles
    return Work(
        x=np.zeros((n_points, 3)),
        v=np.zeros((n_points, 3)),
        f=np.zeros((n_points, 3)),
        tau=np.zeros(n_dof),
        bias=np.zeros(n_dof),
        wrench=np.zeros((len(plant.tree.body_root), 6)),
        length=np.zeros(n_elements),
        rate=np.zeros(n_elements),
        tension=np.zeros(n_elements),
        factor=np.zeros(n_chains),
        pull=np.zeros(len(plant.tissue.a)),
        gap=np.zeros(n_contacts),
        held=plant.contacts.start.copy(),
        diagonal=np.zeros((n_particles, 3, 3)),
        off=np.zeros((len(pattern.pair), 3, 3)),
        lower=np.zeros((len(pattern.row), 3, 3)),
        inverse=np.zeros((n_particles, 3, 3)),
        scratch=np.zeros((n_particles, 3)),
        rigid=np.zeros((n_dof, n_dof)),
        row=np.zeros(n_dof),
        touched=np.zeros(4 * n_dof, dtype=np.int64),
        belly=np.zeros(size),
        chest=np.zeros(size),
        belly_solved=np.zeros(size),
        chest_solved=np.zeros(size),
        change=np.zeros(size),
        span=np.zeros(n_chains),
    )


@compiled
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


@compiled
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


@compiled
def _add_list(
    plant: Plant, work: Work, a: Ints, b: Ints, slot: Ints, along: Floats, across: Floats,
    centre: Floats, motion: Floats,
) -> None:  # fmt: skip
    """Add threads to the matrix.

    Parameters
    ----------
    a, b, slot : (n,), ends and matrix block
    along, across : (n,), kg; `across` is the tension's share against turning
    """
    tree = plant.tree
    x, diagonal, off, matrix = work.x, work.diagonal, work.off, work.rigid
    row, touched, point_body = work.row, work.touched, plant.point_body
    root, last, parent = tree.body_root, tree.body_last_dof, tree.dof_parent
    bound = point_body.shape[0]
    axes = np.empty((3, 3))
    for e in range(a.shape[0]):
        i, j = a[e], b[e]
        if i >= bound or j >= bound:
            _soft_thread(x, i, j, bound, along[e], across[e], diagonal, off, slot[e])
            if i >= bound and j >= bound:
                continue
        _axes(x, i, j, axes)
        one = i >= bound or j >= bound
        for k in range(1 if one else 3):
            mass = along[e] if k == 0 else across[e]
            if mass == 0.0:
                continue
            count = 0
            for end in range(2):
                p = i if end == 0 else j
                if p >= bound:
                    continue
                body = point_body[p]
                sign = 1.0 if end == 0 else -1.0
                count = add_point_row(
                    root[body], last[body], parent, x[p], axes[k], sign, centre, motion,
                    row, touched, count,
                )  # fmt: skip
            add_outer(row, touched, count, 2.0 * mass if one else mass, matrix)


@compiled
def _add_threads(
    plant: Plant, work: Work, step: float, activation: Floats, centre: Floats, motion: Floats
) -> None:
    muscles, tissue, links = plant.muscles, plant.tissue, plant.links
    work.span[:] = 0.0
    for e in range(muscles.a.shape[0]):
        work.span[muscles.chain[e]] += work.length[e]
    square = step * step
    along = np.empty(muscles.a.shape[0])
    muscle_masses(step, muscles, plant.constants, activation, work.length, work.span, along)
    _add_list(
        plant, work, muscles.a, muscles.b, muscles.slot, along,
        square * work.tension / work.length, centre, motion,
    )  # fmt: skip
    _add_list(
        plant, work, tissue.a, tissue.b, tissue.slot,
        square * tissue.stiffness + step * tissue.damping,
        square * work.pull / tissue.rest, centre, motion,
    )  # fmt: skip
    # A link holds in every direction: its stiffest for all three bounds it from above.
    stiffest = square * np.maximum(links.along, links.across) + step * links.damping
    _add_list(
        plant, work, links.a, links.b, np.zeros_like(links.a), stiffest, stiffest, centre, motion
    )


@compiled
def _add_contacts(plant: Plant, work: Work, step: float, centre: Floats, motion: Floats) -> None:
    """Contact in every direction of the particle: it may pass to another face at any step."""
    contacts, constants, tree = plant.contacts, plant.constants, plant.tree
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
            work.diagonal[p - bound, c, c] += mass
        count = 0
        for k in range(3):
            body = plant.point_body[face[k]]
            count = add_point_row(
                tree.body_root[body], tree.body_last_dof[body], tree.dof_parent,
                work.x[face[k]], normal, weight[k], centre, motion, work.row, work.touched, count,
            )  # fmt: skip
        add_outer(work.row, work.touched, count, mass, work.rigid)


@compiled
def _add_joints(plant: Plant, step: float, matrix: Floats) -> None:
    joints = plant.joints
    for j in range(joints.ball_dof.shape[0]):
        dof = joints.ball_dof[j]
        for r in range(3):
            for c in range(3):
                matrix[dof + r, dof + c] += (
                    step * step * joints.ball_stiffness[j, r, c]
                    + step * joints.ball_damping[j, r, c]
                )
            matrix[dof + r, dof + r] += step * step * joints.limit_stiffness[j]
    for j in range(joints.hinge_dof.shape[0]):
        dof = joints.hinge_dof[j]
        matrix[dof, dof] += step * step * joints.hinge_stiffness[j] + step * joints.hinge_damping[j]


@compiled
def _volume_gradient(
    plant: Plant, work: Work, faces: Ints, centre: Floats, motion: Floats, out: Floats
) -> None:
    n_dof, bound = plant.tree.dof_body.shape[0], plant.point_body.shape[0]
    work.f[:] = 0.0
    add_pressure(work.x, faces, 1.0, np.zeros(3), work.f)
    project(plant, work.x, work.f, centre, motion, work.wrench, out[:n_dof])
    for p in range(plant.particle_inertia.shape[0]):
        for c in range(3):
            out[n_dof + 3 * p + c] = work.f[bound + p, c]


@compiled
def solve_blocks(plant: Plant, work: Work, rhs: Floats) -> None:
    """Solve the block-diagonal part of the step's matrix in place."""
    n_dof = plant.tree.dof_body.shape[0]
    rhs[:n_dof] = np.dot(work.rigid, rhs[:n_dof].copy())
    soft = rhs[n_dof:].reshape((plant.particle_inertia.shape[0], 3))
    solve(plant.pattern, work.lower, work.inverse, soft, work.scratch)


@compiled
def refresh(
    plant: Plant,
    work: Work,
    step: float,
    activation: Floats,
    mass: Floats,
    locked: Floats,
    centre: Floats,
    motion: Floats,
) -> None:
    """Build and factor the step's matrix at the present state; `work.f` is overwritten.

    Parameters
    ----------
    mass : entries of the joint-space inertia, lower triangle by rows
    locked : (n_dof,), mass added to a degree of freedom that must not move
    centre, motion : of the engine of rigid bodies
    """
    tree, n_dof = plant.tree, plant.tree.dof_body.shape[0]
    work.rigid[:] = 0.0
    work.diagonal[:] = 0.0
    work.off[:] = 0.0
    for p in range(plant.particle_inertia.shape[0]):
        for c in range(3):
            work.diagonal[p, c, c] = plant.particle_inertia[p]
    _add_threads(plant, work, step, activation, centre, motion)
    _add_contacts(plant, work, step, centre, motion)
    _add_joints(plant, step, work.rigid)
    for i in range(n_dof):
        for k in range(tree.m_start[i], tree.m_start[i] + tree.m_count[i]):
            j = tree.m_column[k]
            work.rigid[i, j] += mass[k]
            if i != j:
                work.rigid[j, i] += mass[k]
        work.rigid[i, i] += locked[i]
    work.rigid[:] = np.linalg.inv(work.rigid)
    factorise(plant.pattern, work.diagonal, work.off, work.lower, work.inverse)
    _volume_gradient(plant, work, plant.abdomen_faces, centre, motion, work.belly)
    _volume_gradient(plant, work, plant.chest_faces, centre, motion, work.chest)
    work.belly_solved[:] = work.belly
    solve_blocks(plant, work, work.belly_solved)
    work.chest_solved[:] = work.chest
    solve_blocks(plant, work, work.chest_solved)


@compiled
def solve_step(plant: Plant, work: Work, belly_mass: float, chest_mass: float) -> None:
    """Solve for the change of velocity; `work.change` holds the impulse and is overwritten.

    Parameters
    ----------
    belly_mass, chest_mass : h^2 times the stiffness of each volume
    """
    solve_blocks(plant, work, work.change)
    a, b, p, q = work.belly, work.chest, work.belly_solved, work.chest_solved
    m00 = 1.0 + belly_mass * np.dot(a, p)
    m01 = belly_mass * np.dot(a, q)
    m10 = chest_mass * np.dot(b, p)
    m11 = 1.0 + chest_mass * np.dot(b, q)
    r0 = belly_mass * np.dot(a, work.change)
    r1 = chest_mass * np.dot(b, work.change)
    det = m00 * m11 - m01 * m10
    s0 = (r0 * m11 - r1 * m01) / det
    s1 = (m00 * r1 - m10 * r0) / det
    for i in range(work.change.shape[0]):
        work.change[i] -= s0 * p[i] + s1 * q[i]
