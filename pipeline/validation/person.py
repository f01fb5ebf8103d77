"""Everything that is simulated for one person of the validation table."""

from __future__ import annotations

import time
from collections.abc import Callable
from operator import lt, truediv
from pathlib import Path
from typing import Any

from pipeline import places
from pipeline.records import write_json
from pipeline.validation import burst_figures as bursts
from pipeline.validation import static_figures as static
from pipeline.validation.behaviours import Run, run_behaviour
from pipeline.validation.breath_figures import breath_figures
from pipeline.validation.capacity_figures import capacity_figures
from pipeline.validation.geometry_figures import geometry_figures
from sim.errors import UnstableSimulation
from sim.model.torso import Subject
from sim.resting import RestingTorso, rest_torso

PEOPLE = {
    "male": Subject(sex="male", stature=1.756, mass=75.0),
    "female": Subject(sex="female", stature=1.6285, mass=67.8),
}
"""The man for whom the torso is calibrated; the mean woman of ANSUR II."""

Figures = dict[str, Any]
Measure = Callable[[Run, RestingTorso], Figures]


def _breath(run: Run, resting: RestingTorso) -> Figures:
    return breath_figures(run)


BEHAVIOURS: tuple[tuple[str, str, Measure], ...] = (
    ("calm", "upright", _breath),
    ("calm", "supine", _breath),
    ("deep", "upright", _breath),
    ("vital_capacity", "upright", capacity_figures),
    ("vital_capacity", "supine", capacity_figures),
    ("paradoxical_normal", "upright", _breath),
    ("paradoxical", "upright", _breath),
    ("cough", "upright", bursts.cough_figures),
    ("forced_exhale", "upright", bursts.cough_figures),
    ("sneeze", "upright", bursts.sneeze_figures),
    ("laugh", "upright", bursts.laugh_figures),
)


def behaviour_figures(resting: RestingTorso) -> tuple[Figures, dict[str, str]]:
    """Figures of every behaviour, `BEHAVIOUR_POSTURE.FIGURE`; why some are not there."""
    out: Figures = {}
    missing = {}
    for name, posture, measure in BEHAVIOURS:
        key = f"{name}_{posture}"
        try:
            found = measure(run_behaviour(name, resting, posture), resting)
        except UnstableSimulation as error:
            missing[key] = str(error)
            continue
        out |= {f"{key}.{figure}": value for figure, value in found.items()}
    return out, missing


def _rib_cage_predominates(upright: float, supine: float, full: float) -> bool:
    half = 0.5
    return upright > half and full > half and supine < half


_COMPARED: dict[str, tuple[tuple[str, ...], Callable[..., Any]]] = {
    "quiet_over_deep_sternum":
        (("calm_upright.sternum_way", "deep_upright.sternum_way"), truediv),
    "quiet_over_deep_navel":
        (("calm_upright.navel_way", "deep_upright.navel_way"), truediv),
    "rib_cage_predominates":
        (("calm_upright.rib_cage_share", "calm_supine.rib_cage_share",
          "vital_capacity_upright.rib_cage_share"), _rib_cage_predominates),
    "tidal_falls":
        (("calm_supine.tidal_volume", "calm_upright.tidal_volume"), lt),
}  # fmt: skip
"""Comparison to the figures that it takes, and how."""


def across(f: Figures) -> Figures:
    """Figures `cross.NAME` that compare behaviours of one person.

    One whose behaviours are not all there (a run that diverged has no figures) is left out.
    """
    return {
        f"cross.{name}": compare(*(f[figure] for figure in needed))
        for name, (needed, compare) in _COMPARED.items()
        if all(figure in f for figure in needed)
    }


def simulate_person(sex: str) -> dict[str, Any]:
    """Make every experiment and behaviour of a person.

    Parameters
    ----------
    sex : "male" or "female"
    """
    began = time.monotonic()
    subject = PEOPLE[sex]
    resting = rest_torso(subject)
    rahn, rahn_curve = static.relaxation_figures(resting)
    efforts, effort_curve = static.effort_figures(resting)
    figures = {**rahn, **efforts, **static.rest_figures(resting), **static.inflated_ribs(resting)}
    figures |= static.belly_gain(resting)
    figures |= geometry_figures(resting)
    figures = {f"static.{name}": value for name, value in figures.items()}
    breaths, missing = behaviour_figures(resting)
    breaths |= across(breaths)
    return {
        "sex": subject.sex,
        "stature_m": subject.stature,
        "mass_kg": subject.mass,
        "figures": {**figures, **breaths},
        "missing": missing,
        "rahn": rahn_curve,
        "diaphragm": effort_curve,
        "version": places.version(),
        "source": places.fingerprint(places.PACKAGE.parent),
        "seconds": round(time.monotonic() - began, 1),
    }


def write_person(sex: str, path: Path) -> Path:
    """Simulate a person and write what was found, whole or not at all."""
    write_json(path, simulate_person(sex))
    return path
