"""`pleura skin`: another skin on a trajectory, and its binding as a table."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from pipeline.binding_file import read_binding, write_binding
from pipeline.own_mesh import own_skin
from sim.errors import InputError, ParameterError
from sim.motion import Motion, belly_faces
from sim.skin.binding import SMOOTH
from sim.skin.bound import BoundSkin
from sim.skin.dress import dress
from sim.trajectory import load_motion, save_motion

MM = 1e-3
FAT_MM = (0.0, 150.0)


@dataclass(frozen=True, kw_only=True, slots=True)
class SkinTask:
    """What is asked.

    Parameters
    ----------
    trajectory : file that is read
    out : trajectory that is written, with the skin; binding : table that is written
    use : edited table that is read
    mesh, landmarks, unit, up : a mesh of one's own, and how it stands
    method : of binding
    age_years, fat_mm : of the human skin
    """

    trajectory: Path
    out: Path | None = None
    binding: Path | None = None
    use: Path | None = None
    mesh: Path | None = None
    landmarks: Path | None = None
    unit: str = "m"
    up: str = "y"
    method: str | None = None
    age_years: float | None = None
    fat_mm: float | None = None


def _check(task: SkinTask) -> None:
    if task.out is None and task.binding is None:
        raise ParameterError("skin: nothing to write. Give --out RUN.h5 or --binding TABLE.csv.")
    if task.landmarks is not None and task.mesh is None:
        raise ParameterError("skin: --landmarks are those of a mesh. Give --mesh too.")
    if task.mesh is not None and task.age_years is not None:
        raise ParameterError("skin: --age-years is for the human skin. Leave --mesh out.")
    if task.fat_mm is not None and not FAT_MM[0] <= task.fat_mm <= FAT_MM[1]:
        raise ParameterError(
            f"skin: --fat-mm is {task.fat_mm:g}. Give {FAT_MM[0]:g} to {FAT_MM[1]:g}."
        )
    if task.out is not None and task.out.suffix.lower() != ".h5":
        raise ParameterError(f"skin: --out {task.out} is no trajectory. Let it end in .h5.")


def _skin(task: SkinTask, motion: Motion) -> BoundSkin:
    if motion.rest is None:
        raise InputError(
            f"{task.trajectory}: has no rest pose, as older files have none. Make it anew with"
            " 'pleura simulate STYLE --out FILE.h5'."
        )
    fat = None if task.fat_mm is None else MM * task.fat_mm
    method = task.method or SMOOTH
    human = (task.method, task.age_years, fat) != (None, None, None) or motion.skin is None
    if task.mesh is not None:
        return own_skin(
            task.mesh, motion, unit=task.unit, up=task.up, landmarks=task.landmarks,
            method=method, fat_layer=fat,
        )  # fmt: skip
    if human or motion.skin is None:
        return dress(
            motion.rest, motion.shapes, belly_faces(motion), age=task.age_years, fat_layer=fat,
            method=method,
        )  # fmt: skip
    return motion.skin


def run_skin(task: SkinTask) -> list[str]:
    """Do what is asked; return lines about it.

    Raises
    ------
    InputError, ParameterError
        for what cannot be read, written or done
    """
    _check(task)
    motion, about = load_motion(task.trajectory)
    skin = _skin(task, motion)
    if task.use is not None:
        skin = read_binding(task.use, skin)
    lines = [f"{task.trajectory}: skin of {len(skin.vertices)} vertices, {len(skin.faces)} faces"]
    if task.binding is not None:
        rows = write_binding(task.binding, skin)
        lines.append(f"  {task.binding}: {rows} rows")
    if task.out is not None:
        save_motion(task.out, replace(motion, skin=skin), about)
        lines.append(f"  {task.out}")
    return lines
