"""A still picture of the torso, for print and for browsers without WebGL."""

from __future__ import annotations

import io

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from sim.motion import Motion

Floats = NDArray[np.float64]

COLOURS = {"bone": "#e6dcc3", "cartilage": "#a9c3c9", "diaphragm": "#c4571f"}
VIEWS = (("from the front", 0.0), ("from the left", 90.0))
"""Titles and turns of the torso about the vertical, degrees."""
LIGHT = np.array([0.55, -0.35, 0.75])
SHADE = (0.45, 0.55)
"""Brightness of what faces away from the light, and what is added by it."""
DOTS = 110
INCHES = (7.6, 5.6)


def bone_triangles(motion: Motion, frame: int) -> list[tuple[str, Floats]]:
    """(tissue, (n, 3, 3) m) of every bone and cartilage in a frame."""
    turns = Rotation.from_quat(motion.quaternion[frame], scalar_first=True)
    out = []
    for shape in motion.shapes.values():
        b = motion.bodies.index(shape.body)
        vertices = turns[b].apply(shape.vertices) + motion.position[frame, b]
        out.append((str(shape.tissue), vertices[shape.faces]))
    return out


def _rgb(colour: str) -> Floats:
    return np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0


def _shaded(triangles: Floats, colour: str) -> Floats:
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1), 1e-15)[:, None]
    facing = np.abs(normal @ (LIGHT / np.linalg.norm(LIGHT)))
    return np.asarray((SHADE[0] + SHADE[1] * facing)[:, None] * _rgb(colour))


def still_png(motion: Motion, frame: int) -> bytes:
    """Skeleton and diaphragm of a frame from the front and from the left, as PNG."""
    dome = motion.soft["diaphragm"]
    parts = [*bone_triangles(motion, frame), ("diaphragm", dome.vertices[frame][dome.faces])]
    figure = Figure(figsize=INCHES, layout="constrained")
    axes = figure.subplots(1, len(VIEWS), squeeze=False)[0]
    every = np.concatenate([t for _, t in parts])
    for axis, (title, degrees) in zip(axes, VIEWS, strict=True):
        turn = Rotation.from_euler("z", -degrees, degrees=True).as_matrix()
        seen = every @ turn.T
        order = np.argsort(seen[:, :, 0].mean(axis=1))
        colour = np.concatenate([_shaded(t @ turn.T, COLOURS[name]) for name, t in parts])
        flat = seen[:, :, 1:]
        colour = colour[order]
        drawn = PolyCollection(list(flat[order]), facecolors=colour, edgecolors=colour, lw=0.3)
        axis.add_collection(drawn)
        axis.set_aspect("equal")
        axis.autoscale_view()
        axis.set_title(title)
        axis.set_axis_off()
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=DOTS)
    return stream.getvalue()
