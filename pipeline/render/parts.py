"""What is drawn of a moment, as triangles with normals and colours."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from pipeline.look import MARKER, SIMULATED, fibre_width, linear, ramp
from pipeline.render.forms import Triangles, ball, copies, tube_faces, tubes, unit
from pipeline.render.pose import Moment
from pipeline.scene import layers
from sim.model.bone_shapes import Shape
from sim.model.landmarks import vertex_normals
from sim.motion import Motion
from sim.physics.types import Ints

Floats = NDArray[np.float64]

NEARER = {"soft": 0.01, "markers": 0.02}
"""m by kind: bones that lie in a surface do not show through it, nor does it hide its markers."""


class Source(Protocol):
    """Makes the triangles of a moment; its faces never change."""

    faces: Ints

    def at(self, moment: Moment) -> Triangles:
        """Return the corners at a moment."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Part:
    """One thing that is drawn.

    Parameters
    ----------
    layer, kind : of `viewer_layers.csv`
    opacity : from 0 to 1
    """

    layer: str
    kind: str
    opacity: float
    source: Source

    @property
    def solid(self) -> bool:
        """Whether it hides what is behind it."""
        return self.opacity >= 0.99

    @property
    def glass(self) -> bool:
        """Whether both its sides are seen."""
        return self.kind == "soft" and not self.solid

    @property
    def nearer(self) -> float:
        """How much nearer it is drawn, m."""
        return NEARER.get(self.kind, 0.0) if self.solid else 0.0


class Rigid:
    """Bones or cartilages on their bodies."""

    def __init__(self, shapes: list[Shape], bodies: tuple[str, ...], colour: str) -> None:
        counts = [len(shape.vertices) for shape in shapes]
        first = np.concatenate([[0], np.cumsum(counts)[:-1]])
        parts = zip(shapes, first, strict=True)
        self.faces = np.concatenate([shape.faces + start for shape, start in parts])
        self._own = np.concatenate([shape.vertices for shape in shapes])
        self._normals = np.concatenate([vertex_normals(s.vertices, s.faces) for s in shapes])
        self._body = np.repeat([bodies.index(shape.body) for shape in shapes], counts)
        self._colours = np.tile(linear(colour), (len(self._own), 1))

    def at(self, moment: Moment) -> Triangles:
        """Return the corners at a moment."""
        turn = moment.rotation[self._body]
        return Triangles(
            places=np.einsum("nij,nj->ni", turn, self._own) + moment.position[self._body],
            normals=np.einsum("nij,nj->ni", turn, self._normals),
            colours=self._colours,
        )


class Skin:
    """A soft surface."""

    def __init__(self, name: str, faces: Ints, n_vertices: int, colour: str) -> None:
        self.faces, self._name = faces, name
        ones = np.ones(faces.size)
        where = (faces.ravel(), np.repeat(np.arange(len(faces)), 3))
        self._around = sparse.csr_matrix((ones, where), shape=(n_vertices, len(faces)))
        self._colours = np.tile(linear(colour), (n_vertices, 1))

    def at(self, moment: Moment) -> Triangles:
        """Return the corners at a moment."""
        places = moment.soft[self._name]
        a, b, c = (places[self.faces[:, k]] for k in range(3))
        normals = np.asarray(self._around @ np.cross(b - a, c - a))
        return Triangles(places=places, normals=unit(normals), colours=self._colours)


class Fibres:
    """Muscle elements as tubes, thick and bright by tension."""

    def __init__(self, n_elements: int) -> None:
        self.faces = tube_faces(n_elements)

    def at(self, moment: Moment) -> Triangles:
        """Return the corners at a moment."""
        return tubes(moment.ends, 0.5 * fibre_width(moment.level), ramp(moment.level))


class Spots:
    """Simulated markers as balls."""

    def __init__(self, n_markers: int) -> None:
        self._ball, faces = ball()
        shifts = len(self._ball) * np.arange(n_markers)
        self.faces = (shifts[:, None, None] + faces).reshape(-1, 3)

    def at(self, moment: Moment) -> Triangles:
        """Return the corners at a moment."""
        return copies(moment.markers, MARKER * self._ball, SIMULATED)


def _source(motion: Motion, row: Mapping[str, str]) -> Source | None:
    """What a layer shows of a motion, if anything."""
    name, kind, colour = row["layer"], row["kind"], row["colour"]
    if kind == "rigid":
        shapes = [shape for shape in motion.shapes.values() if shape.tissue == name]
        return Rigid(shapes, motion.bodies, colour) if shapes else None
    if kind == "muscles" and motion.elements is not None:
        return Fibres(len(motion.elements.group))
    if kind == "markers" and motion.marker_names:
        return Spots(len(motion.marker_names))
    if kind == "soft" and name in motion.soft:
        soft = motion.soft[name]
        return Skin(name, soft.faces, soft.vertices.shape[1], colour)
    return None


def parts(motion: Motion, opacity: Mapping[str, float]) -> list[Part]:
    """Everything to draw, in the order of the layers.

    Parameters
    ----------
    opacity : from 0 to 1, by layer; what is not named is not drawn
    """
    out = []
    for row in sorted(layers(), key=lambda row: int(row["order"])):
        much = opacity.get(row["layer"], 0.0)
        source = _source(motion, row) if much > 0.01 else None
        if source is not None:
            out.append(Part(layer=row["layer"], kind=row["kind"], opacity=much, source=source))
    return out
