"""The tables that every number of the samples comes from, read into SI units."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from pathlib import Path

FOLDER = Path(__file__).parent

TO_SI = {
    "1": 1.0,
    "m": 1.0,
    "mm": 1e-3,
    "mm/mm": 1.0,
    "mm/kg": 1e-3,
    "kg": 1.0,
    "s": 1.0,
    "Hz": 1.0,
    "1/min": 1.0 / 60.0,
    "deg": math.pi / 180.0,
    "deg/deg": 1.0,
    "mL": 1e-6,
    "L": 1e-3,
    "L/m": 1e-3,
    "L/min": 1e-3 / 60.0,
    "L/year": 1e-3,
    "year": 1.0,
}


@dataclass(frozen=True, kw_only=True, slots=True)
class Parameters:
    """Values in SI; a name is looked up for the subject first, then its sex, then everyone."""

    values: dict[str, float]
    subject: str
    sex: str

    def __call__(self, name: str) -> float:
        """Value of `name` in SI units."""
        for key in (f"{self.subject}.{name}", f"{self.sex}.{name}", name):
            if key in self.values:
                return self.values[key]
        raise KeyError(f"parameters.csv: {name}: no such row for {self.subject} ({self.sex}).")


@dataclass(frozen=True, kw_only=True, slots=True)
class MarkerPlace:
    """Where a marker sits: between two named heights, at an azimuth (0 front, + left)."""

    label: str
    start: str
    stop: str
    fraction: float
    azimuth: float
    place: str


def read_parameters(subject: str, sex: str, path: Path = FOLDER / "parameters.csv") -> Parameters:
    """Read `parameters.csv`; each value is turned into SI by its unit."""
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    values = {row["name"]: float(row["value"]) * TO_SI[row["unit"]] for row in rows}
    return Parameters(values=values, subject=subject, sex=sex)


def read_places(path: Path = FOLDER / "markers.csv") -> tuple[MarkerPlace, ...]:
    """Read the 22 marker places of `markers.csv`."""
    with path.open(encoding="utf-8", newline="") as file:
        return tuple(
            MarkerPlace(
                label=row["label"],
                start=row["from"],
                stop=row["to"],
                fraction=float(row["fraction"]),
                azimuth=math.radians(float(row["azimuth_deg"])),
                place=row["place"],
            )
            for row in csv.DictReader(file)
        )
