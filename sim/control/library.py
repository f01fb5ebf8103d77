"""Behaviours that come with the program: control files in `sim/data/behaviours`."""

from __future__ import annotations

from pathlib import Path

from sim.control.channels import unknown
from sim.control.controls import Controls
from sim.control.reader import read_controls
from sim.errors import ParameterError
from sim.tables import DATA

BEHAVIOURS = DATA / "behaviours"
FORMS = ("calibrated", "papers")
"""`calibrated` on the upright reference man; `papers` as printed."""
STYLES = (
    "calm", "deep", "vital_capacity", "panting", "forced_exhale", "giggle", "laugh", "belly_laugh",
    "cough", "sneeze", "paradoxical", "paradoxical_normal",
)  # fmt: skip


def behaviour_file(name: str, form: str = "calibrated") -> Path:
    """The control file of a behaviour.

    Raises
    ------
    ParameterError
        if there is none
    """
    if name not in STYLES:
        raise unknown("simulate: style", name, STYLES)
    path = BEHAVIOURS / form / f"{name}.xml"
    if not path.is_file():
        there = ", ".join(s for s in STYLES if (BEHAVIOURS / form / f"{s}.xml").is_file())
        raise ParameterError(f"simulate: {name} has no form '{form}'. There are: {there}.")
    return path


def find_controls(style: str, form: str = "calibrated") -> Controls:
    """Controls of a behaviour by name, or of a file that ends in `.xml`.

    Raises
    ------
    ParameterError, ControlFileError
        if there is none, or it cannot be used
    """
    if style.lower().endswith(".xml"):
        return read_controls(Path(style))
    return read_controls(behaviour_file(style, form))
