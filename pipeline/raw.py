"""What a marker file holds, before anything is known about the body in it."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sim.errors import InputError

Floats = npt.NDArray[np.float64]

# markers on a body spread at least and at most so far (m): decides the unit when none is stated
BODY_SPAN = (0.1, 3.0)
UNIT_NAMES = {
    "m": 1.0,
    "meter": 1.0,
    "meters": 1.0,
    "metre": 1.0,
    "metres": 1.0,
    "cm": 0.01,
    "centimeters": 0.01,
    "centimetres": 0.01,
    "mm": 0.001,
    "millimeter": 0.001,
    "millimeters": 0.001,
    "millimetres": 0.001,
}


class Column(NamedTuple):
    """One marker as read: its label and (n_frames, 3) places in the file's unit."""

    label: str
    places: Floats


@dataclass(frozen=True, kw_only=True, slots=True)
class RawMarkers:
    """Markers in the axes of the laboratory.

    Parameters
    ----------
    source : file, for messages
    labels : as in the file without a subject's prefix, all different
    positions : (n_frames, n_markers, 3), m, not-a-number where not seen
    rate : Hz
    start : s, time of the first frame in the file's own time
    vertical : index of the axis that points up in the laboratory, -1 if the file does not say
    notes : what the reader decided, one sentence each
    """

    source: str
    labels: tuple[str, ...]
    positions: Floats
    rate: float
    start: float
    vertical: int
    notes: tuple[str, ...]

    def select(self, keep: list[int]) -> RawMarkers:
        """Only the markers `keep`, in that order."""
        labels = tuple(self.labels[i] for i in keep)
        return replace(self, labels=labels, positions=self.positions[:, keep])


def unit_factor(source: str, unit: str, span: float) -> tuple[float, str]:
    """Metres per unit of the file, and a note when it had to be inferred.

    Parameters
    ----------
    source : file, for messages
    unit : as the file states it, empty when it does not
    span : largest distance between two markers in the file's unit
    """
    name = unit.strip().lower()
    if name in UNIT_NAMES:
        return UNIT_NAMES[name], ""
    if name:
        raise InputError(
            f"{source}: unit {unit!r}: not a unit of length known here. Use m, cm or mm."
        )
    # mm and m are what systems write; cm is believed only where neither can be
    order = (("mm", 0.001), ("m", 1.0), ("cm", 0.01))
    fits = [(u, f) for u, f in order if BODY_SPAN[0] <= span * f <= BODY_SPAN[1]]
    if not fits:
        raise InputError(
            f"{source}: unit: none is stated and a spread of {span:.3g} does not tell which."
            " State m, cm or mm in the file."
        )
    unit_found, factor = fits[0]
    return factor, (
        f"no unit is stated; {unit_found} inferred, as the markers then spread over"
        f" {span * factor:.2f} m"
    )


def check_scale(source: str, unit: str, positions: Floats) -> None:
    """Refuse a stated unit that makes the markers a speck or a landscape."""
    span = marker_span(positions)
    if np.isfinite(span) and not 0.02 <= span <= 20.0:
        raise InputError(
            f"{source}: unit {unit!r}: the markers would spread over {span:.3g} m, which is no"
            " body. Correct the unit in the file."
        )


def marker_span(positions: Floats) -> float:
    """Diagonal of the box round the markers' median places, in the unit given."""
    seen = positions[:, np.isfinite(positions).any(axis=(0, 2))]
    if seen.shape[1] == 0:
        return float("nan")
    middle = np.nanmedian(seen, axis=0)
    return float(np.linalg.norm(middle.max(axis=0) - middle.min(axis=0)))


def strip_prefix(labels: list[str]) -> list[str]:
    """Labels without the subject's name in front: `Derrick:CLAV` is `CLAV`."""
    return [re.split(r"[:]", label.strip())[-1].strip() for label in labels]


def unique_columns(columns: list[Column]) -> tuple[list[Column], list[str]]:
    """Merge or rename columns of the same label; the first keeps its name."""
    kept: dict[str, Column] = {}
    notes: list[str] = []
    for label, places in columns:
        if label not in kept:
            kept[label] = Column(label, places)
            continue
        first = kept[label].places
        both = np.isfinite(first).all(axis=1) & np.isfinite(places).all(axis=1)
        if not both.any() or np.allclose(first[both], places[both]):
            kept[label] = Column(label, np.where(np.isfinite(first), first, places))
            notes.append(f"label {label} occurs twice with the same track; merged")
        else:
            count = sum(1 for name in kept if name.startswith(f"{label}#"))
            other = f"{label}#{count + 2}"
            kept[other] = Column(other, places)
            notes.append(f"label {label} occurs twice with different tracks; second is {other}")
    return list(kept.values()), notes


def make_raw(
    *,
    source: str,
    columns: list[Column],
    unit: str,
    rate: float,
    start: float,
    vertical: int,
    notes: list[str],
) -> RawMarkers:
    """Check what both readers must check, and convert to metres."""
    if not np.isfinite(rate) or rate <= 0:
        raise InputError(f"{source}: rate {rate:g} Hz: not positive. State the frame rate.")
    columns, more = unique_columns(columns)
    positions = np.stack([places for _, places in columns], axis=1).astype(np.float64)
    positions[~np.isfinite(positions).all(axis=2)] = np.nan
    # systems write the origin where they saw nothing
    positions[(positions == 0.0).all(axis=2)] = np.nan
    if not np.isfinite(positions).any():
        raise InputError(f"{source}: markers: none is seen in any frame. Record again.")
    factor, note = unit_factor(source, unit, marker_span(positions))
    positions = positions * factor
    check_scale(source, unit, positions)
    return RawMarkers(
        source=source,
        labels=tuple(label for label, _ in columns),
        positions=positions,
        rate=float(rate),
        start=float(start),
        vertical=vertical,
        notes=tuple(notes + more + ([note] if note else [])),
    )


def cut(raw: RawMarkers, start_s: float | None, end_s: float | None) -> RawMarkers:
    """Keep the frames from `start_s` to `end_s` (file time); either may be open."""
    n_frames = raw.positions.shape[0]
    last = raw.start + n_frames / raw.rate
    begin = raw.start if start_s is None else start_s
    end = last if end_s is None else end_s
    half = 0.5 / raw.rate
    if begin < raw.start - half or begin >= last:
        raise InputError(
            f"{raw.source}: start_s {begin:g}: outside the file, which runs from"
            f" {raw.start:.2f} to {last:.2f} s. Change start_s."
        )
    if end > last + half or end <= begin:
        raise InputError(
            f"{raw.source}: end_s {end:g}: must lie after start_s ({begin:g}) and not after the"
            f" end of the file ({last:.2f} s). Change end_s."
        )
    first = max(0, round((begin - raw.start) * raw.rate))
    stop = min(n_frames, round((end - raw.start) * raw.rate))
    return replace(raw, positions=raw.positions[first:stop], start=raw.start + first / raw.rate)
