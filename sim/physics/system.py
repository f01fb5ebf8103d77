"""The implicit step: forces at the predicted place, one factorisation for many steps.

The step solves (M + h D + h^2 K) dv = h f(x + h v, v). The matrix only shapes the change of
velocity, never the forces, so a matrix that is a little old, or larger than the true one,
keeps the scheme stable and of first order; equilibria are exact. Bodies and particles are two
blocks (`assemble`), coupled (`coupling`); the two volumes, whose stiffness is felt by every point
at once, are kept as vectors and solved by the Woodbury identity.
"""

from __future__ import annotations

import numpy as np

from sim.physics.assemble import assemble
from sim.physics.blocks import Pattern, factorise, solve
from sim.physics.compiled import compiled, inner
from sim.physics.coupling import pull_bodies, push_particles
from sim.physics.dense import factorise_dense, solve_dense
from sim.physics.plant import Plant, Tree
from sim.physics.rigid import project
from sim.physics.surface import add_pressure
from sim.physics.types import Floats, Ints
from sim.physics.work import Matrix, Work


@inner
def _volume_gradient(
    plant: Plant, work: Work, faces: Ints, centre: Floats, motion: Floats, out: Floats
) -> None:
    n_dof, bound = work.tau.shape[0], plant.point_body.shape[0]
    work.f[:] = 0.0
    add_pressure(work.x, faces, 1.0, np.zeros(3), work.f)
    project(work.riders, plant.tree, work.x, work.f, centre, motion, work.wrench, out[:n_dof])
    out[n_dof:] = work.f[bound:].ravel()


@inner
def _solve_blocks(tree: Tree, pattern: Pattern, matrix: Matrix, rhs: Floats) -> None:
    """Solve the step's matrix without the two volumes in place, see `sim.physics.coupling`."""
    n_dof, n_particles = matrix.rigid.shape[0], matrix.diagonal.shape[0]
    solve_dense(matrix.rigid_inverse, rhs[:n_dof], matrix.rigid_scratch)
    soft = rhs[n_dof:].reshape((n_particles, 3))
    push_particles(tree, matrix.coupling, rhs[:n_dof], soft)
    solve(pattern, matrix.lower, matrix.inverse, soft, matrix.scratch)
    pull_bodies(tree, matrix.coupling, soft)
    solve_dense(matrix.rigid_inverse, matrix.coupling.back, matrix.rigid_scratch)
    for i in range(n_dof):
        rhs[i] += matrix.coupling.back[i]


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
    matrix, pattern = work.matrix, plant.pattern
    assemble(plant, work, step, activation, mass, locked, centre, motion)
    factorise_dense(matrix.rigid, matrix.rigid_inverse)
    factorise(pattern, matrix.diagonal, matrix.off, matrix.lower, matrix.inverse)
    _volume_gradient(plant, work, plant.abdomen_faces, centre, motion, matrix.belly)
    _volume_gradient(plant, work, plant.chest_faces, centre, motion, matrix.chest)
    matrix.belly_solved[:] = matrix.belly
    _solve_blocks(plant.tree, pattern, matrix, matrix.belly_solved)
    matrix.chest_solved[:] = matrix.chest
    _solve_blocks(plant.tree, pattern, matrix, matrix.chest_solved)


@compiled
def solve_step(
    tree: Tree, pattern: Pattern, matrix: Matrix, change: Floats,
    belly_mass: float, chest_mass: float,
) -> None:  # fmt: skip
    """Solve for the change of velocity.

    Parameters
    ----------
    change : (n_dof + 3 n_particles,), impulse, overwritten by the change of velocity
    belly_mass, chest_mass : h^2 times the stiffness of each volume
    """
    _solve_blocks(tree, pattern, matrix, change)
    a, b, p, q = matrix.belly, matrix.chest, matrix.belly_solved, matrix.chest_solved
    m00 = 1.0 + belly_mass * np.dot(a, p)
    m01 = belly_mass * np.dot(a, q)
    m10 = chest_mass * np.dot(b, p)
    m11 = 1.0 + chest_mass * np.dot(b, q)
    r0 = belly_mass * np.dot(a, change)
    r1 = chest_mass * np.dot(b, change)
    det = m00 * m11 - m01 * m10
    s0 = (r0 * m11 - r1 * m01) / det
    s1 = (m00 * r1 - m10 * r0) / det
    for i in range(change.shape[0]):
        change[i] -= s0 * p[i] + s1 * q[i]
