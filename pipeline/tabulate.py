"""Pages over all recordings of a study: the error table and the group."""

from __future__ import annotations

import csv
import io
import math
import statistics
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pipeline import page, status
from pipeline.headline import BAD, GOOD, Headline, written
from pipeline.records import write_text
from pipeline.report_tables import columns, main_error

ERROR_COLUMNS = (
    "recording",
    "subject",
    "status",
    "scope",
    "n_cycles",
    "error_p_mm",
    "error_v_mm_s",
    "error_p_still_mm",
    "reference_1_mm",
    "reference_2_mm",
    "reference_4_mm",
    "explained",
    "spread_mm",
    "front_error_p_mm",
    "front_error_v_mm_s",
    "front_error_p_still_mm",
    *page.GROUPS,
    "source",
)
FRONT = ("error_p_mm", "error_v_mm_s", "error_p_still_mm")


def _subject(folder: Path) -> str:
    record = status.read_status(folder, "markers")
    return str(record.get("run", {}).get("subject", {}).get("subject", ""))


def subject_levels(folder: Path) -> dict[str, dict[str, str]]:
    """Return group to its row of activations.csv for the subject's mean breath."""
    rows = page.read_rows(folder / "activations.csv")
    return {row["group"]: row for row in rows if row.get("scope") == page.SUBJECT_MEAN}


def error_rows(results: Path, names: Sequence[str]) -> page.Rows:
    """Return one row a recording and the papers' rows beside them.

    Parameters
    ----------
    results : folder with one folder a recording
    names : the recordings
    """
    rows: page.Rows = []
    for name in names:
        folder = results / name
        bad = status.first_problem(folder)
        errors = page.read_rows(folder / "errors.csv")
        front = main_error(errors, "sagittal")
        row = {**main_error(errors), **{f"front_{key}": front.get(key, "") for key in FRONT}}
        row |= {group: found["level"] for group, found in subject_levels(folder).items()}
        row |= {"recording": name, "subject": _subject(folder), "source": "this study"}
        row["status"] = str(bad["reason"]) if bad else status.OK
        rows.append(row)
    for paper in page.read_rows(page.TABLES / "dilorenzo_table_5_2.csv"):
        # The papers' markers are those of the front midline.
        front = {f"front_{key}": paper.get(key, "") for key in FRONT}
        rows.append(
            {**paper, **front, "recording": paper["subject"], "subject": "", "status": "published"}
        )
    return [{column: row.get(column, "") for column in ERROR_COLUMNS} for row in rows]


def as_csv(rows: page.Rows, header: Sequence[str]) -> str:
    """Return rows as the text of a CSV file."""
    stream = io.StringIO()
    writer = csv.DictWriter(stream, header, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return stream.getvalue()


def write_error_table(
    results: Path, names: Sequence[str], problems: Sequence[str], reports: Path
) -> list[Path]:
    """Write reports/error_table.csv and .html.

    Parameters
    ----------
    results : folder with one folder a recording
    names : recordings in the table
    problems : lines about rows that have no report
    reports : where the pages go
    """
    rows = error_rows(results, names)
    paper = [row for row in rows if row["source"] != "this study"]
    shown = columns(rows, ("status", "source"))
    lost = [*_unusable(results, names), *problems]
    html = page.render(
        "error_table.html",
        head=Headline(
            kind="Study",
            title="Errors of all recordings",
            subtitle="The same rows are in error_table.csv beside this page",
            result=f"{len(names) - len(_unusable(results, names))} of {len(names) + len(problems)}"
            " rows could be used.",
            mark=BAD if lost else GOOD,
            made=written(results / name / "posterior.json" for name in names),
        ),
        rows=[row for row in rows if row["source"] == "this study"],
        paper_rows=paper,
        columns=shown,
        # the papers print few of our columns
        paper_columns=[c for c in shown if any(str(row.get(c[0], "")).strip() for row in paper)],
        problems=lost,
    )
    paths = [reports / "error_table.csv", reports / "error_table.html"]
    write_text(paths[0], as_csv(rows, ERROR_COLUMNS))
    write_text(paths[1], html)
    return paths


def _unusable(results: Path, names: Sequence[str]) -> list[str]:
    found = ((name, status.first_problem(results / name)) for name in names)
    return [f"{name}: {bad['reason']}" for name, bad in found if bad is not None]


def by_subject(results: Path, names: Sequence[str]) -> dict[str, dict[str, float]]:
    """Return subject to group to level; several recordings of one subject count as one.

    Parameters
    ----------
    results : folder with one folder a recording
    names : the recordings
    """
    levels: dict[str, dict[str, list[float]]] = {}
    for name in names:
        subject = _subject(results / name)
        for group, row in subject_levels(results / name).items():
            try:
                level = float(row["level"])
            except ValueError:
                continue
            levels.setdefault(subject, {}).setdefault(group, []).append(level)
    return {
        subject: {group: statistics.fmean(values) for group, values in groups.items()}
        for subject, groups in levels.items()
    }


def group_rows(subjects: dict[str, dict[str, float]]) -> list[dict[str, Any]]:
    """Return mean, spread and count over subjects of each muscle group's level."""
    rows = []
    for group in page.GROUPS:
        values = [levels[group] for levels in subjects.values() if group in levels]
        row: dict[str, Any] = {"group": page.words(group), "n_subjects": len(values)}
        row["mean"] = statistics.fmean(values) if values else math.nan
        row["sd"] = statistics.stdev(values) if len(values) > 1 else math.nan
        row["lowest"] = min(values, default=math.nan)
        row["highest"] = max(values, default=math.nan)
        rows.append(row)
    return rows


def write_group(
    results: Path, names: Sequence[str], problems: Sequence[str], reports: Path
) -> list[Path]:
    """Write reports/group.html: the status of every row, activations across subjects.

    Parameters
    ----------
    results : folder with one folder a recording
    names : recordings of the study
    problems : lines about rows that have no report
    reports : where the page goes
    """
    subjects = by_subject(results, names)
    statuses = []
    for name in names:
        bad = status.first_problem(results / name)
        statuses.append(
            {
                "name": name,
                "subject": _subject(results / name),
                "good": bad is None,
                "text": "done" if bad is None else bad["reason"],
            }
        )
    path = reports / "group.html"
    people = [{"subject": subject, **levels} for subject, levels in subjects.items()]
    used = sum(row["good"] is True for row in statuses)
    html = page.render(
        "group.html",
        head=Headline(
            kind="Study",
            title="All recordings",
            result=f"{used} of {len(statuses) + len(problems)} rows could be used.",
            mark=GOOD if used == len(statuses) + len(problems) else BAD,
            made=written(results / name / "posterior.json" for name in names),
        ),
        statuses=statuses,
        problems=list(problems),
        groups=group_rows(subjects),
        people=people,
        people_columns=[("subject", "subject"), *((g, page.words(g)) for g in page.GROUPS)],
    )
    write_text(path, html)
    return [path]
