"""The zone of apposition: the rim of the diaphragm slides on the inside of the rib cage."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from sim.physics.compiled import compiled, inner
from sim.physics.plant import Constants, Contacts
from sim.physics.surface import add_pressure
from sim.physics.types import Floats, Ints

EDGE = 0.25
"""How far past its edge a face is still felt, as a barycentric weight."""
FOLD = 0.002
"""m; a face that a particle is past by so much more than by its present one is another layer: as
the ray sees it, the sheet is folded where a rib moves in front of the next. In touch with its layer
a particle keeps to it; out of touch it takes the other, which brings it back little by little."""
LEAST_SLOPE = -0.05
"""Cosine between ray and normal beyond which a face is edge-on and not seen."""

Crossing: TypeAlias = tuple[float, float, float, float, float, float]
"""How far past the face, m; least weight; weights of the second and third corner; X, Y of the
ray's direction."""


@inner
def _look(x: Floats, faces: Ints, g: int, p: int, axis: float) -> Crossing:
    """Crossing of a face, by value and without a branch: a caller pays only for what it uses."""
    i, j, k = np.uintp(faces[g, 0]), np.uintp(faces[g, 1]), np.uintp(faces[g, 2])
    forward = x[p, 0] - axis
    radius = max(math.sqrt(forward**2 + x[p, 1] ** 2), 1e-6)
    dx, dy = forward / radius, x[p, 1] / radius
    ux, uy, uz = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
    wx, wy, wz = x[k, 0] - x[i, 0], x[k, 1] - x[i, 1], x[k, 2] - x[i, 2]
    nx, ny, nz = wy * uz - wz * uy, wz * ux - wx * uz, wx * uy - wy * ux
    square = max(nx * nx + ny * ny + nz * nz, 1e-24)
    fall = nx * dx + ny * dy
    ox, oy, oz = axis - x[i, 0], -x[i, 1], x[p, 2] - x[i, 2]
    reach = -(nx * ox + ny * oy + nz * oz) / fall
    qx, qy, qz = ox + reach * dx, oy + reach * dy, oz
    s = (nx * (qz * wy - qy * wz) + ny * (qx * wz - qz * wx) + nz * (qy * wx - qx * wy)) / square
    t = (nx * (uz * qy - uy * qz) + ny * (ux * qz - uz * qx) + nz * (uy * qx - ux * qy)) / square
    seen = fall <= LEAST_SLOPE * math.sqrt(square) and reach > 0.0
    return radius - reach, min(1.0 - s - t, min(s, t)) if seen else -1e9, s, t, dx, dy


@compiled
def turn_sheet(x: Floats, faces: Ints, corners: Ints, normals: Floats) -> None:
    """Write the unit normals of the sheet's corners, into the chest: of the faces' mean by area.

    A face has one normal all over; a particle in the crease between two would be thrown from the
    one to the other. Between the corners' normals there is no crease.

    Parameters
    ----------
    faces, corners : (n_faces, 3) and (n_corners,), points of the sheet
    normals : (n_points, 3), written at the corners
    """
    for p in corners:
        normals[p] = 0.0
    add_pressure(x, faces, -1.0, np.zeros(3), normals)
    for p in corners:
        n = normals[p]
        size = max(math.sqrt(n[0] ** 2 + n[1] ** 2 + n[2] ** 2), 1e-12)
        for d in range(3):
            n[d] /= size


@inner
def _face_normal(
    normals: Floats, faces: Ints, g: int, s: float, t: float
) -> tuple[float, float, float]:
    """Unit normal between those of a face's corners, at the weights s and t of the last two."""
    i, j, k = np.uintp(faces[g, 0]), np.uintp(faces[g, 1]), np.uintp(faces[g, 2])
    r = 1.0 - s - t
    nx = r * normals[i, 0] + s * normals[j, 0] + t * normals[k, 0]
    ny = r * normals[i, 1] + s * normals[j, 1] + t * normals[k, 1]
    nz = r * normals[i, 2] + s * normals[j, 2] + t * normals[k, 2]
    size = max(math.sqrt(nx * nx + ny * ny + nz * nz), 1e-12)
    return nx / size, ny / size, nz / size


