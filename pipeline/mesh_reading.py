"""Reading a mesh of one's own, and the landmarks on it; whatever is wrong is told in one line."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray

from pipeline.skin_words import UNITS, UPS
from sim.errors import InputError

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

MOST_VERTICES = 60_000
MOST_BYTES = 100_000_000
TALL = (0.35, 2.6)
"""m; a torso or a person is so high."""
SPREAD = 0.05
"""m; so far must landmarks lie beside a line, or the turn about it is not known."""
FEWEST = 3
"""Landmarks for a similarity."""


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
    if len(at) < FEWEST or spread[1] < SPREAD:
        raise InputError(f"{path}: {len(out)} landmarks. Give at least {FEWEST}, not near a line.")
    return out
