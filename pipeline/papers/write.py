"""Write reports/papers.html and .csv from what was simulated."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from markupsafe import Markup

from pipeline import page, records
from pipeline.citations import citations
from pipeline.headline import Headline, written
from pipeline.papers import plots
from pipeline.papers.behaviours import FORMS
from pipeline.papers.cross import read_figures
from pipeline.papers.muscles import judged_muscles
from pipeline.papers.table import (
    LEFT_OUT,
    RUNS,
    Judged,
    Verdict,
    counts,
    judge_all,
)
from pipeline.validation.strip import strip
from pipeline.validation.table import FINDING, compare
from pipeline.validation.write import gathered, number_cell, verdict_cells

COLUMNS = ("section", "paper", "place", "quantity", "run", "printed", "low", "high", "unit",
           "value", "verdict", "why", "band", "note")  # fmt: skip
PARTS = (*FORMS, "map", "experiments")
"""Records of the heavy rules."""
LAST_SECTIONS = (
    ("methods", "Methods"),
    ("left-out", "What is not made anew"),
    ("errors", "Errors"),
)
CLASSES = {Verdict.HOLDS: "good", Verdict.FAILS: "bad"}


def csv_rows(rows: Sequence[Judged]) -> list[dict[str, str]]:
    """Rows of papers.csv."""
    out = []
    for r in rows:
        p = r.row
        same = ("section", "paper", "place", "quantity", "printed", "unit", "band", "note")
        out.append(
            {
                **{key: getattr(p, key) for key in same},
                "run": RUNS[p.form],
                "low": number_cell(p.low),
                "high": number_cell(p.high),
                **verdict_cells(r),
            }
        )
    return out


def limits(low: float, high: float) -> str:
    """Limits as they are printed: both, one, or a single number."""
    lower, upper = (f"{v:.4g}".replace("-", "−") for v in (low, high))
    if math.isnan(low):
        return f"up to {upper}"
    if math.isnan(high):
        return f"from {lower}"
    return lower if low == high else f"{lower} to {upper}"


def shown(r: Judged) -> dict[str, Any]:
    """A row as the template has it."""
    p = r.row
    number = p.unit != FINDING
    drawn = number and not math.isnan(r.value) and p.low != p.high
    return {
        "quantity": p.quantity,
        "place": f"{p.paper}, {p.place}",
        "run": RUNS[p.form],
        "printed": p.printed,
        "limits": limits(p.low, p.high) if number else "yes",
        "unit": p.unit if number and p.unit != "1" else "",
        "band": p.band,
        "shown": r.shown.replace("-", "−"),
        "strip": _strip(p.low, p.high, r.value) if drawn else "",
        "verdict": str(r.verdict),
        "class": CLASSES.get(r.verdict, "soft"),
        "why": r.why,
    }


def _strip(low: float, high: float, value: float) -> Markup:
    # a band that begins or ends at nothing has no size to scale by
    if 0.0 in (low, high) and (math.isnan(low) or math.isnan(high)):
        return Markup()
    return strip(low, high, value, compare(low, high, value))


def grouped(rows: Sequence[Judged]) -> list[list[dict[str, Any]]]:
    """Rows as they are shown; those of one quantity and place together."""
    return gathered(map(shown, rows), lambda row: (row["quantity"], row["place"]))


def by_section(rows: Sequence[Judged]) -> dict[str, list[Judged]]:
    """Rows of every section, in the order of the table."""
    out: dict[str, list[Judged]] = {}
    for row in rows:
        out.setdefault(row.row.section, []).append(row)
    return out


def tally(sections: Mapping[str, Sequence[Judged]]) -> list[dict[str, Any]]:
    """A line a section: its rows and their verdicts."""
    return [
        {"section": name, "n": len(rows), **counts([str(r.verdict) for r in rows])}
        for name, rows in sections.items()
    ]


def problems(parts: Mapping[str, Any], rows: Sequence[Judged]) -> list[str]:
    """One line for each run that is missing, with what it costs, and for old records."""
    lines = []
    for form in FORMS:
        for style, why in parts[form]["missing"].items():
            start = f"{form}.{style}."
            lost = sum(r.verdict is Verdict.NOT_THERE and r.row.figure.startswith(start)
                       for r in rows)  # fmt: skip
            lines.append(f"{RUNS[form]}: {style.replace('_', ' ')}: {why}; rows without it: {lost}")
    lines += [f"{r.row.quantity} ({RUNS[r.row.form]}): {r.why}" for r in rows
              if r.verdict is Verdict.NOT_THERE]  # fmt: skip
    if parts["map"]["figures"]["failed"]:
        lines.append(
            f"map: {parts['map']['figures']['failed']} runs diverged; their cells are blank"
        )
    sources = {name: part["source"] for name, part in parts.items()}
    if len(set(sources.values())) > 1:
        told = ", ".join(f"{name} {source}" for name, source in sources.items())
        lines.append(f"records of different versions of the code stand side by side: {told}")
    return lines


def made(parts: Mapping[str, Any]) -> list[tuple[str, str]]:
    """How long each part took, and of which version it is."""
    lines = [(f"{name}: seconds", page.number(part["seconds"])) for name, part in parts.items()]
    return [*lines, ("version", parts["map"]["version"]), ("code", parts["map"]["source"])]


def _head(whole: Mapping[str, int], n_rows: int, made: str) -> Headline:
    parts = [f"{whole['does not hold']} do not"]
    parts += [f"{whole[word]} {word}" for word in ("in part", "not run") if whole[word]]
    return Headline(
        kind="Papers",
        title="The papers’ tables and figures, made anew",
        subtitle="Zordan 2006, Sanders 2008, DiLorenzo 2009. Every number is from a run of this"
        " torso (man of 1.756 m and 75 kg, upright); the same rows are in papers.csv beside"
        " this page",
        result=f"{whole['holds']} of {n_rows} printed figures and statements hold,"
        f" {', '.join(parts)}.",
        numbers=(
            (f"{whole['holds']} of {n_rows}", "printed figures and statements hold"),
            (str(whole["does not hold"]), "do not hold"),
            (str(whole["in part"]), "hold in part"),
            (str(whole["not run"]), "could not be run"),
        ),
        made=made,
    )


def context(folder: Path) -> dict[str, Any]:
    """Everything that the template shows.

    Parameters
    ----------
    folder : results of the heavy rules
    """
    parts = {name: records.read_json(folder / f"{name}.json") for name in PARTS}
    figures = read_figures(folder)
    rows = [*judge_all(figures), *judged_muscles(folder)]
    sections = by_section(rows)
    whole = counts([str(r.verdict) for r in rows])
    return {
        "head": _head(whole, len(rows), written(folder / f"{name}.json" for name in PARTS)),
        "citations": citations("papers"),
        "rows": rows,
        "misses": [shown(r) for r in rows if r.verdict is Verdict.FAILS],
        "tally": tally(sections),
        "sections": [
            *((name.replace(" ", "-"), name.capitalize()) for name in sections),
            *LAST_SECTIONS,
        ],
        "rows_by_section": {name: grouped(found) for name, found in sections.items()},
        "drawings": plots.drawings(folder, parts, figures),
        "left_out": page.read_rows(LEFT_OUT),
        "parts_of": parts,
        "made": made(parts),
        "problems": problems(parts, rows),
    }


def write_papers(folder: Path, reports: Path) -> list[Path]:
    """Write the page and the table beside it.

    Parameters
    ----------
    folder : results of the heavy rules
    reports : where the page goes
    """
    found = context(folder)
    stream = io.StringIO()
    writer = csv.DictWriter(stream, COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(csv_rows(found["rows"]))
    paths = [reports / "papers.csv", reports / "papers.html"]
    records.write_text(paths[0], stream.getvalue())
    records.write_text(paths[1], page.render("papers.html", **found))
    return paths
