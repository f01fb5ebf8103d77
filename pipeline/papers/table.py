"""Printed figures and the verdict on each: tables in, judged rows out."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from pipeline import page
from pipeline.validation.table import FINDING, compare
from sim.errors import ParameterError

TABLE, MECHANISMS, LEFT_OUT = (
    page.TABLES / f"papers_{part}.csv" for part in ("figures", "mechanisms", "left_out")
)
RUNS = {
    "papers": "as printed",
    "calibrated": "calibrated",
    "papers_set": "published set",
    "": "–",
}
"""Form that a row was run in, as the page says it."""


class Verdict(StrEnum):
    """What came of a row."""

    HOLDS = "holds"
    PARTLY = "in part"
    FAILS = "does not hold"
    NOT_THERE = "not run"


@dataclass(frozen=True, kw_only=True, slots=True)
class Printed:
    """A figure or a statement of a paper; `low` or `high` not a number: no limit on that side.

    Parameters
    ----------
    key : of the row, for its mechanisms
    section : of the page
    paper, place : where it stands
    form : "papers", "calibrated", "papers_set" or nothing
    figure : name of our value, `RECORD.NAME`
    printed : the number or the words
    unit : of limits and value; "finding" for a statement that is true or not
    band : where the limits come from
    """

    key: str
    section: str
    paper: str
    place: str
    form: str
    quantity: str
    figure: str
    printed: str
    low: float
    high: float
    unit: str
    band: str
    note: str

    def __post_init__(self) -> None:
        if self.form not in RUNS:
            raise ParameterError(f"{TABLE.name}: {self.key}: no form '{self.form}'.")
        if self.low > self.high:
            raise ParameterError(f"{TABLE.name}: {self.key}: low is above high.")
        if self.unit != FINDING and math.isnan(self.low) and math.isnan(self.high):
            raise ParameterError(f"{TABLE.name}: {self.key}: has neither low nor high.")


@dataclass(frozen=True, kw_only=True, slots=True)
class Judged:
    """A row with what the torso does.

    Parameters
    ----------
    value : ours, not a number for a finding or a run that is missing
    shown : ours as text
    why : one line: the mechanism, or why there is no value
    """

    row: Printed
    value: float
    shown: str
    verdict: Verdict
    why: str


def _limit(text: str) -> float:
    return float(text) if text else math.nan


def read_printed() -> list[Printed]:
    """All rows of papers_figures.csv."""
    return [
        Printed(**{**row, "low": _limit(row["low"]), "high": _limit(row["high"])})  # type: ignore[arg-type]
        for row in page.read_rows(TABLE)
    ]


def read_mechanisms() -> dict[tuple[str, str], str]:
    """(key, side) to one line of why; the side is in, low, high, yes or no.

    A key without the form's name at its end is meant for all forms.
    """
    return {(row["key"], row["side"]): row["why"] for row in page.read_rows(MECHANISMS)}


def judge(
    row: Printed, figures: Mapping[str, Any], mechanisms: Mapping[tuple[str, str], str]
) -> Judged:
    """Compare a row with what was simulated.

    Parameters
    ----------
    figures : our values by name
    """
    found = figures.get(row.figure)
    if found is None:
        return Judged(row=row, value=math.nan, shown="–", verdict=Verdict.NOT_THERE,
                      why=f"the run gave no {row.figure}")  # fmt: skip
    if row.unit == FINDING:
        side, value, shown = ("yes" if found else "no"), math.nan, page.number(bool(found))
    else:
        value = float(found)
        side, shown = compare(row.low, row.high, value) or "in", page.number(found)
    good = side in ("in", "yes")
    told = [mechanisms.get((key, side)) for key in (row.key, row.key.removesuffix(f"_{row.form}"))]
    why = told[0] or told[1] or row.note or ("" if good else "not explained yet")
    verdict = Verdict.HOLDS if good else Verdict.FAILS
    return Judged(row=row, value=value, shown=shown, verdict=verdict, why=why)


def judge_all(figures: Mapping[str, Any]) -> list[Judged]:
    """Judge every row of the table."""
    mechanisms = read_mechanisms()
    return [judge(row, figures, mechanisms) for row in read_printed()]


def counts(verdicts: Sequence[str]) -> dict[str, int]:
    """Number of rows of each verdict."""
    return {str(verdict): sum(v == verdict for v in verdicts) for verdict in Verdict}
