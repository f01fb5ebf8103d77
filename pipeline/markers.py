"""From a marker file to a clean recording in the axes of the body."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.body import find_body, front_midline, remove_trunk
from pipeline.c3d import read_c3d
from pipeline.conditioning import (
    Bools,
    decimate,
    fill_gaps,
    low_pass,
    noise_level,
    runs,
    seen,
)
from pipeline.delimited import is_delimited, read_delimited
from pipeline.flicker import Flicker, find_flicker, without_flicker
from pipeline.labels import choose_markers, read_map, unique_names
from pipeline.raw import Floats, RawMarkers, cut
from pipeline.settings import MarkerSettings
from sim.errors import InputError

MIN_FRAMES = 20


@dataclass(frozen=True, kw_only=True, slots=True)
class MarkerRecording:
    """Markers on a torso, in body axes (X anterior, Y left, Z up along the trunk), metres.

    Parameters
    ----------
    name : of the recording
    labels : as in the file, prefix stripped
    names : canonical name, or empty where none is known
    positions : (n_frames, n_markers, 3), m; not-a-number where missing even after filling;
        relative to the back when `back` is not empty
    measured : (n_frames, n_markers), whether the file had a place there
    rate : Hz
    start : s of the first frame in the file's time
    posture : upright or supine
    sagittal : markers of the front midline column, top to bottom
    back : markers by which the trunk's motion was removed, empty if it was not
    quality : JSON-able: gaps, noise, flicker, trunk motion, notes, warnings
    """

    name: str
    labels: tuple[str, ...]
    names: tuple[str, ...]
    positions: Floats
    measured: Bools
    rate: float
    start: float
    posture: str
    sagittal: tuple[int, ...]
    back: tuple[int, ...]
    quality: dict[str, Any]


def read_raw(path: Path, settings: MarkerSettings) -> RawMarkers:
    """Read any marker file by its kind."""
    if is_delimited(path):
        return read_delimited(path, assumed_rate=settings.assumed_rate_hz)
    return read_c3d(path)


def read_recording(
    path: Path,
    settings: MarkerSettings,
    *,
    name: str,
    posture: str,
    start_s: float | None = None,
    end_s: float | None = None,
    marker_map: Path | None = None,
) -> MarkerRecording:
    """Read a file and prepare it: the whole `markers` stage but for writing."""
    mapping = None if marker_map is None else read_map(marker_map)
    raw = cut(read_raw(path, settings), start_s, end_s)
    return prepare(raw, settings, name=name, posture=posture, mapping=mapping)


def prepare(
    raw: RawMarkers,
    settings: MarkerSettings,
    *,
    name: str,
    posture: str,
    mapping: dict[str, str] | None,
) -> MarkerRecording:
    """Choose torso markers, fill gaps, filter, remove the trunk's motion, turn to body axes."""
    _check(raw, posture)
    keep, spots, notes = choose_markers(raw.source, raw.labels, mapping)
    raw, spots, warnings = _drop_unseen(raw.select(keep), spots, settings.min_seen)
    measured = seen(raw.positions)
    noise = noise_level(raw.positions)
    flicker = find_flicker(raw.positions, raw.rate, settings.flicker_m)
    warnings += _flicker_warnings(raw, flicker)
    filled = _fill(raw, flicker, math.floor(settings.max_gap_s * raw.rate + 1e-9))
    warnings += _gap_warnings(raw, filled, settings.max_gap_s)
    factor = max(1, math.ceil(raw.rate / settings.max_rate_hz - 1e-9))
    rate = raw.rate / factor
    if factor > 1:
        notes.append(f"{raw.rate:g} Hz reduced to {rate:g} Hz after an anti-alias filter")
    if rate < settings.low_rate_hz:
        warnings.append(
            f"{rate:.3g} Hz: what is faster than {rate / 2:.3g} Hz cannot be seen (laughs, coughs)"
        )
    slow = low_pass(decimate(filled, factor), rate, settings.cutoff_hz)
    axes, back, axis_notes = find_body(raw, slow, spots, posture)
    placed, trunk = remove_trunk(slow, back, warnings)
    body = (placed - np.nanmean(placed, axis=(0, 1))) @ axes.T
    quality = {
        "file": raw.source,
        "file_rate_hz": raw.rate,
        "rate_hz": rate,
        "duration_s": len(body) / rate,
        "noise_mm": {s: 1e3 * float(v) for s, v in zip(raw.labels, noise, strict=True)},
        "noise_median_m": float(np.median(noise)),
        "gaps": _gap_table(raw, filled),
        "flicker": {
            raw.labels[i]: {
                "jumps": found.n_jumps,
                "repaired_s": sum(r.stop - r.start for r in found.stretches) / raw.rate,
            }
            for i, found in flicker.items()
        },
        "trunk": trunk,
        "notes": [*raw.notes, *notes, *axis_notes],
        "warnings": warnings,
    }
    return MarkerRecording(
        name=name,
        labels=raw.labels,
        names=unique_names(spots),
        positions=body,
        measured=measured[::factor],
        rate=rate,
        start=raw.start,
        posture=posture,
        sagittal=front_midline(body, spots),
        back=tuple(back) if trunk["removed"] else (),
        quality=quality,
    )


