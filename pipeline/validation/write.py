"""Write reports/physiology.html and .csv from what was simulated."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import groupby, pairwise
from pathlib import Path
from typing import Any

import numpy as np

from pipeline import page, records
from pipeline.citations import citations
from pipeline.draw.physiology import Curves, Measured, diaphragm_svg, rahn_svg
from pipeline.headline import BAD, GOOD, Headline, written
from pipeline.validation.strip import strip
from pipeline.validation.table import (
    CLASSES,
    FINDING,
    LEFT_OUT,
    PEOPLE,
    Band,
    Judged,
    Verdict,
    compare,
    counts,
    judge_all,
    read_bands,
    share_in,
)

COLUMNS = (
    "set",
    "area",
    "quantity",
    "condition",
    "sex",
    "posture",
    "class",
    "verified",
    "low",
    "high",
    "published",
    "value",
    "unit",
    "verdict",
    "why",
    "citation",
    "doi",
    "note",
)
LAST_SECTIONS = (
    ("curves", "Curves"),
    ("methods", "Methods"),
    ("left-out", "Rows that the torso cannot state"),
    ("errors", "Errors"),
)
TARGET = 0.8
"""Share of the emergent rows that should be in their bands; of the tuned ones all should."""
WHO = {"male": "man", "female": "woman", "both": "both"}
POSTURE = {"upright": "", "supine": ", supine", "both": ", both postures"}
VERIFIED = {"yes": "verified", "partial": "partly verified", "no": "recalled"}


def number_cell(value: float) -> str:
    """A number as a table's cell has it; nothing for what is not a number."""
    return "" if math.isnan(value) else f"{value:.6g}"


def verdict_cells(row: Any) -> dict[str, str]:
    """Columns value, verdict and why of a judged row of either page."""
    shown = number_cell(row.value) or row.shown.replace("–", "")
    return {"value": shown, "verdict": str(row.verdict), "why": row.why}


def csv_rows(rows: Sequence[Judged]) -> list[dict[str, str]]:
    """Rows of physiology.csv."""
    out = []
    for r in rows:
        b = r.band
        yes = "yes" if b.unit == FINDING else ""
        out.append(
            {
                **{key: getattr(b, key) for key in ("set", "area", "quantity", "condition", "sex",
                   "posture", "verified", "unit", "citation", "doi", "note")},
                "class": b.kind,
                "low": yes or number_cell(b.low),
                "high": yes or number_cell(b.high),
                "published": number_cell(b.value),
                **verdict_cells(r),
            }
        )  # fmt: skip
    return out


def band_text(band: Band) -> str:
    """A band as it is printed: both limits, one, the value alone, or a statement."""
    low, high = f"{band.low:.6g}".replace("-", "−"), f"{band.high:.6g}".replace("-", "−")
    if band.unit == FINDING:
        return "yes"
    if math.isnan(band.low) and math.isnan(band.high):
        return f"{band.value:.6g}, no range" if not math.isnan(band.value) else "–"
    if math.isnan(band.low):
        return f"up to {high}"
    return f"from {low}" if math.isnan(band.high) else f"{low} to {high}"


def _shown(r: Judged) -> dict[str, Any]:
    b = r.band
    value = r.value
    if math.isnan(value) and r.shown[:1] in "<>":
        value = math.inf if r.shown.startswith(">") else -math.inf
    drawn = not math.isnan(value) and not (math.isnan(b.low) and math.isnan(b.high))
    return {
        "band": b,
        "who": WHO[b.sex] + POSTURE[b.posture],
        "limits": band_text(b),
        "unit": "" if b.unit in (FINDING, "1") else b.unit,
        "shown": r.shown.replace("-", "−"),
        "verdict": str(r.verdict),
        "why": r.why if r.verdict in (Verdict.OUT, Verdict.NOT_THERE) else "",
        "verified": VERIFIED[b.verified],
        "strip": strip(b.low, b.high, value, compare(b.low, b.high, value)) if drawn else "",
    }


def gathered(
    rows: Iterable[dict[str, Any]], place: Callable[[dict[str, Any]], Any]
) -> list[list[dict[str, Any]]]:
    """Neighbouring rows of the same place together, a reason they share told by the last alone."""
    groups = [list(same) for _, same in groupby(rows, key=place)]
    for group in groups:
        for row, after in pairwise(group):
            if row["why"] == after["why"]:
                row["why"] = ""
    return groups


def grouped(rows: Sequence[Judged]) -> list[list[dict[str, Any]]]:
    """Rows as they are shown, those of one quantity and source together."""
    return gathered(map(_shown, rows), lambda row: (row["band"].quantity, row["band"].citation))


def tally(rows: Sequence[Judged]) -> list[dict[str, Any]]:
    """A line a class: counts of verdicts and the share in band, also of verified rows alone."""
    out = []
    for kind, found in counts(rows).items():
        mine = [r for r in rows if r.band.kind == kind]
        sure = [r for r in mine if r.band.verified == "yes"]
        asked = [r for r in mine if r.band.set]
        out.append(
            {
                "kind": kind,
                "n": len(mine),
                **{verdict.replace(" ", "_"): n for verdict, n in found.items()},
                "share": share_in(mine),
                "share_verified": share_in(sure),
                "share_set": share_in(asked),
            }
        )
    return out


def _measured(figure: str, sex: str, volume: float, label: str) -> Measured | None:
    bands = [b for b in read_bands() if b.figure == figure and b.sex == sex]
    if not bands:
        return None
    return Measured(volume=volume, low=bands[0].low, high=bands[0].high, label=label)


