"""A skin's binding as a table that a person can edit (dilorenzo2009, section 8.2).

    vertex,handle,weight,region,x_m,y_m,z_m
    17,rib_L3,0.62,chest,0.061,0.083,0.301

A row is one handle of one vertex. `region` and the place are told to find a vertex by; on the way
back only the first three columns are read, or with an empty `vertex` the region: then the row
holds for all its vertices. Whatever the table does not name stays as it is.
"""

from __future__ import annotations

import csv
import difflib
import io
from dataclasses import replace
from pathlib import Path

import numpy as np

from pipeline.records import write_text
from sim.errors import InputError
from sim.skin.binding import Weights
from sim.skin.bound import BoundSkin
from sim.skin.frame import SOFT

COLUMNS = ("vertex", "handle", "weight", "region", "x_m", "y_m", "z_m")
NEEDED = COLUMNS[:3]
LEAST = 5e-5
"""Weights below it are not written."""
SUM_OFF = 1e-3
"""How far the weights of a vertex may be from a sum of one."""
REGIONS = (
    ("head", ("skull", "C1")), ("neck", ("C4",)), ("belly", (SOFT, "L1", "L4")),
    ("hips", ("pelvis",)), ("left shoulder", ("girdle_L",)), ("right shoulder", ("girdle_R",)),
    ("left arm", ("upper_arm_L", "forearm_L")), ("right arm", ("upper_arm_R", "forearm_R")),
)  # fmt: skip
CHEST = "chest"
Rows = dict[int | str, dict[int, float]]


def regions(skin: BoundSkin) -> list[str]:
    """Region of each vertex: of the handle that it follows most."""
    names = []
    for handle in skin.rest.handles:
        found = [region for region, starts in REGIONS if handle.startswith(starts)]
        names.append(found[0] if found else CHEST)
    most = np.argmax(skin.weights.weight, axis=1)
    return [names[h] for h in skin.weights.handle[np.arange(len(most)), most]]


def write_binding(path: Path, skin: BoundSkin) -> int:
    """Write the table; return the number of rows."""
    stream = io.StringIO()
    table = csv.writer(stream, lineterminator="\n")
    table.writerow(COLUMNS)
    handles, where, rows = skin.rest.handles, regions(skin), 0
    for vertex, (place, region) in enumerate(zip(skin.vertices, where, strict=True)):
        at = [f"{x:.4f}" for x in place]
        pairs = zip(skin.weights.handle[vertex], skin.weights.weight[vertex], strict=True)
        for handle, weight in pairs:
            if weight >= LEAST:
                table.writerow([vertex, handles[handle], f"{weight:.5f}", region, *at])
                rows += 1
    write_text(path, stream.getvalue())
    return rows


def _handle(names: dict[str, int], word: str, place: str) -> int:
    if word not in names:
        near = difflib.get_close_matches(word, names, n=3) or ["skull", "rib_L1", f"{SOFT}0"]
        raise InputError(f"{place}: no bone or point '{word}'. Near it: {', '.join(near)}.")
    return names[word]


def _vertex(row: dict[str, str], n: int, known: set[str], place: str) -> int | str:
    word = (row["vertex"] or "").strip()
    if not word:
        region = (row.get("region") or "").strip()
        if region not in known:
            raise InputError(
                f"{place}: neither a vertex nor a region ('{region}'). Regions:"
                f" {', '.join(sorted(known))}."
            )
        return region
    if not (word.isdecimal() and int(word) < n):
        raise InputError(f"{place}: vertex is '{word}'. Use 0 to {n - 1}.")
    return int(word)


def _weight(word: str | None, place: str) -> float:
    try:
        weight = float(word or "")
    except ValueError:
        weight = np.nan
    if not 0.0 <= weight <= 1.0 + SUM_OFF:
        raise InputError(f"{place}: weight is '{word}'. Use a number from 0 to 1.")
    return weight


def _rows(path: Path, skin: BoundSkin) -> Rows:
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read as a table ({error}).") from error
    table = csv.DictReader(lines)
    missing = [name for name in NEEDED if name not in (table.fieldnames or ())]
    if missing:
        raise InputError(f"{path}: no column {', '.join(missing)}. Begin with {','.join(COLUMNS)}.")
    names = {name: k for k, name in enumerate(skin.rest.handles)}
    known = set(regions(skin))
    found: Rows = {}
    for row in table:
        place = f"{path} line {table.line_num}"
        if None in row.values() and any(row.get(name) is None for name in NEEDED):
            raise InputError(f"{place}: too few values. Give {', '.join(NEEDED)}.")
        key = _vertex(row, len(skin.vertices), known, place)
        handle = _handle(names, (row["handle"] or "").strip(), place)
        own = found.setdefault(key, {})
        if handle in own:
            raise InputError(f"{place}: {row['handle']} stands twice for {key}. Leave one row.")
        own[handle] = _weight(row["weight"], place)
    return found


def read_binding(path: Path, skin: BoundSkin) -> BoundSkin:
    """A skin with the weights of a table; vertices that it does not name keep theirs.

    Raises
    ------
    InputError
        for a file that is no such table, unknown names, or weights whose sum is not one
    """
    found = _rows(path, skin)
    for key, own in found.items():
        total = sum(own.values())
        if abs(total - 1.0) > SUM_OFF:
            what = f"vertex {key}" if isinstance(key, int) else f"region {key}"
            raise InputError(f"{path}: weights of {what} sum to {total:.4f}. Make them sum to 1.")
    where = regions(skin)
    most = max([skin.weights.handle.shape[1], *(len(own) for own in found.values())])
    more = ((0, 0), (0, most - skin.weights.handle.shape[1]))
    handle, weight = np.pad(skin.weights.handle, more), np.pad(skin.weights.weight, more)
    # regions first: a vertex that is named itself goes before its region
    for key, own in sorted(found.items(), key=lambda item: isinstance(item[0], int)):
        chosen = [key] if isinstance(key, int) else [v for v, r in enumerate(where) if r == key]
        handle[chosen], weight[chosen] = 0, 0.0
        handle[np.ix_(chosen, range(len(own)))] = list(own)
        weight[np.ix_(chosen, range(len(own)))] = list(own.values())
    weights = Weights(handle=handle, weight=weight / weight.sum(axis=1, keepdims=True))
    return replace(skin, weights=weights, about=skin.about | {"edited": path.name})
