"""The tables of a study: one row a recording, one row a subject, each checked."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipeline.configuration import nearest, read_yaml
from sim.errors import InputError

SCHEMAS = Path(__file__).parent / "schemas"
LAUGH = "laugh"
RESERVED_END = "_retraining"
RESERVED = ("all", "error_table", "group", "index", "papers", "physiology", "README")
NAME = re.compile(r"\w[\w.-]*")

Row = dict[str, str]


@dataclass(frozen=True, kw_only=True, slots=True)
class Entry:
    """A row of the table of recordings with its subject, or why it cannot be used.

    Parameters
    ----------
    name : the recording
    recording, subject : cells as text; empty when there is no such row
    file : the recording, its path taken from the table's folder
    markers : file that maps labels or places, if one is named
    problem : one line, empty for a usable row
    reportable : a report can be written under this name
    """

    name: str
    recording: Row
    subject: Row
    file: Path
    markers: Path | None
    problem: str
    reportable: bool


@dataclass(frozen=True, kw_only=True, slots=True)
class Study:
    """Every row of a study, in the order of its table."""

    entries: tuple[Entry, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names that a report can be written under, each once."""
        return tuple(dict.fromkeys(e.name for e in self.entries if e.reportable))

    def names_of(self, kind: str) -> tuple[str, ...]:
        """Return those names whose row is of a kind; a row of no known kind counts as a breath."""
        return tuple(
            name
            for name in self.names
            if (self.entry(name).recording["kind"] == LAUGH) == (kind == LAUGH)
        )

    def entry(self, name: str) -> Entry:
        """Return the row called `name`; of rows that share a name, the first."""
        for entry in self.entries:
            if entry.name == name:
                return entry
        known = nearest(name, self.names) or f" There are {', '.join(self.names) or 'none'}."
        raise InputError(f"{name}: is not a recording of this study.{known}")


def _cells(path: Path) -> list[list[str]]:
    try:
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise InputError(
            f"{path}: there is no such table. Run in the folder of the study, or make one with"
            " 'pleura new STUDY'."
        ) from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read as UTF-8 text ({error}). Save it so.") from error
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    return [[c.strip() for c in row] for row in csv.reader(lines, delimiter="\t")]


def read_table(path: Path, schema: Mapping[str, Any]) -> list[Row]:
    """Read a tab-separated table as text and check its columns.

    Parameters
    ----------
    path : the table; blank lines and lines that begin with # are skipped
    schema : column name to its rules
    """
    cells = _cells(path)
    if not cells:
        raise InputError(f"{path}: is empty. Its first line names {', '.join(schema)}.")
    header, rows = cells[0], cells[1:]
    if len(header) == 1 and "," in header[0]:
        raise InputError(f"{path}: columns are separated by commas. Save it with tabs.")
    for column, count in Counter(header).items():
        if column not in schema:
            raise InputError(f"{path}: column '{column}': is unknown.{nearest(column, schema)}")
        if count > 1:
            raise InputError(f"{path}: column '{column}': stands there {count} times. Keep one.")
    for column, rules in schema.items():
        if rules.get("required") and column not in header:
            raise InputError(f"{path}: column '{column}': is missing. Add it.")
    for number, row in enumerate(rows, start=1):
        if len(row) > len(header) and any(row[len(header) :]):
            raise InputError(
                f"{path}: row {number} ('{row[0]}'): has {len(row)} cells for {len(header)}"
                " columns. Remove a tab."
            )
    empty = dict.fromkeys(schema, "")
    return [empty | dict(zip(header, row, strict=False)) for row in rows]


def _cell_problem(row: Row, schema: Mapping[str, Any]) -> str:
    for column, rules in schema.items():
        value = row[column]
        if not value:
            if rules.get("required"):
                return f"{column} is empty. Fill it in."
            continue
        words = rules.get("words")
        if words and value not in words:
            near = nearest(value.lower(), words, 1) or f" Write one of: {', '.join(words)}."
            return f"{column} is '{value}'.{near}"
        if "least" in rules:
            try:
                number = float(value)
            except ValueError:
                return f"{column} is '{value}', not a number. {rules['hint']}"
            if not rules["least"] <= number <= rules["most"]:
                span = f"{rules['least']:g} to {rules['most']:g}"
                return f"{column} is {value}, outside {span}. {rules['hint']}"
    return ""


def _name_problem(name: str, count: int) -> str:
    if name.casefold() in {r.casefold() for r in RESERVED}:
        return "the name is reserved for a page of the whole study. Rename the row."
    if name.casefold().endswith(RESERVED_END):
        return f"a name may not end with {RESERVED_END}, the page of a retraining. Rename the row."
    if not NAME.fullmatch(name):
        return "a name has letters, digits, '_', '-' and '.' only. Rename the row."
    if count > 1:
        return f"{count} rows have this name. Rename all but one."
    return ""


def _subject_problem(name: str, subjects: list[Row], table: Path, schema: Mapping[str, Any]) -> str:
    found = [s for s in subjects if s["subject"] == name]
    if not found:
        near = nearest(name, [s["subject"] for s in subjects], 1)
        return f"subject '{name}' has no row in {table}.{near or ' Add one.'}"
    if len(found) > 1:
        return f"subject '{name}' has {len(found)} rows in {table}. Keep one."
    problem = _cell_problem(found[0], schema)
    return f"{table}: subject {name}: {problem}" if problem else ""


def _file_problem(file: Path, column: str) -> str:
    if not file.exists():
        return (
            f"{column}: there is no file {file}. Paths start at the table's folder: correct it,"
            " or put the file there."
        )
    if not file.is_file():
        return f"{column}: {file} is not a file. Name a file."
    if file.stat().st_size == 0:
        return f"{column}: {file} is empty. Export it again."
    return ""


def _beside(table: Path, cell: str) -> Path:
    """Return the file a cell names, as seen from the current folder where it is inside."""
    file, here = (table.parent / cell).resolve(), Path.cwd().resolve()
    return file.relative_to(here) if file.is_relative_to(here) else file


def _span_problem(row: Row) -> str:
    if row["start_s"] and row["end_s"] and float(row["start_s"]) >= float(row["end_s"]):
        return f"start_s {row['start_s']} is not before end_s {row['end_s']}. Exchange them."
    return ""


def read_study(recordings: Path, subjects: Path) -> Study:
    """Read both tables; a table that cannot be read raises, a bad row only carries its problem.

    Parameters
    ----------
    recordings, subjects : the two tables
    """
    of_recording = read_yaml(SCHEMAS / "recordings.yaml")
    of_subject = read_yaml(SCHEMAS / "subjects.yaml")
    rows = read_table(recordings, of_recording)
    people = read_table(subjects, of_subject)
    counts = Counter(row["recording"] for row in rows)
    entries = []
    for row in rows:
        name = row["recording"]
        file = _beside(recordings, row["path"])
        markers = _beside(recordings, row["markers"]) if row["markers"] else None
        bad_name = _name_problem(name, counts[name])
        problem = (
            bad_name
            or _cell_problem(row, of_recording)
            or _span_problem(row)
            or _file_problem(file, "path")
            or (_file_problem(markers, "markers") if markers else "")
        )
        if problem:
            problem = f"{recordings}: recording {name}: {problem}"
        else:
            problem = _subject_problem(row["subject"], people, subjects, of_subject)
        person = next((s for s in people if s["subject"] == row["subject"]), {})
        entries.append(
            Entry(
                name=name,
                recording=row,
                subject=person,
                file=file,
                markers=markers,
                problem=problem,
                reportable=not bad_name or counts[name] > 1,
            )
        )
    return Study(entries=tuple(entries))