def curves(person: Mapping[str, Any]) -> Curves:
    """What the plots need of one person, with the published values of the table."""
    rahn, effort, sex = person["rahn"], person["diaphragm"], str(person["sex"])
    rv, frc, tlc = rahn["capacity"]
    statics = [("wall_pressure_rv", rv, "published"), ("wall_pressure_tlc", tlc, ""),
               ("lung_recoil_frc", frc, ""), ("lung_recoil_tlc", tlc, "")]  # fmt: skip
    efforts = [("pdi_rv", rv, "published"), ("pdi_frc", frc, ""), ("pdi_high", 0.95 * tlc, "")]

    def beside(named: Sequence[tuple[str, float, str]]) -> list[Measured]:
        found = [_measured(f"static.{name}", sex, at, label) for name, at, label in named]
        return [one for one in found if one is not None]

    return Curves(
        title=f"{WHO[sex]}, {person['stature_m']:.4g} m, {person['mass_kg']:.3g} kg",
        volume=np.array(rahn["volume"]),
        wall=np.array(rahn["wall"]),
        lung=np.array(rahn["lung"]),
        capacity=rahn["capacity"],
        effort_volume=np.array(effort["volume"]),
        effort=np.array(effort["pdi"]),
        active_volume=np.array(effort["active_volume"]),
        active=np.array(effort["active_pdi"]),
        statics=beside(statics),
        efforts=beside(efforts),
    )


def problems(people: Mapping[str, Mapping[str, Any]], rows: Sequence[Judged]) -> list[str]:
    """One line for each run that is missing or not steady, with the rows it costs."""
    lines = []
    for sex, person in people.items():
        for run, why in person["missing"].items():
            lost = sum(r.verdict is Verdict.NOT_THERE and r.band.sex == sex
                       and r.band.figure.startswith(f"{run}.") for r in rows)  # fmt: skip
            lines.append(f"{WHO[sex]}: {run.replace('_', ' ')}: {why}; rows without it: {lost}.")
        for name, value in person["figures"].items():
            if name.endswith(".steady") and not value:
                run = name.split(".")[0].replace("_", " ")
                lines.append(f"{WHO[sex]}: {run}: the last breath is not steady yet.")
    return lines


def _head(
    lines: Sequence[Mapping[str, Any]], people: Sequence[Mapping[str, Any]], n_rows: int, made: str
) -> Headline:
    of = {str(line["kind"]): line for line in lines}
    numbers = [
        (f"{line['in']} of {line['in'] + line['out']}", f"{kind} rows in band")
        for kind, line in of.items()
    ]
    share = float(of["emergent"]["share"])
    good = share >= TARGET
    who = " and ".join(
        f"a {WHO[one['sex']]} of {one['stature_m']:.4g} m and {one['mass_kg']:.3g} kg"
        for one in people
    )
    return Headline(
        kind="Physiology",
        title="The torso beside published physiology",
        subtitle=f"{n_rows} rows, one set of parameters; {who}. The same rows are in"
        " physiology.csv beside this page",
        result=f"Of what nothing was set to meet, {100 * share:.0f} % lies in its published band;"
        f" the target is {100 * TARGET:.0f} %.",
        mark=GOOD if good else BAD,
        numbers=tuple(numbers),
        made=made,
    )


def context(people: Mapping[str, Mapping[str, Any]], made: str = "") -> dict[str, Any]:
    """Everything that the template shows; `made` is when the people were simulated."""
    rows = judge_all(people)
    areas: dict[str, list[Judged]] = {}
    for row in rows:
        areas.setdefault(row.band.area, []).append(row)
    sources = sorted({(r.band.citation, r.band.doi) for r in rows})
    drawn = [curves(people[sex]) for sex in PEOPLE]
    lines = tally(rows)
    return {
        "head": _head(lines, list(people.values()), len(rows), made),
        "sections": [
            *((area.replace(" ", "-"), area.capitalize()) for area in areas),
            *LAST_SECTIONS,
        ],
        "citations": citations("physiology"),
        "tally": lines,
        "classes": CLASSES,
        "target": TARGET,
        "areas": {area: grouped(found) for area, found in areas.items()},
        "left_out": page.read_rows(LEFT_OUT),
        "sources": sources,
        "rahn": page.own_ids(rahn_svg(drawn), "rahn"),
        "diaphragm": page.own_ids(diaphragm_svg(drawn), "diaphragm"),
        "checks": checks(people),
        "problems": problems(people, rows),
    }


def checks(people: Mapping[str, Mapping[str, Any]]) -> list[tuple[str, str]]:
    """Properties of the simulation itself: contents kept, spine in a full inspiration."""
    out = []
    for sex, person in people.items():
        f, who = person["figures"], WHO[sex]
        for run in ("calm_upright", "calm_supine", "deep_upright"):
            error = f.get(f"{run}.abdomen_volume_error")
            if error is not None:
                name = f"{who}: largest change of the abdomen's volume, {run.replace('_', ' ')} (%)"
                out.append((name, page.number(error)))
    return out


def write_physiology(folder: Path, reports: Path) -> list[Path]:
    """Write the page and the table beside it.

    Parameters
    ----------
    folder : results of the two people, SEX.json
    reports : where the page goes
    """
    people = {sex: records.read_json(folder / f"{sex}.json") for sex in PEOPLE}
    made = written(folder / f"{sex}.json" for sex in PEOPLE)
    stream = io.StringIO()
    writer = csv.DictWriter(stream, COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(csv_rows(judge_all(people)))
    paths = [reports / "physiology.csv", reports / "physiology.html"]
    records.write_text(paths[0], stream.getvalue())
    records.write_text(paths[1], page.render("physiology.html", **context(people, made)))
    return paths
