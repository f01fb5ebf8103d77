"""OpenGL off screen: a context, uniforms, and the corners of a part.

The context is EGL's where there need be no screen (Linux), the system's own elsewhere.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from pipeline.render.parts import Part
from pipeline.render.pose import Moment
from sim.errors import InputError

Floats = NDArray[np.float64]

OPENGL = 330
DEBIAN = "libegl1 libgl1 libgl1-mesa-dri"


def context() -> moderngl.Context:
    """A place to draw in without a screen.

    Raises
    ------
    InputError
        where there is no GL library
    """
    settings: dict[str, Any] = {"backend": "egl"} if sys.platform.startswith("linux") else {}
    try:
        return moderngl.create_context(standalone=True, require=OPENGL, **settings)
    except Exception as error:
        reason = " ".join(str(error).split()).rstrip(".") or type(error).__name__
        raise InputError(
            f"render: no GL library that draws off screen ({reason}). On Debian or Ubuntu:"
            f" apt-get install {DEBIAN}"
        ) from error


def as_matrix(values: Floats) -> bytes:
    """A matrix as OpenGL keeps it, column by column."""
    return np.ascontiguousarray(values.T, dtype=np.float32).tobytes()


def put(program: moderngl.Program, **values: Any) -> None:
    """Set uniforms; what the compiler left out of a program is passed over."""
    for name, value in values.items():
        found = program.get(name, None)
        if not isinstance(found, moderngl.Uniform):
            continue
        if isinstance(value, np.ndarray):
            found.write(as_matrix(value))
        else:
            found.value = value


class Buffers:
    """A part's corners on the graphics side."""

    def __init__(self, gl: moderngl.Context, part: Part, n: int, programs: Sequence[Any]) -> None:
        self.part = part
        self.corners = gl.buffer(reserve=36 * n, dynamic=True)
        faces = gl.buffer(np.ascontiguousarray(part.source.faces, dtype=np.int32).tobytes())
        self.drawn = {}
        for program in programs:
            used = [k for k in ("place", "normal", "colour") if k in program]
            told = " ".join("3f" if k in used else "3x4" for k in ("place", "normal", "colour"))
            self.drawn[program] = gl.vertex_array(program, [(self.corners, told, *used)], faces)

    def fill(self, moment: Moment) -> Floats:
        """Take the corners of a moment; return their places."""
        made = self.part.source.at(moment)
        rows = np.hstack([made.places, made.normals, made.colours])
        self.corners.write(np.ascontiguousarray(rows, dtype=np.float32).tobytes())
        return made.places
