"""Alembic: bodies as moving transforms, soft surfaces as moving points; metres, Y up.

A file of this kind states no axes, and those who read it take Y for up, so vectors are turned as in
`pipeline.glb`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pipeline.glb import turned, turned_quaternions
from sim.motion import Motion

Floats = NDArray[np.float64]


class _Writer:
    """An archive that is filled; the library is imported when somebody asks for a file."""

    def __init__(self, rate: float, path: Path) -> None:
        import imath
        from alembic3d import Abc, AbcCoreAbstract, AbcGeom

        self.imath, self.Geom = imath, AbcGeom
        self.archive = Abc.OArchive(str(path))
        sampling = AbcCoreAbstract.TimeSampling(1.0 / rate, 0.0)
        self.times = self.archive.addTimeSampling(sampling)
        self.root = AbcGeom.OXform(self.archive.getTop(), "torso")
        self.root.getSchema().set(AbcGeom.XformSample())

    def points(self, values: Floats) -> Any:
        """Rows of three as the library keeps them."""
        return self.imath.V3fArrayFromBuffer(np.ascontiguousarray(values, dtype=np.float32))

    def whole(self, values: Any) -> Any:
        """Whole numbers as the library keeps them."""
        return self.imath.IntArrayFromBuffer(np.ascontiguousarray(values, dtype=np.int32))

    def mesh(self, above: Any, name: str, points: Floats, faces: Any) -> None:
        """Add a surface of triangles, of turned points (n, 3) once or (n_frames, n, 3)."""
        moving = points.ndim == 3
        frames = points if moving else points[None]
        extra = (self.times,) if moving else ()
        schema = self.Geom.OPolyMesh(above, _word(name), *extra).getSchema()
        # its faces are wound the other way round from everybody else's
        order = self.whole(np.ravel(np.asarray(faces)[:, ::-1]))
        counts = self.whole(np.full(len(faces), 3))
        for frame in frames:
            schema.set(self.Geom.OPolyMeshSchemaSample(self.points(frame), order, counts))

    def transform(self, name: str, matrices: Floats) -> Any:
        """Add a moving transform of matrices (n_frames, 4, 4) that rows are multiplied by."""
        made = self.Geom.OXform(self.root, _word(name), self.times)
        for matrix in matrices:
            sample = self.Geom.XformSample()
            sample.setMatrix(self.imath.M44d(*matrix.ravel().tolist()))
            made.getSchema().set(sample)
        return made


def _word(name: str) -> str:
    """A name without what parts names in an archive."""
    return name.replace("/", "_")


def _matrices(place: Floats, turn: Floats | None = None) -> Floats:
    """Matrices (n_frames, 4, 4) of turned places (n_frames, 3) and quaternions x y z w."""
    out = np.tile(np.eye(4), (len(place), 1, 1))
    out[:, 3, :3] = place
    if turn is not None:
        out[:, :3, :3] = Rotation.from_quat(turn).as_matrix().swapaxes(1, 2)
    return out


def write_alembic(motion: Motion, rate: float, path: Path) -> None:
    """Write a trajectory as Alembic (Ogawa).

    Parameters
    ----------
    rate : Hz, of the frames
    """
    out = _Writer(rate, path)
    position, turn = turned(motion.position), turned_quaternions(motion.quaternion)
    for b, body in enumerate(motion.bodies):
        node = out.transform(body, _matrices(position[:, b], turn[:, b]))
        for name, shape in motion.shapes.items():
            if shape.body == body:
                out.mesh(node, name, turned(shape.vertices), shape.faces)
    for name, soft in motion.soft.items():
        out.mesh(out.root, name, turned(soft.vertices), soft.faces)
    places = turned(motion.markers)
    for m, name in enumerate(motion.marker_names):
        out.transform(f"marker_{name}", _matrices(places[:, m]))
