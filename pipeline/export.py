"""`pleura export`: a trajectory as a file for another tool."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.alembic import write_alembic
from pipeline.bvh import bvh_text
from pipeline.c3d import write_c3d
from pipeline.extras import need
from pipeline.glb import glb_bytes
from pipeline.records import write_bytes, write_text
from pipeline.usd import write_usd
from sim.errors import InputError
from sim.motion import Motion, skinned
from sim.trajectory import load_motion

MM = 1e3


def _told(motion: Motion) -> str:
    return (
        f"{len(motion.bodies)} bodies, {len(motion.shapes)} bones and cartilages,"
        f" {len(motion.soft)} soft surfaces"
    )


def _glb(motion: Motion, about: dict[str, Any], out: Path) -> str:
    content, error = glb_bytes(motion, about)
    write_bytes(out, content)
    return f"{_told(motion)} within {MM * error:.2f} mm"


def _c3d(motion: Motion, about: dict[str, Any], out: Path) -> str:
    write_c3d(out, motion.marker_names, motion.markers, motion.time)
    return f"{len(motion.marker_names)} markers"


def _bvh(motion: Motion, about: dict[str, Any], out: Path) -> str:
    write_text(out, bvh_text(motion))
    return f"{len(motion.bodies)} joints"


def _rate(motion: Motion) -> float:
    """Frames a second; those of a file are evenly spaced."""
    n = len(motion.time)
    return round((n - 1) / float(np.ptp(motion.time)), 6) if n > 1 else 1.0


def _usd(motion: Motion, about: dict[str, Any], out: Path) -> str:
    need(("pxr",), extra="usd", out=out)
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / f"torso{out.suffix.lower()}"
        write_usd(motion, about, _rate(motion), made)
        write_bytes(out, made.read_bytes())
    elements = 0 if motion.elements is None else len(motion.elements.group)
    return f"{_told(motion)}, {elements} muscle elements"


def _abc(motion: Motion, about: dict[str, Any], out: Path) -> str:
    need(("alembic3d",), extra="alembic", out=out)
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / "torso.abc"
        write_alembic(motion, _rate(motion), made)
        write_bytes(out, made.read_bytes())
    return _told(motion)


FORMATS = {
    ".glb": _glb, ".c3d": _c3d, ".bvh": _bvh, ".abc": _abc,
    ".usd": _usd, ".usda": _usd, ".usdc": _usd,
}  # fmt: skip


def export(trajectory: Path, out: Path) -> str:
    """Write a trajectory in the format that the ending of `out` names; return one line about it.

    Raises
    ------
    InputError
        for a file that is no trajectory, an unknown ending, or a place that cannot be written
    """
    write = FORMATS.get(out.suffix.lower())
    if write is None:
        raise InputError(f"{out}: unknown ending. Use one of {', '.join(FORMATS)}.")
    motion, about = load_motion(trajectory)
    motion = skinned(motion)
    try:
        told = write(motion, about, out)
    except OSError as error:
        raise InputError(f"{out}: cannot be written ({error}). Choose another place.") from error
    return f"{out}: {told}, {len(motion.time)} frames"
