"""Text of any common dialect to a table of names and numbers."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sim.errors import InputError

Floats = npt.NDArray[np.float64]

EMPTY = {"", "nan", "na", "n/a", "null", "none", "-"}
AXES = {"x", "y", "z"}
# keys of other systems' preambles (Qualisys) that state the rate
RATE_KEYS = {"rate_hz", "rate", "frequency", "frame_rate"}


@dataclass(frozen=True, kw_only=True, slots=True)
class Table:
    """A table as text says it.

    Parameters
    ----------
    names : one a column
    rows : cells as text
    numbers : (n_rows, n_columns), not-a-number where a cell is no number
    stated : `unit`, `rate_hz` from lines above the header
    unit_row : unit from a row below the header, or empty
    """

    path: Path
    names: list[str]
    rows: list[list[str]]
    numbers: Floats
    stated: dict[str, str]
    unit_row: str


def read_table(path: Path) -> Table:
    """Read a separated text file: comma, semicolon or tab, decimal point or comma."""
    lines, stated = _lines(path)
    separator = max(";\t,", key=lambda s: (lines[0].count(s), s == ";"))
    cells = [[c.strip() for c in row] for row in csv.reader(lines, delimiter=separator)]
    n_header = next((i for i, row in enumerate(cells) if i and _is_data(row)), 0)
    if n_header == 0:
        raise InputError(
            f"{path}: table: no header row with rows of numbers below it. See"
            " docs/methods/mocap.md for the shapes that are read."
        )
    names, unit_row = _header(cells[:n_header])
    rows = [row for row in cells[n_header:] if any(row)]
    width = len(names)
    short = next((i for i, row in enumerate(rows) if len(row) < width), None)
    if short is not None and short < len(rows) - 1:
        raise InputError(
            f"{path}: row {n_header + short + 1}: has {len(rows[short])} of {width} columns."
            " Export the table again."
        )
    rows = rows[:short]
    numbers = np.array([[_number(c, separator) for c in row[:width]] for row in rows])
    if numbers.shape[0] < 2:
        raise InputError(f"{path}: table: fewer than two rows of numbers. Export it again.")
    return Table(
        path=path, names=names, rows=rows, numbers=numbers, stated=stated, unit_row=unit_row
    )


def _lines(path: Path) -> tuple[list[str], dict[str, str]]:
    if not path.is_file():
        raise InputError(f"{path}: file: not found. Check the path in the recordings table.")
    content = path.read_bytes()
    if not content.strip():
        raise InputError(f"{path}: file: empty. Export the recording again.")
    if b"\0" in content[:4096] and not content.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise InputError(f"{path}: file: not text. Name a C3D file .c3d, or export a table.")
    wide = content.startswith((b"\xff\xfe", b"\xfe\xff"))
    text = content.decode("utf-16" if wide else "utf-8-sig", errors="replace")
    stated: dict[str, str] = {}
    lines: list[str] = []
    for line in text.splitlines():
        if not line.strip(" ,;\t"):
            continue
        match = re.match(r"^#?\s*([A-Za-z_]+)\s*(?:[:=]|\t)\s*([^\t,;]+)\s*$", line)
        if line.startswith("#") or (not lines and match):
            if match:
                key = match[1].lower()
                stated["rate_hz" if key in RATE_KEYS else key] = match[2].strip()
            continue
        lines.append(line)
    if not lines:
        raise InputError(f"{path}: table: no header row. Export the recording again.")
    return lines, stated


def _is_data(row: list[str]) -> bool:
    filled = [c for c in row if c.lower() not in EMPTY]
    numeric = sum(bool(re.fullmatch(r"[+-]?[\d.,]+(?:[eE][+-]?\d+)?", c)) for c in filled)
    return len(filled) > 1 and numeric >= max(2, 0.5 * len(filled))


def _header(head: list[list[str]]) -> tuple[list[str], str]:
    """Column names and unit from one, two or three rows."""
    axes_row = next(
        (i for i, row in enumerate(head) if sum(c.lower() in AXES for c in row) >= 3), None
    )
    unit_row = ""
    if axes_row is None:
        return head[-1] if len(head) == 1 else head[0], unit_row
    if axes_row + 1 < len(head):
        unit_row = next((c for c in head[axes_row + 1] if c.lower() in {"mm", "cm", "m"}), "")
    axes = head[axes_row]
    above = head[axes_row - 1] if axes_row else []
    label = ""
    names: list[str] = []
    for i, axis in enumerate(axes):
        label = above[i] if i < len(above) and above[i] else label
        is_axis = axis.lower() in AXES
        names.append(f"{label} {axis}" if is_axis and label else axis)
    return names, unit_row


def _number(cell: str, separator: str) -> float:
    if cell.lower() in EMPTY:
        return float("nan")
    if separator != ",":
        cell = cell.replace(",", ".")
    try:
        return float(cell)
    except ValueError:
        return float("nan")
