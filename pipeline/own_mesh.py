"""A mesh of one's own as the skin: brought over the torso and bound."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RBFInterpolator
from scipy.spatial import cKDTree

from pipeline.mesh_reading import read_landmarks, read_mesh
from sim.errors import InputError
from sim.model.landmarks import vertex_normals
from sim.motion import Motion, belly_faces
from sim.skin.body_mesh import Person, body_mesh, find_build, skin_parameters, usual_age
from sim.skin.bound import BoundSkin
from sim.skin.dress import bind, dress
from sim.skin.frame import RestPose, underneath
from sim.skin.place import covered

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

GROWS = (0.6, 1.7)
"""How much a mesh may have to be scaled."""
FAR = 0.03
"""m, median distance of a mesh that has found its place."""
ALIKE = 0.5
"""Cosine between its normals and those of the human skin, median."""
ROUNDS, KEPT = 60, 0.7
"""Steps of the registration, and the share of nearest points that counts."""
CONTROLS, BENDS, REACH, SOFT = 200, 3, 0.10, 0.1
"""Points of the human trunk towards which a mesh is bent, how often, from where (m), how softly."""
ARMS = ("upper_arm_L", "upper_arm_R")
FEWEST_WARP = 6
"""Landmarks from which on the mesh is warped too."""


def similarity(source: Floats, target: Floats) -> tuple[float, Floats, Floats]:
    """Scale, turn (3, 3) and shift (3,) that bring points (k, 3) nearest to others.

    References
    ----------
    Umeyama 1991
    """
    a, b = source - source.mean(axis=0), target - target.mean(axis=0)
    u, size, v = np.linalg.svd(b.T @ a)
    signs = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ v))])
    turn = u @ np.diag(signs) @ v
    scale = float((size * signs).sum() / (a * a).sum())
    return scale, turn, target.mean(axis=0) - scale * turn @ source.mean(axis=0)


def human_landmarks(human: BoundSkin) -> dict[str, Floats]:
    """Places (3,), m, on the human skin at rest by name; both sides where there are two."""
    subject = human.rest.subject
    person = Person(subject=subject, age=float(human.about["age_years"]))
    mesh = body_mesh(person, find_build(person))
    tree, out = cKDTree(mesh.vertices), {}
    for name, at in mesh.landmarks.items():
        if name in ("shoulder", "elbow", "upper-leg"):
            continue
        word = name.removesuffix("_left")
        sides = [("", at)] if word == name else [("_left", at), ("_right", at * [1.0, -1.0, 1.0])]
        for side, place in sides:
            out[word + side] = human.vertices[tree.query(place)[1]]
    return out


def _by_landmarks(vertices: Floats, given: dict[str, Floats], known: dict[str, Floats]) -> Floats:
    source = np.array(list(given.values()))
    target = np.array([known[name] for name in given])
    scale, turn, shift = similarity(source, target)
    moved, at = scale * vertices @ turn.T + shift, scale * source @ turn.T + shift
    if len(source) < FEWEST_WARP:
        return np.asarray(moved)
    # of the kernels the one that runs out: limbs lie far from any landmark
    return np.asarray(moved + RBFInterpolator(at, target - at, kernel="linear", degree=0)(moved))


def _by_shape(vertices: Floats, human: Floats) -> Floats:
    """The similarity that brings the mesh nearest to the human skin (n, 3), trimmed ICP."""
    best, found = np.inf, vertices
    high = human[:, 2].max() - vertices[:, 2].max()
    for up in (high, human[:, 2].mean() - vertices[:, 2].mean()):
        flat = human[:, :2].mean(axis=0) - vertices[:, :2].mean(axis=0)
        moved = vertices + np.array([*flat, up])
        grown = 1.0
        for _ in range(ROUNDS):
            away, index = map(np.asarray, cKDTree(moved).query(human))
            near = away <= np.quantile(away, KEPT)
            scale, turn, shift = similarity(moved[index[near]], human[near])
            scale = float(np.clip(scale, GROWS[0] / grown, GROWS[1] / grown))
            moved, grown = scale * moved @ turn.T + shift, grown * scale
        off = float(np.median(cKDTree(moved).query(human)[0]))
        if off < best:
            best, found = off, moved
    return found


def _check_place(path: Path, vertices: Floats, faces: Ints, human: BoundSkin) -> None:
    """Refuse a mesh that lies far from the human skin, or looks another way."""
    away, index = map(np.asarray, cKDTree(vertices).query(human.vertices))
    normals = vertex_normals(vertices, faces)[index]
    alike = (normals * vertex_normals(human.vertices, human.faces)).sum(axis=1)
    if np.median(away) > FAR or np.median(alike) < ALIKE:
        raise InputError(
            f"{path}: lies {1e3 * np.median(away):.0f} mm from the torso's skin (median) or turned,"
            " so it found no place. Check --up and --unit, or give other --landmarks."
        )


def _bent(vertices: Floats, faces: Ints, human: Floats) -> Floats:
    """The mesh bent softly towards the human skin of the trunk (n, 3), which covers the bones."""
    chosen = _spread(human, CONTROLS)
    for _ in range(BENDS):
        normals = vertex_normals(vertices, faces)
        away, index = map(np.asarray, cKDTree(vertices).query(chosen))
        # what lies on the far side of a fold, or beyond reach, is not what should go there
        ahead = np.abs(((chosen - vertices[index]) * normals[index]).sum(axis=1))
        good = (away < REACH) & (ahead > 0.7 * away)
        at, first = np.unique(index[good], return_index=True)
        move = chosen[good][first] - vertices[at]
        field = RBFInterpolator(vertices[at], move, kernel="linear", degree=0, smoothing=SOFT)
        vertices = vertices + field(vertices)
    return np.asarray(vertices)


def _spread(points: Floats, n: int) -> Floats:
    """Points (n, 3) far from each other, each the farthest from those before it."""
    chosen = [0]
    away = np.linalg.norm(points - points[0], axis=1)
    for _ in range(n - 1):
        chosen.append(int(np.argmax(away)))
        away = np.minimum(away, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return points[chosen]


def own_skin(
    path: Path,
    motion: Motion,
    *,
    unit: str,
    up: str,
    landmarks: Path | None,
    method: str,
    fat_layer: float | None,
) -> BoundSkin:
    """A mesh as the skin of a torso: registered, pushed out over bones and belly, bound.

    Parameters
    ----------
    unit, up : of the mesh: one of `UNITS`, one of `UPS`
    landmarks : table of places on the mesh; else the shapes alone are brought together
    method : of `METHODS`
    fat_layer : m, at the navel
    """
    rest = motion.rest
    if rest is None:
        raise InputError(f"{path}: the trajectory has no rest pose. Simulate it anew.")
    vertices, faces = read_mesh(path, unit, up)
    human = _human(rest, motion)
    if landmarks is None:
        vertices = _by_shape(vertices, human.vertices)
    else:
        known = human_landmarks(human)
        vertices = _by_landmarks(vertices, read_landmarks(landmarks, unit, up, known), known)
    _check_place(path, vertices, faces, human)
    trunk = np.isin(_bodies(human), ARMS, invert=True)
    trunk &= human.vertices[:, 2] > rest.marks["pubis"][2]
    vertices = _bent(vertices, faces, human.vertices[trunk])
    layer = skin_parameters()["fat_layer"] if fat_layer is None else fat_layer
    vertices = covered(
        vertices, faces, underneath(rest, motion.shapes), layer, np.ones(len(vertices))
    )
    about: dict[str, str | float] = {"made_from": path.name, "method": method, "fat_layer": layer}
    return bind(vertices, faces, rest, motion.shapes, belly_faces(motion), method, about)


def _bodies(skin: BoundSkin) -> NDArray[np.str_]:
    """Name of the handle that each vertex follows most."""
    most = np.argmax(skin.weights.weight, axis=1)
    handle = skin.weights.handle[np.arange(len(most)), most]
    return np.asarray(np.array(skin.rest.handles)[handle])


def _human(rest: RestPose, motion: Motion) -> BoundSkin:
    if motion.skin is not None and motion.skin.about.get("made_from") == "human":
        return motion.skin
    return dress(rest, motion.shapes, belly_faces(motion), age=usual_age(rest.subject))
