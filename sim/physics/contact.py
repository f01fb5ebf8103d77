"""The zone of apposition: the rim of the diaphragm slides on the inside of the rib cage."""

from __future__ import annotations

import math

import numpy as np

from sim.physics.compiled import compiled
from sim.physics.plant import Constants, Contacts
from sim.physics.types import Floats, Ints

EDGE = 0.25
"""How far past its edge a face is still felt, as a barycentric weight."""


@compiled
def cross_sheet(
    x: Floats, faces: Ints, g: int, p: int, axis: float, weight: Floats, normal: Floats
) -> tuple[float, float]:
    """Where the horizontal ray from the torso's axis through point `p` crosses a face.

    The rib cage is seen from its axis once in every direction, so the radial gap is continuous
    from face to face, which a distance to the nearest face is not.

    Parameters
    ----------
    faces, g : faces of the sheet and the one looked at
    axis : m, X of the vertical axis
    weight : (3,), barycentric weights of the crossing, written
    normal : (3,), unit normal of the face, into the chest, written

    Returns
    -------
    gap along the normal, m, positive inside the chest; least weight (negative outside the face)
    """
    i, j, k = np.uintp(faces[g, 0]), np.uintp(faces[g, 1]), np.uintp(faces[g, 2])
    forward = x[p, 0] - axis
    radius = max(math.sqrt(forward**2 + x[p, 1] ** 2), 1e-6)
    dx, dy = forward / radius, x[p, 1] / radius
    ux, uy, uz = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
    wx, wy, wz = x[k, 0] - x[i, 0], x[k, 1] - x[i, 1], x[k, 2] - x[i, 2]
    nx, ny, nz = wy * uz - wz * uy, wz * ux - wx * uz, wx * uy - wy * ux
    size = max(math.sqrt(nx * nx + ny * ny + nz * nz), 1e-12)
    slope = (nx * dx + ny * dy) / size
    if slope > -0.05:
        return 1.0, -1e9
    ox, oy, oz = axis - x[i, 0], -x[i, 1], x[p, 2] - x[i, 2]
    reach = -(nx * ox + ny * oy + nz * oz) / (nx * dx + ny * dy)
    qx, qy, qz = ox + reach * dx, oy + reach * dy, oz
    s = (nx * (qz * wy - qy * wz) + ny * (qx * wz - qz * wx) + nz * (qy * wx - qx * wy)) / size**2
    t = (nx * (uz * qy - uy * qz) + ny * (ux * qz - uz * qx) + nz * (uy * qx - ux * qy)) / size**2
    weight[0], weight[1], weight[2] = 1.0 - s - t, s, t
    shrink = 1.0 / size
    normal[0], normal[1], normal[2] = shrink * nx, shrink * ny, shrink * nz
    return (radius - reach) * slope, min(1.0 - s - t, min(s, t))


@compiled
def follow_sheet(x: Floats, contacts: Contacts, held: Ints) -> None:
    """Let each diaphragm particle walk to the face that its ray crosses.

    Parameters
    ----------
    held : (n_contacts,), index of the present face, updated
    """
    weight, normal = np.empty(3), np.empty(3)
    for i in range(contacts.point.shape[0]):
        p = contacts.point[i]
        _, best = cross_sheet(x, contacts.face, held[i], p, contacts.axis, weight, normal)
        moved = best < 0.0
        while moved:
            moved = False
            for g in contacts.neighbour[held[i]]:
                if g < 0:
                    break
                _, inside = cross_sheet(x, contacts.face, g, p, contacts.axis, weight, normal)
                if inside > best + 1e-9:
                    best, held[i], moved = inside, g, True


@compiled
def add_contacts(
    x: Floats,
    v: Floats,
    contacts: Contacts,
    constants: Constants,
    held: Ints,
    gap: Floats,
    f: Floats,
) -> None:
    """Add the normal force between the apposed diaphragm and the rib cage, free of friction.

    Parameters
    ----------
    held : (n_contacts,), face beside each particle
    gap : (n_contacts,), m, written; 1 where there is no face
    """
    weight, normal = np.empty(3), np.empty(3)
    for i in range(contacts.point.shape[0]):
        p = contacts.point[i]
        gap[i], inside = cross_sheet(x, contacts.face, held[i], p, contacts.axis, weight, normal)
        if inside < -EDGE:
            gap[i] = 1.0
        depth = min(constants.contact_gap - gap[i], 3.0 * constants.contact_gap)
        if depth <= 0.0:
            continue
        face = contacts.face[held[i]]
        closing = 0.0
        for c in range(3):
            speed = v[p, c]
            for k in range(3):
                speed -= weight[k] * v[np.uintp(face[k]), c]
            closing -= speed * normal[c]
        # Past its edge a face lets go little by little, so that no particle is dropped at once.
        hold = min(1.0, 1.0 + inside / EDGE)
        push = hold * (constants.contact_stiffness * depth + constants.contact_damping * closing)
        if push <= 0.0:
            continue
        for c in range(3):
            f[p, c] += push * normal[c]
            for k in range(3):
                f[np.uintp(face[k]), c] -= weight[k] * push * normal[c]
