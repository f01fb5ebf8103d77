"""Published bands and the verdict on each: tables in, judged rows out."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from pipeline import page
from sim.errors import ParameterError

CLASSES = ("emergent", "tuned", "imposed")
FINDING = "finding"
COMPARISON = "cross"
TABLE, MECHANISMS, LEFT_OUT = (
    page.TABLES / f"validation{part}.csv" for part in ("", "_mechanisms", "_left_out")
)
PEOPLE = ("male", "female")
Figures = Mapping[str, Any]


class Verdict(StrEnum):
    """What came of a row."""

    IN = "in"
    OUT = "out"
    NO_RANGE = "no range"
    NOT_THERE = "not stated"


@dataclass(frozen=True, kw_only=True, slots=True)
class Band:
    """A published quantity; `low` or `high` not a number: no limit on that side.

    Parameters
    ----------
    set : number in the reference's suggested validation set, or empty
    sex : "male", "female" or "both"
    figure : name of our value, `static.NAME`, `BEHAVIOUR_POSTURE.NAME` or `cross.NAME`
    value : central value, not a number where the source gives none for this row
    unit : of the limits and the value; "finding" for a statement that is true or not
    kind : "emergent", "tuned" or "imposed"
    """

    set: str
    area: str
    quantity: str
    condition: str
    sex: str
    posture: str
    figure: str
    low: float
    high: float
    value: float
    unit: str
    citation: str
    doi: str
    verified: str
    kind: str
    note: str

    def __post_init__(self) -> None:
        if self.kind not in CLASSES:
            raise ParameterError(f"{TABLE.name}: {self.quantity}: no class '{self.kind}'.")
        if self.low >= self.high:
            raise ParameterError(f"{TABLE.name}: {self.quantity}: low is not below high.")


@dataclass(frozen=True, kw_only=True, slots=True)
class Judged:
    """A band with what the torso does.

    Parameters
    ----------
    value : ours, not a number when it is a finding, lies beyond what was tried, or is missing
    shown : ours as text
    why : mechanism of a value that is out, or reason why there is none
    """

    band: Band
    value: float
    shown: str
    verdict: Verdict
    why: str


def _limit(text: str) -> float:
    return float(text) if text not in ("", "yes") else math.nan


def read_bands() -> list[Band]:
    """All rows of validation.csv."""
    keys = ("set", "area", "quantity", "condition", "sex", "posture", "figure", "unit", "citation",
            "doi", "verified", "note")  # fmt: skip
    return [
        Band(
            **{key: row[key] for key in keys},
            low=_limit(row["low"]),
            high=_limit(row["high"]),
            value=_limit(row["value"]),
            kind=row["class"],
        )
        for row in page.read_rows(TABLE)
    ]


def read_mechanisms() -> dict[tuple[str, str], str]:
    """(figure, side) to one line of why; the side is low, high or no (a finding)."""
    return {(row["figure"], row["side"]): row["why"] for row in page.read_rows(MECHANISMS)}


def compare(low: float, high: float, value: float) -> str:
    """Side on which a value leaves a band: "low", "high", or "" for none."""
    if value < low:
        return "low"
    return "high" if value > high else ""


def _found(band: Band, people: Mapping[str, Mapping[str, Any]]) -> Any:
    """Our value of a band, or None."""
    if band.sex in PEOPLE:
        return people[band.sex]["figures"].get(band.figure)
    man, woman = (people[sex]["figures"].get("calm_upright.rib_cage_share") for sex in PEOPLE)
    return None if man is None or woman is None else bool(woman > man)


def _why_missing(band: Band, people: Mapping[str, Mapping[str, Any]]) -> str:
    """Why a band has no value; a comparison lacks one when any run of its people stopped."""
    run = band.figure.split(".")[0]
    sexes = (band.sex,) if band.sex in PEOPLE else PEOPLE
    stopped = {name: why for sex in sexes for name, why in people[sex]["missing"].items()}
    if run == COMPARISON and stopped:
        return "; ".join(f"{name}: {why}" for name, why in stopped.items())
    return str(stopped.get(run, "was not simulated"))


def judge(
    band: Band, people: Mapping[str, Mapping[str, Any]], mechanisms: Mapping[tuple[str, str], str]
) -> Judged:
    """Compare a band with what was simulated.

    Parameters
    ----------
    people : sex to the record of that person's runs
    mechanisms : see `read_mechanisms`
    """
    found = _found(band, people)
    if found is None:
        why = _why_missing(band, people)
        return Judged(band=band, value=math.nan, shown="–", verdict=Verdict.NOT_THERE, why=why)
    if band.unit == FINDING:
        side, value, shown = "" if found else "no", math.nan, "yes" if found else "no"
    elif isinstance(found, str):
        # the end of what was tried, "> 25": beyond it, and it lies outside every band we have
        value, shown = math.nan, found
        side = compare(band.low, band.high, math.inf if found[0] == ">" else -math.inf)
    elif math.isnan(band.low) and math.isnan(band.high):
        shown = page.number(float(found))
        return Judged(
            band=band, value=float(found), shown=shown, verdict=Verdict.NO_RANGE, why=band.note
        )
    else:
        value, shown = float(found), page.number(float(found))
        side = compare(band.low, band.high, value)
    why = mechanisms.get((band.figure, side), "not explained yet") if side else ""
    verdict = Verdict.OUT if side else Verdict.IN
    return Judged(band=band, value=value, shown=shown, verdict=verdict, why=why)


def judge_all(people: Mapping[str, Mapping[str, Any]]) -> list[Judged]:
    """Judge every row of the table."""
    mechanisms = read_mechanisms()
    return [judge(band, people, mechanisms) for band in read_bands()]


def counts(rows: Sequence[Judged]) -> dict[str, dict[str, int]]:
    """Number of rows of each class and verdict."""
    return {
        kind: {
            str(verdict): sum(r.band.kind == kind and r.verdict is verdict for r in rows)
            for verdict in Verdict
        }
        for kind in CLASSES
    }


def share_in(rows: Sequence[Judged]) -> float:
    """Share of the judged rows that are in their band; not a number when none was judged."""
    judged = [r for r in rows if r.verdict in (Verdict.IN, Verdict.OUT)]
    return sum(r.verdict is Verdict.IN for r in judged) / len(judged) if judged else math.nan
