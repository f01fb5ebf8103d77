"""The skin side of the torso and the virtual markers on it.

Every vertex of the tube of rib cage and belly has a skin point: on bones it rides rigidly, on
the belly it stands off along the normal. A marker is bound to a face of that skin.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from sim.model.anatomy import SIDES
from sim.model.skeleton import margin_point, segment_of
from sim.model.torso import Torso
from sim.physics.types import Floats, Ints
from sim.tables import Parameters

BACK_SKIN = 0.008
"""Skin over the spinous processes, m."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Surface:
    """Skin-side surface at rest: vertices, faces and unit vertex normals (outward)."""

    vertices: Floats
    faces: Ints
    normals: Floats


@dataclass(frozen=True, kw_only=True, slots=True)
class Attachments:
    """Points that ride on the skin.

    Parameters
    ----------
    face : (n, 3), indices of `Skin` vertices
    weight : (n, 3), barycentric
    height : (n,), m, off the face along its normal
    slide : (n, 2), m, left over within the face's plane (points past an edge of the skin)
    """

    face: Ints
    weight: Floats
    height: Floats
    slide: Floats


@dataclass(frozen=True, kw_only=True, slots=True)
class Skin:
    """How skin vertices follow the points of the torso.

    Parameters
    ----------
    point : (n,), index of the point that a vertex belongs to
    body : (n,), body it rides on, -1 for the belly
    local : (n, 3), place in the frame of the body
    thickness : (n,), stand-off of belly vertices, m
    faces : (m, 3), of skin vertices
    outside : (k, 3), of skin vertices: `faces` without the thoracic inlet, across which the neck
        leaves the chest, so that no marker can sit there
    """

    point: Ints
    body: Ints
    local: Floats
    thickness: Floats
    faces: Ints
    outside: Ints


def vertex_normals(x: Floats, faces: Ints) -> Floats:
    """Unit normals at vertices, weighted by area; (..., n, 3)."""
    a, b, c = x[..., faces[:, 0], :], x[..., faces[:, 1], :], x[..., faces[:, 2], :]
    n = np.cross(b - a, c - a)
    out = np.zeros_like(x)
    for k in range(3):
        where: Any = (..., faces[:, k], slice(None))
        np.add.at(out, where, n)
    size = np.linalg.norm(out, axis=-1, keepdims=True)
    return np.asarray(out / np.maximum(size, 1e-12))


def build_skin(torso: Torso, points: Floats) -> Skin:
    """Skin of a torso at rest.

    Parameters
    ----------
    points : (n_points, 3), all points in the upright rest pose, bones as built
    """
    used, inverse = np.unique(torso.outer, return_inverse=True)
    faces = inverse.reshape(torso.outer.shape).astype(np.int64)
    inner = points[used]
    normals = vertex_normals(inner, faces)
    anatomy, bound = torso.anatomy, used < torso.n_bound
    skin = inner + anatomy.skin * normals
    front = bound & (inner[:, 0] > 0.0) & (np.abs(inner[:, 1]) < 0.06)
    skin[front] = inner[front] + torso.parameters["sternum_skin"] * normals[front]
    _to_the_back(torso, used, inner, skin)
    skin[bound, 1] *= _shoulder_breadth(skin[bound], torso.parameters)
    thickness = np.where(bound, 0.0, anatomy.belly_skin)
    origin = body_origins(torso)
    body = np.where(bound, torso.plant.point_body[np.minimum(used, torso.n_bound - 1)], -1)
    local = np.where(bound[:, None], skin - origin[np.maximum(body, 0)], 0.0)
    return Skin(
        point=used.astype(np.int64), body=body.astype(np.int64), local=local,
        thickness=thickness, faces=faces, outside=faces[~_inlet(torso, body[faces])],
    )  # fmt: skip


def _inlet(torso: Torso, body: Ints) -> NDArray[np.bool_]:
    """(m,), faces of bodies (m, 3) that close the ring of first ribs and manubrium at the top."""
    first = [torso.skeleton.body[f"rib_{side}1"] for side in SIDES]
    ring = [*first, torso.skeleton.body["sternum"], torso.skeleton.body[segment_of("T1")]]
    return np.asarray(np.isin(body, ring).all(axis=1) & np.isin(body, first).any(axis=1))


