"""A mesh of one's own as the skin: read, brought over the torso, bound."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.interpolate import RBFInterpolator
from scipy.spatial import cKDTree

from pipeline.skin_words import UNITS, UPS
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

MOST_VERTICES = 60_000
MOST_BYTES = 100_000_000
TALL = (0.35, 2.6)
"""m; a torso or a person is so high."""
GROWS = (0.6, 1.7)
"""How much a mesh may have to be scaled."""
FAR = 0.03
"""m, median distance of a mesh that has found its place."""
ROUNDS, KEPT = 60, 0.7
"""Steps of the registration, and the share of nearest points that counts."""
SPREAD = 4e-4
"""m^2; landmarks must not lie on a line."""
CONTROLS, BENDS, REACH, SOFT = 200, 3, 0.10, 0.1
"""Points of the human trunk towards which a mesh is bent, how often, from where (m), how softly."""
ARMS = ("upper_arm_L", "upper_arm_R")
FEWEST, FEWEST_WARP = 3, 6
"""Landmarks for a similarity, and from which on the mesh is warped too."""


def _load(path: Path) -> trimesh.Trimesh:
    kind = path.suffix.lower()
    if kind not in (".obj", ".glb"):
        raise InputError(f"{path}: unknown ending. Use .obj or .glb.")
    try:
        size = path.stat().st_size
        with path.open("rb") as stream:
            head = stream.read(4)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}). Check its name.") from error
    if size > MOST_BYTES:
        raise InputError(
            f"{path}: {size / 1e6:.0f} MB. A skin may have {MOST_VERTICES:,} vertices and"
            f" {MOST_BYTES / 1e6:.0f} MB. Decimate it."
        )
    if kind == ".glb" and head != b"glTF":
        raise InputError(f"{path}: is no GLB, whatever its ending. Export it as binary glTF.")
    try:
        return trimesh.load_mesh(path, process=False)
    except Exception as error:  # its readers raise whatever they meet
        reason = " ".join(f"{type(error).__name__} {error}".split())[:120]
        raise InputError(
            f"{path}: cannot be read as {kind[1:].upper()} ({reason}). Export it anew."
        ) from error


def in_our_axes(points: Floats, unit: str, up: str) -> Floats:
    """Points (n, 3) of a file in metres, X forward, Y left, Z up."""
    columns, signs = UPS[up]
    return np.asarray(UNITS[unit] * points[:, list(columns)] * np.array(signs))


def read_mesh(path: Path, unit: str, up: str) -> tuple[Floats, Ints]:
    """Vertices (n, 3), m, X forward, Y left, Z up, welded, and faces (m, 3).

    Raises
    ------
    InputError
        for what is no mesh, has no faces, places that are no numbers, too many vertices, or the
        wrong unit
    """
    mesh = _load(path)
    faces = np.asarray(getattr(mesh, "faces", np.empty((0, 3))), dtype=np.int64)
    vertices = np.asarray(getattr(mesh, "vertices", np.empty((0, 3))), dtype=float)
    if not len(faces):
        raise InputError(f"{path}: has no faces. Export a mesh, not points or lines.")
    if not np.isfinite(vertices).all():
        bad = int(np.flatnonzero(~np.isfinite(vertices).all(axis=1))[0])
        raise InputError(f"{path}: vertex {bad + 1} is not a number. Mend the mesh.")
    vertices = in_our_axes(vertices, unit, up)
    # seams of a texture split vertices; a skin would tear there
    vertices, index = np.unique(vertices, axis=0, return_inverse=True)
    faces = index.ravel()[faces]
    whole = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    used, faces = np.unique(faces[whole], return_inverse=True)
    vertices, faces = vertices[used], faces.reshape(-1, 3).astype(np.int64)
    if len(vertices) > MOST_VERTICES:
        raise InputError(
            f"{path}: {len(vertices):,} vertices. A skin may have {MOST_VERTICES:,}. Decimate it."
        )
    _check_size(path, float(np.ptp(vertices[:, 2])), unit)
    return vertices, faces


def _check_size(path: Path, tall: float, unit: str) -> None:
    if TALL[0] <= tall <= TALL[1]:
        return
    fits = [u for u, metres in UNITS.items() if TALL[0] <= tall / UNITS[unit] * metres <= TALL[1]]
    remedy = f"Give --unit {' or '.join(fits)}." if fits else "Scale it to a person's size."
    raise InputError(
        f"{path}: is {tall:.3g} m high with --unit {unit}, no person's torso. {remedy}"
    )


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


def read_landmarks(path: Path, unit: str, up: str, known: dict[str, Floats]) -> dict[str, Floats]:
    """Landmarks of a mesh: a table with the columns landmark, x, y, z in the mesh's own axes."""
    try:
        table = csv.DictReader(path.read_text(encoding="utf-8-sig").splitlines())
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read as a table ({error}).") from error
    if not {"landmark", "x", "y", "z"} <= set(table.fieldnames or ()):
        raise InputError(f"{path}: no columns landmark,x,y,z. Begin with them.")
    out: dict[str, Floats] = {}
    for row in table:
        place, name = f"{path} line {table.line_num}", (row["landmark"] or "").strip()
        if name not in known:
            raise InputError(f"{place}: no landmark '{name}'. There are: {', '.join(known)}.")
        try:
            at = np.array([float(row[axis] or "") for axis in "xyz"])
        except (TypeError, ValueError) as error:
            raise InputError(f"{place}: x, y, z must be numbers.") from error
        if not np.isfinite(at).all():
            raise InputError(f"{place}: x, y, z must be numbers.")
        out[name] = in_our_axes(at[None], unit, up)[0]
    at = np.array(list(out.values())).reshape(-1, 3)
    spread = np.linalg.svd(at - at.mean(axis=0), compute_uv=False) if len(at) else np.zeros(3)
    if len(at) < FEWEST or spread[1] ** 2 < SPREAD:
        raise InputError(f"{path}: {len(out)} landmarks. Give at least {FEWEST}, not on a line.")
    return out


def _by_landmarks(vertices: Floats, given: dict[str, Floats], known: dict[str, Floats]) -> Floats:
    source = np.array(list(given.values()))
    target = np.array([known[name] for name in given])
    scale, turn, shift = similarity(source, target)
    moved, at = scale * vertices @ turn.T + shift, scale * source @ turn.T + shift
    if len(source) < FEWEST_WARP:
        return np.asarray(moved)
    return np.asarray(moved + RBFInterpolator(at, target - at, kernel="cubic", degree=1)(moved))


def _by_shape(path: Path, vertices: Floats, human: Floats) -> Floats:
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
    if best > FAR:
        raise InputError(
            f"{path}: lies {1e3 * best:.0f} mm from the torso's skin (median), so it found no"
            " place. Check --up and --unit, or give --landmarks."
        )
    return found


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
        vertices = _by_shape(path, vertices, human.vertices)
    else:
        known = human_landmarks(human)
        vertices = _by_landmarks(vertices, read_landmarks(landmarks, unit, up, known), known)
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
