"""The page of a laugh or another sound: what was heard, and how the torso follows it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from markupsafe import Markup

from pipeline import page, status, view
from pipeline import report_tables as tables
from pipeline.citations import citations
from pipeline.headline import BAD, GOOD, PLAIN, Headline, Numbers, computed
from pipeline.job import LAUGH, chain_of
from pipeline.laugh_scene import heard
from pipeline.records import write_text
from pipeline.report import ran, subtitle

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
    "in_short",
    "at_bound",
    "events",
    "asked_s",
)
FIGURES = ("calls", "spectrogram", "followed", "search")
SECTIONS = (
    ("torso", "The torso, laughing"),
    ("calls", "Sound, pressure and calls"),
    ("followed", "The torso follows"),
    ("errors_table", "Error of each call"),
    ("settings", "Figures, settings and versions"),
    ("methods", "Methods"),
    ("errors", "Errors"),
)
PUBLISHED = 0.16
"""Error of a call after 1,800 runs, dilorenzo2009 Fig. 6.8."""
CALL_COLUMNS = (
    "call",
    "start_s",
    "peak_s",
    "end_s",
    "peak",
    "bout",
    "voiced",
    "kept",
    "why_not",
)


def _facts(record: dict[str, Any]) -> list[tuple[str, Any]]:
    return [
        (tables.heading(key.removeprefix("quality.").replace(".", ": ")), value)
        for key, value in page.flat(record)
        if key.split(".")[0] not in HEAD
    ]


def _key_numbers(record: Mapping[str, Any]) -> Numbers:
    """Figures at the top of the page."""
    if record["status"] != status.OK:
        return ()
    asked = "lung pressure" if record["quantity"] == "pressure" else "flow"
    found = [(page.number(record["correlation"], 2), f"correlation with the desired {asked}")]
    if "median_rms_normalised" in record:
        error = page.number(record["median_rms_normalised"], 2)
        found.append((error, f"median error of a call, of no {asked}"))
    if record.get("air_used_by_bouts_l"):
        total = sum(record["air_used_by_bouts_l"])
        found.append((f"{total:.2f} L", "air that the calls took"))
    found.append((f"{record['least_volume_below_rest_l']:.2f} L", "lowest lung volume, below rest"))
    if "evaluations" in record:
        found.append((str(record["evaluations"]), "runs of the torso"))
    return tuple(found)


def _result(follow: Mapping[str, Any], problem: str) -> tuple[str, str]:
    """What came of it, and its mark: the published error of a call is the measure of a laugh."""
    if problem:
        return f"This recording could not be used to the end: {problem}", BAD
    if follow["kind"] != "laugh" or "median_rms_normalised" not in follow:
        return page.sentence(str(follow.get("summary", ""))), PLAIN
    error = float(follow["median_rms_normalised"])
    good = error <= PUBLISHED
    said = (
        f"The torso laughs with the sound: the error of a call is {page.number(error, 2)} of that"
        f" of no pressure, {'no more' if good else 'more'} than the published {PUBLISHED}."
    )
    return said, GOOD if good else BAD


def _head(name: str, records: Mapping[str, Mapping[str, Any]], problem: str) -> Headline:
    follow = records["follow"]
    result, mark = _result(follow, problem)
    kind = str(follow.get("kind") or records["audio"].get("kind") or "sound")
    told = [r["summary"] for stage, r in records.items() if r.get("summary") and stage != "follow"]
    return Headline(
        kind=kind.capitalize(),
        title=name,
        subtitle=subtitle(records),
        result=result,
        mark=mark,
        numbers=_key_numbers(follow),
        sentences=(". ".join(page.sentence(str(line))[:-1] for line in told),) if told else (),
        made=computed(records.values()),
    )


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
    shown = [{key: row.get(key, "") for key in CALL_COLUMNS} for row in calls]
    more = [key for key in (calls[0] if calls else ()) if key not in CALL_COLUMNS]
    fitted = [
        {"call": row["call"], **{key: row[key] for key in more if key != "at_bound"}}
        for row in calls
        if row.get("evaluations")
    ]
    run_facts, setting_facts = ran(records)
    follow = records["follow"]
    return {
        "head": _head(folder.name, records, str(bad["reason"]) if bad else ""),
        "name": folder.name,
        "records": records,
        "problem": str(bad["reason"]) if bad else "",
        "problem_stage": bad["stage"] if bad else "",
        "sections": SECTIONS,
        "heard": heard(folder, follow),
        "script": Markup(view.script()),
        "script_digest": view.digest(),
        "citations": citations("laugh"),
        "figures": {name: page.inline_svg(folder / f"{name}.svg") for name in FIGURES},
        "facts": {stage: _facts(records[stage]) for stage in stages if stage != "follow"},
        "follow_facts": _facts(follow),
        "run_facts": run_facts,
        "setting_facts": setting_facts,
        "calls": shown,
        "call_columns": tables.columns(shown),
        "fitted": fitted,
        "fitted_columns": tables.columns(fitted),
        "at_bound": follow.get("at_bound", []),
        "events": follow.get("events", []),
        "event_columns": tables.columns(follow.get("events", [])),
        "warnings": page.messages(records),
    }


def write_laugh_report(folder: Path, path: Path) -> Path:
    """Write the page of one sound; one that could not be used gets a page that says why.

    Parameters
    ----------
    folder : results of the recording
    path : where the page goes
    """
    found = context(folder)
    text = page.render("laugh.html", **found)
    if len(text) > view.MOST_BYTES and found["heard"].viewer:
        why = f"its motion would make this page {len(text) / 1e6:.0f} MB"
        found["heard"] = replace(found["heard"], viewer=None, why=why)
        text = page.render("laugh.html", **found)
    write_text(path, text)
    return path
