"""Elastic ball joints and hinges: their torques and their share of the step's matrix."""

from __future__ import annotations

import math

import numpy as np

from sim.physics.compiled import compiled
from sim.physics.plant import Joints
from sim.physics.types import Floats


@compiled
def rotation_vector(q: Floats, out: Floats) -> None:
    """Rotation vector of a unit quaternion (w, x, y, z), shorter way round."""
    sign = 1.0 if q[0] >= 0.0 else -1.0
    size = math.sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    angle = 2.0 * math.atan2(size, sign * q[0])
    scale = sign * (angle / size if size > 1e-9 else 2.0)
    out[0], out[1], out[2] = scale * q[1], scale * q[2], scale * q[3]


@compiled
def add_joints(joints: Joints, bend: Floats, qpos: Floats, qvel: Floats, tau: Floats) -> None:
    """Add the elastic, viscous and limit torques of all joints (dilorenzo2009, Eq. 3.1).

    The elastic torque is the exact gradient of 0.5 (r - r0)^T K (r - r0), r the rotation
    vector, up to third order in the angle.

    Parameters
    ----------
    bend : (n, 3), rad, added to the slack rotation vectors of the first n ball joints
    tau : (n_dof,), N m, added to
    """
    r, t = np.empty(3), np.empty(3)
    for j in range(joints.ball_dof.shape[0]):
        adr, dof = joints.ball_qpos[j], joints.ball_dof[j]
        rotation_vector(qpos[adr : adr + 4], r)
        for c in range(3):
            t[c] = 0.0
            for k in range(3):
                rest = joints.ball_rest[j, k]
                if j < bend.shape[0]:
                    rest += bend[j, k]
                t[c] += joints.ball_stiffness[j, c, k] * (r[k] - rest)
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
def add_joint_masses(joints: Joints, step: float, matrix: Floats) -> None:
    """Add h^2 K + h D of every joint, its limits included, to the rigid block.

    Parameters
    ----------
    matrix : (n_dof, n_dof), kg or kg m^2
    """
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
