"""calls.csv, which a person may edit and which is respected then; the same as a Praat TextGrid.

What the stage found stands in `calls.found.csv` as well. As long as the columns it wrote are the
same in both, calls.csv is the program's and is made anew; once they differ it is the person's.
Further columns (those of the fit) do not count and are kept out of the way.
"""

from __future__ import annotations

import csv
import hashlib
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from pipeline.records import write_text
from sim.errors import InputError

COLUMNS = ("call", "start_s", "peak_s", "end_s", "peak", "bout", "voiced", "kept", "why_not")
FIT_COLUMNS = ("rms_normalised", "evaluations", "seconds")
"""Come with the fit, followed by its seven parameters."""
TABLE, FOUND, GRID = "calls.csv", "calls.found.csv", "calls.TextGrid"
YES, NO = "yes", "no"
BY_HAND = "left out by hand"


@dataclass(frozen=True, kw_only=True, slots=True)
class Call:
    """A call of calls.csv.

    Parameters
    ----------
    call : number, from 1; bout : number, from 1, 0 for those left out
    start, peak_time, end : s in the file's time; peak_time is nan where a person left it empty
    peak : height over the mean peak height; nan likewise
    voiced, kept : whether it has a voice, whether it is used
    why_not : empty for those kept
    """

    call: int
    start: float
    peak_time: float
    end: float
    peak: float
    bout: int
    voiced: bool
    kept: bool
    why_not: str


def as_rows(calls: Sequence[Call]) -> list[dict[str, str]]:
    """Rows of calls.csv."""
    return [
        {
            "call": str(one.call),
            "start_s": f"{one.start:.3f}",
            "peak_s": f"{one.peak_time:.3f}",
            "end_s": f"{one.end:.3f}",
            "peak": f"{one.peak:.3f}",
            "bout": str(one.bout or ""),
            "voiced": YES if one.voiced else NO,
            "kept": YES if one.kept else NO,
            "why_not": one.why_not,
        }
        for one in calls
    ]


