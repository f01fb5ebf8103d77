"""The small JSON beside every stage's result: did it work, with what, and if not why."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from pipeline import places
from pipeline.job import BESIDE, BREATH, CHAINS, Job, chain_of, stages_of
from pipeline.records import read_json, write_json

OK, UNUSABLE, FAILED = "ok", "unusable", "failed"
RECORDS = chain_of(BREATH)
EVERY_RECORD = (*(stage for chain in CHAINS.values() for stage in chain), *BESIDE)


def provenance(job: Job, seconds: float) -> dict[str, Any]:
    """Return what ran: versions, seed and settings."""
    return {
        "version": places.version(),
        "source": places.fingerprint(places.PACKAGE.parent),
        "commit": places.commit(Path.cwd()),
        "seed": job.seed,
        "settings": job.settings,
        "subject": job.subject,
        "seconds": round(seconds, 2),
        "finished": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def write_ok(path: Path, job: Job, content: Mapping[str, Any], seconds: float) -> None:
    """Write the record of a stage that worked."""
    head = {"status": OK, "stage": job.stage, "recording": job.name, "recorded": job.kind}
    write_json(path, {**head, **content, "run": provenance(job, seconds)})


def write_unusable(path: Path, job: Job, reason: str, *, stage: str, status: str) -> None:
    """Write the record of a row that cannot be used; `stage` is where it was found."""
    head = {"status": status, "stage": stage, "recording": job.name, "reason": reason}
    write_json(path, {**head, "recorded": job.kind, "run": provenance(job, 0.0)})


def read_status(folder: Path, stage: str) -> dict[str, Any]:
    """Read the record of `stage`; one that is not there says so."""
    path = folder / f"{stage}.json"
    if not path.exists():
        reason = f"The stage '{stage}' has not run."
        return {"status": FAILED, "stage": stage, "recording": folder.name, "reason": reason}
    record: dict[str, Any] = read_json(path)
    return record


def belongs(folder: Path, stage: str) -> bool:
    """Whether a record is there and its stage is one of the recording's kind."""
    if not (folder / f"{stage}.json").exists():
        return False
    kind = read_status(folder, stage).get("recorded")
    return kind is None or stage in stages_of(kind)


def first_problem(folder: Path, stages: Sequence[str] = RECORDS) -> dict[str, Any] | None:
    """Return the first record of a recording that is not ok, or None."""
    for stage in stages:
        record = read_status(folder, stage)
        if record["status"] != OK:
            return record
    return None


def forget_failures(results: Path, names: Sequence[str]) -> None:
    """Remove records of stages that broke, so that the next run tries them again.

    A row that cannot be used keeps its record until it changes; what broke (a defect, a full disk)
    may be mended without any change that Snakemake can see.

    Parameters
    ----------
    results : folder with one folder a recording
    names : the recordings to look at
    """
    for name in names:
        for stage in EVERY_RECORD:
            path = results / name / f"{stage}.json"
            if path.exists() and read_json(path)["status"] == FAILED:
                path.unlink()
