"""Read the bone meshes out of the `myo-sim` wheel and name their connected pieces."""

from __future__ import annotations

import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

MESH_FOLDER = "myo_sim/models/meshes/"
SPINE_LEVELS = tuple(
    [f"C{k}" for k in range(1, 8)]
    + [f"T{k}" for k in range(1, 13)]
    + [f"L{k}" for k in range(1, 6)]
)
SMALLEST_BONE = 0.065  # m, box diagonal; the twelfth rib has 0.075, medallion letters 0.059
DISC_VERTICES = 26


@dataclass(kw_only=True, frozen=True, slots=True)
class Mesh:
    """A triangle mesh: vertices (n, 3) in metres, body axes; faces (m, 3)."""

    vertices: Floats
    faces: Ints

    @property
    def low(self) -> Floats:
        """Lower corner of the box around the mesh, (3,) m."""
        return np.asarray(self.vertices.min(axis=0))

    @property
    def high(self) -> Floats:
        """Upper corner of the box around the mesh, (3,) m."""
        return np.asarray(self.vertices.max(axis=0))

    def moved(self, shift: Floats) -> Mesh:
        """Return a copy moved by `shift` (3,) m."""
        return Mesh(vertices=self.vertices + shift, faces=self.faces)


def read_stl(wheel: Path, name: str) -> Mesh:
    """Read one binary STL of the wheel, weld it and turn it into body axes.

    The files have X forward, Y up, Z right; body axes are (x, -z, y), a pure rotation.
    """
    with zipfile.ZipFile(wheel) as archive:
        raw = archive.read(f"{MESH_FOLDER}{name}.stl")
    count = int(np.frombuffer(raw, dtype="<u4", count=1, offset=80)[0])
    record = np.dtype([("normal", "<f4", 3), ("corner", "<f4", (3, 3)), ("flags", "<u2")])
    corners = np.frombuffer(raw, dtype=record, count=count, offset=84)["corner"].reshape(-1, 3)
    points, back = np.unique(corners, axis=0, return_inverse=True)
    faces = back.reshape(-1, 3)
    distinct = (np.diff(np.sort(faces, axis=1), axis=1) > 0).all(axis=1)
    vertices = np.column_stack([points[:, 0], -points[:, 2], points[:, 1]]).astype(np.float64)
    return Mesh(vertices=vertices, faces=faces[distinct].astype(np.int64))


def pieces(mesh: Mesh) -> list[Mesh]:
    """Split a mesh into its connected pieces, highest first."""
    size = len(mesh.vertices)
    start, stop = mesh.faces.ravel(), np.roll(mesh.faces, 1, axis=1).ravel()
    graph = coo_array((np.ones(len(start)), (start, stop)), shape=(size, size))
    count, label = connected_components(graph, directed=False)
    parts = []
    for piece in range(count):
        chosen = np.flatnonzero(label == piece)
        if len(chosen) < 4:
            continue
        faces = mesh.faces[label[mesh.faces[:, 0]] == piece]
        parts.append(Mesh(vertices=mesh.vertices[chosen], faces=np.searchsorted(chosen, faces)))
    return sorted(parts, key=lambda part: -float(part.high[2]))


def is_bone(part: Mesh) -> bool:
    """Tell a bone from the logo medallion: large, and on one side or symmetric."""
    large = float(np.linalg.norm(part.high - part.low)) > SMALLEST_BONE
    one_side = part.low[1] > 0.008 or part.high[1] < -0.008
    symmetric = abs(part.low[1] + part.high[1]) < 0.003
    return bool(large and (one_side or symmetric))


def chest_bones(wheel: Path) -> dict[str, Mesh]:
    """Return ribs, sternum with cartilage, clavicles and scapulae by name."""
    parts = [part for part in pieces(read_stl(wheel, "hat_ribs_scap")) if is_bone(part)]
    bones: dict[str, Mesh] = {}
    sides = {
        "L": [part for part in parts if part.low[1] > 0.008],
        "R": [part for part in parts if part.high[1] < -0.008],
    }
    for side, mine in sides.items():
        by_detail = sorted(mine, key=lambda part: -len(part.vertices))
        bones[f"scapula_{side}"], bones[f"clavicle_{side}"] = by_detail[:2]
        ribs = sorted(by_detail[2:], key=lambda part: -float(part.high[2]))
        bones |= {f"rib_{side}{number}": rib for number, rib in enumerate(ribs, start=1)}
    bones["sternum"] = next(part for part in parts if part.low[1] < 0.0 < part.high[1])
    return bones


def spine_bones(wheel: Path) -> tuple[dict[str, Mesh], dict[str, Mesh]]:
    """Return the 24 vertebrae by name and the 23 discs by the name of the level above."""
    vertebrae: list[Mesh] = []
    discs: list[Mesh] = []
    for name in ("hat_cervical", "hat_thoracic", "hat_lumbar"):
        for part in pieces(read_stl(wheel, name)):
            (discs if len(part.vertices) == DISC_VERTICES else vertebrae).append(part)
    vertebrae.sort(key=lambda part: -float(part.low[2] + part.high[2]))
    discs.sort(key=lambda part: -float(part.low[2] + part.high[2]))
    return (
        dict(zip(SPINE_LEVELS, vertebrae, strict=True)),
        dict(zip(SPINE_LEVELS[1:], discs, strict=True)),
    )
