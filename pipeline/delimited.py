"""Marker tables in text (CSV, TSV and their kin) to markers in metres.

Four shapes are read; `docs/methods/mocap.md` shows each:

- wide: columns `LABEL X`, `LABEL Y`, `LABEL Z` in any order, paired by name;
- two header rows: labels above `X Y Z` (as Vicon exports), a row of units below is read;
- long: columns `frame` or `time`, `marker`, `x`, `y`, `z`;
- one marker a file: columns `frame` and/or `time`, `x`, `y`, `z`; a folder or a pattern such as
  `rec1-*.csv` names the set, and what differs between the file names is the label.

Lines `# unit: mm` and `# rate_hz: 100` above the header state what a table cannot.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pipeline.delimited_text import Floats, Table, read_table
from pipeline.delimited_time import FRAME, TIME, common_grid, in_order, resample, row_times
from pipeline.raw import Column, RawMarkers, make_raw, strip_prefix
from sim.errors import InputError

WIDE = re.compile(
    r"^(?P<label>.+?)[\s_.:\-]+(?P<axis>[xyzXYZ])(?:[\s_]*[\[(]?(?P<unit>mm|cm|m)[\])]?)?$"
)
BARE = re.compile(r"^(?P<axis>[xyzXYZ])(?:[\s_]*[\[(]?(?P<unit>mm|cm|m)[\])]?)?$")
MARKER = re.compile(r"^(marker|label|name)$", re.I)


@dataclass(frozen=True, kw_only=True, slots=True)
class _Track:
    """Markers of one file at its own times."""

    times: Floats
    columns: list[Column]
    unit: str
    rate: float
    notes: list[str]


def is_delimited(path: Path) -> bool:
    """Whether a path names a text table, a folder or a pattern of them."""
    return path.suffix.lower() in {".csv", ".tsv", ".txt"} or path.is_dir() or "*" in path.name


def read_delimited(path: Path, *, assumed_rate: float) -> RawMarkers:
    """Read a marker table, or a set of one-marker tables.

    Parameters
    ----------
    path : file, folder, or pattern with `*` in the last part
    assumed_rate : Hz, used with a note when a table has neither times nor a rate
    """
    files = _files(path)
    labels = _labels_of_files(files)
    tracks = [
        _read_one(file, label, assumed_rate) for file, label in zip(files, labels, strict=True)
    ]
    notes = list(dict.fromkeys(note for track in tracks for note in track.notes))
    units = {track.unit for track in tracks}
    if len(units) > 1:
        raise InputError(f"{path}: unit: the files state different ones {sorted(units)}. Use one.")
    rate = tracks[0].rate
    if any(abs(track.rate - rate) > 0.02 * rate for track in tracks):
        raise InputError(f"{path}: rate: differs between the files. Export them at one rate.")
    grid = common_grid(path, [track.times for track in tracks], rate)
    columns = [
        Column(column.label, resample(track.times, column.places, grid, rate))
        for track in tracks
        for column in track.columns
    ]
    return make_raw(
        source=str(path),
        columns=columns,
        unit=units.pop(),
        rate=rate,
        start=float(grid[0]),
        vertical=-1,
        notes=notes,
    )


def _files(path: Path) -> list[Path]:
    if path.is_dir():
        files = sorted(f for f in path.iterdir() if f.suffix.lower() in {".csv", ".tsv", ".txt"})
    elif "*" in path.name:
        files = sorted(path.parent.glob(path.name))
    else:
        files = [path]
    if not files:
        raise InputError(f"{path}: file: no table matches. Check the path in the table.")
    return files


def _labels_of_files(files: list[Path]) -> list[str]:
    """Take what differs between the names: `a-LAC-1.csv`, `a-UAC-1.csv` are LAC and UAC."""
    parts = [re.split(r"[-_ ]", file.stem) for file in files]
    if len(files) == 1:
        words = [w for w in parts[0] if re.fullmatch(r"[A-Za-z]{2,}\d*", w)]
        return [words[0] if words else files[0].stem]
    if len({len(p) for p in parts}) == 1:
        differing = [i for i in range(len(parts[0])) if len({p[i] for p in parts}) > 1]
        return ["-".join(p[i] for i in differing) for p in parts]
    return [file.stem for file in files]


def _read_one(path: Path, label: str, assumed_rate: float) -> _Track:
    table = read_table(path)
    notes: list[str] = []
    names = table.names
    bare = {m["axis"].lower(): i for i, n in enumerate(names) if (m := BARE.match(n))}
    has_marker = any(MARKER.match(name) for name in names)
    if len(bare) == 3 and has_marker:
        times, rate, columns = _long(table, bare, assumed_rate, notes)
    elif len(bare) == 3:
        times, rate = row_times(table, assumed_rate, notes)
        columns = [Column(label, np.stack([table.numbers[:, bare[a]] for a in "xyz"], axis=1))]
    else:
        times, rate = row_times(table, assumed_rate, notes)
        columns = _wide(table)
    times, columns = in_order(times, columns, notes)
    return _Track(times=times, columns=columns, unit=_unit(table), rate=rate, notes=notes)


def _unit(table: Table) -> str:
    if "unit" in table.stated:
        return table.stated["unit"]
    found = [m["unit"] for n in table.names if (m := WIDE.match(n) or BARE.match(n)) and m["unit"]]
    return found[0] if found else table.unit_row


def _wide(table: Table) -> list[Column]:
    """Columns `LABEL X` and so on, paired by name whatever their order."""
    found: dict[str, dict[str, int]] = {}
    for index, name in enumerate(table.names):
        match = WIDE.match(name)
        if match:
            axes = found.setdefault(strip_prefix([match["label"]])[0], {})
            axis = match["axis"].lower()
            if axis in axes:
                raise InputError(
                    f"{table.path}: column {name!r}: occurs twice. Give every marker its own name."
                )
            axes[axis] = index
    if not found:
        raise InputError(
            f"{table.path}: header: no columns like 'CLAV X', 'CLAV Y', 'CLAV Z'. See"
            " docs/methods/mocap.md for the shapes that are read."
        )
    for label, axes in found.items():
        if len(axes) < 3:
            missing = ", ".join(sorted(set("xyz") - set(axes))).upper()
            raise InputError(
                f"{table.path}: marker {label}: no column for {missing}. Add it or drop the marker."
            )
    return [
        Column(label, np.stack([table.numbers[:, axes[a]] for a in "xyz"], axis=1))
        for label, axes in found.items()
    ]


def _long(
    table: Table, bare: dict[str, int], assumed_rate: float, notes: list[str]
) -> tuple[Floats, float, list[Column]]:
    """One row a marker and frame."""
    which = next(i for i, name in enumerate(table.names) if MARKER.match(name))
    row_labels = np.array(strip_prefix([row[which] for row in table.rows]))
    keys = [i for i, n in enumerate(table.names) if FRAME.match(n) or TIME.match(n)]
    if not keys:
        raise InputError(
            f"{table.path}: header: a long table needs a frame or time column. Add it."
        )
    stamps, first, inverse = np.unique(
        table.numbers[:, keys[0]], return_index=True, return_inverse=True
    )
    short = Table(
        path=table.path,
        names=table.names,
        rows=[],
        numbers=table.numbers[first],
        stated=table.stated,
        unit_row=table.unit_row,
    )
    times, rate = row_times(short, assumed_rate, notes)
    columns: list[Column] = []
    for label in dict.fromkeys(row_labels.tolist()):
        places = np.full((stamps.size, 3), np.nan)
        mine = row_labels == label
        places[inverse[mine]] = table.numbers[mine][:, [bare[a] for a in "xyz"]]
        columns.append(Column(label, places))
    return times, rate, columns
