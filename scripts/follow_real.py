"""Let a torso follow every sound of a folder; each ends in a report or in one line.

    python scripts/follow_real.py DATA_REAL OUT --evaluations 100

OUT gets a folder a sound, a page in each, and `followed_real.csv`.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pipeline import configuration, records, status
from pipeline.job import CHAINS, LAUGH, make_job
from pipeline.laugh_report import write_laugh_report
from pipeline.run import run_stage
from pipeline.stages import STAGES
from pipeline.study import Entry
from sim.errors import TorsoError

SOUNDS = {".wav", ".flac", ".ogg", ".mp3"}
SUBJECT = {"subject": "p1", "sex": "male", "stature_m": "1.756", "mass_kg": "75"}


def sounds(folder: Path) -> list[Path]:
    """Sound files under a folder, in order."""
    return sorted(path for path in folder.rglob("*") if path.suffix in SOUNDS)


def follow_one(path: Path, folder: Path, config: dict[str, Any], processes: int) -> dict[str, Any]:
    """Run all stages of one sound and write its page; one row about how it went."""
    row = {"recording": path.stem, "kind": LAUGH, "subject": "p1", "start_s": "", "end_s": ""}
    entry = Entry(
        name=path.stem,
        recording=row,
        subject={**SUBJECT, "posture": "upright"},
        file=path,
        markers=None,
        problem="",
        reportable=True,
    )
    line, began = "", time.process_time()
    for stage in CHAINS[LAUGH]:
        try:
            run_stage(STAGES[stage], make_job(entry, stage, config), folder, processes)
        except TorsoError as error:
            line = line or str(error)
    seconds = time.process_time() - began
    page = write_laugh_report(folder, folder / "page.html")
    found = status.read_status(folder, "follow")
    return {
        "sound": path.name,
        "kind": found.get("kind", ""),
        "correlation": found.get("correlation", ""),
        "median_rms_normalised": found.get("median_rms_normalised", ""),
        "n_calls": found.get("n_calls", ""),
        "evaluations": found.get("evaluations", ""),
        "processor_s": round(seconds, 1),
        "page_mb": round(page.stat().st_size / 1e6, 2),
        "line": line,
    }


def follow_all(
    folder: Path, out: Path, config: dict[str, Any], processes: int
) -> Iterator[dict[str, Any]]:
    """Follow each sound of a folder in turn."""
    for number, path in enumerate(sounds(folder)):
        yield follow_one(path, out / f"{number:02d}_{path.stem}", config, processes)


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--evaluations", type=int, help="runs a call; else as in config.yaml")
    parser.add_argument("--processes", type=int, default=2)
    options = parser.parse_args()
    changes: dict[str, Any] = {"compared": []}
    if options.evaluations:
        changes["n_evaluations"] = options.evaluations
    config = configuration.load(None, {"follow": changes})
    rows = []
    for row in follow_all(options.folder, options.out, config, options.processes):
        rows.append(row)
        records.write_rows(options.out / "followed_real.csv", rows)
        print({k: v for k, v in row.items() if v != ""}, flush=True)


if __name__ == "__main__":
    main()
