"""The diaphragm against the rib cage: which face each particle starts beside."""

from __future__ import annotations

import numpy as np

from sim.physics.contact import cross_sheet
from sim.physics.plant import Contacts
from sim.physics.types import Floats, Ints


def _neighbours(faces: Ints) -> Ints:
    owners: dict[int, list[int]] = {}
    for f, face in enumerate(faces.tolist()):
        for v in face:
            owners.setdefault(v, []).append(f)
    near = [
        sorted({g for v in face for g in owners[v]} - {f}) for f, face in enumerate(faces.tolist())
    ]
    out = np.full((len(faces), max(map(len, near)) + 1), -1, dtype=np.int64)
    for f, row in enumerate(near):
        out[f, : len(row)] = row
    return out


def off_the_spine(sheet: Ints, body: Ints, spine: set[int]) -> Ints:
    """Faces of the sheet that the diaphragm may touch: all but those on vertebrae alone.

    They lie along the ray that they are seen by, so a particle at the back would find now one of
    them, now a rib's; crura and arcuate ligaments hold the diaphragm at the spine, not contact.

    Parameters
    ----------
    sheet : (n, 3), points of each face
    body : (n_bound,), body of each point
    spine : bodies of the vertebral column
    """
    return sheet[~np.isin(body[sheet], sorted(spine)).all(axis=1)]


TIE = 1e-6
"""Difference of barycentric weights that counts as none."""


def build_contacts(x: Floats, dome: Ints, sheet: Ints, axis: float) -> Contacts:
    """Contacts of the particles `dome` with the faces `sheet` (n, 3), seen from the axis X, m."""
    weight, normal, normals = np.zeros(3), np.zeros(3), np.zeros_like(x)
    start = []
    for p in dome:
        inside = np.array(
            [
                cross_sheet(x, sheet, g, p, axis, normals, weight, normal)[1]
                for g in range(len(sheet))
            ]
        )
        # in the mid-plane two mirrored faces are as good: the first, not what rounding says
        start.append(int(np.argmax(inside > inside.max() - TIE)))
    return Contacts(
        point=dome,
        face=sheet,
        corner=np.unique(sheet),
        neighbour=_neighbours(sheet),
        start=np.array(start, dtype=np.int64),
        axis=axis,
    )
