"""What couples particles and bodies in the step's matrix, and the solution with it.

Bodies and particles are two blocks, D1 and D2, that are factored apart. The coupling L between
them is kept as a list of threads and contacts, and the system solved is

    (D + L) D^-1 (D + L^T) = D + L + L^T + L D1^-1 L^T,

one sweep of symmetric block Gauss-Seidel. It is never smaller than the true matrix, so the step
stays stable, and larger only by what a body gives way to one particle while all others hold still.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sim.physics.compiled import compiled, inner
from sim.physics.mass import Arm, Mass
from sim.physics.plant import Plant, Tree
from sim.physics.rigid import project_wrenches
from sim.physics.types import Floats, Ints


class Coupling(NamedTuple):
    """Threads and contacts between a particle and a body, as they were at the last refresh."""

    used: Ints
    """(1,), how many there are now"""
    particle: Ints
    body: Ints
    """(n,)"""
    arm: Floats
    """(n, 3), m, the body's end from the centre that its motion is stated at"""
    mass: Floats
    """(n, 6), kg: xx, xy, xz, yy, yz, zz"""
    motion: Floats
    """(n_dof, 6), how each degree of freedom moves its bodies"""
    twist: Floats
    """(n_bodies, 6), scratch: motion of, then impulse on each body"""
    back: Floats
    """(n_dof,), scratch"""


def make_coupling(plant: Plant, n_dof: int) -> Coupling:
    """Allocate for every thread that has one end on a body, and every contact."""
    bound, n_bodies = len(plant.point_body), len(plant.tree.body_root)
    ends = [
        (threads.a >= bound) != (threads.b >= bound) for threads in (plant.muscles, plant.tissue)
    ]
    n = int(sum(mixed.sum() for mixed in ends)) + 3 * len(plant.contacts.point)
    return Coupling(
        used=np.zeros(1, dtype=np.int64),
        particle=np.zeros(n, dtype=np.int64),
        body=np.zeros(n, dtype=np.int64),
        arm=np.zeros((n, 3)),
        mass=np.zeros((n, 6)),
        motion=np.zeros((n_dof, 6)),
        twist=np.zeros((n_bodies, 6)),
        back=np.zeros(n_dof),
    )


@inner
def couple(coupling: Coupling, particle: int, body: int, r: Arm, m: Mass, k: float) -> None:
    """Note k times a mass between a particle and the point r of a body."""
    n = np.uintp(coupling.used[0])
    coupling.used[0] += 1
    coupling.particle[n], coupling.body[n] = particle, body
    for c in range(3):
        coupling.arm[n, c] = r[c]
    for c in range(6):
        coupling.mass[n, c] = k * m[c]


@compiled
def push_particles(tree: Tree, coupling: Coupling, change: Floats, soft: Floats) -> None:
    """Add to the particles' impulse what the bodies' change of velocity gives them: -L change.

    Parameters
    ----------
    change : (n_dof,), change of the bodies' velocity
    soft : (n_particles, 3), impulse, added to
    """
    twist, motion, j = coupling.twist, coupling.motion, 0
    twist[0] = 0.0
    for b in range(1, twist.shape[0]):
        twist[b] = twist[tree.body_parent[b]]
        while j < change.shape[0] and tree.dof_body[j] == b:
            for c in range(6):
                twist[b, c] += change[j] * motion[j, c]
            j += 1
    for e in range(coupling.used[0]):
        p, q = np.uintp(coupling.particle[e]), np.uintp(coupling.body[e])
        rx, ry, rz = coupling.arm[e, 0], coupling.arm[e, 1], coupling.arm[e, 2]
        wx, wy, wz = twist[q, 0], twist[q, 1], twist[q, 2]
        vx = twist[q, 3] + wy * rz - wz * ry
        vy = twist[q, 4] + wz * rx - wx * rz
        vz = twist[q, 5] + wx * ry - wy * rx
        m = coupling.mass[e]
        soft[p, 0] += m[0] * vx + m[1] * vy + m[2] * vz
        soft[p, 1] += m[1] * vx + m[3] * vy + m[4] * vz
        soft[p, 2] += m[2] * vx + m[4] * vy + m[5] * vz


@compiled
def pull_bodies(tree: Tree, coupling: Coupling, soft: Floats) -> None:
    """Write to `coupling.back` the impulse that the particles give the bodies: -L^T soft.

    Parameters
    ----------
    soft : (n_particles, 3), change of the particles' velocity
    """
    wrench = coupling.twist
    wrench[:] = 0.0
    for e in range(coupling.used[0]):
        p, q = np.uintp(coupling.particle[e]), np.uintp(coupling.body[e])
        vx, vy, vz = soft[p, 0], soft[p, 1], soft[p, 2]
        rx, ry, rz = coupling.arm[e, 0], coupling.arm[e, 1], coupling.arm[e, 2]
        m = coupling.mass[e]
        fx = m[0] * vx + m[1] * vy + m[2] * vz
        fy = m[1] * vx + m[3] * vy + m[4] * vz
        fz = m[2] * vx + m[4] * vy + m[5] * vz
        wrench[q, 0] += ry * fz - rz * fy
        wrench[q, 1] += rz * fx - rx * fz
        wrench[q, 2] += rx * fy - ry * fx
        wrench[q, 3] += fx
        wrench[q, 4] += fy
        wrench[q, 5] += fz
    project_wrenches(tree, coupling.motion, wrench, coupling.back)
