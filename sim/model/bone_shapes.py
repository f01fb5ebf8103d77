"""Surfaces of the bones and cartilages, corrected and sized like their landmarks, for drawing.

Bones are carried by what `sim.model.anatomy` does to their landmarks; the right side is the left
one mirrored. The costal cartilages, of one piece with the sternum in the bone set, are tubes
from the ribs' ends to the sternum, as the model's are.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from sim.model.anatomy import SIDES, Anatomy, Placer, girdle_landmarks, rib_tilts, turn_down
from sim.model.mesh import along
from sim.model.skeleton import segment_of
from sim.physics.types import Floats, Ints
from sim.tables import bone_arrays

Tissue = Literal["bone", "cartilage"]

MIRROR = np.array([1.0, -1.0, 1.0])
TUBE_SIDES, TUBE_RINGS = 8, 10
"""Of a cartilage: corners of its section, sections along it."""
TIP_SHARE = 0.9
"""From this share of a rib's length on its thickness is that of its cartilage."""
BEND = 0.4
"""Share of a cartilage's length over which it goes on in its rib's direction."""
JOINS = 0.5
"""Share of the way along the cartilage above where those of ribs 8 to 10 join it."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Shape:
    """A rigid surface.

    Parameters
    ----------
    body : name of the body that carries it
    tissue : "bone" or "cartilage"
    vertices : (n, 3), m, in the body's frame
    faces : (m, 3), outward
    """

    body: str
    tissue: Tissue
    vertices: Floats
    faces: Ints


World = dict[str, Shape]


def _mesh(name: str) -> tuple[Floats, Ints]:
    bones = bone_arrays()
    faces = np.asarray(bones[f"mesh/{name}/faces"], dtype=np.int64)
    return np.asarray(bones[f"mesh/{name}/vertices"], dtype=float), faces


def _both(out: World, name: str, body: str, vertices: Floats, faces: Ints, tissue: Tissue) -> None:
    """Add a left shape and its mirror image; `name` and `body` hold an X for the side."""
    for letter, mirror in zip(SIDES, (np.ones(3), MIRROR), strict=True):
        turned = faces if letter == SIDES[0] else faces[:, ::-1]
        out[name.replace("X", letter)] = Shape(
            body=body.replace("X", letter), tissue=tissue, vertices=vertices * mirror, faces=turned
        )


def _midline(out: World, anatomy: Anatomy, place: Placer) -> None:
    for level in anatomy.spine:
        if segment_of(level) != "pelvis":
            v, f = _mesh(level)
            out[level] = Shape(
                body=segment_of(level), tissue="bone", vertices=place(v) * anatomy.scale, faces=f
            )
    v, f = _mesh("sacrum")
    out["sacrum"] = Shape(body="pelvis", tissue="bone", vertices=place(v) * anatomy.scale, faces=f)
    names = [str(n) for n in bone_arrays()["spine/name"]]
    base = bone_arrays()["spine/top"][names.index("C1")]
    for name in ("skull", "jaw"):
        # the skull is not deeper because the chest is
        v, f = _mesh(name)
        v = anatomy.skull_base + anatomy.scale[2] * (v - base)
        out[name] = Shape(body="skull", tissue="bone", vertices=v, faces=f)


def _sternum(anatomy: Anatomy, place: Placer) -> Shape:
    """The sternum without the cartilages that the bone set has on it."""
    v, f = _mesh("sternum")
    edge = np.abs(bone_arrays()["sternum/rib_facets"][:, 1]).max()
    f = f[(np.abs(v[f, 1]) <= edge).all(axis=1)]
    used, inverse = np.unique(f, return_inverse=True)
    v = place.follow(place(v[used])) * anatomy.scale
    return Shape(body="sternum", tissue="bone", vertices=v, faces=inverse.reshape(f.shape))


def _affine(source: Floats, target: Floats, points: Floats) -> Floats:
    """Carry points (n, 3) by the affine map of four landmarks (4, 3) onto four others."""
    ones = np.ones((len(source), 1))
    matrix = np.linalg.solve(np.hstack([source, ones]), target)
    return np.asarray(points @ matrix[:3] + matrix[3])


def _turned(source: Floats, target: Floats, points: Floats) -> Floats:
    """Carry points by the similarity that takes two ends (2, 3) to two others by the least turn."""
    a, b = source[1] - source[0], target[1] - target[0]
    size = float(np.linalg.norm(b) / np.linalg.norm(a))
    u, v = a / np.linalg.norm(a), b / np.linalg.norm(b)
    axis = np.cross(u, v)
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    turn = np.eye(3) + k + k @ k / (1.0 + float(u @ v))
    return np.asarray(target[0] + size * (points - source[0]) @ turn.T)


def _girdle(out: World, anatomy: Anatomy, place: Placer) -> None:
    raw = {k: place(v) * anatomy.scale for k, v in girdle_landmarks(bone_arrays()).items()}

    def landmarks(*names: str) -> tuple[Floats, Floats]:
        return np.array([raw[n] for n in names]), np.array([anatomy.girdle[n][0] for n in names])

    v, f = _mesh("clavicle_L")
    ends = landmarks("clavicle_sternal", "clavicle_acromial")
    _both(out, "clavicle_X", "girdle_X", _turned(*ends, place(v) * anatomy.scale), f, "bone")
    v, f = _mesh("scapula_L")
    four = landmarks("acromion", "coracoid", "superior_angle", "inferior_angle")
    _both(out, "scapula_X", "girdle_X", _affine(*four, place(v) * anatomy.scale), f, "bone")


def _ribs(out: World, anatomy: Anatomy, place: Placer) -> Floats:
    """Add the ribs; return the radii of their front ends, (12,), m."""
    heads = place(bone_arrays()["ribs/centreline"][:12, 0])
    radii = np.empty(12)
    for k, angle in enumerate(rib_tilts()):
        v, f = _mesh(f"rib_L{k + 1}")
        v = turn_down(place(v), heads[k], float(angle)) * anatomy.scale
        _both(out, f"rib_X{k + 1}", f"rib_X{k + 1}", v, f, "bone")
        end = along(anatomy.rib[0, k], np.linspace(TIP_SHARE, 1.0, 8))
        away = np.linalg.norm(v[:, None] - end[None], axis=-1).min(axis=1)
        radii[k] = np.sort(away)[:8].mean()
    return radii


def tube(line: Floats, radius: float) -> tuple[Floats, Ints]:
    """A closed tube along a polyline (n, 3): vertices and outward faces."""
    n, way = len(line), np.gradient(line, axis=0)
    way /= np.linalg.norm(way, axis=1)[:, None]
    across = np.cross(way, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across, axis=1)[:, None]
    up = np.cross(across, way)
    angle = np.linspace(0.0, 2.0 * np.pi, TUBE_SIDES, endpoint=False)[None, :, None]
    rings = line[:, None] + radius * (np.cos(angle) * across[:, None] + np.sin(angle) * up[:, None])
    vertices = np.vstack([rings.reshape(-1, 3), line[:1], line[-1:]])
    faces = []
    for j in range(TUBE_SIDES):
        k = (j + 1) % TUBE_SIDES
        for i in range(n - 1):
            a, b = i * TUBE_SIDES, (i + 1) * TUBE_SIDES
            faces += [(a + j, b + j, a + k), (a + k, b + j, b + k)]
        faces += [(n * TUBE_SIDES, j, k)]
        last = (n - 1) * TUBE_SIDES
        faces += [(n * TUBE_SIDES + 1, last + k, last + j)]
    return vertices, np.array(faces, dtype=np.int64)


def _curve(rib: Floats, end: Floats) -> Floats:
    """(n, 3), from a rib's end in its direction to `end`: a quadratic Bézier curve."""
    start, way = rib[-1], rib[-1] - rib[-4]
    reach = BEND * np.linalg.norm(end - start) / np.linalg.norm(way)
    t = np.linspace(0.0, 1.0, TUBE_RINGS)[:, None]
    middle = start + reach * way
    return np.asarray((1 - t) ** 2 * start + 2 * t * (1 - t) * middle + t**2 * end)