def write_calls(
    path: Path, calls: Sequence[Call], more: Sequence[Mapping[str, Any]] | None = None
) -> None:
    """Write calls.csv.

    Parameters
    ----------
    path : where
    calls : in order
    more : further columns of each call, all with the same keys; the fit's
    """
    rows: list[dict[str, Any]] = [dict(row) for row in as_rows(calls)]
    if more:
        rows = [{**row, **extra} for row, extra in zip(rows, more, strict=True)]
    stream = io.StringIO()
    writer = csv.DictWriter(stream, list(rows[0]) if rows else COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    write_text(path, stream.getvalue())


def add_columns(path: Path, more: Mapping[int, Mapping[str, Any]]) -> None:
    """Add columns to calls.csv beside what stands there, edited or not.

    Parameters
    ----------
    more : by the number of the row, from 1, all with the same keys; other rows stay empty
    """
    names = list(next(iter(more.values())))
    rows: list[dict[str, Any]] = []
    for number, row in enumerate(_read_rows(path), start=1):
        rows.append({**row, **dict.fromkeys(names, ""), **more.get(number, {})})
    stream = io.StringIO()
    writer = csv.DictWriter(stream, [*COLUMNS, *names], lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    write_text(path, stream.getvalue())


def _read_rows(path: Path) -> list[dict[str, str]]:
    """Rows of our columns as text; a table saved with other separators is read too."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read as UTF-8 text. Save it so.") from error
    lines = [line for line in text.splitlines() if line.strip(" ,;\t")]
    separator = max(",;\t", key=lambda s: lines[0].count(s)) if lines else ","
    rows = list(csv.DictReader(lines, delimiter=separator))
    missing = [c for c in ("start_s", "end_s", "kept") if rows and c not in rows[0]]
    if missing or not lines:
        raise InputError(
            f"{path}: column {', '.join(missing) or 'start_s'}: is missing. Add it, or delete the"
            " file to have it made anew."
        )
    return [{c: (row.get(c) or "").strip() for c in COLUMNS} for row in rows]


def is_edited(folder: Path) -> bool:
    """Whether calls.csv holds what a person put there."""
    table, found = folder / TABLE, folder / FOUND
    if not table.exists():
        return False
    if not found.exists():
        return True
    return _read_rows(table) != _read_rows(found)


def edit_digest(folder: Path) -> str:
    """A short digest of an edited calls.csv, empty for one of the program's own.

    The workflow hands it to the stage, so that an edit reruns it and what depends on it.
    """
    try:
        if not is_edited(folder):
            return ""
        text = repr(_read_rows(folder / TABLE))
    except InputError as error:
        text = str(error)
    return hashlib.sha256(text.encode()).hexdigest()[:12]


def read_calls(path: Path) -> list[Call]:
    """Read calls.csv, edited or not; a cell that cannot be meant is named."""
    calls = [_call(path, number, row) for number, row in enumerate(_read_rows(path), start=1)]
    kept = [one for one in calls if one.kept]
    for before, after in pairwise(kept):
        if after.start < before.end - 1e-3:
            raise InputError(
                f"{path}: call {after.call}: starts at {after.start:.3f} s, before call"
                f" {before.call} ends ({before.end:.3f} s). Put the rows in order of time, without"
                " overlap."
            )
    return calls


def _call(path: Path, number: int, row: Mapping[str, str]) -> Call:
    where = f"{path}: row {number}"
    start, end = (_number(where, column, row[column]) for column in ("start_s", "end_s"))
    if not end > start:
        raise InputError(f"{where}: end_s {end:g} is not after start_s {start:g}. Correct them.")
    peak_time = _number(where, "peak_s", row["peak_s"]) if row["peak_s"] else float("nan")
    if row["peak_s"] and not start <= peak_time <= end:
        raise InputError(
            f"{where}: peak_s {peak_time:g} is not between start_s and end_s. Correct it, or leave"
            " it empty."
        )
    kept = _yes(where, "kept", row["kept"])
    return Call(
        call=number,
        start=start,
        peak_time=peak_time,
        end=end,
        peak=_number(where, "peak", row["peak"]) if row["peak"] else float("nan"),
        bout=int(_number(where, "bout", row["bout"])) if row["bout"] else 0,
        voiced=_yes(where, "voiced", row["voiced"] or YES),
        kept=kept,
        why_not="" if kept else row["why_not"] or BY_HAND,
    )


def _number(where: str, column: str, cell: str) -> float:
    try:
        value = float(cell.replace(",", "."))
    except ValueError:
        value = float("nan")
    if not abs(value) < 1e6:
        raise InputError(f"{where}: {column} is '{cell}', not a number. Correct it.")
    return value


def _yes(where: str, column: str, cell: str) -> bool:
    word = cell.lower()
    if word in (YES, "y", "1", "true"):
        return True
    if word in (NO, "n", "0", "false"):
        return False
    raise InputError(f"{where}: {column} is '{cell}'. Write yes or no.")


def write_text_grid(
    path: Path,
    calls: Sequence[Call],
    breaths: Sequence[tuple[float, float]],
    start: float,
    end: float,
) -> None:
    """Write tiers bouts, calls, breaths and left out for Praat.

    Parameters
    ----------
    path : where
    calls : all, kept or not
    breaths : inhalations, s
    start, end : of the sound, s
    """
    kept = [one for one in calls if one.kept]
    bouts = [
        (min(c.start for c in mine), max(c.end for c in mine), f"bout {number}")
        for number in dict.fromkeys(c.bout for c in kept)
        if (mine := [c for c in kept if c.bout == number])
    ]
    named = [(c.start, c.end, str(c.call) if c.voiced else f"{c.call} unvoiced") for c in kept]
    left_out = [(c.start, c.end, c.why_not) for c in calls if not c.kept]
    tiers = {
        "bouts": bouts,
        "calls": named,
        "inhalations": [(a, b, "inhalation") for a, b in breaths],
        "left out": left_out,
    }
    lines = ['File type = "ooTextFile"', 'Object class = "TextGrid"', ""]
    lines += [f"xmin = {start:.4f}", f"xmax = {end:.4f}", "tiers? <exists>", f"size = {len(tiers)}"]
    lines.append("item []:")
    for number, (name, marks) in enumerate(tiers.items(), start=1):
        spans = _filled(marks, start, end)
        lines += [f"    item [{number}]:", '        class = "IntervalTier"']
        lines += [f'        name = "{name}"', f"        xmin = {start:.4f}"]
        lines += [f"        xmax = {end:.4f}", f"        intervals: size = {len(spans)}"]
        for k, (first, last, text) in enumerate(spans, start=1):
            quoted = text.replace('"', '""')
            lines += [f"        intervals [{k}]:", f"            xmin = {first:.4f}"]
            lines += [f"            xmax = {last:.4f}", f'            text = "{quoted}"']
    write_text(path, "\n".join(lines) + "\n")


def _filled(
    marks: Sequence[tuple[float, float, str]], start: float, end: float
) -> list[tuple[float, float, str]]:
    """Intervals that cover a tier without gap or overlap, as Praat wants them."""
    out: list[tuple[float, float, str]] = []
    at = start
    for first, last, text in sorted(marks):
        first, last = max(first, at), min(last, end)
        if last - first < 1e-4:
            continue
        if first - at > 1e-4:
            out.append((at, first, ""))
            at = first
        out.append((at, last, text))
        at = last
    if end - at > 1e-4 or not out:
        out.append((at, end, ""))
    return out
