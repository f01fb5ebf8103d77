"""C3D files to markers in metres; the only place that knows ezc3d."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import ezc3d
import numpy as np

from pipeline.c3d_header import read_header
from pipeline.raw import Column, Floats, RawMarkers, make_raw, strip_prefix
from pipeline.records import write_bytes
from sim.errors import InputError

# groups of POINT that list points which are not places of markers (Vicon's C3D convention)
NOT_MARKERS = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS", "REACTIONS")
MM = 1e3
"""In a metre."""


def read_c3d(path: Path) -> RawMarkers:
    """Read the markers of a C3D file.

    Not-a-number, a negative residual and the exact origin all mean "not seen". Angles, forces
    and the like, unlabelled points (`*114`) and points never seen are left out.
    """
    header = read_header(path)
    parameters, points, residuals = _load(path)
    point = parameters["POINT"]
    labels = _texts(point, "LABELS")
    unit = (_texts(point, "UNITS") or [""])[0]
    rate = _rate(point, header.rate)
    n_frames = points.shape[2]
    if n_frames < 1:
        raise InputError(f"{path}: data: no frames. Export the recording again.")
    excluded = _not_markers(point)
    columns: list[Column] = []
    dropped = {"unlabelled": 0, "angles and other derived points": 0, "never seen": 0}
    for index in range(points.shape[1]):
        label = labels[index] if index < len(labels) else ""
        name = strip_prefix([label])[0]
        places = np.array(points[:3, index].T, dtype=np.float64)
        places[(residuals[index] < 0) | ~np.isfinite(places).all(axis=1)] = np.nan
        places[(places == 0.0).all(axis=1)] = np.nan
        if not name or re.fullmatch(r"\*.*|[UC]_\d+", name):
            dropped["unlabelled"] += 1
        elif label.strip() in excluded or name in excluded:
            dropped["angles and other derived points"] += 1
        elif not np.isfinite(places).any():
            dropped["never seen"] += 1
        else:
            columns.append(Column(name, places))
    if not columns:
        raise InputError(
            f"{path}: markers: none is labelled and seen. Label them and export again."
        )
    notes = [f"{count} points left out: {why}" for why, count in dropped.items() if count]
    if header.first_frame > 1:
        notes.append(f"the first frame is number {header.first_frame}; times count from it as 0 s")
    return make_raw(
        source=str(path),
        columns=columns,
        unit=unit,
        rate=rate,
        start=0.0,
        vertical=_vertical(point),
        notes=notes,
    )


def _load(path: Path) -> tuple[Any, Floats, Floats]:
    try:
        content = ezc3d.c3d(str(path))
        points = np.asarray(content["data"]["points"], dtype=np.float64)
        residuals = np.asarray(content["data"]["meta_points"]["residuals"], dtype=np.float64)
        return (
            content["parameters"],
            points,
            residuals.reshape(-1, points.shape[2])[: points.shape[1]],
        )
    except (OSError, RuntimeError, ValueError, KeyError, IndexError, MemoryError) as error:
        detail = " ".join(str(error).split())[:120]
        raise InputError(
            f"{path}: data: cannot be read as C3D ({detail}). Export it again."
        ) from error


def _texts(point: Any, key: str) -> list[str]:
    """Values of a text parameter with its continuations (LABELS, LABELS2, ...)."""
    found: list[str] = []
    for name in [key] + [f"{key}{i}" for i in range(2, 20)]:
        if name not in point:
            break
        found += [str(value).strip() for value in np.atleast_1d(point[name]["value"])]
    return found


def _rate(point: Any, of_header: float) -> float:
    values = np.atleast_1d(point["RATE"]["value"]) if "RATE" in point else np.array([])
    # the parameter is authoritative where header and parameter differ
    return float(values[0]) if values.size else float(of_header)


def _not_markers(point: Any) -> set[str]:
    names: set[str] = set()
    for group in NOT_MARKERS:
        names.update(name for name in _texts(point, group) if name)
    return names


def _vertical(point: Any) -> int:
    """Axis that points up: what the file calls up the screen, -1 when it does not say."""
    up = (_texts(point, "Y_SCREEN") or [""])[0].upper()
    match = re.fullmatch(r"[+-]?([XYZ])", up)
    return "XYZ".index(match.group(1)) if match else -1


def write_c3d(path: Path, names: Sequence[str], places: Floats, time: Floats) -> None:
    """Write markers as a C3D file in millimetres, whole or not at all.

    Parameters
    ----------
    names : labels; places : (n_frames, n_markers, 3), m, X anterior, Y left, Z up
    time : (n_frames,), s, evenly spaced
    """
    content = ezc3d.c3d()
    point = content["parameters"]["POINT"]
    point["LABELS"]["value"] = list(names)
    point["UNITS"]["value"] = ["mm"]
    n_frames = len(time)
    seconds = float(time[-1] - time[0])
    point["RATE"]["value"] = [(n_frames - 1) / seconds if seconds > 0 else 1.0]
    content.add_parameter("POINT", "X_SCREEN", ["+X"])
    content.add_parameter("POINT", "Y_SCREEN", ["+Z"])
    points = np.ones((4, len(names), n_frames))
    points[:3] = MM * np.moveaxis(places, (0, 1, 2), (2, 1, 0))
    content["data"]["points"] = points
    with tempfile.TemporaryDirectory() as folder:
        # the library puts its own ending after any other
        written = Path(folder) / "markers.c3d"
        content.write(str(written))
        write_bytes(path, written.read_bytes())