def _shoulder_breadth(skin: Floats, parameters: Parameters) -> Floats:
    """(n,), how much broader the torso is than the rib cage, which tapers towards the neck.

    Pectorals, latissimus and shoulder blades fill the taper: above its widest level the torso
    keeps its breadth.
    """
    z, y = skin[:, 2], np.abs(skin[:, 1])
    near = np.abs(z[:, None] - z[None]) < 0.5 * parameters["shoulder_window"]
    half = np.where(near, y[None], 0.0).max(axis=1)
    above = z > z[np.argmax(y)]
    return np.where(above, np.minimum(y.max() / half, parameters["shoulder_most"]), 1.0)


def body_origins(torso: Torso) -> Floats:
    """World origins of the bodies in the built pose, where all frames are parallel."""
    model = torso.skeleton.model
    origin = np.zeros((model.nbody, 3))
    for b in range(1, model.nbody):
        free = model.body_dofnum[b] == 6
        start = int(model.jnt_qposadr[model.body_jntadr[b]]) if free else 0
        own = model.qpos0[start : start + 3] if free else model.body_pos[b]
        origin[b] = origin[model.body_parentid[b]] + own
    return origin


def _to_the_back(torso: Torso, used: Ints, inner: Floats, skin: Floats) -> None:
    """Points before the spine get their skin behind the spinous processes."""
    levels = torso.anatomy.process
    z = np.array([p[2] for p in levels.values()])
    x = np.array([p[0] for p in levels.values()])
    order = np.argsort(z)
    back = {int(row[0]) for side in torso.rows for row in side}
    for k in (0, 1, len(torso.wall) - 1):
        back |= {int(i) for i in torso.wall[k] if i < torso.n_bound}
    rows = [k for k, i in enumerate(used.tolist()) if i in back]
    skin[rows] = inner[rows]
    skin[rows, 0] = np.interp(inner[rows, 2], z[order], x[order]) - BACK_SKIN


def skin_places(skin: Skin, torso: Torso, x: Floats, position: Floats, rotation: Floats) -> Floats:
    """Skin vertices of one or many frames.

    Parameters
    ----------
    x : (..., n_used, 3), places of `skin.point`
    position, rotation : (..., n_bodies, 3) and (..., n_bodies, 3, 3)
    """
    normals = vertex_normals(x, skin.faces)
    out = x + skin.thickness[:, None] * normals
    on = skin.body >= 0
    b = skin.body[on]
    out[..., on, :] = position[..., b, :] + np.einsum(
        "...bij,bj->...bi", rotation[..., b, :, :], skin.local[on]
    )
    return out


def _frames(vertices: Floats, face: Ints) -> tuple[Floats, Floats, Floats]:
    a, b, c = (vertices[..., face[:, k], :] for k in range(3))
    u = b - a
    n = np.cross(u, c - a)
    n = n / np.maximum(np.linalg.norm(n, axis=-1, keepdims=True), 1e-12)
    u = u / np.maximum(np.linalg.norm(u, axis=-1, keepdims=True), 1e-12)
    return n, u, np.cross(n, u)


def _closest(points: Floats, a: Floats, b: Floats, c: Floats) -> Floats:
    """Barycentric weights of the points of triangles nearest to points, clamped; (n, 3)."""
    u, w, p = b - a, c - a, points - a
    uu, uw, ww = (u * u).sum(1), (u * w).sum(1), (w * w).sum(1)
    pu, pw = (p * u).sum(1), (p * w).sum(1)
    det = np.maximum(uu * ww - uw * uw, 1e-18)
    weight = np.stack([np.zeros(len(p)), (ww * pu - uw * pw) / det, (uu * pw - uw * pu) / det], 1)
    weight[:, 0] = 1.0 - weight[:, 1] - weight[:, 2]
    weight = np.clip(weight, 0.0, 1.0)
    return np.asarray(weight / weight.sum(axis=1, keepdims=True))