def _check(raw: RawMarkers, posture: str) -> None:
    if posture not in ("upright", "supine"):
        raise InputError(
            f"{raw.source}: posture {posture!r}: unknown. Use upright or supine in the table."
        )
    n_frames = len(raw.positions)
    if n_frames < MIN_FRAMES:
        raise InputError(
            f"{raw.source}: data: {n_frames} frames are too few for a breath."
            " Give a longer recording, or widen start_s and end_s."
        )


def _drop_unseen(
    raw: RawMarkers, spots: list[str], min_seen: float
) -> tuple[RawMarkers, list[str], list[str]]:
    """Leave out markers that are hidden most of the time."""
    share = seen(raw.positions).mean(axis=0)
    keep = [i for i in range(len(spots)) if share[i] >= min_seen]
    hidden = [i for i in range(len(spots)) if i not in keep]
    if not keep:
        raise InputError(
            f"{raw.source}: markers: all {len(spots)} on the torso are hidden for more than"
            f" {1 - min_seen:.0%} of the time. Record again or choose start_s and end_s."
        )
    warnings = [f"{raw.labels[i]}: seen {share[i]:.0%} of the time, left out" for i in hidden]
    return raw.select(keep), [spots[i] for i in keep], warnings


def _fill(raw: RawMarkers, flicker: dict[int, Flicker], max_gap: int) -> Floats:
    """Fill stretches of flicker whatever their length, and gaps up to `max_gap` frames."""
    clean = without_flicker(raw.positions, flicker)
    longest = max(
        (r.stop - r.start for found in flicker.values() for r in found.stretches), default=0
    )
    repaired = np.where(seen(raw.positions)[:, :, None], fill_gaps(clean, longest), np.nan)
    return fill_gaps(repaired, max_gap)


def _flicker_warnings(raw: RawMarkers, flicker: dict[int, Flicker]) -> list[str]:
    return [
        f"{raw.labels[i]}: jumps {found.n_jumps} times between two positions;"
        f" {sum(r.stop - r.start for r in found.stretches) / raw.rate:.2f} s repaired"
        for i, found in flicker.items()
    ]


def _gap_warnings(raw: RawMarkers, filled: Floats, max_gap: float) -> list[str]:
    out = []
    for label, missing in zip(raw.labels, ~seen(filled).T, strict=True):
        for gap in runs(missing)[:3]:
            out.append(
                f"{label}: no data from {raw.start + gap.start / raw.rate:.2f} to"
                f" {raw.start + gap.stop / raw.rate:.2f} s, longer than max_gap_s ({max_gap:g})"
            )
    return out


def _gap_table(raw: RawMarkers, filled: Floats) -> dict[str, dict[str, float]]:
    """Share missing, share still missing and longest gap of each marker."""
    before, after = ~seen(raw.positions), ~seen(filled)
    return {
        label: {
            "missing": float(before[:, i].mean()),
            "left_missing": float(after[:, i].mean()),
            "longest_s": max((g.stop - g.start for g in runs(before[:, i])), default=0) / raw.rate,
        }
        for i, label in enumerate(raw.labels)
    }
