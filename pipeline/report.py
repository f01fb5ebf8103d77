"""One offline HTML page a recording, put together from what the stages left."""

from __future__ import annotations

import platform
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

from pipeline import page, status
from pipeline import report_tables as tables
from pipeline.citations import citations
from pipeline.headline import Headline, computed
from pipeline.records import write_text
from pipeline.summary import Summary, summarise
from pipeline.view import Viewer, make_viewer
from sim.trajectory import load_motion

Pairs = list[tuple[str, Any]]


@dataclass(frozen=True, kw_only=True, slots=True)
class Part:
    """A section: its title here, its content in templates/sections/ID.html."""

    id: str
    title: str


PARTS = (
    Part(id="model", title="The torso, breathing"),
    Part(id="input", title="Quality of the recording"),
    Part(id="cycles", title="Breaths"),
    Part(id="signature", title="Breath signature"),
    Part(id="comparison", title="Simulated and measured"),
    Part(id="errors_table", title="Errors of the fit"),
    Part(id="activations", title="Muscle activations"),
    Part(id="lung", title="Lung volume"),
    Part(id="ribs", title="Rotation of the ribs"),
    Part(id="search", title="Course of the fit"),
    Part(id="settings", title="Settings and versions"),
    Part(id="methods", title="Methods"),
    Part(id="errors", title="Errors"),
)
FIGURES = (
    "input",
    "cycles",
    "signature",
    "sagittal",
    "markers_time",
    "trace",
    "volume",
    "ribs",
    "posterior",
)
HEAD = ("status", "stage", "recording", "recorded", "summary", "reason", "run", "warnings", "notes")
FACTS = ("One mean breath of the fit: the last of two from rest, repeated.",)
"""Shown with the torso."""
SHORT = 0.1
LIBRARIES = ("numpy", "scipy", "numba", "mujoco", "nlopt", "emcee", "arviz", "ezc3d", "snakemake")


def _facts(content: Mapping[str, Any], leave_out: Iterable[str]) -> Pairs:
    hidden = {*HEAD, *leave_out}
    pairs = [
        (key.removeprefix("quality."), value)
        for key, value in page.flat(content)
        if hidden.isdisjoint(key.split("."))
    ]
    return [_readable(key.replace(".", ": "), value) for key, value in pairs]


def _readable(key: str, value: Any) -> tuple[str, Any]:
    """Return a heading and its value, short lengths in millimetres."""
    if key.endswith("_m") and isinstance(value, float) and abs(value) < SHORT:
        key, value = f"{key}m", 1e3 * value
    return tables.heading(key), value


def _libraries() -> Pairs:
    found: Pairs = [("python", platform.python_version())]
    for name in LIBRARIES:
        try:
            found.append((name, metadata.version(name)))
        except metadata.PackageNotFoundError:
            found.append((name, "not installed"))
    return found


def ran(records: Mapping[str, Mapping[str, Any]]) -> tuple[Pairs, Pairs]:
    """Return what ran (versions, seed, times) and every setting, from the stages' records."""
    runs = {stage: record["run"] for stage, record in records.items() if "run" in record}
    facts: Pairs = []
    for key in ("version", "source", "commit", "seed"):
        values = list(dict.fromkeys(str(run[key]) for run in runs.values() if run[key] != ""))
        facts.append((key, ", ".join(values)))
    for stage, run in runs.items():
        facts.append((f"{stage}: finished", f"{run['finished']}, {run['seconds']} s"))
    subject: Mapping[str, Any] = next((run["subject"] for run in runs.values()), {})
    facts += [(f"subject: {key}", value or "population value") for key, value in subject.items()]
    settings: dict[str, Any] = {}
    for run in runs.values():
        settings |= run["settings"]
    return facts, list(page.flat(settings))


def subtitle(records: Mapping[str, Mapping[str, Any]]) -> str:
    """Return who was recorded, from the stages' records."""
    run: Mapping[str, Any] = next((r["run"] for r in records.values() if "run" in r), {})
    person = run.get("subject") or {}
    told = [
        person.get("subject") and f"Subject {person['subject']}",
        person.get("sex"),
        person.get("stature_m") and f"{person['stature_m']} m",
        person.get("mass_kg") and f"{person['mass_kg']} kg",
        person.get("posture"),
    ]
    return ", ".join(word for word in told if word)


def _viewer(folder: Path, records: Mapping[str, Mapping[str, Any]]) -> Viewer | None:
    """Return the fitted breath to be played, or nothing where there is none."""
    path = folder / "trajectory.h5"
    if records["fit"].get("status") != status.OK or not path.exists():
        return None
    motion, _ = load_motion(path)
    return make_viewer({folder.name: motion}, place=str(path), facts=FACTS)


def _head(name: str, records: Mapping[str, Mapping[str, Any]], summary: Summary) -> Headline:
    return Headline(
        kind="Breath",
        title=name,
        subtitle=subtitle(records),
        result=summary.result,
        mark=summary.mark,
        numbers=summary.numbers,
        sentences=summary.sentences,
        made=computed(records.values()),
    )


def context(folder: Path) -> dict[str, Any]:
    """Gather everything the template shows.

    Parameters
    ----------
    folder : results of one recording
    """
    records = {stage: status.read_status(folder, stage) for stage in status.RECORDS}
    bad = status.first_problem(folder)
    problem = str(bad["reason"]) if bad else ""
    cycles, errors, activations = (
        page.read_rows(folder / f"{name}.csv") for name in ("cycles", "errors", "activations")
    )
    markers = records["markers"]
    names = dict(zip(markers.get("labels", ()), markers.get("names", ()), strict=False))
    paper = page.read_rows(page.TABLES / "dilorenzo_table_5_2.csv")
    run_facts, setting_facts = ran(records)
    return {
        "head": _head(folder.name, records, summarise(records, errors, activations, problem)),
        "sections": [(part.id, part.title) for part in PARTS],
        "records": records,
        "problem": problem,
        "problem_stage": bad["stage"] if bad else "",
        "parts_of_report": PARTS,
        "viewer": _viewer(folder, records),
        "figures": {name: page.inline_svg(folder / f"{name}.svg") for name in FIGURES},
        "tables": tables,
        "input_facts": _facts(markers, ("labels", "names", "noise_mm", "gaps")),
        "marker_rows": tables.marker_table(markers.get("quality", {}), names),
        "signature_facts": _facts(records["signature"], ()),
        "search_facts": _facts(
            records["fit"], ("levels", "errors", "rib_rotation_deg", *tables.BREATH_FIGURES)
        ),
        "breath_facts": tables.breath_facts(records["fit"]),
        "rib_rows": tables.rib_table(records["fit"].get("rib_rotation_deg", {})),
        "cycles": cycles,
        "cycle_columns": tables.columns(cycles),
        "errors": tables.error_table(errors),
        "verdicts": tables.verdicts(errors),
        "paper_rows": paper,
        "paper_columns": tables.columns(paper, ("source",)),
        "levels": tables.level_table(activations),
        "cycle_levels": tables.cycle_table(activations),
        "sampling_facts": _facts(records["posterior"], ("correlation", "identifiability")),
        "identifiability": records["posterior"].get("identifiability", []),
        "run_facts": run_facts,
        "setting_facts": setting_facts,
        "library_facts": _libraries(),
        "citations": citations("breath"),
        "warnings": page.messages(records),
    }


def write_report(folder: Path, path: Path) -> Path:
    """Write the page of one recording; one that could not be used gets a page that says why.

    Parameters
    ----------
    folder : results of the recording
    path : where the page goes
    """
    write_text(path, page.render("report.html", **context(folder)))
    return path
