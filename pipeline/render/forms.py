"""Balls and tubes as triangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from pipeline.look import linear
from sim.physics.types import Ints

Floats = NDArray[np.float64]

SIDES = 8
"""Of the tube that a muscle's element is drawn as."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Triangles:
    """Corners of a moment: (n, 3) each, m, unit vectors outward, and light."""

    places: Floats
    normals: Floats
    colours: Floats


def unit(vectors: Floats) -> Floats:
    """Vectors (..., 3) of length one."""
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12))


def copies(centres: Floats, corners: Floats, colour: str) -> Triangles:
    """A round thing about each centre (n, 3)."""
    places = (centres[:, None] + corners).reshape(-1, 3)
    return Triangles(
        places=places,
        normals=np.tile(unit(corners), (len(centres), 1)),
        colours=np.tile(linear(colour), (len(places), 1)),
    )


def ball(n: int = 200) -> tuple[Floats, Ints]:
    """Unit ball of n corners on a spiral."""
    k = np.arange(n) + 0.5
    up, turn = 1.0 - 2.0 * k / n, np.pi * (1.0 + 5**0.5) * k
    flat = np.sqrt(1.0 - up**2)
    corners = np.column_stack([flat * np.cos(turn), flat * np.sin(turn), up])
    faces = ConvexHull(corners).simplices.astype(np.int64)
    a, b, c = corners[faces].swapaxes(0, 1)
    inward = (np.cross(b - a, c - a) * a).sum(axis=1) < 0
    faces[inward] = faces[inward, ::-1]
    return corners, faces


def tube_faces(count: int) -> Ints:
    """Two triangles a side between the rings of each tube, outward."""
    k = np.arange(SIDES)
    on = (k + 1) % SIDES
    one = np.concatenate([
        np.column_stack([k, on, k + SIDES]), np.column_stack([on, on + SIDES, k + SIDES])
    ])  # fmt: skip
    shifts = 2 * SIDES * np.arange(count)
    return np.asarray((shifts[:, None, None] + one).reshape(-1, 3))


def tubes(ends: Floats, radius: Floats, colour: Floats) -> Triangles:
    """Tubes between ends (n, 2, 3), of a radius and a light each."""
    way = unit(ends[:, 1] - ends[:, 0])
    # any vector that is not along the tube
    other = np.where(np.abs(way[:, 2:]) < 0.8, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]])
    across = unit(np.cross(way, other))
    third = np.cross(way, across)
    angle = 2.0 * np.pi * np.arange(SIDES) / SIDES
    ring = np.cos(angle)[:, None] * across[:, None] + np.sin(angle)[:, None] * third[:, None]
    places = ends[:, :, None] + (radius[:, None, None] * ring)[:, None]
    normals = np.broadcast_to(ring[:, None], places.shape)
    colours = np.broadcast_to(colour[:, None, None], places.shape)
    return Triangles(
        places=places.reshape(-1, 3), normals=normals.reshape(-1, 3), colours=colours.reshape(-1, 3)
    )
