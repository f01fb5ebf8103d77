"""Tables of a report: the stages' rows with headings and words for a person."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from pipeline.breath_motion import FIGURES
from pipeline.page import GROUPS, SUBJECT_MEAN, Rows, number, words

Columns = list[tuple[str, str]]

UNITS = (
    ("_mm_s", " (mm/s)"),
    ("_mm", " (mm)"),
    ("_cmh2o", " (cmH2O)"),
    ("_deg", " (°)"),
    ("_hz", " (Hz)"),
    ("_kg", " (kg)"),
    ("_l_s", " (L/s)"),
    ("_l", " (L)"),
    ("_s", " (s)"),
    ("_m", " (m)"),
)
BREATH_FIGURES = ("tidal_volume_l", *(name for name in FIGURES if name != "rib_rotation_deg"))
"""What the report says of the fitted torso's breath, out of fit.json; the ribs have a figure."""
SCOPES = {
    "signature": "the mean breath",
    "cycles": "every breath",
    "cycles_steady": "every breath, drift between breaths left out",
    "own": "every breath, each with levels of its own",
    "own_steady": "every breath, levels of its own, drift left out",
    "heldout": "breaths held out",
    "heldout_steady": "breaths held out, drift left out",
}
MARKERS = {"all": "all markers", "sagittal": "the front midline"}
ERROR_COLUMNS: Columns = [
    ("what", "against"),
    ("n_cycles", "breaths"),
    ("error_p_mm", "error p (mm)"),
    ("error_p_still_mm", "not moving (mm)"),
    ("share", "of not moving"),
    ("reference_1_mm", "1 mode (mm)"),
    ("reference_2_mm", "2 modes (mm)"),
    ("reference_4_mm", "4 modes (mm)"),
    ("spread_mm", "other breaths (mm)"),
    ("error_v_mm_s", "error v (mm/s)"),
    ("error_v_still_mm_s", "not moving (mm/s)"),
    ("error_p_absolute_mm", "with offset (mm)"),
]
MARKER_COLUMNS: Columns = [
    ("label", "label"),
    ("name", "place"),
    ("noise_mm", "noise (mm)"),
    ("missing", "missing (%)"),
    ("left", "still missing after filling (%)"),
    ("longest_s", "longest gap (s)"),
]
LEVEL_COLUMNS: Columns = [
    ("group", "group"),
    ("mean", "mean breath"),
    ("next", "next breath"),
    ("at_bound", "at a bound"),
]
RIB_COLUMNS: Columns = [
    ("rib", "rib"),
    ("pump", "pump handle (°)"),
    ("bucket", "bucket handle (°)"),
]
CYCLE_LEVEL_COLUMNS: Columns = [("cycle", "breath"), *((g, words(g)) for g in GROUPS)]


def heading(key: str) -> str:
    """Return a key as a heading: `error_p_mm` → `error p (mm)`, `n_runs` → `number of runs`."""
    if key.startswith("n_"):
        return f"number of {words(key.removeprefix('n_'))}"
    for suffix, unit in UNITS:
        if key.endswith(suffix):
            return words(key.removesuffix(suffix)) + unit
    return words(key)


def columns(rows: Rows, leave_out: Iterable[str] = ()) -> Columns:
    """Return (key, heading) of the columns of a table, in its order."""
    keys = list(rows[0]) if rows else []
    return [(key, heading(key)) for key in keys if key not in set(leave_out)]


def main_error(errors: Iterable[Mapping[str, Any]], markers: str = "all") -> Mapping[str, Any]:
    """Return the row that is quoted: every used breath in recording time; empty if none.

    Parameters
    ----------
    errors : rows of errors.csv
    markers : all or sagittal
    """
    rows = {str(row.get("scope", "")): row for row in errors}
    return rows.get(f"cycles_{markers}", {})