def _cartilages(out: World, anatomy: Anatomy, radii: Floats) -> None:
    above = np.empty((0, 3))
    for k in range(10):
        if k < 7:
            end = anatomy.facet[0, k]
        else:
            end = along(above, np.array([JOINS]))[0]
        above = _curve(anatomy.rib[0, k], end)
        rib = k + 1
        body = "sternum" if rib == 1 else f"cartilage_X{rib}" if rib < 6 else "cartilage_X6-10"
        _both(out, f"cartilage_X{rib}", body, *tube(above, radii[k]), "cartilage")


def bone_shapes(anatomy: Anatomy, place: Placer, origins: dict[str, Floats]) -> World:
    """Bones and cartilages of one subject by name.

    Parameters
    ----------
    place : the corrections that `anatomy` was made with
    origins : place of each body's frame, (3,) m, as built, where all frames are parallel
    """
    out: World = {}
    _midline(out, anatomy, place)
    out["sternum"] = _sternum(anatomy, place)
    v, f = _mesh("pelvis_L")
    _both(out, "pelvis_X", "pelvis", place(v) * anatomy.scale, f, "bone")
    _girdle(out, anatomy, place)
    _cartilages(out, anatomy, _ribs(out, anatomy, place))
    return {
        name: Shape(
            body=s.body, tissue=s.tissue, vertices=s.vertices - origins[s.body], faces=s.faces
        )
        for name, s in out.items()
    }