@compiled
def cross_sheet(
    x: Floats, faces: Ints, g: int, p: int, axis: float, normals: Floats,
    weight: Floats, normal: Floats,
) -> tuple[float, float]:  # fmt: skip
    """Where the horizontal ray from the torso's axis through point `p` crosses a face.

    The rib cage is seen from its axis once in every direction, so the radial gap is continuous
    from face to face, which a distance to the nearest face is not.

    Parameters
    ----------
    faces, g : faces of the sheet and the one looked at
    axis : m, X of the vertical axis
    normals : (n_points, 3), of `turn_sheet`
    weight : (3,), barycentric weights of the crossing, written
    normal : (3,), unit normal of the sheet there, into the chest, written

    Returns
    -------
    gap along the normal, m, positive inside the chest, 1 where the face is not seen; least weight
    (negative outside the face)
    """
    past, inside, s, t, dx, dy = _look(x, faces, g, p, axis)
    nx, ny, nz = _face_normal(normals, faces, g, s, t)
    weight[0], weight[1], weight[2] = 1.0 - s - t, s, t
    normal[0], normal[1], normal[2] = nx, ny, nz
    return past * min(nx * dx + ny * dy, LEAST_SLOPE) if inside > -1e8 else 1.0, inside


@compiled
def follow_sheet(
    x: Floats, contacts: Contacts, held: Ints, ease: Floats, more: float, normals: Floats
) -> None:
    """Let each diaphragm particle walk to the face that its ray crosses.

    Parameters
    ----------
    held : (n_contacts,), index of the present face, updated
    ease : (n_contacts,), share of its push that a contact has, updated: it begins at nothing where
        a particle finds itself behind another layer
    more : what the share grows by
    normals : (n_points, 3), as `turn_sheet` writes it
    """
    turn_sheet(x, contacts.face, contacts.corner, normals)
    for i in range(contacts.point.shape[0]):
        p = contacts.point[i]
        here, best = _look(x, contacts.face, held[i], p, contacts.axis)[:2]
        ease[i] = min(1.0, ease[i] + more)
        moved = best < 0.0
        while moved:
            moved = False
            for g in contacts.neighbour[held[i]]:
                if g < 0:
                    break
                past, inside = _look(x, contacts.face, g, p, contacts.axis)[:2]
                behind = past > FOLD + (max(here, 0.0) if best >= -EDGE else 0.0)
                if inside > best + 1e-9 and not (behind and best >= -EDGE):
                    best, here, held[i], moved = inside, past, g, True
                    if behind:
                        ease[i] = 0.0


@compiled
def add_contacts(
    x: Floats,
    v: Floats,
    contacts: Contacts,
    constants: Constants,
    held: Ints,
    ease: Floats,
    normals: Floats,
    gap: Floats,
    f: Floats,
) -> None:
    """Add the normal force between the apposed diaphragm and the rib cage, free of friction.

    Parameters
    ----------
    held : (n_contacts,), face beside each particle
    ease : (n_contacts,), share of its push that a contact has
    normals : (n_points, 3), of `turn_sheet`
    gap : (n_contacts,), m, written; 1 where there is no face
    """
    faces = contacts.face
    for n in range(contacts.point.shape[0]):
        p, h = contacts.point[n], held[n]
        past, inside, s, t, dx, dy = _look(x, faces, h, p, contacts.axis)
        gap[n] = 1.0
        if inside < -EDGE:
            continue
        nx, ny, nz = _face_normal(normals, faces, h, s, t)
        gap[n] = past * min(nx * dx + ny * dy, LEAST_SLOPE)
        depth = min(constants.contact_gap - gap[n], 3.0 * constants.contact_gap)
        if depth <= 0.0:
            continue
        i, j, k = np.uintp(faces[h, 0]), np.uintp(faces[h, 1]), np.uintp(faces[h, 2])
        r = 1.0 - s - t
        vx = v[p, 0] - r * v[i, 0] - s * v[j, 0] - t * v[k, 0]
        vy = v[p, 1] - r * v[i, 1] - s * v[j, 1] - t * v[k, 1]
        vz = v[p, 2] - r * v[i, 2] - s * v[j, 2] - t * v[k, 2]
        closing = -(vx * nx + vy * ny + vz * nz)
        # Past its edge a face lets go little by little, so that no particle is dropped at once.
        hold = ease[n] * min(1.0, 1.0 + inside / EDGE)
        # Stiffness and damping grow from nothing over the first part: no chatter at the touch.
        part = min(depth, constants.contact_gap)
        touch = part * part / (2.0 * constants.contact_gap) + depth - part
        damping = constants.contact_damping * part / constants.contact_gap
        push = hold * (constants.contact_stiffness * touch + damping * closing)
        if push <= 0.0:
            continue
        px, py, pz = push * nx, push * ny, push * nz
        f[p, 0] += px
        f[p, 1] += py
        f[p, 2] += pz
        for q, share in ((i, r), (j, s), (k, t)):
            f[q, 0] -= share * px
            f[q, 1] -= share * py
            f[q, 2] -= share * pz
