"""Forces of muscles, tissue, links and contact on the points of the torso."""

from __future__ import annotations

import math

from sim.physics.compiled import compiled
from sim.physics.muscle import (
    HILL,
    active_factor,
    force_length,
    hill_tension,
    passive_shape,
    spring_tension,
)
from sim.physics.plant import Constants, Contacts, Links, Muscles, Tissue
from sim.physics.types import Floats, Ints

EDGE = 0.25
"""How far past its edge a face is still felt, as a barycentric weight."""


@compiled
def _pull(x: Floats, f: Floats, a: int, b: int, tension: float, length: float) -> None:
    s = tension / length
    for c in range(3):
        d = s * (x[b, c] - x[a, c])
        f[a, c] += d
        f[b, c] -= d


@compiled
def _length_and_rate(x: Floats, v: Floats, a: int, b: int) -> tuple[float, float]:
    dx, dy, dz = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
    length = max(math.sqrt(dx * dx + dy * dy + dz * dz), 1e-6)
    rate = (dx * (v[b, 0] - v[a, 0]) + dy * (v[b, 1] - v[a, 1]) + dz * (v[b, 2] - v[a, 2])) / length
    return length, rate


@compiled
def add_muscles(
    x: Floats,
    v: Floats,
    muscles: Muscles,
    constants: Constants,
    activation: Floats,
    length: Floats,
    rate: Floats,
    factor: Floats,
    tension: Floats,
    f: Floats,
) -> None:
    """Add the tension of every muscle element to the nodal forces.

    Parameters
    ----------
    x, v : (n_points, 3), m and m/s
    activation : (n_groups,)
    length, rate, tension : (n_elements,), written
    factor : (n_chains,), force-length times force-velocity of each fibre, written
    f : (n_points, 3), N, added to
    """
    n_chains = muscles.chain_rest.shape[0]
    span = factor
    speed = muscles.chain_rest * 0.0
    for c in range(n_chains):
        span[c] = 0.0
    for e in range(muscles.a.shape[0]):
        length[e], rate[e] = _length_and_rate(x, v, muscles.a[e], muscles.b[e])
        span[muscles.chain[e]] += length[e]
        speed[muscles.chain[e]] += rate[e]
    if constants.law == HILL:
        for c in range(n_chains):
            rest = muscles.chain_rest[c]
            factor[c] = active_factor(
                span[c] / rest,
                speed[c] / (rest * muscles.chain_v_max[c]),
                constants.width,
                constants.curvature,
                constants.eccentric,
            )
    for e in range(muscles.a.shape[0]):
        level = activation[muscles.group[e]] * muscles.share[e]
        rest = muscles.rest[e]
        if constants.law == HILL:
            tension[e] = hill_tension(
                level,
                factor[muscles.chain[e]],
                length[e] / rest,
                rate[e] / rest,
                muscles.f_max[e],
                muscles.k_pe[e],
                muscles.b_pe[e],
            )
        else:
            tension[e] = spring_tension(
                level,
                length[e],
                rate[e],
                rest,
                muscles.chain_v_max[muscles.chain[e]],
                muscles.f_max[e],
                muscles.k_pe[e],
                muscles.b_pe[e],
            )
        _pull(x, f, muscles.a[e], muscles.b[e], tension[e], length[e])


@compiled
def muscle_masses(
    step: float,
    muscles: Muscles,
    constants: Constants,
    activation: Floats,
    length: Floats,
    span: Floats,
    out: Floats,
) -> None:
    """Bound on h^2 K + h D of every element along its line, as an added mass, kg.

    The active part of a chain couples all its elements; n times the fibre's own slope on each
    element bounds that coupling from above, and equals it when the fibre shortens evenly.

    Parameters
    ----------
    span : (n_chains,), length of each fibre, m
    out : (n_elements,), written
    """
    steepest = (1.0 + constants.curvature) / constants.curvature
    for e in range(out.shape[0]):
        level = activation[muscles.group[e]] * muscles.share[e]
        rest = muscles.rest[e]
        if constants.law != HILL:
            k = level * muscles.f_max[e] + muscles.k_pe[e]
            out[e] = step * step * k + step * muscles.b_pe[e]
            continue
        chain = muscles.chain[e]
        ratio = span[chain] / muscles.chain_rest[chain]
        k = muscles.k_pe[e] * passive_shape(length[e] / rest)[1] / rest
        d = muscles.b_pe[e] / rest
        force = level * muscles.f_max[e] * muscles.chain_count[chain] / muscles.chain_rest[chain]
        k += force * max(0.0, -2.0 * (ratio - 1.0) / constants.width**2)
        speed = muscles.chain_v_max[chain]
        d += force * force_length(ratio, constants.width) * steepest / speed
        out[e] = step * step * k + step * d


