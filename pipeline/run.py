"""Run one stage of one recording: pass problems on, clear old files, leave a record."""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from pipeline import calls_file, status
from pipeline.job import Job, stages_before
from pipeline.records import write_text
from sim.errors import TorsoError

Content = Mapping[str, Any]
# A stage gets its job, the recording's folder and a number of processes; it writes its files and
# returns what its JSON says, with one line for a person under "summary".
Stage = Callable[[Job, Path, int], Content]

FILES_OF: dict[str, tuple[str, ...]] = {
    "markers": ("markers.npz", "input.svg"),
    "signature": ("signature.npz", "cycles.csv", "cycles.svg", "signature.svg"),
    "fit": (
        "fit.npz",
        "errors.csv",
        "trajectory.h5",
        "sagittal.svg",
        "markers_time.svg",
        "trace.svg",
        "volume.svg",
        "ribs.svg",
    ),
    "posterior": ("posterior.nc", "activations.csv", "posterior.svg"),
    "audio": ("audio.npz",),
    "pressure": ("pressure.npz", "pressure.csv"),
    "calls": ("calls.csv", "calls.TextGrid", "calls.svg", "spectrogram.svg"),
    "follow": (
        "follow.npz",
        "followed.csv",
        "control.xml",
        "trajectory.h5",
        "followed.svg",
        "search.svg",
    ),
    "retraining": ("retraining.csv", "retraining.svg"),
}


def _clear(job: Job, folder: Path) -> None:
    """Remove what an earlier run left, but not a table that a person has edited."""
    edited = job.stage == "calls" and bool(calls_file.edit_digest(folder))
    for name in (f"{job.stage}.json", *FILES_OF[job.stage]):
        if not (edited and name == calls_file.TABLE):
            (folder / name).unlink(missing_ok=True)


def _earlier_problem(job: Job, folder: Path) -> dict[str, Any] | None:
    for stage in stages_before(job.stage, job.kind):
        record = status.read_status(folder, stage)
        if record["status"] != status.OK:
            return record
    return None


def run_stage(stage: Stage, job: Job, folder: Path, processes: int) -> str:
    """Run a stage and write its record; raise what made the recording unusable.

    Parameters
    ----------
    stage : the work
    job : what is asked
    folder : results of this recording
    processes : how many may be used; results do not depend on it

    Returns
    -------
    One line about the result; empty when an earlier stage's problem was passed on.
    """
    record = folder / f"{job.stage}.json"
    _clear(job, folder)
    earlier = _earlier_problem(job, folder)
    if earlier is not None:
        status.write_unusable(
            record, job, earlier["reason"], stage=earlier["stage"], status=earlier["status"]
        )
        return ""
    began = time.monotonic()
    try:
        if job.problem:
            raise TorsoError(job.problem)
        content = dict(stage(job, folder, processes))
    except TorsoError as error:
        status.write_unusable(record, job, str(error), stage=job.stage, status=status.UNUSABLE)
        raise
    except Exception as error:
        # A defect of ours: this recording is lost, the rest of the batch need not be.
        reason = f"internal error in '{job.stage}' ({type(error).__name__}: {error}). Report it."
        write_text(folder / f"{job.stage}_error.txt", traceback.format_exc())
        reason = " ".join(reason.split())
        status.write_unusable(record, job, reason, stage=job.stage, status=status.FAILED)
        raise TorsoError(f"{job.name}: {reason}") from error
    seconds = time.monotonic() - began
    status.write_ok(record, job, content, seconds)
    return f"{job.name}: {job.stage}: {content.get('summary', 'done')} ({seconds:.1f} s)"
