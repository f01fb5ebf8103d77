"""Which marker of a recording sits where on a torso, by its label."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from pipeline.raw import Floats
from sim.errors import InputError

TABLE = Path(__file__).with_name("tables") / "torso_markers.csv"
# labels that say nothing but a number: M01, 17, marker_3
NUMBERED = re.compile(r"^(?:m|mk|mkr|marker|p|pt|point)?[\s_-]*\d+$", re.I)
# below this number symmetry and stiffness say nothing about front and back
MIN_NUMBERED = 8
# what a map may say of a marker that has no anatomical name
REGIONS = {"FRONT", "MID", "SIDE", "BACK"}
IGNORE = {"", "-", "IGNORE", "NONE"}


@dataclass(frozen=True, kw_only=True, slots=True)
class Place:
    """A canonical marker.

    Parameters
    ----------
    name : canonical name
    region : front, side or back
    nominal : (3,), m, body axes (X anterior, Y left, Z up), a hand-set place on a man of 1.75 m
        that only serves to find the axes of a body
    """

    name: str
    region: str
    nominal: Floats


@cache
def places() -> dict[str, Place]:
    """Every canonical marker by its name."""
    with TABLE.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    return {
        row["name"]: Place(
            name=row["name"],
            region=row["region"],
            nominal=np.array([float(row[f"{a}_m"]) for a in "xyz"]),
        )
        for row in rows
    }


@cache
def _aliases() -> dict[str, str]:
    with TABLE.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    known = {row["name"]: row["name"] for row in rows}
    for row in rows:
        for alias in row["aliases"].split():
            known.setdefault(alias, row["name"])
    return known


def canonical(label: str) -> str:
    """Canonical name of a label, empty when it is not known to be on a torso."""
    plain = re.sub(r"[\s_.\-]+", "", label).upper()
    known = _aliases()
    if plain in known:
        return known[plain]
    # Sternum1, ScapulaL3: a cluster of one place
    match = re.fullmatch(r"([A-Z]{4,})\d", plain)
    return known.get(match[1], "") if match else ""


def region(spot: str) -> str:
    """Side of the torso of a spot: front, side, back, or empty when it is not known."""
    if spot in places():
        return places()[spot].region
    return {"FRONT": "front", "MID": "front", "SIDE": "side", "BACK": "back"}.get(spot, "")


def read_map(path: Path) -> dict[str, str]:
    """Read a markers map: a TSV with columns `label` and `name`; `-` leaves a marker out.

    A name is canonical (or an alias of one), or `MID` (front midline), `FRONT`, `SIDE`, `BACK`;
    any other name means: on the torso, place found from geometry.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: markers map: cannot be read. Check the table's path.") from error
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    rows = [[cell.strip() for cell in line.split("\t")] for line in lines]
    if not rows or rows[0][:2] != ["label", "name"]:
        raise InputError(
            f"{path}: header: must be 'label' and 'name' with a tab between. Correct the first row."
        )
    mapping: dict[str, str] = {}
    for number, row in enumerate(rows[1:], start=2):
        if len(row) < 2 or not row[0]:
            raise InputError(f"{path}: row {number}: needs a label, a tab and a name. Add them.")
        if row[0] in mapping:
            raise InputError(f"{path}: row {number}: label {row[0]} occurs twice. Keep one.")
        mapping[row[0]] = row[1]
    return mapping


def virtual_segments(labels: tuple[str, ...]) -> set[str]:
    """List ends of computed axes: Plug-in Gait writes `PELO PELA PELL PELP` for the pelvis."""
    stems = {label[:-1] for label in labels if label.endswith("O")}
    return {
        stem + end
        for stem in stems
        for end in "OALP"
        if all(stem + other in labels for other in "OALP")
    }


def choose_markers(
    source: str, labels: tuple[str, ...], mapping: dict[str, str] | None
) -> tuple[list[int], list[str], list[str]]:
    """Choose the markers on the torso.

    Returns
    -------
    indices of the markers kept; the spot of each: a canonical name, a region (`FRONT`, `MID`,
    `SIDE`, `BACK`) or empty; notes
    """
    if mapping is not None:
        return _by_map(source, labels, mapping)
    virtual = virtual_segments(labels)
    spots = ["" if label in virtual else canonical(label) for label in labels]
    keep = [i for i, spot in enumerate(spots) if spot]
    if keep:
        left_out = [label for label, spot in zip(labels, spots, strict=True) if not spot]
        notes = [f"not known to be on the torso, left out: {', '.join(left_out)}"]
        return keep, [spots[i] for i in keep], notes if left_out else []
    keep = [i for i, label in enumerate(labels) if NUMBERED.match(label)]
    if len(keep) < MIN_NUMBERED:
        raise InputError(
            f"{source}: markers: none on the torso is known ({', '.join(labels[:6])} ...)."
            " Name them in a markers map (docs/methods/mocap.md)."
        )
    note = "labels are only numbers: front, back and sides found from geometry"
    return keep, [""] * len(keep), [note]


def _by_map(
    source: str, labels: tuple[str, ...], mapping: dict[str, str]
) -> tuple[list[int], list[str], list[str]]:
    missing = [label for label in mapping if label not in labels]
    keep = [i for i, s in enumerate(labels) if mapping.get(s, "-").upper() not in IGNORE]
    if not keep:
        raise InputError(
            f"{source}: markers: the map names none of its labels ({', '.join(labels[:6])} ...)."
            " Correct the map."
        )
    notes = [f"in the map but not in the file: {', '.join(missing)}"] if missing else []
    spots = []
    for i in keep:
        given = mapping[labels[i]]
        spots.append(given.upper() if given.upper() in REGIONS else canonical(given))
    return keep, spots, notes


def unique_names(spots: list[str]) -> tuple[str, ...]:
    """Canonical names, the first marker of a cluster only; empty for all others."""
    out: list[str] = []
    for spot in spots:
        out.append(spot if spot in places() and spot not in out else "")
    return tuple(out)
