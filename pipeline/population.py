"""The size of a subject; what the table leaves empty comes from a population."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from pipeline.page import TABLES, read_rows


@dataclass(frozen=True, kw_only=True, slots=True)
class Size:
    """Sex, stature in m and mass in kg, and one line for each that was not measured."""

    sex: str
    stature: float
    mass: float
    notes: tuple[str, ...]


def subject_age(row: Mapping[str, str]) -> float | None:
    """Return the age in years of a checked row, for the skin's looks, or none."""
    return float(row["age_years"]) if row.get("age_years") else None


def subject_size(row: Mapping[str, str]) -> Size:
    """Return the size of a checked row of the table of subjects.

    A missing mass keeps the population's body mass index at the subject's stature.

    Parameters
    ----------
    row : cells of config/subjects.tsv as text
    """
    means = {mean["sex"]: mean for mean in read_rows(TABLES / "population.csv")}
    mean = means[row["sex"]]
    mean_stature, mean_mass = float(mean["stature_m"]), float(mean["mass_kg"])
    stature = float(row["stature_m"] or mean_stature)
    mass = float(row["mass_kg"] or mean_mass * (stature / mean_stature) ** 2)
    notes = []
    if not row["stature_m"]:
        notes.append(f"stature is not known: {stature:.2f} m taken, {mean['source']}")
    if not row["mass_kg"]:
        notes.append(
            f"mass is not known: {mass:.0f} kg taken, the body mass index of {mean['source']}"
        )
    return Size(sex=row["sex"], stature=stature, mass=mass, notes=tuple(notes))
