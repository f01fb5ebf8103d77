"""The page of a breath retraining: steps to be played, their figures, a pace to breathe with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pipeline import page, status, view
from pipeline import report_tables as tables
from pipeline.citations import citations
from pipeline.headline import BAD, GOOD, Headline, computed
from pipeline.records import write_text
from pipeline.report import ran, subtitle
from pipeline.retraining_stage import DRAWING, motion_file
from pipeline.study import RESERVED_END
from pipeline.view import Viewer, make_viewer
from sim.trajectory import load_motion

STAGE = "retraining"
SUFFIX = RESERVED_END
"""Of the page's name, after the recording's."""
SECTIONS = (
    ("steps", "Breathe with the torso"),
    ("table", "Figures of each step"),
    ("methods", "Methods"),
    ("settings", "Settings and versions"),
    ("errors", "Errors"),
)
COLUMNS = (
    ("name", "step"),
    ("rate_per_min", "breaths a minute"),
    ("inspiration_s", "in (s)"),
    ("expiration_s", "out (s)"),
    ("tidal_volume_l", "breath (L)"),
    ("swept_volume_l", "swept (L)"),
    ("asked_swept_volume_l", "asked (L)"),
    ("rib_cage_share", "rib cage"),
    ("belly_share", "belly"),
    ("asked_belly_share", "asked"),
    ("alveolar_ventilation_l_min", "air to the alveoli (L/min)"),
)
LEVELS = (("name", "step"), *((group, page.words(group)) for group in page.GROUPS))
DIGITS = {"alveolar_ventilation_l_min": 2, "rate_per_min": 3, "inspiration_s": 2, "expiration_s": 2}
FACTS = (
    "Each step is the second of two breaths from rest, repeated.",
    "A breath beside another one of another length is shown at the pace of the chosen step.",
)


def step_name(number: int) -> str:
    """What a step is called."""
    return f"step {number}" if number else "own breath"


def _rows(steps: Sequence[Mapping[str, Any]]) -> list[dict[str, str]]:
    return [
        {
            "name": step_name(step["step"]),
            **{
                key: page.number(step[key], DIGITS.get(key, 2))
                for key, _ in (*COLUMNS, *LEVELS)
                if key != "name"
            },
        }
        for step in steps
    ]


def _viewer(folder: Path, steps: Sequence[Mapping[str, Any]]) -> Viewer:
    motions = {}
    for step in steps:
        path = motion_file(folder, step["step"])
        motions[step_name(step["step"])], _ = load_motion(path)
    paced = [
        {
            "name": step_name(step["step"]),
            "inspiration": step["inspiration_s"],
            "period": step["inspiration_s"] + step["expiration_s"],
        }
        for step in steps
    ]
    return make_viewer(motions, place=str(folder), facts=FACTS, steps=paced)


def _head(name: str, record: Mapping[str, Any]) -> Headline:
    about: dict[str, Any] = {
        "kind": "Breath retraining",
        "title": f"{name}: breath retraining",
        "subtitle": subtitle({STAGE: record}),
        "made": computed([record]),
    }
    if record["status"] != status.OK:
        return Headline(**about, result=f"There are no steps: {record['reason']}", mark=BAD)
    own, last = record["steps"][0], record["steps"][-1]
    now = page.number(own["diaphragm"], 2)
    reached = all(step["error"] <= record["tolerance"] for step in record["steps"])
    said = "the torso reaches every step" if reached else "the torso does not reach every step"
    return Headline(
        **about,
        result=f"From {page.number(own['rate_per_min'], 2)} to"
        f" {page.number(last['rate_per_min'], 2)} breaths a minute and from"
        f" {100 * own['belly_share']:.0f} to {100 * last['belly_share']:.0f} % of the breath by"
        f" the belly, in {len(record['steps']) - 1} steps: {said}.",
        mark=GOOD if reached else BAD,
        numbers=(
            (f"{page.number(last['rate_per_min'], 2)} / min", "breathing rate of the last step"),
            (f"{last['tidal_volume_l']:.2f} L", f"a breath then, {own['tidal_volume_l']:.2f} now"),
            (f"{100 * last['belly_share']:.0f} %", "of it by the belly wall"),
            (
                page.number(last["diaphragm"], 2),
                f"level of the diaphragm, {now} now",
            ),
        ),
    )


def context(folder: Path) -> dict[str, Any]:
    """Gather everything the template shows.

    Parameters
    ----------
    folder : results of one recording
    """
    record = status.read_status(folder, STAGE)
    good = record["status"] == status.OK
    steps = record["steps"] if good else []
    run_facts, setting_facts = ran({STAGE: record})
    return {
        "head": _head(folder.name, record),
        "sections": SECTIONS,
        "viewer": _viewer(folder, steps) if good else None,
        "rows": _rows(steps),
        "columns": COLUMNS,
        "level_columns": LEVELS,
        "target": [(tables.heading(key), value) for key, value in record.get("target", {}).items()],
        "drawing": page.inline_svg(folder / DRAWING),
        "run_facts": run_facts,
        "setting_facts": setting_facts,
        "n_runs": record.get("n_runs"),
        "tolerance": record.get("tolerance"),
        "citations": citations("retraining"),
        "problem": "" if good else str(record["reason"]),
        "problem_stage": record["stage"],
        "warnings": page.messages({STAGE: record}),
    }


def write_retraining_report(folder: Path, path: Path) -> Path:
    """Write the page of a retraining; without steps it says why.

    Parameters
    ----------
    folder : results of the recording
    path : where the page goes
    """
    text = page.render("retraining.html", **context(folder))
    view.check_size(text, str(folder), "Ask for fewer steps (retraining.n_steps).")
    write_text(path, text)
    return path
