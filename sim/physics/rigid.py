"""From points to bodies and joints: positions out, generalised forces in."""

from __future__ import annotations

import math

import numpy as np

from sim.physics.compiled import compiled
from sim.physics.plant import Joints, Plant
from sim.physics.types import Floats, Ints


@compiled
def place_points(plant: Plant, position: Floats, rotation: Floats, x: Floats) -> None:
    """Write the world positions of the bound points.

    Parameters
    ----------
    position, rotation : (n_bodies, 3) and (n_bodies, 9), body to world
    x : (n_points, 3), m; only the bound points are written
    """
    body, local = plant.point_body, plant.point_local
    for p in range(body.shape[0]):
        b = body[p]
        qx, qy, qz = local[p, 0], local[p, 1], local[p, 2]
        for c in range(3):
            turned = rotation[b, 3 * c] * qx + rotation[b, 3 * c + 1] * qy
            x[p, c] = position[b, c] + turned + rotation[b, 3 * c + 2] * qz


@compiled
def move_points(plant: Plant, x: Floats, spatial: Floats, centre: Floats, v: Floats) -> None:
    """Write the velocities of the bound points.

    Parameters
    ----------
    spatial : (n_bodies, 6), angular and linear velocity at the tree's centre of mass
    centre : (n_bodies, 3), centre of mass of each subtree
    """
    body, root = plant.point_body, plant.tree.body_root
    for p in range(body.shape[0]):
        b = body[p]
        o = root[b]
        rx, ry, rz = x[p, 0] - centre[o, 0], x[p, 1] - centre[o, 1], x[p, 2] - centre[o, 2]
        wx, wy, wz = spatial[b, 0], spatial[b, 1], spatial[b, 2]
        v[p, 0] = spatial[b, 3] + wy * rz - wz * ry
        v[p, 1] = spatial[b, 4] + wz * rx - wx * rz
        v[p, 2] = spatial[b, 5] + wx * ry - wy * rx


@compiled
def project(
    plant: Plant, x: Floats, f: Floats, centre: Floats, motion: Floats, wrench: Floats, out: Floats
) -> None:
    """Generalised forces of the forces on the bound points.

    Parameters
    ----------
    f : (n_points, 3), N
    motion : (n_dof, 6), how each degree of freedom moves its bodies
    wrench : (n_bodies, 6), scratch
    out : (n_dof,), written
    """
    tree, body, root = plant.tree, plant.point_body, plant.tree.body_root
    wrench[:] = 0.0
    for p in range(body.shape[0]):
        fx, fy, fz = f[p, 0], f[p, 1], f[p, 2]
        if fx == 0.0 and fy == 0.0 and fz == 0.0:
            continue
        b = body[p]
        o = root[b]
        rx, ry, rz = x[p, 0] - centre[o, 0], x[p, 1] - centre[o, 1], x[p, 2] - centre[o, 2]
        wrench[b, 0] += ry * fz - rz * fy
        wrench[b, 1] += rz * fx - rx * fz
        wrench[b, 2] += rx * fy - ry * fx
        wrench[b, 3] += fx
        wrench[b, 4] += fy
        wrench[b, 5] += fz
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
def rotation_vector(q: Floats, out: Floats) -> None:
    """Rotation vector of a unit quaternion (w, x, y, z), shorter way round."""
    sign = 1.0 if q[0] >= 0.0 else -1.0
    size = math.sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    angle = 2.0 * math.atan2(size, sign * q[0])
    scale = sign * (angle / size if size > 1e-9 else 2.0)
    out[0], out[1], out[2] = scale * q[1], scale * q[2], scale * q[3]


@compiled
def add_joints(joints: Joints, qpos: Floats, qvel: Floats, tau: Floats) -> None:
    """Add the elastic, viscous and limit torques of all joints (dilorenzo2009, Eq. 3.1).

    The elastic torque is the exact gradient of 0.5 (r - r0)^T K (r - r0), r the rotation
    vector, up to third order in the angle.
    """
    r, t = np.empty(3), np.empty(3)
    for j in range(joints.ball_dof.shape[0]):
        adr, dof = joints.ball_qpos[j], joints.ball_dof[j]
        rotation_vector(qpos[adr : adr + 4], r)
        for c in range(3):
            t[c] = 0.0
            for k in range(3):
                t[c] += joints.ball_stiffness[j, c, k] * (r[k] - joints.ball_rest[j, k])
            top, bottom = joints.ball_limit[j, c], joints.ball_limit[j, c + 3]
            if r[c] > top:
                t[c] += joints.limit_stiffness[j] * (r[c] - top)
            elif r[c] < -bottom:
                t[c] += joints.limit_stiffness[j] * (r[c] + bottom)
        # d r / dt = (1 + [r]/2 + [r][r]/12) w with w in the child's frame.
        ux = r[1] * t[2] - r[2] * t[1]
        uy = r[2] * t[0] - r[0] * t[2]
        uz = r[0] * t[1] - r[1] * t[0]
        vx = r[1] * uz - r[2] * uy
        vy = r[2] * ux - r[0] * uz
        vz = r[0] * uy - r[1] * ux
        tau[dof] -= t[0] - 0.5 * ux + vx / 12.0
        tau[dof + 1] -= t[1] - 0.5 * uy + vy / 12.0
        tau[dof + 2] -= t[2] - 0.5 * uz + vz / 12.0
        for c in range(3):
            for k in range(3):
                tau[dof + c] -= joints.ball_damping[j, c, k] * qvel[dof + k]
    for j in range(joints.hinge_dof.shape[0]):
        dof = joints.hinge_dof[j]
        bend = qpos[joints.hinge_qpos[j]] - joints.hinge_rest[j]
        tau[dof] -= joints.hinge_stiffness[j] * bend + joints.hinge_damping[j] * qvel[dof]


@compiled
def add_point_row(
    root: int,
    last: int,
    dof_parent: Ints,
    x: Floats,
    direction: Floats,
    scale: float,
    centre: Floats,
    motion: Floats,
    row: Floats,
    touched: Ints,
    count: int,
) -> int:
    """Add `scale` times the generalised force of a unit force on a point to a sparse row.

    Takes plain arrays: a call that passes the whole plant counts a reference for each of its
    arrays, which costs more than the work.

    Parameters
    ----------
    root, last : root of the body's tree and last degree of freedom that moves it
    x, direction : (3,)
    row : (n_dof,), dense row; entries listed in `touched[:count]` may be nonzero

    Returns
    -------
    the new count
    """
    rx, ry, rz = x[0] - centre[root, 0], x[1] - centre[root, 1], x[2] - centre[root, 2]
    dx, dy, dz = scale * direction[0], scale * direction[1], scale * direction[2]
    tx, ty, tz = ry * dz - rz * dy, rz * dx - rx * dz, rx * dy - ry * dx
    i = last
    while i >= 0:
        value = motion[i, 0] * tx + motion[i, 1] * ty + motion[i, 2] * tz
        value += motion[i, 3] * dx + motion[i, 4] * dy + motion[i, 5] * dz
        if row[i] == 0.0:
            touched[count] = i
            count += 1
            row[i] = 1e-300
        row[i] += value
        i = dof_parent[i]
    return count


@compiled
def add_outer(row: Floats, touched: Ints, count: int, weight: float, matrix: Floats) -> None:
    """Add `weight * row row^T` to `matrix` and clear the row."""
    for i in range(count):
        a = touched[i]
        w = weight * row[a]
        for j in range(count):
            b = touched[j]
            matrix[a, b] += w * row[b]
    for i in range(count):
        row[touched[i]] = 0.0