def share_of_still(row: Mapping[str, Any]) -> float:
    """Return error_p over the error of not moving; not-a-number where nothing moves."""
    try:
        error, still = float(row["error_p_mm"]), float(row["error_p_still_mm"])
    except (KeyError, ValueError):
        return float("nan")
    return error / still if still > 0 else float("nan")


def error_table(errors: Rows) -> Rows:
    """Return the rows of errors.csv with their scope in words and the share of not moving."""
    table = []
    for row in errors:
        scope, _, markers = row["scope"].rpartition("_")
        said = {
            "what": SCOPES.get(scope, words(row["scope"])),
            "markers": MARKERS.get(markers, words(markers)),
            "share": number(share_of_still(row), 2),
        }
        table.append({**row, **said})
    return table


def verdicts(errors: Rows) -> list[str]:
    """Return one sentence a row with a verdict, over the breaths in recording time."""
    lines = []
    for row in error_table(errors):
        if row["scope"].startswith(("cycles_", "heldout_")) and row.get("verdict"):
            if "steady" not in row["scope"]:
                lines.append(f"{row['what']}, {row['markers']}: {row['verdict']}.".capitalize())
    return lines


def interval_text(row: Mapping[str, str]) -> str:
    """Return a level with its interval, where it has one."""
    text = number(row["level"], 2)
    if row["low"] and row["high"]:
        text += f" ({number(row['low'], 2)} to {number(row['high'], 2)})"
    return text


def level_table(activations: Rows) -> Rows:
    """Return one row a group: the subject's mean breath and the next breath, with intervals."""
    rows = []
    for group in GROUPS:
        of_group = {r["scope"]: r for r in activations if r["group"] == group}
        if SUBJECT_MEAN not in of_group:
            continue
        row = {"group": words(group), "mean": interval_text(of_group[SUBJECT_MEAN])}
        if "next_breath" in of_group:
            row["next"] = interval_text(of_group["next_breath"])
        row["at_bound"] = of_group[SUBJECT_MEAN]["at_bound"]
        rows.append(row)
    return rows


def cycle_table(activations: Rows) -> Rows:
    """Return one row a breath with the four levels and their intervals."""
    rows: dict[str, dict[str, str]] = {}
    for row in activations:
        if row["scope"] == "cycle":
            rows.setdefault(row["id"], {"cycle": row["id"]})[row["group"]] = interval_text(row)
    return list(rows.values())


def marker_table(quality: Mapping[str, Any], names: Mapping[str, str]) -> Rows:
    """Return one row a marker: noise, and what was missing before and after filling.

    Parameters
    ----------
    quality : of markers.json
    names : label to canonical name
    """
    noise, gaps = quality.get("noise_mm", {}), quality.get("gaps", {})
    return [
        {
            "label": label,
            "name": names.get(label) or "–",
            "noise_mm": number(value, 2),
            "missing": number(100 * gaps.get(label, {}).get("missing", 0), 2),
            "left": number(100 * gaps.get(label, {}).get("left_missing", 0), 2),
            "longest_s": number(gaps.get(label, {}).get("longest_s", 0), 2),
        }
        for label, value in noise.items()
    ]


def rib_table(rotation: Mapping[str, Mapping[str, float]]) -> Rows:
    """Return one row a rib of the left side: rotation since rest at the height of the breath.

    Parameters
    ----------
    rotation : of fit.json, rib to pump and bucket handle, degrees
    """
    return [
        {"rib": name.removeprefix("rib_L"), **{axis: number(turn[axis], 2) for axis in turn}}
        for name, turn in rotation.items()
        if name.startswith("rib_L")
    ]


def breath_facts(fit: Mapping[str, Any]) -> list[tuple[str, Any]]:
    """Return (heading, value) of the figures of the fitted torso's breath; a span in words."""
    facts = []
    for key in BREATH_FIGURES:
        value = fit.get(key, "")
        if isinstance(value, list | tuple):
            value = " to ".join(number(end) for end in value)
        facts.append((heading(key), value))
    return facts
