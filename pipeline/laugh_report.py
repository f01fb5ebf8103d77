"""The page of a laugh: what its sound gave, so far without the torso that follows it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pipeline import page, status
from pipeline import report_tables as tables
from pipeline.job import LAUGH, chain_of
from pipeline.records import write_text

HEAD = (
    "status",
    "stage",
    "recording",
    "recorded",
    "summary",
    "reason",
    "run",
    "warnings",
    "notes",
    "bouts",
    "calls",
)
FIGURES = ("calls", "spectrogram")


def context(folder: Path) -> dict[str, Any]:
    """Gather everything the template shows.

    Parameters
    ----------
    folder : results of one recording
    """
    stages = chain_of(LAUGH)
    records = {stage: status.read_status(folder, stage) for stage in stages}
    bad = status.first_problem(folder, stages)
    calls = page.read_rows(folder / "calls.csv")
    facts = {
        stage: [
            (tables.heading(key.removeprefix("quality.").replace(".", ": ")), value)
            for key, value in page.flat(record)
            if key.split(".")[0] not in HEAD
        ]
        for stage, record in records.items()
    }
    return {
        "name": folder.name,
        "records": records,
        "problem": str(bad["reason"]) if bad else "",
        "problem_stage": bad["stage"] if bad else "",
        "sentences": [str(r["summary"]) for r in records.values() if r.get("summary")],
        "figures": {name: page.inline_svg(folder / f"{name}.svg") for name in FIGURES},
        "facts": facts,
        "calls": calls,
        "call_columns": tables.columns(calls),
        "warnings": page.messages(records),
    }


def write_laugh_report(folder: Path, path: Path) -> Path:
    """Write the page of one laugh; one that could not be used gets a page that says why.

    Parameters
    ----------
    folder : results of the recording
    path : where the page goes
    """
    write_text(path, page.render("laugh.html", **context(folder)))
    return path
