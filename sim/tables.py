"""The numbers of the model: tables in `sim/data`, each with its source.

A named set of parameters is a folder of `sim/data`: a table there takes the place of that of the
calibrated set, and the rows of its `parameters.csv` those of the same name.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sim.errors import ParameterError
from sim.physics.types import Floats

if TYPE_CHECKING:
    from sim.model.anatomy import Subject

DATA = Path(__file__).parent / "data"
CALIBRATED = "calibrated"
SETS = (CALIBRATED, "papers")


@dataclass(frozen=True, kw_only=True, slots=True)
class Parameters:
    """Named numbers in the units of their table (SI, angles in degrees).

    Parameters
    ----------
    name : of the set, whose tables come before those of the calibrated one
    """

    numbers: dict[str, float]
    name: str = CALIBRATED

    def __getitem__(self, name: str) -> float:
        if name not in self.numbers:
            raise ParameterError(f"parameters: no {name!r}. There are: {', '.join(self.numbers)}.")
        return self.numbers[name]

    def replace(self, **changes: float) -> Parameters:
        """A copy with some numbers changed; unknown names are refused."""
        for name in changes:
            self[name]
        return Parameters(numbers={**self.numbers, **changes}, name=self.name)

    def rows(self, table: str) -> list[dict[str, str]]:
        """Rows of a table as this set has it."""
        own = Path(self.name) / table
        return read_rows(str(own) if (DATA / own).is_file() else table)


def read_rows(name: str) -> list[dict[str, str]]:
    """Rows of a table in `sim/data`."""
    with (DATA / name).open(newline="", encoding="utf-8") as lines:
        return list(csv.DictReader(line for line in lines if not line.startswith("#")))


@cache
def parameters(name: str = CALIBRATED) -> Parameters:
    """A named parameter set, one of `SETS`.

    Raises
    ------
    ParameterError
        if there is none of this name, or it changes a number that does not exist
    """
    if name not in SETS:
        raise ParameterError(f"parameters: no set {name!r}. There are: {', '.join(SETS)}.")
    numbers = {row["name"]: float(row["value"]) for row in read_rows("parameters.csv")}
    base = Parameters(numbers=numbers, name=name)
    if name == CALIBRATED:
        return base
    return base.replace(**{row["name"]: float(row["value"]) for row in base.rows("parameters.csv")})


@cache
def bone_arrays() -> dict[str, np.ndarray]:
    """Arrays of `bones.npz`; `bones.json` says where they come from."""
    with np.load(DATA / "bones.npz") as archive:
        return {key: archive[key] for key in archive.files}


def body_size(subject: Subject) -> dict[str, float]:
    """Skin-side sizes of the population of this sex, stature and mass, m (ANSUR II)."""
    out = {}
    for row in read_rows("body_size.csv"):
        if row["sex"] != subject.sex:
            continue
        if row["intercept_m"]:
            value = float(row["intercept_m"]) + float(row["per_stature"]) * subject.stature
            value += float(row["per_mass_m_per_kg"]) * subject.mass
        elif row["fraction_of_stature"]:
            value = float(row["fraction_of_stature"]) * subject.stature
        else:
            value = float(row["mean_m"])
        out[row["quantity"]] = value
    return out


def column(rows: list[dict[str, str]], name: str) -> Floats:
    """One numeric column of a table."""
    return np.array([float(row[name]) for row in rows])