def attach(vertices: Floats, faces: Ints, points: Floats) -> Attachments:
    """Bind points to the nearest faces of the skin at rest.

    Parameters
    ----------
    vertices : (n, 3), skin at rest, m
    points : (k, 3), m, on or near it
    """
    points = np.atleast_2d(np.asarray(points, dtype=float))
    centres = cKDTree(vertices[faces].mean(axis=1))
    chosen, weights = [], []
    for p in points:
        near = np.asarray(centres.query(p, k=24)[1], dtype=np.int64)
        t = vertices[faces[near]]
        w = _closest(np.repeat(p[None], len(near), axis=0), t[:, 0], t[:, 1], t[:, 2])
        best = int(np.argmin(np.linalg.norm((w[:, :, None] * t).sum(axis=1) - p, axis=1)))
        chosen.append(faces[near[best]])
        weights.append(w[best])
    face, weight = np.array(chosen, dtype=np.int64), np.array(weights)
    n, u, t = _frames(vertices, face)
    rest = points - (weight[:, :, None] * vertices[face]).sum(axis=1)
    slide = np.stack([(rest * u).sum(axis=1), (rest * t).sum(axis=1)], axis=1)
    return Attachments(face=face, weight=weight, height=(rest * n).sum(axis=1), slide=slide)


def marker_places(attachments: Attachments, vertices: Floats) -> Floats:
    """Places of attached points; `vertices` (..., n, 3) -> (..., n_markers, 3)."""
    a = attachments
    n, u, t = _frames(vertices, a.face)
    base = (a.weight[:, :, None] * vertices[..., a.face, :]).sum(axis=-2)
    return np.asarray(base + a.height[:, None] * n + a.slide[:, :1] * u + a.slide[:, 1:] * t)


def _flank(vertices: Floats, z: float, sign: float) -> Floats:
    near = vertices[np.abs(vertices[:, 2] - z) < 0.02]
    return np.asarray(near[np.argmax(sign * near[:, 1])])


def landmark_points(torso: Torso, vertices: Floats) -> dict[str, Floats]:
    """Usual markers on the skin of the upright torso at rest.

    CLAV, STRN, XIPH : top, middle and lower end of the sternum
    UABD, NAVEL, LABD : front of the belly; C7, T3 ... L4 : spinous processes
    LUCH, LMCH : third and fifth costal cartilage; LLCH : mid-axillary at the height of XIPH;
    LCOS : costal margin; the same on the right with R
    """
    a, p = torso.anatomy, torso.parameters
    sternum = a.sternum_front[np.argsort(a.sternum_front[:, 2])]
    skin = np.array([p["sternum_skin"], 0.0, 0.0])
    front = vertices[np.abs(vertices[:, 1]) < 0.02]

    def belly(z: float) -> Floats:
        near = front[(np.abs(front[:, 2] - z) < 0.05) & (front[:, 0] > 0.03)]
        order = np.argsort(near[:, 2])
        return np.array([np.interp(z, near[order, 2], near[order, 0]), 0.0, z])

    out = {
        "CLAV": sternum[-1] + skin,
        "STRN": sternum[len(sternum) // 2] + skin,
        "XIPH": sternum[1] + skin,
        "NAVEL": belly(a.navel_height),
        "UABD": belly(0.5 * (a.navel_height + sternum[1][2])),
        "LABD": belly(a.navel_height - 0.06),
    }
    for level in ("C7", "T3", "T5", "T8", "T10", "L1", "L4"):
        out[level] = a.process[level] - np.array([BACK_SKIN, 0.0, 0.0])
    for side, letter in enumerate("LR"):
        places = {
            "UCH": a.rib[side, 2, -1],
            "MCH": a.rib[side, 4, -1],
            "LCH": _flank(vertices, sternum[1][2], 1.0 - 2.0 * side),
            "COS": margin_point(a, side, 0.6, p),
        }
        for name, at in places.items():
            out[f"{letter}{name}"] = vertices[np.argmin(np.linalg.norm(vertices - at, axis=1))]
    return out
