"""From points to bodies: positions and velocities out, generalised forces in."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sim.physics.compiled import compiled, inner
from sim.physics.plant import Tree
from sim.physics.types import Floats, Ints


class Riders(NamedTuple):
    """The points that ride on each body, body by body, so that a body is read once."""

    point: Ints
    """(n_bound,), points in the order of their bodies"""
    start: Ints
    """(n_bodies + 1,), where each body's points begin"""


def find_riders(point_body: Ints, n_bodies: int) -> Riders:
    """Sort the bound points by body; `point_body` (n_bound,)."""
    point = np.argsort(point_body, kind="stable")
    start = np.searchsorted(point_body[point], np.arange(n_bodies + 1))
    return Riders(point=point.astype(np.int64), start=start.astype(np.int64))


@compiled
def place_points(
    riders: Riders, local: Floats, position: Floats, rotation: Floats, x: Floats
) -> None:
    """Write the world positions of the bound points.

    Parameters
    ----------
    local : (n_bound, 3), m, in the frame of the body
    position, rotation : (n_bodies, 3) and (n_bodies, 9), body to world
    x : (n_points, 3), m; only the bound points are written
    """
    for b in range(position.shape[0]):
        r, px, py, pz = rotation[b], position[b, 0], position[b, 1], position[b, 2]
        r0, r1, r2, r3, r4, r5, r6, r7, r8 = r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8]
        for k in range(riders.start[b], riders.start[b + 1]):
            p = np.uintp(riders.point[k])
            qx, qy, qz = local[p, 0], local[p, 1], local[p, 2]
            x[p, 0] = px + r0 * qx + r1 * qy + r2 * qz
            x[p, 1] = py + r3 * qx + r4 * qy + r5 * qz
            x[p, 2] = pz + r6 * qx + r7 * qy + r8 * qz


@compiled
def move_points(
    riders: Riders, root: Ints, x: Floats, spatial: Floats, centre: Floats, v: Floats
) -> None:
    """Write the velocities of the bound points.

    Parameters
    ----------
    root : (n_bodies,), body at the root of each kinematic tree
    spatial : (n_bodies, 6), angular and linear velocity at the tree's centre of mass
    centre : (n_bodies, 3), centre of mass of each subtree
    """
    for b in range(root.shape[0]):
        ox, oy, oz = centre[root[b], 0], centre[root[b], 1], centre[root[b], 2]
        wx, wy, wz = spatial[b, 0], spatial[b, 1], spatial[b, 2]
        ux, uy, uz = spatial[b, 3], spatial[b, 4], spatial[b, 5]
        for k in range(riders.start[b], riders.start[b + 1]):
            p = np.uintp(riders.point[k])
            rx, ry, rz = x[p, 0] - ox, x[p, 1] - oy, x[p, 2] - oz
            v[p, 0] = ux + wy * rz - wz * ry
            v[p, 1] = uy + wz * rx - wx * rz
            v[p, 2] = uz + wx * ry - wy * rx


@inner
def _gather_wrenches(
    riders: Riders, root: Ints, x: Floats, f: Floats, centre: Floats, wrench: Floats
) -> None:
    """Moment about the tree's centre of mass, and force, of the points of each body."""
    for b in range(root.shape[0]):
        ox, oy, oz = centre[root[b], 0], centre[root[b], 1], centre[root[b], 2]
        tx, ty, tz, sx, sy, sz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(riders.start[b], riders.start[b + 1]):
            p = np.uintp(riders.point[k])
            fx, fy, fz = f[p, 0], f[p, 1], f[p, 2]
            rx, ry, rz = x[p, 0] - ox, x[p, 1] - oy, x[p, 2] - oz
            tx += ry * fz - rz * fy
            ty += rz * fx - rx * fz
            tz += rx * fy - ry * fx
            sx += fx
            sy += fy
            sz += fz
        wrench[b, 0], wrench[b, 1], wrench[b, 2] = tx, ty, tz
        wrench[b, 3], wrench[b, 4], wrench[b, 5] = sx, sy, sz


@inner
def project_wrenches(tree: Tree, motion: Floats, wrench: Floats, out: Floats) -> None:
    """Generalised forces of the wrenches on the bodies.

    Parameters
    ----------
    motion : (n_dof, 6), how each degree of freedom moves its bodies
    wrench : (n_bodies, 6), on each body alone; overwritten by that on all that it carries
    out : (n_dof,), written
    """
    for b in range(wrench.shape[0] - 1, 0, -1):
        parent = tree.body_parent[b]
        if parent > 0:
            for c in range(6):
                wrench[parent, c] += wrench[b, c]
    for i in range(out.shape[0]):
        b = tree.dof_body[i]
        out[i] = 0.0
        for c in range(6):
            out[i] += motion[i, c] * wrench[b, c]


@compiled
def project(
    riders: Riders,
    tree: Tree,
    x: Floats,
    f: Floats,
    centre: Floats,
    motion: Floats,
    wrench: Floats,
    out: Floats,
) -> None:
    """Generalised forces of the forces on the bound points.

    Parameters
    ----------
    f : (n_points, 3), N
    motion : (n_dof, 6), how each degree of freedom moves its bodies
    wrench : (n_bodies, 6), scratch
    out : (n_dof,), written
    """
    _gather_wrenches(riders, tree.body_root, x, f, centre, wrench)
    project_wrenches(tree, motion, wrench, out)
