"""The page of a laugh or another sound: what was heard, and how the torso follows it."""

from __future__ import annotations

import base64
import hashlib
import io
from pathlib import Path
from typing import Any

from markupsafe import Markup

from pipeline import page, status
from pipeline import report_tables as tables
from pipeline.job import LAUGH, chain_of
from pipeline.records import write_text
from pipeline.report import ran, subtitle

HEAD = (
    "status",
    "stage",
    "recording",
    "recorded",
    "summary",
    "reason",
    "run",
    "warnings",
    "notes",
    "bouts",
    "calls",
    "in_short",
    "at_bound",
    "events",
    "asked_s",
)
FIGURES = ("calls", "spectrogram", "followed", "search")
SECTIONS = (
    ("calls", "Sound, pressure and calls"),
    ("followed", "The torso follows"),
    ("errors_table", "Error of each call"),
    ("settings", "Figures, settings and versions"),
    ("errors", "Errors"),
)
SOUND_RATE = 16000
"""Hz of the sound in the page."""
CALL_COLUMNS = (
    "call",
    "start_s",
    "peak_s",
    "end_s",
    "peak",
    "bout",
    "voiced",
    "kept",
    "why_not",
)


def _script() -> tuple[Markup, str]:
    """The page's script and the digest by which it alone is allowed to run."""
    text = (page.TEMPLATES / "player.js").read_text(encoding="utf-8")
    # an end tag inside a script would end it
    text = text.replace("</script", "<\\/script")
    digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
    return Markup(text), f"sha256-{digest}"


def _audio(folder: Path) -> tuple[str, tuple[float, float] | None]:
    """The sound as an address that holds it, and its span in the file, s; or nothing."""
    path = folder / "audio.npz"
    if not path.exists():
        return "", None
    import numpy as np
    import soundfile

    from pipeline.audio import Sound
    from pipeline.records import load

    sound = load(Sound, path)
    loudest = max(float(np.abs(sound.samples).max()), 1e-9)
    stream = io.BytesIO()
    samples = np.asarray(0.9 * sound.samples / loudest)
    soundfile.write(stream, samples, int(sound.rate), format="FLAC", subtype="PCM_16")
    text = base64.b64encode(stream.getvalue()).decode()
    return f"data:audio/flac;base64,{text}", (sound.start, sound.start + sound.duration)


def _facts(record: dict[str, Any]) -> list[tuple[str, Any]]:
    return [
        (tables.heading(key.removeprefix("quality.").replace(".", ": ")), value)
        for key, value in page.flat(record)
        if key.split(".")[0] not in HEAD
    ]


def _key_numbers(record: dict[str, Any]) -> list[tuple[str, str]]:
    """Figures at the top of the page."""
    if record["status"] != status.OK:
        return []
    asked = "lung pressure" if record["quantity"] == "pressure" else "flow"
    found = [(page.number(record["correlation"], 2), f"correlation with the desired {asked}")]
    if "median_rms_normalised" in record:
        found.append(
            (
                page.number(record["median_rms_normalised"], 2),
                "median error of a call, of no pressure",
            )
        )
    if record.get("air_used_by_bouts_l"):
        total = sum(record["air_used_by_bouts_l"])
        found.append((f"{total:.2f} L", "air that the calls took"))
    found.append((f"{record['least_volume_below_rest_l']:.2f} L", "lowest lung volume, below rest"))
    if "evaluations" in record:
        found.append((str(record["evaluations"]), "runs of the torso"))
    return found


def context(folder: Path) -> dict[str, Any]:
    """Gather everything the template shows.

    Parameters
    ----------
    folder : results of one recording
    """
    stages = chain_of(LAUGH)
    records = {stage: status.read_status(folder, stage) for stage in stages}
    bad = status.first_problem(folder, stages)
    calls = page.read_rows(folder / "calls.csv")
    shown = [{key: row.get(key, "") for key in CALL_COLUMNS} for row in calls]
    more = [key for key in (calls[0] if calls else ()) if key not in CALL_COLUMNS]
    fitted = [
        {"call": row["call"], **{key: row[key] for key in more if key != "at_bound"}}
        for row in calls
        if row.get("evaluations")
    ]
    audio, span = _audio(folder)
    script, digest = _script()
    run_facts, setting_facts = ran(records)
    follow = records["follow"]
    played = follow["status"] == status.OK
    return {
        "name": folder.name,
        "subtitle": subtitle(records),
        "records": records,
        "problem": str(bad["reason"]) if bad else "",
        "problem_stage": bad["stage"] if bad else "",
        "sentences": [str(r["summary"]) for r in records.values() if r.get("summary")],
        "key_numbers": _key_numbers(follow),
        "sections": SECTIONS,
        "audio": audio,
        "sound_span": span,
        "follow_span": (
            (follow["control_starts_at_s"], follow["control_ends_at_s"]) if played else None
        ),
        "script": script,
        "script_digest": digest,
        "figures": {name: page.inline_svg(folder / f"{name}.svg") for name in FIGURES},
        "facts": {stage: _facts(records[stage]) for stage in stages if stage != "follow"},
        "follow_facts": _facts(follow),
        "run_facts": run_facts,
        "setting_facts": setting_facts,
        "calls": shown,
        "call_columns": tables.columns(shown),
        "fitted": fitted,
        "fitted_columns": tables.columns(fitted),
        "at_bound": follow.get("at_bound", []),
        "events": follow.get("events", []),
        "event_columns": tables.columns(follow.get("events", [])),
        "warnings": page.messages(records),
    }


def write_laugh_report(folder: Path, path: Path) -> Path:
    """Write the page of one sound; one that could not be used gets a page that says why.

    Parameters
    ----------
    folder : results of the recording
    path : where the page goes
    """
    write_text(path, page.render("laugh.html", **context(folder)))
    return path
