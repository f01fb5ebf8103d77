"""The table that names calibration recordings: a person's sound and measured pressure a row."""

from __future__ import annotations

import csv
from pathlib import Path

from sim.errors import InputError

COLUMNS = ("subject", "audio", "pressure")


def calibration_files(table: Path) -> list[tuple[str, Path, Path]]:
    """Subject, sound and pressure file of each row of a calibration table."""
    try:
        lines = table.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{table}: cannot be read as UTF-8 text. Save it so.") from error
    filled = (line for line in lines if line.strip() and not line.startswith("#"))
    rows = list(csv.DictReader(filled, delimiter="\t"))
    if not rows or any(column not in rows[0] for column in COLUMNS):
        raise InputError(
            f"{table}: calibration: needs tab-separated columns {', '.join(COLUMNS)} and a row a"
            " subject. Mend the table."
        )
    for row in rows:
        if not all(row.get(column) for column in COLUMNS):
            raise InputError(f"{table}: subject {row['subject']}: a cell is empty. Fill it in.")
    folder = table.parent
    return [(row["subject"], folder / row["audio"], folder / row["pressure"]) for row in rows]


def calibration_parts(table: Path) -> list[str]:
    """Files that a table names and that are there; the stage itself complains about the others."""
    try:
        rows = calibration_files(table)
    except InputError:
        return []
    return [str(path) for _, *pair in rows for path in pair if path.exists()]
