"""`pleura export`: a trajectory as a file for another tool."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from pipeline.bvh import bvh_text
from pipeline.c3d import write_c3d
from pipeline.glb import glb_bytes
from pipeline.records import write_bytes, write_text
from sim.errors import InputError
from sim.motion import Motion, skin_surface
from sim.trajectory import load_motion

MM = 1e3


def _glb(motion: Motion, about: dict[str, Any], out: Path) -> str:
    content, error = glb_bytes(motion, about)
    write_bytes(out, content)
    return (
        f"{len(motion.bodies)} bodies, {len(motion.shapes)} bones and cartilages,"
        f" {len(motion.soft)} soft surfaces within {MM * error:.2f} mm"
    )


def _c3d(motion: Motion, about: dict[str, Any], out: Path) -> str:
    write_c3d(out, motion.marker_names, motion.markers, motion.time)
    return f"{len(motion.marker_names)} markers"


def _bvh(motion: Motion, about: dict[str, Any], out: Path) -> str:
    write_text(out, bvh_text(motion))
    return f"{len(motion.bodies)} joints"


FORMATS = {".glb": _glb, ".c3d": _c3d, ".bvh": _bvh}


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
    motion = replace(motion, soft=motion.soft | {"skin": skin_surface(motion)})
    try:
        told = write(motion, about, out)
    except OSError as error:
        raise InputError(f"{out}: cannot be written ({error}). Choose another place.") from error
    return f"{out}: {told}, {len(motion.time)} frames"