@compiled
def add_tissue(x: Floats, v: Floats, tissue: Tissue, tension: Floats, f: Floats) -> None:
    """Add the pull of the passive threads; `tension` (n,), N, is written."""
    for e in range(tissue.a.shape[0]):
        length, rate = _length_and_rate(x, v, tissue.a[e], tissue.b[e])
        pull = tissue.stiffness[e] * (length - tissue.rest[e]) + tissue.damping[e] * rate
        tension[e] = max(0.0, pull)
        if pull > 0.0 or tissue.pushes[e] == 1:
            _pull(x, f, tissue.a[e], tissue.b[e], pull, length)


@compiled
def link_axis(links: Links, e: int, point_body: Ints, rotation: Floats, out: Floats) -> None:
    """Direction of a link's cartilage in the world.

    Parameters
    ----------
    rotation : (n_bodies, 9), body to world
    out : (3,), written
    """
    r, s = rotation[point_body[links.b[e]]], links.axis[e]
    for c in range(3):
        out[c] = r[3 * c] * s[0] + r[3 * c + 1] * s[1] + r[3 * c + 2] * s[2]


@compiled
def add_links(
    x: Floats, v: Floats, links: Links, point_body: Ints, rotation: Floats, f: Floats
) -> None:
    """Add the forces of the bone-to-cartilage links, which are slack when both ends meet."""
    axis = x[0].copy()
    for e in range(links.a.shape[0]):
        a, b = links.a[e], links.b[e]
        link_axis(links, e, point_body, rotation, axis)
        stretch = 0.0
        for c in range(3):
            stretch += axis[c] * (x[b, c] - x[a, c])
        for c in range(3):
            pull = links.across[e] * (x[b, c] - x[a, c])
            pull += (links.along[e] - links.across[e]) * stretch * axis[c]
            pull += links.damping[e] * (v[b, c] - v[a, c])
            f[a, c] += pull
            f[b, c] -= pull


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
    i, j, k = faces[g, 0], faces[g, 1], faces[g, 2]
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
    normal[0], normal[1], normal[2] = nx / size, ny / size, nz / size
    return (radius - reach) * slope, min(1.0 - s - t, min(s, t))


@compiled
def follow_sheet(x: Floats, contacts: Contacts, held: Ints) -> None:
    """Let each diaphragm particle walk to the face that its ray crosses.

    Parameters
    ----------
    held : (n_contacts,), index of the present face, updated
    """
    weight, normal = x[0].copy(), x[0].copy()
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
    weight, normal = x[0].copy(), x[0].copy()
    for i in range(contacts.point.shape[0]):
        p = contacts.point[i]
        face = contacts.face[held[i]]
        gap[i], inside = cross_sheet(x, contacts.face, held[i], p, contacts.axis, weight, normal)
        if inside < -EDGE:
            gap[i] = 1.0
        depth = min(constants.contact_gap - gap[i], 3.0 * constants.contact_gap)
        if depth <= 0.0:
            continue
        closing = 0.0
        for c in range(3):
            speed = v[p, c]
            for k in range(3):
                speed -= weight[k] * v[face[k], c]
            closing -= speed * normal[c]
        # Past its edge a face lets go little by little, so that no particle is dropped at once.
        hold = min(1.0, 1.0 + inside / EDGE)
        push = hold * (constants.contact_stiffness * depth + constants.contact_damping * closing)
        if push <= 0.0:
            continue
        for c in range(3):
            f[p, c] += push * normal[c]
            for k in range(3):
                f[face[k], c] -= weight[k] * push * normal[c]
